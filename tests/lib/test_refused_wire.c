/* SPDX-License-Identifier: MIT */
/* Messages and frames: every NULL, length, code and number that the headers refuse, one at a time,
 * and that nothing is written then. */
#include "refuses.h"

#include <math.h>

#include "rim/can.h"
#include "rim/can_table.h"
#include "rim/lcm.h"

static uint8_t out[8192];

static void lcm_packers_refuse(void **state) {
  (void)state;
  rim_observation_message o = {.count = 1};
  rim_alarm a = {.p_value = 0.5};
  rim_health_message h = {.sequence = 1};
  rim_command c = {1, 2, RIM_COMMAND_CLEAR};
  rim_counters n = {0};
  rim_entry e = {.to_entry_s = 1.0};
  static rim_plan p = {.count = 1};
  p.pose[0].orientation[0] = 1.0;
#define PACKER(function, size, message)                                                            \
  do {                                                                                             \
    REFUSES(out, RIM_E_ARGUMENT, function(NULL, sizeof out, &(message)));                          \
    REFUSES(out, RIM_E_ARGUMENT, function(out, sizeof out, NULL));                                 \
    REFUSES(out, RIM_E_SIZE, function(out, (size)-1, &(message)));                                 \
    assert_int_equal(function(out, (size), &(message)), RIM_OK);                                   \
    assert_int_equal(out[(size)], 0x5a);                                                           \
  } while (0)
  PACKER(rim_lcm_pack_observation, RIM_LCM_OBSERVATION_SIZE, o);
  PACKER(rim_lcm_pack_alarm, RIM_LCM_ALARM_SIZE, a);
  PACKER(rim_lcm_pack_health, RIM_LCM_HEALTH_SIZE, h);
  PACKER(rim_lcm_pack_command, RIM_LCM_COMMAND_SIZE, c);
  PACKER(rim_lcm_pack_counters, RIM_LCM_COUNTERS_SIZE, n);
  PACKER(rim_lcm_pack_entry, RIM_LCM_ENTRY_SIZE, e);
  PACKER(rim_lcm_pack_plan, RIM_LCM_PLAN_SIZE, p);
  for (uint32_t count = 0; count <= 129; count += 129) {
    o.count = count;
    REFUSES(out, RIM_E_RANGE, rim_lcm_pack_observation(out, sizeof out, &o));
  }
  for (uint32_t count = 0; count <= RIM_PLAN_MAX_POSES + 1; count += RIM_PLAN_MAX_POSES + 1) {
    p.count = count;
    REFUSES(out, RIM_E_RANGE, rim_lcm_pack_plan(out, sizeof out, &p));
  }
  c.command = 0;
  REFUSES(out, RIM_E_RANGE, rim_lcm_pack_command(out, sizeof out, &c));
  c.command = RIM_COMMAND_DESCRIBE + 1;
  REFUSES(out, RIM_E_RANGE, rim_lcm_pack_command(out, sizeof out, &c));
  e.to_entry_s = -0.5;
  REFUSES(out, RIM_E_DATA, rim_lcm_pack_entry(out, sizeof out, &e));
  e.to_entry_s = (double)INFINITY;
  REFUSES(out, RIM_E_DATA, rim_lcm_pack_entry(out, sizeof out, &e));
  e = (rim_entry){.t_s = (double)NAN, .to_entry_s = RIM_ENTRY_NEVER};
  REFUSES(out, RIM_E_DATA, rim_lcm_pack_entry(out, sizeof out, &e));
}

static void lcm_unpackers_refuse(void **state) {
  (void)state;
  static rim_observation_message o;
  static rim_plan p;
  static rim_model_message m;
  rim_alarm a;
  rim_health_message h;
  rim_command c;
  rim_counters n;
  rim_entry e;
  memset(out, 0, sizeof out);
#define UNPACKER(function, size, message)                                                          \
  do {                                                                                             \
    IS_ARGUMENT(function(NULL, out, (size)));                                                      \
    IS_ARGUMENT(function(&(message), NULL, (size)));                                               \
    REFUSES(message, RIM_E_TRUNCATED, function(&(message), out, 7));                               \
    REFUSES(message, RIM_E_MAGIC, function(&(message), out, (size)));                              \
  } while (0)
  UNPACKER(rim_lcm_unpack_observation, RIM_LCM_OBSERVATION_SIZE, o);
  UNPACKER(rim_lcm_unpack_alarm, RIM_LCM_ALARM_SIZE, a);
  UNPACKER(rim_lcm_unpack_health, RIM_LCM_HEALTH_SIZE, h);
  UNPACKER(rim_lcm_unpack_command, RIM_LCM_COMMAND_SIZE, c);
  UNPACKER(rim_lcm_unpack_counters, RIM_LCM_COUNTERS_SIZE, n);
  UNPACKER(rim_lcm_unpack_entry, RIM_LCM_ENTRY_SIZE, e);
  UNPACKER(rim_lcm_unpack_plan, RIM_LCM_PLAN_SIZE, p);
  UNPACKER(rim_lcm_unpack_model, RIM_LCM_MODEL_SIZE, m);
}

/* Every number of a record, not finite, one at a time: no message and no frame is made of it. */
static void a_record_has_no_number_that_is_none(void **state) {
  (void)state;
  static rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  uint32_t count;
  rim_alarm good = {.p_value = 0.5, .channels = 1};
  double *const number[] = {
      &good.t_s,
      &good.since_s,
      &good.since_sd_s,
      &good.ln_anom,
      &good.threshold,
      &good.p_value,
      &good.shift[0],
      &good.shift[RIM_ALARM_MAX_CHANNELS - 1],
      &good.shift_sd[0],
      &good.shift_sd[RIM_ALARM_MAX_CHANNELS - 1],
      &good.region.center[0],
      &good.region.center[RIM_REGION_MAX_DIMS - 1],
      &good.region.inverse_shape[0],
      &good.region.inverse_shape[RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS - 1],
      &good.region.lower[0],
      &good.region.lower[RIM_REGION_MAX_DIMS - 1],
      &good.region.upper[0],
      &good.region.upper[RIM_REGION_MAX_DIMS - 1]};
  const double none[3] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
  for (size_t i = 0; i < 3 * sizeof number / sizeof number[0]; ++i) {
    const double was = *number[i / 3];
    *number[i / 3] = none[i % 3];
    REFUSES(out, RIM_E_DATA, rim_lcm_pack_alarm(out, sizeof out, &good));
    REFUSES(frame, RIM_E_DATA, rim_can_pack_summary(frame, 1, &good));
    REFUSES(frame, RIM_E_DATA, rim_can_pack_detail(frame, 1, &good));
    REFUSES(frame, RIM_E_DATA, rim_can_pack_detail_fd(frame, 1, &good));
    REFUSES(frame, RIM_E_DATA, rim_can_pack_finding(frame, &count, 1, &good));
    *number[i / 3] = was;
  }
  uint8_t *const code[] = {&good.detector, &good.state,    &good.level,
                           &good.kind,     &good.channels, &good.region.dims};
  const uint8_t most[] = {RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED,      RIM_LEVEL_STALE,
                          RIM_KIND_PUSHED,           RIM_ALARM_MAX_CHANNELS, RIM_REGION_MAX_DIMS};
  for (size_t i = 0; i < sizeof code / sizeof code[0]; ++i) {
    const uint8_t was = *code[i];
    *code[i] = (uint8_t)(most[i] + 1u);
    REFUSES(out, RIM_E_RANGE, rim_lcm_pack_alarm(out, sizeof out, &good));
    REFUSES(frame, RIM_E_RANGE, rim_can_pack_summary(frame, 1, &good));
    REFUSES(frame, RIM_E_RANGE, rim_can_pack_detail(frame, 1, &good));
    *code[i] = was;
  }
  assert_int_equal(rim_lcm_pack_alarm(out, sizeof out, &good), RIM_OK);
}

static void can_packers_refuse(void **state) {
  (void)state;
  static rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  rim_alarm a = {.p_value = 0.5};
  rim_command c = {1, 2, RIM_COMMAND_CLEAR};
  rim_health_message h = {.sequence = 1};
  rim_entry e = {.to_entry_s = 1.0};
  uint32_t count = 77;
#define OF_A_RECORD(function)                                                                      \
  do {                                                                                             \
    IS_ARGUMENT(function(NULL, 1, &a));                                                            \
    REFUSES(frame, RIM_E_ARGUMENT, function(frame, 1, NULL));                                      \
    REFUSES(frame, RIM_E_RANGE, function(frame, RIM_CAN_MAX_NODE + 1, &a));                        \
    assert_int_equal(function(frame, RIM_CAN_MAX_NODE, &a), RIM_OK);                               \
  } while (0)
  OF_A_RECORD(rim_can_pack_summary);
  OF_A_RECORD(rim_can_pack_detail);
  OF_A_RECORD(rim_can_pack_detail_fd);
  IS_ARGUMENT(rim_can_pack_finding(NULL, &count, 1, &a));
  REFUSES(frame, RIM_E_ARGUMENT, rim_can_pack_finding(frame, NULL, 1, &a));
  REFUSES(frame, RIM_E_ARGUMENT, rim_can_pack_finding(frame, &count, 1, NULL));
  assert_int_equal(count, 77);
  IS_ARGUMENT(rim_can_pack_command(NULL, 1, &c));
  REFUSES(frame, RIM_E_ARGUMENT, rim_can_pack_command(frame, 1, NULL));
  REFUSES(frame, RIM_E_RANGE, rim_can_pack_command(frame, RIM_CAN_MAX_NODE + 1, &c));
  c.command = 0;
  REFUSES(frame, RIM_E_RANGE, rim_can_pack_command(frame, 1, &c));
  IS_ARGUMENT(rim_can_pack_heartbeat(NULL, 1, &h, 0, false));
  REFUSES(frame, RIM_E_ARGUMENT, rim_can_pack_heartbeat(frame, 1, NULL, 0, false));
  REFUSES(frame, RIM_E_RANGE, rim_can_pack_heartbeat(frame, RIM_CAN_MAX_NODE + 1, &h, 0, false));
  h.level = RIM_LEVEL_STALE + 1;
  REFUSES(frame, RIM_E_RANGE, rim_can_pack_heartbeat(frame, 1, &h, 0, false));
  IS_ARGUMENT(rim_can_pack_entry(NULL, 1, &e));
  REFUSES(frame, RIM_E_ARGUMENT, rim_can_pack_entry(frame, 1, NULL));
  REFUSES(frame, RIM_E_RANGE, rim_can_pack_entry(frame, RIM_CAN_MAX_NODE + 1, &e));
  e.to_entry_s = -0.25;
  REFUSES(frame, RIM_E_DATA, rim_can_pack_entry(frame, 1, &e));
}

static void can_unpackers_refuse(void **state) {
  (void)state;
  rim_can_frame frame = {.id = 0x7ff, .length = 8};
  rim_can_summary s;
  rim_can_finding f;
  rim_can_heartbeat h;
  rim_alarm a;
  rim_entry e;
  rim_command c;
#define OF_A_FRAME(function, result, first_id)                                                     \
  do {                                                                                             \
    IS_ARGUMENT(function(NULL, &frame));                                                           \
    REFUSES(result, RIM_E_ARGUMENT, function(&(result), NULL));                                    \
    frame.id = (first_id)-1u;                                                                      \
    REFUSES(result, RIM_E_MAGIC, function(&(result), &frame));                                     \
    frame.id = (first_id) + RIM_CAN_MAX_NODE + 1u;                                                 \
    REFUSES(result, RIM_E_MAGIC, function(&(result), &frame));                                     \
  } while (0)
  OF_A_FRAME(rim_can_unpack_summary, s, RIM_CAN_SUMMARY_ID);
  OF_A_FRAME(rim_can_unpack_finding, f, RIM_CAN_FINDING_ID);
  OF_A_FRAME(rim_can_unpack_detail_fd, a, RIM_CAN_DETAIL_ID);
  OF_A_FRAME(rim_can_unpack_heartbeat, h, RIM_CAN_HEARTBEAT_ID);
  OF_A_FRAME(rim_can_unpack_entry, e, RIM_CAN_ENTRY_ID);
  IS_ARGUMENT(rim_can_unpack_command(NULL, 1, &frame));
  REFUSES(c, RIM_E_ARGUMENT, rim_can_unpack_command(&c, 1, NULL));
  frame.id = RIM_CAN_COMMAND_ID + RIM_CAN_MAX_NODE + 1;
  REFUSES(c, RIM_E_MAGIC, rim_can_unpack_command(&c, RIM_CAN_MAX_NODE + 1, &frame));
  REFUSES(c, RIM_E_MAGIC, rim_can_unpack_command(&c, RIM_CAN_MAX_NODE, &frame));
}

/* A finding's own codes and number, under a good check sum. */
static void a_finding_out_of_range_is_refused(void **state) {
  (void)state;
  static rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  rim_alarm a = {.p_value = 0.0, .channels = 0};
  rim_can_finding f;
  uint32_t count = 0;
  assert_int_equal(rim_can_pack_finding(frame, &count, 1, &a), RIM_OK);
  assert_int_equal(count, 5);
  assert_int_equal(rim_can_unpack_finding(&f, &frame[0]), RIM_OK);
  assert_true(f.index == 0 && f.channels == 0);
  assert_true(f.value > 0.0 && f.value < 1e-9); /* 0 is told as the least that there is */
  a.channels = 1;
  a.shift[0] = 1.5;
  assert_int_equal(rim_can_pack_finding(frame, &count, 1, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_finding(&f, &frame[1]), RIM_OK);
  assert_true(f.value == 1.5);
}

static void a_detail_wants_its_pieces(void **state) {
  (void)state;
  static rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  const rim_alarm a = {.p_value = 0.5, .seq = 9};
  rim_alarm got;
  bool complete = false;
  rim_can_assembly assembly = {.node = 3};
  assert_int_equal(rim_can_pack_detail(frame, 3, &a), RIM_OK);
  IS_ARGUMENT(rim_can_take_detail(NULL, frame, &got, &complete));
  IS_ARGUMENT(rim_can_take_detail(&assembly, NULL, &got, &complete));
  IS_ARGUMENT(rim_can_take_detail(&assembly, frame, NULL, &complete));
  IS_ARGUMENT(rim_can_take_detail(&assembly, frame, &got, NULL));
  rim_can_assembly beyond = {.node = RIM_CAN_MAX_NODE + 1};
  rim_can_frame of_it = frame[0];
  of_it.id = RIM_CAN_DETAIL_ID + RIM_CAN_MAX_NODE + 1;
  assert_int_equal(rim_can_take_detail(&beyond, &of_it, &got, &complete), RIM_E_MAGIC);
  /* A record given up counts once, and the count does not run over. */
  assembly.lost = UINT32_MAX - 1;
  for (int i = 0; i < 3; ++i) {
    assert_int_equal(rim_can_take_detail(&assembly, &frame[0], &got, &complete), RIM_OK);
    assert_int_equal(rim_can_take_detail(&assembly, &frame[2], &got, &complete), RIM_E_TRUNCATED);
    assert_true(assembly.lost == UINT32_MAX);
  }
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
    assert_int_equal(rim_can_take_detail(&assembly, &frame[i], &got, &complete), RIM_OK);
  assert_true(complete && got.seq == 9);
  /* One more of the right number, 25 mod 16, when none is due. */
  rim_can_frame more = frame[RIM_CAN_DETAIL_FRAMES - 1];
  more.data[0] = 0x20 | (RIM_CAN_DETAIL_FRAMES & 15);
  complete = false;
  assert_int_equal(rim_can_take_detail(&assembly, &more, &got, &complete), RIM_E_TRUNCATED);
  assert_false(complete);
}

static void a_table_wants_its_pieces(void **state) {
  (void)state;
  rim_can_table t;
  rim_can_gather g = {0};
  rim_can_frame f = {.id = 1};
  bool complete;
  double row_s;
  REFUSES(t, RIM_E_ARGUMENT, rim_can_table_open(&t, NULL, 64));
  IS_ARGUMENT(rim_can_table_open(NULL, out, 64));
  memset(&t, 0, sizeof t);
  assert_int_equal(rim_can_table_id(NULL, 0), 0);
  assert_int_equal(rim_can_table_id(&t, 0), 0);
  IS_ARGUMENT(rim_can_gather_frame(NULL, &t, &f, 0.0, 1.0, &complete, &row_s));
  IS_ARGUMENT(rim_can_gather_frame(&g, NULL, &f, 0.0, 1.0, &complete, &row_s));
  IS_ARGUMENT(rim_can_gather_frame(&g, &t, NULL, 0.0, 1.0, &complete, &row_s));
  IS_ARGUMENT(rim_can_gather_frame(&g, &t, &f, 0.0, 1.0, NULL, &row_s));
  IS_ARGUMENT(rim_can_gather_frame(&g, &t, &f, 0.0, 1.0, &complete, NULL));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(lcm_packers_refuse),
      cmocka_unit_test(lcm_unpackers_refuse),
      cmocka_unit_test(a_record_has_no_number_that_is_none),
      cmocka_unit_test(can_packers_refuse),
      cmocka_unit_test(can_unpackers_refuse),
      cmocka_unit_test(a_finding_out_of_range_is_refused),
      cmocka_unit_test(a_detail_wants_its_pieces),
      cmocka_unit_test(a_table_wants_its_pieces),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
