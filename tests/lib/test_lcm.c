/* SPDX-License-Identifier: MIT */
/* LCM messages: the same bytes as lcm-gen's own encoders, in both directions, and no others read.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "rim/lcm.h"

#include <rim_alarm_t.h>
#include <rim_health_t.h>
#include <rim_observation_t.h>

#define SAMPLES 300u

static void generated_alarm(rim_alarm_t *g, const rim_alarm *a) {
  memset(g, 0, sizeof *g);
  g->t_s = a->t_s;
  g->since_s = a->since_s;
  memcpy(&g->sequence, &a->seq, 4);
  memcpy(&g->model_id, &a->model_id, 4);
  memcpy(&g->observations, &a->observations, 4);
  g->detector = a->detector;
  g->state = a->state;
  g->level = a->level;
  g->kind = a->kind;
  g->flags = a->flags;
  g->channels = a->channels;
  g->dims = a->region.dims;
  memcpy(g->channel, a->channel, sizeof g->channel);
  memcpy(g->shift, a->shift, sizeof g->shift);
  memcpy(g->shift_sd, a->shift_sd, sizeof g->shift_sd);
  memcpy(g->feature, a->region.feature, sizeof g->feature);
  memcpy(g->center, a->region.center, sizeof g->center);
  memcpy(g->inverse_shape, a->region.inverse_shape, sizeof g->inverse_shape);
  memcpy(g->lower, a->region.lower, sizeof g->lower);
  memcpy(g->upper, a->region.upper, sizeof g->upper);
  g->ln_anom = a->ln_anom;
  g->threshold = a->threshold;
  g->p_value = a->p_value;
  g->since_sd_s = a->since_sd_s;
}

static void alarms_equal_the_generated_encoder(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < SAMPLES; ++seed) {
    const rim_alarm a = sample_alarm(seed);
    rim_alarm_t g, decoded;
    uint8_t ours[RIM_LCM_ALARM_SIZE], theirs[RIM_LCM_ALARM_SIZE];
    generated_alarm(&g, &a);
    assert_int_equal(rim_alarm_t_encoded_size(&g), RIM_LCM_ALARM_SIZE);
    assert_int_equal(rim_alarm_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_ALARM_SIZE);
    assert_int_equal(rim_lcm_pack_alarm(ours, sizeof ours, &a), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
    assert_int_equal(rim_alarm_t_decode(ours, 0, sizeof ours, &decoded), RIM_LCM_ALARM_SIZE);
    assert_memory_equal(decoded.inverse_shape, a.region.inverse_shape, sizeof g.inverse_shape);
    rim_alarm back;
    assert_int_equal(rim_lcm_unpack_alarm(&back, theirs, sizeof theirs), RIM_OK);
    assert_int_equal(rim_lcm_pack_alarm(ours, sizeof ours, &back), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
  }
}

static void the_first_version_of_an_alarm_is_read(void **state) {
  (void)state;
  static const uint8_t first[8] = {0xe5, 0xc3, 0xea, 0xd0, 0x8c, 0xa8, 0x12, 0xdb};
  const rim_alarm a = sample_alarm(7);
  uint8_t bytes[RIM_LCM_ALARM_SIZE], again[RIM_LCM_ALARM_SIZE];
  rim_alarm back;
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_OK);
  memcpy(again, bytes, sizeof again);
  memcpy(bytes, first, sizeof first);
  assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, sizeof bytes), RIM_E_SIZE);
  assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, sizeof bytes - 9), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, 8), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, sizeof bytes - 8), RIM_OK);
  assert_true(back.since_sd_s == 0.0);
  back.since_sd_s = a.since_sd_s;
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &back), RIM_OK);
  assert_memory_equal(bytes, again, sizeof bytes);
}

static void observations_equal_the_generated_encoder(void **state) {
  (void)state;
  static rim_observation_message o, back;
  static rim_observation_t g;
  static uint8_t ours[RIM_LCM_OBSERVATION_SIZE], theirs[RIM_LCM_OBSERVATION_SIZE];
  uint32_t random = 5;
  for (uint32_t count = 1; count <= RIM_OBSERVATION_MAX_VALUES; ++count) {
    memset(&o, 0, sizeof o);
    memset(&g, 0, sizeof g);
    o.t_us = g.t_us = -(int64_t)count * 1000000007;
    o.sequence = 0x80000000u + count;
    memcpy(&g.sequence, &o.sequence, 4);
    o.count = count;
    g.count = (int32_t)count;
    for (uint32_t i = 0; i < count; ++i)
      o.value[i] = g.values[i] = i == 3 ? (double)NAN : sample_between(&random, -1e6, 1e6);
    assert_int_equal(rim_observation_t_encode(theirs, 0, sizeof theirs, &g), sizeof theirs);
    assert_int_equal(rim_lcm_pack_observation(ours, sizeof ours, &o), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
    assert_int_equal(rim_lcm_unpack_observation(&back, theirs, sizeof theirs), RIM_OK);
    assert_int_equal(rim_lcm_pack_observation(ours, sizeof ours, &back), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
  }
  /* What lies behind count in the caller's struct does not leak onto the bus. */
  o.count = 1;
  g.count = 1;
  memset(g.values + 1, 0, sizeof g.values - sizeof g.values[0]);
  assert_int_equal(rim_observation_t_encode(theirs, 0, sizeof theirs, &g), sizeof theirs);
  assert_int_equal(rim_lcm_pack_observation(ours, sizeof ours, &o), RIM_OK);
  assert_memory_equal(ours, theirs, sizeof ours);
}

static void health_equals_the_generated_encoder(void **state) {
  (void)state;
  const rim_health_message h = {12.5, 0x80000001u, 2, 3, 4, 5, 6, UINT32_MAX, RIM_LEVEL_STALE, 1};
  const rim_health_t g = {12.5, INT32_MIN + 1, 2, 3, 4, 5, 6, -1, RIM_LEVEL_STALE, 1};
  uint8_t ours[RIM_LCM_HEALTH_SIZE], theirs[RIM_LCM_HEALTH_SIZE];
  rim_health_message back;
  memset(&back, 0, sizeof back);
  assert_int_equal(rim_health_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_HEALTH_SIZE);
  assert_int_equal(rim_lcm_pack_health(ours, sizeof ours, &h), RIM_OK);
  assert_memory_equal(ours, theirs, sizeof ours);
  assert_int_equal(rim_lcm_unpack_health(&back, theirs, sizeof theirs), RIM_OK);
  assert_true(back.t_s == h.t_s && back.sequence == h.sequence && back.dropped == h.dropped);
  assert_true(back.level == h.level && back.flags == h.flags && back.gaps == h.gaps);
}

static void every_shorter_and_longer_message_is_refused(void **state) {
  (void)state;
  static uint8_t bytes[RIM_LCM_OBSERVATION_SIZE + 8];
  const rim_alarm a = sample_alarm(1);
  const rim_health_message h = {0};
  static rim_observation_message o;
  rim_alarm alarm;
  rim_health_message health;
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_OK);
  for (size_t n = 0; n < RIM_LCM_ALARM_SIZE; ++n)
    assert_int_equal(rim_lcm_unpack_alarm(&alarm, bytes, n), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_alarm(&alarm, bytes, RIM_LCM_ALARM_SIZE + 1), RIM_E_SIZE);
  assert_int_equal(rim_lcm_unpack_health(&health, bytes, RIM_LCM_HEALTH_SIZE), RIM_E_MAGIC);
  assert_int_equal(rim_lcm_unpack_observation(&o, bytes, RIM_LCM_OBSERVATION_SIZE), RIM_E_MAGIC);
  assert_int_equal(rim_lcm_pack_health(bytes, sizeof bytes, &h), RIM_OK);
  for (size_t n = 0; n < RIM_LCM_HEALTH_SIZE; ++n)
    assert_int_equal(rim_lcm_unpack_health(&health, bytes, n), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_alarm(&alarm, bytes, RIM_LCM_ALARM_SIZE), RIM_E_MAGIC);
  for (uint32_t bit = 0; bit < 64; ++bit) {
    bytes[bit / 8] ^= (uint8_t)(1u << (bit % 8));
    assert_int_equal(rim_lcm_unpack_health(&health, bytes, RIM_LCM_HEALTH_SIZE), RIM_E_MAGIC);
    bytes[bit / 8] ^= (uint8_t)(1u << (bit % 8));
  }
}

/* Counts and codes that a later reader would index with. */
static void wrong_contents_are_refused(void **state) {
  (void)state;
  static uint8_t bytes[RIM_LCM_OBSERVATION_SIZE];
  static rim_observation_message o;
  const rim_alarm a = sample_alarm(1);
  rim_alarm back;
  o.count = 2;
  assert_int_equal(rim_lcm_pack_observation(bytes, sizeof bytes, &o), RIM_OK);
  const uint32_t wrong[] = {0, 129, 0xffffffffu, 0x80000000u};
  for (size_t i = 0; i < 4; ++i) {
    for (int b = 0; b < 4; ++b)
      bytes[20 + b] = (uint8_t)(wrong[i] >> (24 - 8 * b));
    assert_int_equal(rim_lcm_unpack_observation(&o, bytes, sizeof bytes), RIM_E_RANGE);
  }
  const size_t codes = 8 + 2 * 8 + 3 * 4; /* detector, state, level, kind, flags, channels, dims */
  const uint8_t limit[7] = {
      2, 4, 4, RIM_KIND_PUSHED + 1, 0, RIM_ALARM_MAX_CHANNELS + 1, RIM_REGION_MAX_DIMS + 1};
  for (size_t i = 0; i < 7; ++i) {
    assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_OK);
    bytes[codes + i] = limit[i];
    const rim_status want = i == 4 ? RIM_OK : RIM_E_RANGE;
    assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, RIM_LCM_ALARM_SIZE), want);
  }
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_OK);
  bytes[RIM_LCM_ALARM_SIZE - 8] = 0x7f; /* p_value infinite or NaN */
  bytes[RIM_LCM_ALARM_SIZE - 7] = 0xf0;
  assert_int_equal(rim_lcm_unpack_alarm(&back, bytes, RIM_LCM_ALARM_SIZE), RIM_E_DATA);
}

static void wrong_records_are_not_written(void **state) {
  (void)state;
  uint8_t bytes[RIM_LCM_ALARM_SIZE];
  static rim_observation_message o;
  rim_alarm a = sample_alarm(1);
  rim_health_message h = {0};
  memset(bytes, 0x55, sizeof bytes);
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes - 1, &a), RIM_E_SIZE);
  assert_int_equal(rim_lcm_pack_alarm(NULL, sizeof bytes, &a), RIM_E_ARGUMENT);
  assert_int_equal(rim_lcm_pack_observation(bytes, sizeof bytes, &o), RIM_E_SIZE);
  a.level = 4;
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_E_RANGE);
  a = sample_alarm(1);
  a.shift[3] = (double)NAN; /* in use or not: the receiver looks at all of them */
  assert_int_equal(rim_lcm_pack_alarm(bytes, sizeof bytes, &a), RIM_E_DATA);
  h.level = 4;
  assert_int_equal(rim_lcm_pack_health(bytes, sizeof bytes, &h), RIM_E_RANGE);
  for (size_t i = 0; i < sizeof bytes; ++i)
    assert_int_equal(bytes[i], 0x55);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(alarms_equal_the_generated_encoder),
      cmocka_unit_test(the_first_version_of_an_alarm_is_read),
      cmocka_unit_test(observations_equal_the_generated_encoder),
      cmocka_unit_test(health_equals_the_generated_encoder),
      cmocka_unit_test(every_shorter_and_longer_message_is_refused),
      cmocka_unit_test(wrong_contents_are_refused),
      cmocka_unit_test(wrong_records_are_not_written),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
