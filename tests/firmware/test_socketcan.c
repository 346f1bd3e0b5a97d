/* SPDX-License-Identifier: MIT */
/* The CAN interface: present, absent, down, gone, full, off the bus, and every frame that it may
 * bring. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "transport/socketcan.h"

#include "fake_can.h"

static const socketcan_filter one[2] = {{0x201, 0x7ff},
                                        {0x80001234u, SOCKETCAN_EXTENDED | 0x1fffffffu}};
static socketcan can;

static int set_up(void **state) {
  (void)state;
  memset(&fake, 0, sizeof fake);
  return socketcan_open(&can, "can0", one, 2, true);
}

static int tear_down(void **state) {
  (void)state;
  socketcan_close(&can);
  socketcan_close(&can); /* twice is once */
  return can.fd == -1 ? 0 : -1;
}

static void what_cannot_be_opened(void **state) {
  (void)state;
  socketcan c;
  assert_int_equal(socketcan_open(&c, "", one, 1, false), -EINVAL);
  assert_int_equal(socketcan_open(&c, "sixteen_letters_", one, 1, false), -EINVAL);
  assert_int_equal(socketcan_open(&c, "can0", one, SOCKETCAN_MAX_FILTERS + 1, false), -EINVAL);
  fake.no_can = true;
  assert_int_equal(socketcan_open(&c, "can0", one, 1, false), -EAFNOSUPPORT);
  fake.no_can = false;
  fake.bind_fails = EPERM;
  assert_int_equal(socketcan_open(&c, "can0", one, 1, false), -EPERM);
  assert_true(c.fd == -1 && c.counts.down == 0);
  fake.bind_fails = 0;
  const int options[3] = {CAN_RAW_FILTER, CAN_RAW_ERR_FILTER, CAN_RAW_FD_FRAMES};
  for (int i = 0; i < 3; ++i) { /* a bus that is set otherwise than was asked is no bus */
    fake.option = options[i];
    fake.option_fails = ENOPROTOOPT;
    assert_int_equal(socketcan_open(&c, "can0", one, 1, true), -ENOPROTOOPT);
    assert_int_equal(c.fd, -1);
  }
  fake.option_fails = 0;
  fake.mtu_fails = EPERM;
  assert_int_equal(socketcan_open(&c, "can0", one, 1, true), -EPERM);
  assert_int_equal(c.fd, -1);
}

/* Whether it is up cannot be asked: it is taken for up, and the first send tells. */
static void an_interface_that_tells_no_flags(void **state) {
  (void)state;
  socketcan c;
  const rim_can_frame frame = {.id = 0x181, .length = 8};
  fake.down = true;
  fake.flags_fails = EPERM;
  assert_int_equal(socketcan_open(&c, "can0", one, 1, false), 0);
  assert_true(c.fd >= 0 && !c.is_down);
  fake.write_fails = ENETDOWN;
  fake.fails = 1;
  assert_int_equal(socketcan_send(&c, &frame), SOCKETCAN_DOWN);
  assert_true(c.is_down && c.counts.down == 1);
  socketcan_tend(&c); /* nor is it taken for back */
  assert_true(c.is_down);
  socketcan_close(&c);
}

static void filters_tell_requests_and_lengths_apart(void **state) {
  (void)state;
  assert_true(can.fd_capable && !can.is_down);
  assert_int_equal(fake.filters, 2);
  assert_true(fake.filter[0].can_id == 0x201 &&
              fake.filter[0].can_mask == (0x7ffu | CAN_EFF_FLAG | CAN_RTR_FLAG));
  assert_true(fake.filter[1].can_id == 0x80001234u &&
              fake.filter[1].can_mask == (0x1fffffffu | CAN_EFF_FLAG | CAN_RTR_FLAG));
  socketcan none;
  fake.no_force = fake.classic = true;
  assert_int_equal(socketcan_open(&none, "can1", NULL, 0, true), 0);
  assert_int_equal(fake.filters, 0);
  assert_false(none.fd_capable);
  socketcan_close(&none);
}

static void an_absent_interface_is_waited_for(void **state) {
  (void)state;
  socketcan c;
  rim_can_frame frame = {.id = 0x181, .length = 8};
  double t_s;
  fake.absent = true;
  assert_int_equal(socketcan_open(&c, "can9", one, 1, false), 0);
  assert_true(c.fd == -1 && c.is_down && c.counts.down == 1);
  assert_int_equal(socketcan_send(&c, &frame), SOCKETCAN_DOWN);
  assert_int_equal(socketcan_receive(&c, &frame, &t_s), 0);
  socketcan_tend(&c);
  assert_int_equal(c.fd, -1);
  fake.absent = false;
  fake.down = true;
  socketcan_tend(&c); /* there, and down */
  assert_true(c.fd >= 0 && c.is_down && c.counts.down == 1);
  socketcan_close(&c);
  c.fd = -1;
  fake.down = false;
  socketcan_tend(&c);
  assert_true(c.fd >= 0 && !c.is_down);
  const int fd = c.fd;
  socketcan_tend(&c); /* nothing to do */
  assert_int_equal(c.fd, fd);
  socketcan_close(&c);
}

static void every_way_of_sending(void **state) {
  (void)state;
  struct canfd_frame seen;
  ssize_t bytes;
  const rim_can_frame classic = {.id = 0x181, .length = 2, .data = {1, 2}};
  const rim_can_frame fd = {.id = 0x281, .length = 64, .fd = true, .data = {3}};
  assert_int_equal(socketcan_send(&can, &classic), SOCKETCAN_SENT);
  assert_true(fake_take(can.fd, &seen, &bytes) && bytes == CAN_MTU && seen.can_id == 0x181 &&
              seen.len == 2 && seen.data[1] == 2);
  assert_int_equal(socketcan_send(&can, &fd), SOCKETCAN_SENT);
  assert_true(fake_take(can.fd, &seen, &bytes) && bytes == CANFD_MTU && seen.flags == CANFD_BRS);
  can.fd_capable = false;
  assert_int_equal(socketcan_send(&can, &fd), SOCKETCAN_REFUSED);
  assert_false(fake_take(can.fd, &seen, &bytes));
  const struct {
    int why;
    socketcan_sent answer;
  } of[] = {{ENOBUFS, SOCKETCAN_FULL},
            {EAGAIN, SOCKETCAN_FULL},
            {EINVAL, SOCKETCAN_REFUSED},
            {ENETDOWN, SOCKETCAN_DOWN}};
  for (size_t i = 0; i < sizeof of / sizeof of[0]; ++i) {
    fake.write_fails = of[i].why;
    fake.fails = 1;
    assert_int_equal(socketcan_send(&can, &classic), of[i].answer);
  }
  assert_true(can.counts.full == 2 && can.counts.down == 1 && can.is_down);
  fake.fails = 1;
  assert_int_equal(socketcan_send(&can, &classic), SOCKETCAN_DOWN); /* counted once */
  assert_int_equal(can.counts.down, 1);
  assert_int_equal(socketcan_send(&can, &classic), SOCKETCAN_SENT);
  assert_true(!can.is_down);
  can.is_bus_off = true; /* the queue takes it, the bus does not */
  assert_int_equal(socketcan_send(&can, &classic), SOCKETCAN_SENT);
  assert_true(can.is_bus_off);
  can.counts.full = UINT32_MAX;
  fake.write_fails = ENOBUFS;
  fake.fails = 1;
  assert_int_equal(socketcan_send(&can, &classic), SOCKETCAN_FULL);
  assert_true(can.counts.full == UINT32_MAX);
}

static void a_gone_interface_is_let_go(void **state) {
  (void)state;
  const rim_can_frame frame = {.id = 0x181, .length = 8};
  rim_can_frame got;
  double t_s;
  const int why[2] = {ENODEV, ENXIO};
  for (int i = 0; i < 4; ++i) {
    fake.write_fails = fake.read_fails = why[i / 2];
    fake.fails = 1;
    if (i % 2 == 0)
      assert_int_equal(socketcan_send(&can, &frame), SOCKETCAN_DOWN);
    else
      assert_int_equal(socketcan_receive(&can, &got, &t_s), 0);
    assert_true(can.fd == -1 && can.is_down && can.counts.down == (uint32_t)i + 1);
    socketcan_tend(&can);
    assert_true(can.fd >= 0 && !can.is_down);
  }
}

static void every_frame_that_may_come(void **state) {
  (void)state;
  rim_can_frame got;
  double t_s = -1.0;
  const uint8_t data[64] = {9, 8, 7, 6, 5, 4, 3, 2};
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 0);
  fake_send(can.fd, 0x123, data, 3, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 1);
  assert_true(got.id == 0x123 && got.length == 3 && !got.fd && got.data[2] == 7 && t_s == 0.0);
  fake_send(can.fd, 0x80001234u, data, 64, true);
  fake.dropped = 5;
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 1);
  assert_true(got.id == 0x80001234u && got.length == 64 && got.fd && t_s == 100.25);
  assert_int_equal(can.counts.lost, 5);
  fake.dropped = 7;
  fake_send(can.fd, 0x123, data, 0, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 1);
  assert_true(got.length == 0 && can.counts.lost == 7 && can.counts.frames == 3);
  can.counts.lost = UINT32_MAX - 1;
  fake.dropped = 20;
  fake_send(can.fd, 0x123, data, 0, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 1);
  assert_true(can.counts.lost == UINT32_MAX);
  fake.foreign = true; /* what is not of the socket's level says no time */
  fake_send(can.fd, 0x123, data, 1, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), 1);
  assert_true(t_s == 0.0 && got.length == 1);
  fake.foreign = false;
  fake.dropped = 0;
  fake_send(can.fd, 0x123, data, 9, false);                /* longer than a frame */
  fake_send(can.fd, 0x123, data, 65, true);                /* longer than any */
  fake_send(can.fd, 0x123 | CAN_RTR_FLAG, data, 0, false); /* a request */
  (void)!__real_write(fake.theirs[can.fd], data, 5);       /* none at all */
  for (uint32_t i = 1; i <= 4; ++i) {
    assert_int_equal(socketcan_receive(&can, &got, &t_s), -1);
    assert_int_equal(can.counts.refused, i);
  }
  fake_send(can.fd, CAN_ERR_FLAG | CAN_ERR_CRTL, data, 8, false);
  fake_send(can.fd, CAN_ERR_FLAG | CAN_ERR_BUSOFF, data, 8, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), -1);
  assert_true(can.counts.errors == 1 && !can.is_bus_off);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), -1);
  assert_true(can.counts.errors == 2 && can.counts.bus_off == 1 && can.is_bus_off);
  fake_send(can.fd, CAN_ERR_FLAG | CAN_ERR_RESTARTED, data, 8, false);
  assert_int_equal(socketcan_receive(&can, &got, &t_s), -1);
  assert_true(!can.is_bus_off);
  const int why[3] = {ENETDOWN, EIO, EAGAIN}, answer[3] = {-1, -1, 0};
  for (int i = 0; i < 3; ++i) {
    fake.read_fails = why[i];
    fake.fails = 1;
    assert_int_equal(socketcan_receive(&can, &got, &t_s), answer[i]);
  }
  assert_true(can.is_down && can.counts.down == 1 && can.fd >= 0);
}

int main(void) {
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
  const struct CMUnitTest tests[] = {
      TEST(what_cannot_be_opened),
      TEST(filters_tell_requests_and_lengths_apart),
      TEST(every_way_of_sending),
      TEST(an_absent_interface_is_waited_for),
      TEST(a_gone_interface_is_let_go),
      TEST(every_frame_that_may_come),
      TEST(an_interface_that_tells_no_flags),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
