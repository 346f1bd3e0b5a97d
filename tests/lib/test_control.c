/* SPDX-License-Identifier: MIT */
/* Commands, heartbeat and counters: lcm-gen's own bytes, every damage refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "rim/can.h"

#include <rim_command_t.h>
#include <rim_counters_t.h>

static void a_command_equals_the_generated_encoder(void **state) {
  (void)state;
  const rim_command c = {0x80000001u, 77, RIM_COMMAND_CLEAR};
  const rim_command_t g = {INT32_MIN + 1, 77, 2};
  uint8_t ours[RIM_LCM_COMMAND_SIZE], theirs[RIM_LCM_COMMAND_SIZE];
  assert_int_equal(rim_command_t_encoded_size(&g), RIM_LCM_COMMAND_SIZE);
  assert_int_equal(rim_command_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_COMMAND_SIZE);
  assert_int_equal(rim_lcm_pack_command(ours, sizeof ours, &c), RIM_OK);
  assert_memory_equal(ours, theirs, sizeof ours);
  rim_command back = {0};
  assert_int_equal(rim_lcm_unpack_command(&back, theirs, sizeof theirs), RIM_OK);
  assert_true(back.sequence == c.sequence && back.model_id == 77 && back.command == 2);
}

static void counters_equal_the_generated_encoder(void **state) {
  (void)state;
  uint32_t value[RIM_COUNTERS_FIELDS];
  rim_counters c, back;
  rim_counters_t g;
  for (uint32_t i = 0; i < RIM_COUNTERS_FIELDS; ++i)
    value[i] = i * 2654435761u + 9u;
  memcpy(&c, value, sizeof c);
  assert_int_equal(sizeof g, sizeof c);
  memcpy(&g, value, sizeof g);
  assert_true((uint32_t)g.state_failures == c.state_failures && (uint32_t)g.rows == c.rows);
  assert_true((uint32_t)g.can_unsent == c.can_unsent && (uint32_t)g.overruns == c.overruns);
  uint8_t ours[RIM_LCM_COUNTERS_SIZE], theirs[RIM_LCM_COUNTERS_SIZE];
  assert_int_equal(rim_counters_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_COUNTERS_SIZE);
  assert_int_equal(rim_lcm_pack_counters(ours, sizeof ours, &c), RIM_OK);
  assert_memory_equal(ours, theirs, sizeof ours);
  assert_int_equal(rim_lcm_unpack_counters(&back, ours, sizeof ours), RIM_OK);
  assert_memory_equal(&back, &c, sizeof c);
  assert_int_equal(rim_lcm_pack_counters(ours, sizeof ours - 1, &c), RIM_E_SIZE);
}

/* The names are the fields of lib/wire/rim_counters_t.lcm, in order. */
static void counters_have_their_names(void **state) {
  (void)state;
  rim_counters c = {0};
  c.rows = 5;
  c.can_full = 6;
  c.state_refused = 7;
#define HAS(field)                                                                                 \
  assert_string_equal(rim_counters_name((uint32_t)(offsetof(rim_counters_t, field) / 4)), #field)
  HAS(sequence), HAS(rows), HAS(wrong_length), HAS(not_finite), HAS(time_back), HAS(future);
  HAS(gaps), HAS(incomplete), HAS(clock_resets), HAS(stale), HAS(overruns), HAS(step_us);
  HAS(commands), HAS(commands_refused), HAS(lcm_malformed), HAS(lcm_fragments), HAS(lcm_other);
  HAS(lcm_refused), HAS(lcm_unsent), HAS(can_frames), HAS(can_other), HAS(can_refused);
  HAS(can_errors), HAS(can_bus_off), HAS(can_down), HAS(can_full), HAS(can_unsent);
  HAS(input_lost), HAS(state_failures), HAS(restarts), HAS(state_refused);
#undef HAS
  assert_null(rim_counters_name(RIM_COUNTERS_FIELDS));
  assert_int_equal(rim_counters_value(&c, 1), 5);
  assert_int_equal(rim_counters_value(&c, offsetof(rim_counters, can_full) / 4), 6);
  assert_int_equal(rim_counters_value(&c, RIM_COUNTERS_FIELDS - 1), 7);
  assert_int_equal(rim_counters_value(&c, RIM_COUNTERS_FIELDS), 0);
  assert_int_equal(rim_counters_value(NULL, 0), 0);
}

static void other_messages_are_refused(void **state) {
  (void)state;
  uint8_t bytes[RIM_LCM_COUNTERS_SIZE + 1] = {0};
  rim_command c = {1, 2, RIM_COMMAND_ACKNOWLEDGE};
  rim_counters counters = {0};
  assert_int_equal(rim_lcm_pack_command(bytes, sizeof bytes, &c), RIM_OK);
  for (size_t n = 0; n < RIM_LCM_COMMAND_SIZE; ++n)
    assert_int_equal(rim_lcm_unpack_command(&c, bytes, n), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_command(&c, bytes, RIM_LCM_COMMAND_SIZE + 1), RIM_E_SIZE);
  assert_int_equal(rim_lcm_unpack_counters(&counters, bytes, RIM_LCM_COUNTERS_SIZE), RIM_E_MAGIC);
  for (unsigned code = 0; code < 256; ++code) {
    bytes[16] = (uint8_t)code;
    const rim_status wanted = code >= 1 && code <= 3 ? RIM_OK : RIM_E_RANGE;
    assert_int_equal(rim_lcm_unpack_command(&c, bytes, RIM_LCM_COMMAND_SIZE), wanted);
    c.command = (uint8_t)code;
    assert_int_equal(rim_lcm_pack_command(bytes, sizeof bytes, &c), wanted);
  }
  assert_int_equal(rim_lcm_unpack_command(NULL, bytes, RIM_LCM_COMMAND_SIZE), RIM_E_ARGUMENT);
}

/* A frame comes back, and not with any bit changed or under another identifier. */
static void a_command_frame_survives_no_damage(void **state) {
  (void)state;
  const rim_command c = {0x1234, 0x56789, RIM_COMMAND_ACKNOWLEDGE};
  rim_can_frame frame;
  rim_command back;
  assert_int_equal(rim_can_pack_command(&frame, 5, &c), RIM_OK);
  assert_int_equal(frame.id, 0x205);
  assert_int_equal(rim_can_unpack_command(&back, 5, &frame), RIM_OK);
  assert_true(back.sequence == 0x34 && back.model_id == 0x89 && back.command == 1);
  assert_int_equal(rim_can_unpack_command(&back, 4, &frame), RIM_E_MAGIC);
  for (unsigned bit = 0; bit < 64; ++bit) {
    frame.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_equal(rim_can_unpack_command(&back, 5, &frame), RIM_E_CRC);
    frame.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
  }
  frame.length = 7;
  assert_int_equal(rim_can_unpack_command(&back, 5, &frame), RIM_E_TRUNCATED);
  frame.length = 12;
  assert_int_equal(rim_can_unpack_command(&back, 5, &frame), RIM_E_SIZE);
  assert_int_equal(rim_can_pack_command(&frame, 128, &c), RIM_E_RANGE);
  assert_int_equal(rim_can_pack_command(&frame, RIM_CAN_MAX_NODE, &c), RIM_OK); /* the last one */
  assert_int_equal(rim_can_unpack_command(&back, RIM_CAN_MAX_NODE, &frame), RIM_OK);
  assert_true(back.sequence == 0x34 && back.model_id == 0x89 && back.command == 1);
}

static void a_heartbeat_comes_back(void **state) {
  (void)state;
  rim_health_message h = {0};
  h.sequence = 0x102;
  h.model_id = 0x304;
  h.observations = 0x50607;
  h.rejected = 255;
  h.dropped = 100000;
  h.level = RIM_LEVEL_STALE;
  h.flags = RIM_HEALTH_FLAG_REPLAY;
  rim_can_frame frame;
  rim_can_heartbeat b;
  for (unsigned i = 0; i < 16; ++i) { /* every level, with every flag */
    h.level = (uint8_t)(i / 4u);
    const uint8_t latched = (i & 1u) != 0 ? RIM_ALARM_FLAG_LATCHED : 0;
    assert_int_equal(rim_can_pack_heartbeat(&frame, 127, &h, latched, (i & 2u) != 0), RIM_OK);
    assert_int_equal(frame.id, 0x77f);
    assert_int_equal(rim_can_unpack_heartbeat(&b, &frame), RIM_OK);
    assert_int_equal(b.flags, RIM_ALARM_FLAG_REPLAY | latched);
    assert_int_equal(b.acknowledged, (i & 2u) != 0);
    assert_int_equal(b.level, h.level);
  }
  assert_true(b.node == 127 && b.level == RIM_LEVEL_STALE && b.sequence == 2 && b.model_id == 4);
  assert_true(b.observations == 0x607 && b.rejected == 255 && b.dropped == 255);
  for (unsigned bit = 0; bit < 64; ++bit) {
    frame.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_equal(rim_can_unpack_heartbeat(&b, &frame), RIM_E_CRC);
    frame.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
  }
  for (uint32_t node = 0; node < 2; ++node) { /* the first and the last, and beyond them */
    const uint32_t own = node == 0 ? 0 : RIM_CAN_MAX_NODE;
    h.level = RIM_LEVEL_OK;
    h.flags = (uint8_t)(node == 0 ? 0u : RIM_HEALTH_FLAG_REPLAY);
    assert_int_equal(rim_can_pack_heartbeat(&frame, own, &h, 0, false), RIM_OK);
    assert_int_equal(rim_can_unpack_heartbeat(&b, &frame), RIM_OK);
    assert_int_equal(b.flags, h.flags);
    assert_int_equal(b.node, own);
    frame.id = node == 0 ? 0x6ff : 0x780;
    assert_int_equal(rim_can_unpack_heartbeat(&b, &frame), RIM_E_MAGIC);
  }
  h.level = 4;
  assert_int_equal(rim_can_pack_heartbeat(&frame, 1, &h, 0, false), RIM_E_RANGE);
}

/* Another type is told from one that was cut, however long it is. */
static void a_short_message_of_another_type_is_told(void **state) {
  (void)state;
  const uint8_t other[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  rim_command out;
  assert_int_equal(rim_lcm_unpack_command(&out, other, sizeof other), RIM_E_MAGIC);
  assert_int_equal(rim_lcm_unpack_command(&out, other, 7), RIM_E_TRUNCATED);
}

/* Where all is well every bit before the check sum is 0; each flag is a bit of its own beside the
 * level. */
static void a_heartbeat_of_nothing(void **state) {
  (void)state;
  rim_health_message h = {.level = RIM_LEVEL_OK};
  rim_can_frame frame;
  assert_int_equal(rim_can_pack_heartbeat(&frame, 1, &h, 0, false), RIM_OK);
  for (size_t i = 0; i < 7; ++i)
    assert_int_equal(frame.data[i], 0);
  for (uint32_t flags = 0; flags < 8; ++flags) {
    rim_can_heartbeat b;
    h.level = RIM_LEVEL_STALE;
    h.flags = (flags & 1u) != 0 ? RIM_HEALTH_FLAG_REPLAY : 0;
    const uint8_t latched = (flags & 2u) != 0 ? RIM_ALARM_FLAG_LATCHED : 0;
    assert_int_equal(rim_can_pack_heartbeat(&frame, 1, &h, latched, (flags & 4u) != 0), RIM_OK);
    const uint32_t bits = frame.data[0] & ~(uint32_t)RIM_LEVEL_STALE;
    assert_int_equal((bits & 1u) + (bits >> 1 & 1u) + (bits >> 2 & 1u) + (bits >> 3 & 1u) +
                         (bits >> 4 & 1u) + (bits >> 5 & 1u) + (bits >> 6 & 1u) + (bits >> 7 & 1u),
                     (flags & 1u) + (flags >> 1 & 1u) + (flags >> 2 & 1u));
    assert_int_equal(rim_can_unpack_heartbeat(&b, &frame), RIM_OK);
    assert_int_equal(b.level, RIM_LEVEL_STALE);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_short_message_of_another_type_is_told),
      cmocka_unit_test(a_command_equals_the_generated_encoder),
      cmocka_unit_test(counters_equal_the_generated_encoder),
      cmocka_unit_test(counters_have_their_names),
      cmocka_unit_test(other_messages_are_refused),
      cmocka_unit_test(a_command_frame_survives_no_damage),
      cmocka_unit_test(a_heartbeat_comes_back),
      cmocka_unit_test(a_heartbeat_of_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
