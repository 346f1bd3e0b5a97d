/* SPDX-License-Identifier: MIT */
/* threshold: the section is validated whole; scores, thresholds and p-values agree with
 * their definition. */
#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "image/threshold.h"

enum { CHANNELS = 3, RUNS = 9, KNOTS = 3 };
enum { WORDS = 4 + 4 + RUNS + KNOTS + 2 * CHANNELS };

typedef struct section {
  _Alignas(8) uint8_t bytes[4 * WORDS];
} section;

static void put_u32(section *s, size_t i, uint32_t v) {
  for (int k = 0; k < 4; ++k)
    s->bytes[4 * i + (size_t)k] = (uint8_t)(v >> (8 * k));
}
static void put_f32(section *s, size_t i, float f) {
  uint32_t v;
  memcpy(&v, &f, 4);
  put_u32(s, i, v);
}

static section make_section(void) {
  section s;
  memset(&s, 0, sizeof s);
  const uint32_t header[4] = {CHANNELS, RUNS, KNOTS, 9};
  for (size_t i = 0; i < 4; ++i)
    put_u32(&s, i, header[i]);
  const float scores[4] = {9.0f, 8.0f, 0.1f, 0.0f};
  for (size_t i = 0; i < 4; ++i)
    put_f32(&s, 4 + i, scores[i]);
  size_t at = 8;
  for (size_t i = 0; i < RUNS; ++i)
    put_f32(&s, at++, (float)(i + 1));
  const float growth[KNOTS] = {1.0f, 2.0f, 4.0f};
  for (size_t i = 0; i < KNOTS; ++i)
    put_f32(&s, at++, growth[i]);
  for (size_t i = 0; i < CHANNELS; ++i)
    put_f32(&s, at++, 0.5f);
  for (size_t i = 0; i < CHANNELS; ++i)
    put_f32(&s, at++, (float)(i + 1));
  return s;
}

static void opens_a_valid_section(void **state) {
  (void)state;
  const section s = make_section();
  rim_threshold t;
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  assert_int_equal(t.channels, CHANNELS);
  assert_int_equal(t.rank, 9);
  assert_true(t.alarm_score == 9.0);
}

/* A rate of 0 is no promise, and neither is one above 1, nor a score that every run reaches. */
static void a_promise_lies_between_never_and_always(void **state) {
  (void)state;
  const struct {
    float rate;
    rim_status expected;
  } promise[] = {{0.0f, RIM_E_RANGE}, {1e-6f, RIM_OK}, {1.0f, RIM_OK}, {1.5f, RIM_E_RANGE}};
  for (size_t i = 0; i < sizeof promise / sizeof *promise; ++i) {
    section s = make_section();
    put_f32(&s, 6, promise[i].rate);
    rim_threshold t;
    assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), promise[i].expected);
  }
  section s = make_section();
  put_f32(&s, 4, 0.0f); /* a score that every run reaches */
  put_f32(&s, 5, 0.0f);
  rim_threshold t;
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
}

static void every_truncation_is_refused_and_leaves_the_view(void **state) {
  (void)state;
  const section s = make_section();
  rim_threshold t;
  memset(&t, 0x5a, sizeof t);
  const rim_threshold before = t;
  for (size_t n = 0; n < sizeof s.bytes; ++n) {
    assert_int_not_equal(rimi_threshold_open(&t, s.bytes, n), RIM_OK);
    assert_memory_equal(&t, &before, sizeof t);
  }
  assert_int_equal(rimi_threshold_open(NULL, s.bytes, sizeof s.bytes), RIM_E_ARGUMENT);
  assert_int_equal(rimi_threshold_open(&t, NULL, sizeof s.bytes), RIM_E_ARGUMENT);
}

/* Each of these breaks one rule of the header comment. */
static void bad_values_are_refused(void **state) {
  (void)state;
  rim_threshold t;
  for (size_t word = 4; word < WORDS; ++word) {
    section s = make_section();
    put_u32(&s, word, 0x7fc00000u); /* NaN */
    assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
  }
  section s = make_section();
  put_f32(&s, 9, 0.5f); /* maxima no longer ascend */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
  s = make_section();
  put_u32(&s, 3, RUNS + 1); /* the last rank that there is: none of the runs' scores */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  put_u32(&s, 3, RUNS + 2);
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
  s = make_section();
  put_f32(&s, 8 + RUNS + KNOTS + CHANNELS, 0.0f); /* a scale of zero */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
  s = make_section();
  put_f32(&s, 8 + RUNS + KNOTS, -1.0f); /* an offset below zero */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
  s = make_section();
  put_u32(&s, 0, 0); /* no channel, and nothing of one */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes - 8 * CHANNELS), RIM_E_RANGE);
  s = make_section();
  put_f32(&s, 5, 9.5f); /* the warning above the alarm */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_E_RANGE);
}

/* The fewest and the most of each, every number of them 1; and one more. */
static void counts_end(void **state) {
  (void)state;
  static uint8_t whole[4 * (8 + RIM_THRESHOLD_MAX_RUNS + RIM_THRESHOLD_MAX_KNOTS + 2 * 1025)];
  const uint32_t most[3] = {1024, RIM_THRESHOLD_MAX_RUNS, RIM_THRESHOLD_MAX_KNOTS};
  for (uint32_t more = 0; more < 2; ++more) {
    for (uint32_t which = 0; which < 4; ++which) {
      uint32_t n[3] = {1, 0, 0};
      if (which < 3)
        n[which] = most[which] + more;
      section one;
      put_f32(&one, 0, 1.0f);
      const size_t words = 8u + n[1] + n[2] + 2u * n[0];
      for (size_t i = 0; i < words; ++i)
        memcpy(whole + 4 * i, one.bytes, 4);
      for (size_t i = 0; i < 4; ++i)
        put_u32(&one, i, i < 3 ? n[i] : 1u);
      memcpy(whole, one.bytes, 16);
      rim_threshold t;
      assert_int_equal(rimi_threshold_open(&t, whole, 4 * words),
                       which < 3 && more ? RIM_E_RANGE : RIM_OK);
    }
  }
}

/* Runs may be alike; no scale with the observations may vanish or fall below FLT_MIN; and a header
 * without anything behind it is read. */
static void what_is_just_allowed(void **state) {
  (void)state;
  rim_threshold t;
  section s = make_section();
  put_f32(&s, 9, 1.0f); /* as much as the one before */
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  for (size_t k = 0; k < KNOTS; ++k) {
    s = make_section();
    const float least[3] = {0.0f, FLT_MIN / 2.0f, FLT_MIN};
    for (size_t i = 0; i < 3; ++i) {
      put_f32(&s, 8 + RUNS + k, least[i]);
      assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes),
                       least[i] < FLT_MIN ? RIM_E_RANGE : RIM_OK);
    }
    assert_true(rimi_threshold_growth(&t, 1u << k) == (double)FLT_MIN);
  }
  s = make_section();
  assert_int_equal(rimi_threshold_open(&t, s.bytes, RIM_THRESHOLD_HEADER_BYTES), RIM_E_TRUNCATED);
  put_u32(&s, 0, 0);
  assert_int_equal(rimi_threshold_open(&t, s.bytes, RIM_THRESHOLD_HEADER_BYTES), RIM_E_RANGE);
}

/* A score may be of any sign, and the scale of a run may fall before it rises; one alone holds for
 * all of a run. */
static void scores_and_scales_of_any_kind(void **state) {
  (void)state;
  rim_threshold t;
  section s = make_section();
  put_f32(&s, 8, -5.0f);
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  const float growth[KNOTS] = {3.0f, 1.0f, 9.0f};
  for (size_t i = 0; i < KNOTS; ++i)
    put_f32(&s, 8 + RUNS + i, growth[i]);
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  const double expected[6] = {3.0, 3.0, 1.0, 5.0, 9.0, 9.0};
  for (uint32_t n = 0; n < 6; ++n)
    assert_true(rimi_threshold_growth(&t, n) == expected[n]);
  put_u32(&s, 2, 1); /* one knot, and what would be others goes */
  memmove(s.bytes + 4 * (8 + RUNS + 1), s.bytes + 4 * (8 + RUNS + KNOTS), 8 * CHANNELS);
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes - 4 * (KNOTS - 1)), RIM_OK);
  for (uint32_t n = 0; n < 6; ++n)
    assert_true(rimi_threshold_growth(&t, n) == 3.0);
}

static void envelope_interpolates_and_is_constant_beyond(void **state) {
  (void)state;
  const section s = make_section();
  rim_threshold t;
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  assert_true(rimi_threshold_growth(&t, 0) == 1.0);
  assert_true(rimi_threshold_growth(&t, 1) == 1.0);
  assert_true(rimi_threshold_growth(&t, 2) == 2.0);
  assert_true(rimi_threshold_growth(&t, 3) == 3.0);
  for (uint32_t n = 4; n < 20; ++n) /* nothing grows behind the last one */
    assert_true(rimi_threshold_growth(&t, n) == 4.0);
  assert_true(rimi_threshold_growth(&t, UINT32_MAX) == 4.0);
}

/* The score reaches alarm_score exactly when ln anom reaches the threshold. */
static void score_and_threshold_agree(void **state) {
  (void)state;
  const section s = make_section();
  rim_threshold t;
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  const uint32_t n[] = {1, 2, 3, 5, 400};
  for (uint16_t c = 0; c < CHANNELS; ++c) {
    for (size_t i = 0; i < sizeof n / sizeof *n; ++i) {
      const double ln_anom = rimi_threshold_ln_anom(&t, c, n[i]);
      const double score = rimi_threshold_score(&t, c, ln_anom, n[i]);
      assert_true(score > t.alarm_score * (1 - 1e-15) && score < t.alarm_score * (1 + 1e-15));
    }
  }
}

static void p_value_counts_maxima(void **state) {
  (void)state;
  const section s = make_section();
  rim_threshold t;
  assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
  rim_rng rng;
  print_message("seed 7\n");
  rimi_rng_seed(&rng, 7, 0);
  for (int trial = 0; trial < 1000; ++trial) {
    const double score = trial < 20 ? 0.5 * (double)trial : 12.0 * rimi_rng_uniform(&rng);
    int above = 0;
    for (int i = 1; i <= RUNS; ++i)
      above += (double)i >= score;
    const double expected = (double)(1 + above) / (double)(RUNS + 1);
    assert_true(rimi_threshold_p_value(&t, score) == expected);
  }
  assert_true(rimi_threshold_p_value(&t, 1e9) == 1.0 / (RUNS + 1)); /* no surer than the runs */
}

/* Conformal promise: with exchangeable runs the k-th smallest maximum is exceeded at most
 * (n + 1 - k) / (n + 1) of the time. */
static void promise_holds_for_exchangeable_runs(void **state) {
  (void)state;
  rim_rng rng;
  print_message("seed 11\n");
  rimi_rng_seed(&rng, 11, 0);
  int false_alarms = 0;
  const int trials = 4000;
  for (int trial = 0; trial < trials; ++trial) {
    float maxima[RUNS];
    for (int i = 0; i < RUNS; ++i)
      maxima[i] = (float)(5.0 + rimi_rng_normal(&rng));
    for (int i = 1; i < RUNS; ++i) {
      for (int j = i; j > 0 && maxima[j] < maxima[j - 1]; --j) {
        const float swap = maxima[j];
        maxima[j] = maxima[j - 1];
        maxima[j - 1] = swap;
      }
    }
    section s = make_section();
    for (size_t i = 0; i < RUNS; ++i)
      put_f32(&s, 8 + i, maxima[i]);
    rim_threshold t;
    assert_int_equal(rimi_threshold_open(&t, s.bytes, sizeof s.bytes), RIM_OK);
    false_alarms += rimi_threshold_p_value(&t, 5.0 + rimi_rng_normal(&rng)) <= 0.2;
  }
  /* Expected 0.2; six standard deviations of a binomial are 0.038. */
  assert_in_range(false_alarms, (int)(0.162 * trials), (int)(0.238 * trials));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(opens_a_valid_section),
      cmocka_unit_test(a_promise_lies_between_never_and_always),
      cmocka_unit_test(every_truncation_is_refused_and_leaves_the_view),
      cmocka_unit_test(bad_values_are_refused),
      cmocka_unit_test(counts_end),
      cmocka_unit_test(what_is_just_allowed),
      cmocka_unit_test(scores_and_scales_of_any_kind),
      cmocka_unit_test(envelope_interpolates_and_is_constant_beyond),
      cmocka_unit_test(score_and_threshold_agree),
      cmocka_unit_test(p_value_counts_maxima),
      cmocka_unit_test(promise_holds_for_exchangeable_runs),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
