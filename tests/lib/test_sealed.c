/* SPDX-License-Identifier: MIT */
/* wire/sealed.h: where counter and tag stand, held to lcm-gen's encoders; all else is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rim/can.h"
#include "wire/sealed.h"

#include <rim_sealed_command_t.h>
#include <rim_sealed_observation_t.h>

#define COMMAND_BYTES (RIM_LCM_COMMAND_SIZE + RIMI_SEAL_BYTES)
#define OBSERVATION_BYTES (RIM_LCM_OBSERVATION_SIZE + RIMI_SEAL_BYTES)

static const uint64_t counter = UINT64_C(0x8123456789abcdef);

static void a_sealed_command_equals_the_generated_encoder(void **state) {
  (void)state;
  const rim_command c = {0x80000001u, 77, RIM_COMMAND_CLEAR};
  rim_sealed_command_t g = {.sequence = INT32_MIN + 1, .model_id = 77, .command = 2};
  g.counter = (int64_t)counter;
  uint8_t plain[RIM_LCM_COMMAND_SIZE], ours[COMMAND_BYTES], theirs[COMMAND_BYTES];
  for (uint8_t i = 0; i < 16; ++i)
    g.tag[i] = (uint8_t)(i + 1);
  assert_int_equal(rim_sealed_command_t_encoded_size(&g), COMMAND_BYTES);
  assert_int_equal(rim_sealed_command_t_encode(theirs, 0, sizeof theirs, &g), COMMAND_BYTES);
  assert_int_equal(rim_lcm_pack_command(plain, sizeof plain, &c), RIM_OK);
  uint8_t *tag = rimi_lcm_seal(ours, plain, rimi_sealed_command(), counter);
  assert_ptr_equal(tag, ours + COMMAND_BYTES - RIMI_TAG_BYTES);
  memcpy(tag, g.tag, sizeof g.tag);
  assert_memory_equal(ours, theirs, sizeof ours);
}

static void a_sealed_observation_equals_the_generated_encoder(void **state) {
  (void)state;
  rim_observation_message o = {.t_us = -3, .sequence = 5, .count = 128};
  rim_sealed_observation_t g = {.t_us = -3, .sequence = 5, .count = 128};
  g.counter = (int64_t)counter;
  for (int i = 0; i < 128; ++i)
    o.value[i] = g.values[i] = 0.5 * i - 9.0;
  static uint8_t plain[RIM_LCM_OBSERVATION_SIZE], ours[OBSERVATION_BYTES];
  static uint8_t theirs[OBSERVATION_BYTES], back[RIM_LCM_OBSERVATION_SIZE];
  assert_int_equal(rim_sealed_observation_t_encoded_size(&g), OBSERVATION_BYTES);
  assert_int_equal(rim_sealed_observation_t_encode(theirs, 0, sizeof theirs, &g),
                   OBSERVATION_BYTES);
  assert_int_equal(rim_lcm_pack_observation(plain, sizeof plain, &o), RIM_OK);
  (void)rimi_lcm_seal(ours, plain, rimi_sealed_observation(), counter);
  assert_memory_equal(ours, theirs, sizeof ours);
  uint64_t seen = 0;
  const uint8_t *tag = NULL;
  assert_int_equal(
      rimi_lcm_unseal(back, theirs, sizeof theirs, rimi_sealed_observation(), &seen, &tag), RIM_OK);
  assert_memory_equal(back, plain, sizeof back);
  assert_true(seen == counter);
  assert_ptr_equal(tag, theirs + OBSERVATION_BYTES - RIMI_TAG_BYTES);
}

static void other_messages_are_refused(void **state) {
  (void)state;
  const rim_command c = {1, 2, RIM_COMMAND_ACKNOWLEDGE};
  uint8_t plain[RIM_LCM_COMMAND_SIZE], back[RIM_LCM_COMMAND_SIZE], in[COMMAND_BYTES + 1] = {0};
  uint64_t seen = 9;
  const uint8_t *tag = NULL;
  assert_int_equal(rim_lcm_pack_command(plain, sizeof plain, &c), RIM_OK);
  (void)rimi_lcm_seal(in, plain, rimi_sealed_command(), counter);
  const rimi_sealed_type type = rimi_sealed_command();
  assert_int_equal(rimi_lcm_unseal(back, in, 7, type, &seen, &tag), RIM_E_TRUNCATED);
  assert_int_equal(rimi_lcm_unseal(back, in, COMMAND_BYTES - 1, type, &seen, &tag),
                   RIM_E_TRUNCATED);
  assert_int_equal(rimi_lcm_unseal(back, in, COMMAND_BYTES + 1, type, &seen, &tag), RIM_E_SIZE);
  assert_int_equal(rimi_lcm_unseal(back, plain, sizeof plain, type, &seen, &tag), RIM_E_MAGIC);
  assert_int_equal(rimi_lcm_unseal(back, in, COMMAND_BYTES, rimi_sealed_observation(), &seen, &tag),
                   RIM_E_MAGIC);
  assert_true(seen == 9 && tag == NULL);
  /* And a sealed one is no plain one. */
  rim_command out;
  assert_int_equal(rim_lcm_unpack_command(&out, in, COMMAND_BYTES), RIM_E_MAGIC);
}

static void a_frame_goes_there_and_back(void **state) {
  (void)state;
  const rim_command c = {0xdeadbeefu, 0x01020304u, RIM_COMMAND_DESCRIBE};
  uint8_t tag[RIMI_TAG_BYTES];
  memset(tag, 0x5a, sizeof tag);
  rim_can_frame frame;
  rimi_can_seal(&frame, 127, &c, counter);
  rimi_can_seal_finish(&frame, tag);
  assert_true(frame.fd && frame.length == 48 && frame.id == 0x27f);
  const uint8_t head[20] = {1, 127, 3,    0,    0xef, 0xbe, 0xad, 0xde, 4,    3,
                            2, 1,   0xef, 0xcd, 0xab, 0x89, 0x67, 0x45, 0x23, 0x81};
  assert_memory_equal(frame.data, head, sizeof head);
  assert_memory_equal(frame.data + 20, tag, sizeof tag);
  rim_command back = {0};
  uint64_t seen = 0;
  assert_int_equal(rimi_can_unseal(&back, 127, &frame, &seen), RIM_OK);
  assert_true(back.sequence == c.sequence && back.model_id == c.model_id && back.command == 3);
  assert_true(seen == counter);
}

static void other_frames_are_refused(void **state) {
  (void)state;
  const rim_command c = {1, 2, RIM_COMMAND_CLEAR};
  const uint8_t tag[RIMI_TAG_BYTES] = {0};
  rim_can_frame good, bad;
  rim_command out;
  uint64_t seen;
  rimi_can_seal(&good, 5, &c, 1);
  rimi_can_seal_finish(&good, tag);
  assert_int_equal(rimi_can_unseal(&out, 6, &good, &seen), RIM_E_MAGIC);
  bad = good;
  bad.length = 47;
  assert_int_equal(rimi_can_unseal(&out, 5, &bad, &seen), RIM_E_TRUNCATED);
  bad.length = 64;
  assert_int_equal(rimi_can_unseal(&out, 5, &bad, &seen), RIM_E_SIZE);
  for (size_t byte = 0; byte < 48; ++byte) { /* a bit anywhere */
    bad = good;
    bad.data[byte] ^= 1;
    assert_int_equal(rimi_can_unseal(&out, 5, &bad, &seen), RIM_E_CRC);
  }
  const uint8_t wrong[4][3] = {{0, 2, 1}, {1, 6, 1}, {2, 0, 0}, {2, 4, 0}};
  for (size_t i = 0; i < 4; ++i) { /* another layout, node, command, with a good check sum */
    bad = good;
    bad.data[wrong[i][0]] = wrong[i][1];
    rimi_can_seal_finish(&bad, tag);
    assert_int_equal(rimi_can_unseal(&out, 5, &bad, &seen),
                     wrong[i][2] ? RIM_E_VERSION : RIM_E_RANGE);
  }
  rim_can_frame plain;
  assert_int_equal(rim_can_pack_command(&plain, 5, &c), RIM_OK);
  assert_int_equal(rimi_can_unseal(&out, 5, &plain, &seen), RIM_E_TRUNCATED);
  assert_int_equal(rim_can_unpack_command(&out, 5, &good), RIM_E_SIZE);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_sealed_command_equals_the_generated_encoder),
      cmocka_unit_test(a_sealed_observation_equals_the_generated_encoder),
      cmocka_unit_test(other_messages_are_refused),
      cmocka_unit_test(a_frame_goes_there_and_back),
      cmocka_unit_test(other_frames_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
