/* SPDX-License-Identifier: MIT */
/* The outgoing queues: what cannot be packed or will never be taken is counted, not lost silently.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "rimd/outbox.h"

static outbox box;
static lcm_udp lcm;
static socketcan can;

/* A device on which every write fails with an error that no CAN interface has: /dev/full. */
static int set_up(void **state) {
  (void)state;
  memset(&lcm, 0, sizeof lcm);
  memset(&can, 0, sizeof can);
  lcm.in = lcm.out = -1;
  can.fd = open("/dev/full", O_WRONLY | O_CLOEXEC);
  return can.fd >= 0 ? 0 : -1;
}

static int tear_down(void **state) {
  (void)state;
  return close(can.fd);
}

static rim_alarm alarm_with(double shift) {
  rim_alarm a;
  memset(&a, 0, sizeof a);
  a.seq = 1;
  a.state = RIM_ALARM_RAISED;
  a.level = RIM_LEVEL_ERROR;
  a.channels = 1;
  a.shift[0] = shift;
  a.p_value = 0.05;
  return a;
}

static void a_record_without_bytes_is_counted_on_each_bus(void **state) {
  (void)state;
  const rim_alarm bad = alarm_with((double)NAN);
  outbox_init(&box, &lcm, NULL, 1);
  outbox_alarm(&box, &bad, 0);
  assert_int_equal(box.dropped, 1);
  assert_false(box.lcm_waits);
  outbox_init(&box, NULL, &can, 1);
  outbox_alarm(&box, &bad, 0);
  assert_int_equal(box.dropped, 1);
  assert_false(box.summary_waits);
  assert_int_equal(box.details, 0);
  outbox_init(&box, &lcm, &can, 1);
  outbox_alarm(&box, &bad, 0);
  assert_int_equal(box.dropped, 2);
}

static void a_good_record_waits_for_a_network_that_is_down(void **state) {
  (void)state;
  const rim_alarm good = alarm_with(0.5);
  outbox_init(&box, &lcm, NULL, 1);
  outbox_alarm(&box, &good, 0);
  assert_true(box.lcm_waits);
  assert_int_equal(box.dropped, 0);
}

static void frames_that_are_refused_are_counted(void **state) {
  (void)state;
  const rim_alarm good = alarm_with(0.5);
  const rim_entry entry = {.sequence = 1, .to_entry_s = RIM_ENTRY_NEVER};
  rim_health_message health;
  rim_counters counters;
  memset(&health, 0, sizeof health);
  memset(&counters, 0, sizeof counters);
  outbox_init(&box, NULL, &can, 1);
  outbox_health(&box, &health, &counters, &good, false, 0);
  (void)outbox_pump(&box, 1); /* one that was refused leaves the next one its turn */
  assert_false(box.heartbeat_waits || box.summary_waits);
  assert_int_equal(box.frames_unsent, 2);
  outbox_entry(&box, &entry, 2);
  assert_false(box.entry_waits);
  assert_int_equal(box.frames_unsent, 3);
  assert_int_equal(box.dropped, 0); /* no record was under way */
  outbox_alarm(&box, &good, 3);
  while (outbox_pump(&box, 4) >= 0) {
  }
  /* The summary; five pages of the finding and the detail, given up with their first frame. */
  assert_int_equal(box.frames_unsent, 3 + 1 + 5 + RIM_CAN_DETAIL_FRAMES);
  assert_int_equal(box.dropped, 1);
}

static void a_record_is_repeated_where_one_was_sent(void **state) {
  (void)state;
  rim_alarm good = alarm_with(0.5);
  outbox_init(&box, NULL, &can, 1);
  can.fd_capable = true;
  outbox_repeat(&box, &good, 0);
  assert_int_equal(box.frames_unsent, 5 + 1); /* refused at the first, all given up */
  good.seq = 0;
  outbox_repeat(&box, &good, 0);
  assert_int_equal(box.frames_unsent, 5 + 1);
  outbox_init(&box, &lcm, NULL, 1);
  good.seq = 1;
  outbox_repeat(&box, &good, 0); /* over LCM every record went whole */
  assert_int_equal(box.frames_unsent, 0);
  can.fd_capable = false;
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_record_without_bytes_is_counted_on_each_bus),
      cmocka_unit_test(a_good_record_waits_for_a_network_that_is_down),
      cmocka_unit_test(frames_that_are_refused_are_counted),
      cmocka_unit_test(a_record_is_repeated_where_one_was_sent),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
