/* SPDX-License-Identifier: MIT */
/* The digest of a verdict: whatever decides anything changes it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "base/crc.h"
#include "rim/interference.h"
#include "rim/monitor.h"

static const rim_interference_verdict motion = {.valid = true, .ln_odds = -3.0};

static rim_verdict sample(void) {
  rim_verdict v;
  memset(&v, 0, sizeof v);
  v.score = 0.75;
  v.ln_anom = 12.0;
  v.threshold = 16.0;
  v.p_value = 0.25;
  v.blocks = 7;
  v.channel = 3;
  v.level = RIM_LEVEL_ERROR;
  v.valid = true;
  v.alarm = sample_alarm(4);
  v.alarm.state = RIM_ALARM_RAISED;
  v.alarm.channels = 2;
  v.alarm.region.dims = 2;
  v.interference = &motion;
  return v;
}

static uint64_t digest_of(const rim_verdict *v) { return rim_verdict_digest(RIM_DIGEST_START, v); }

#define CHANGES(field, value)                                                                      \
  do {                                                                                             \
    rim_verdict other = sample();                                                                  \
    other.field = (value);                                                                         \
    assert_true(digest_of(&other) != whole);                                                       \
  } while (0)

static void what_decides_changes_it(void **state) {
  (void)state;
  const rim_verdict v = sample();
  const uint64_t whole = digest_of(&v);
  assert_true(digest_of(&v) == whole);
  CHANGES(score, 0.76);
  CHANGES(ln_anom, 12.1);
  CHANGES(threshold, 16.1);
  CHANGES(p_value, 0.26);
  CHANGES(blocks, 8);
  CHANGES(channel, 4);
  CHANGES(level, RIM_LEVEL_WARN);
  CHANGES(valid, false);
  CHANGES(reason, RIM_REASON_RATE);
  CHANGES(reason, RIM_REASON_OUT_OF_RANGE);
  rim_interference_verdict moved = motion;
  moved.ln_odds = -2.0;
  CHANGES(interference, &moved);
  moved = motion;
  moved.alarmed = true;
  CHANGES(interference, &moved);
  CHANGES(interference, NULL);
  CHANGES(alarm.state, RIM_ALARM_UPDATED);
  CHANGES(alarm.state, RIM_ALARM_NONE);
  CHANGES(alarm.kind, v.alarm.kind ^ 1u);
  CHANGES(alarm.detector, v.alarm.detector ^ 1u);
  CHANGES(alarm.since_sd_s, v.alarm.since_sd_s + 1.0);
  CHANGES(alarm.since_s, v.alarm.since_s + 1.0);
  CHANGES(alarm.channel[1], v.alarm.channel[1] ^ 1u);
  CHANGES(alarm.shift[1], v.alarm.shift[1] + 1.0);
  CHANGES(alarm.shift_sd[0], v.alarm.shift_sd[0] + 1.0);
  CHANGES(alarm.region.dims, 1);
  CHANGES(alarm.region.feature[1], v.alarm.region.feature[1] ^ 1u);
  CHANGES(alarm.region.center[1], v.alarm.region.center[1] + 1.0);
  CHANGES(alarm.region.lower[0], v.alarm.region.lower[0] - 1.0);
  CHANGES(alarm.region.upper[0], v.alarm.region.upper[0] + 1.0);
  CHANGES(alarm.region.inverse_shape[3], v.alarm.region.inverse_shape[3] + 1.0);
}

/* Each number of a verdict on motion by itself, and each of an alarm's region and outcomes. */
static void every_number_changes_it(void **state) {
  (void)state;
  const rim_verdict v = sample();
  const uint64_t whole = digest_of(&v);
  rim_interference_verdict moved = motion;
  double *const number[] = {&moved.score[0],     &moved.score[1],     &moved.score[2],
                            &moved.ln_odds,      &moved.residual_mps, &moved.one_step_mps,
                            &moved.since_onset_s};
  for (size_t i = 0; i < sizeof number / sizeof *number; ++i) {
    *number[i] += 1.0;
    CHANGES(interference, &moved);
    *number[i] -= 1.0;
  }
  moved.motion ^= 1u;
  CHANGES(interference, &moved);
  moved = motion;
  moved.kind ^= 1u;
  CHANGES(interference, &moved);
  for (size_t i = 0; i < 2; ++i) {
    CHANGES(alarm.channel[i], v.alarm.channel[i] ^ 1u);
    CHANGES(alarm.shift[i], v.alarm.shift[i] + 1.0);
    CHANGES(alarm.shift_sd[i], v.alarm.shift_sd[i] + 1.0);
    CHANGES(alarm.region.feature[i], v.alarm.region.feature[i] ^ 1u);
    CHANGES(alarm.region.center[i], v.alarm.region.center[i] + 1.0);
    CHANGES(alarm.region.lower[i], v.alarm.region.lower[i] - 1.0);
    CHANGES(alarm.region.upper[i], v.alarm.region.upper[i] + 1.0);
  }
  for (size_t i = 0; i < 4; ++i)
    CHANGES(alarm.region.inverse_shape[i], v.alarm.region.inverse_shape[i] + 1.0);
}

static void what_is_not_in_use_does_not(void **state) {
  (void)state;
  rim_verdict v = sample(), other = sample();
  other.out_feature = 5; /* nothing is out of range */
  other.out_value = 5.0;
  other.alarm.channel[2] ^= 1u;       /* two channels */
  other.alarm.region.center[2] = 9.0; /* two features */
  other.alarm.region.inverse_shape[4] += 1.0;
  assert_true(digest_of(&v) == digest_of(&other));
  v.reason = other.reason = RIM_REASON_OUT_OF_RANGE;
  assert_true(digest_of(&v) != digest_of(&other));
  other.out_feature = v.out_feature;
  v.alarm.state = other.alarm.state = RIM_ALARM_NONE; /* no record */
  other.alarm.shift[0] += 1.0;
  assert_true(digest_of(&v) == digest_of(&other));
  assert_true(rim_verdict_digest(5, NULL) == 5);
}

static void order_counts(void **state) {
  (void)state;
  const rim_verdict a = sample();
  rim_verdict b = sample();
  b.score = 0.5;
  assert_true(rim_verdict_digest(digest_of(&a), &b) != rim_verdict_digest(digest_of(&b), &a));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_decides_changes_it),
      cmocka_unit_test(every_number_changes_it),
      cmocka_unit_test(what_is_not_in_use_does_not),
      cmocka_unit_test(order_counts),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
