/* SPDX-License-Identifier: MIT */
/* The interval against brute force and against Algorithm 8 (p. 116) as the thesis writes it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "batch/interval.h"

#define SEED 88u
enum { K = 24 };

static rim_rng rng;

static void draw(rim_stats *bin, int bins) {
  memset(bin, 0, (size_t)bins * sizeof *bin);
  for (int i = 0; i < bins; ++i) {
    for (uint32_t j = rimi_rng_below(&rng, 5); j > 0; --j) {
      (void)rimi_stats_add(&bin[i], 0.3 + rimi_rng_normal(&rng), 0.5 + rimi_rng_uniform(&rng));
    }
  }
}

/* Line by line: T[i][j] holds the bins j..j+i; ties go to the smaller i, then j, as the loops run.
 */
static rim_interval algorithm_8(const rim_stats *bin, int bins) {
  static rim_stats t[K + 1][K];
  rim_interval best = {0};
  for (int i = 0; i < bins; ++i) {
    for (int j = 0; j + i < bins; ++j) {
      t[i][j] = i == 0 ? bin[j] : t[i - 1][j];
      if (i > 0) {
        rimi_stats_merge(&t[i][j], &bin[i + j]);
      }
      const double f = rimi_stats_ln_anom(&t[i][j]);
      if (f > best.ln_anom) {
        best = (rim_interval){(uint32_t)j, (uint32_t)i + 1, t[i][j].n, t[i][j].s, t[i][j].w, f};
      }
    }
  }
  return best;
}

static void assert_same(const rim_interval *a, const rim_interval *b) {
  assert_int_equal(a->first, b->first);
  assert_int_equal(a->bins, b->bins);
  assert_true(a->n == b->n && a->s == b->s && a->w == b->w && a->ln_anom == b->ln_anom);
}

static void equals_algorithm_8(void **state) {
  (void)state;
  for (int round = 0; round < 3000; ++round) {
    rim_stats bin[K];
    const int bins = 1 + (int)rimi_rng_below(&rng, K);
    draw(bin, bins);
    if (round % 5 == 0) { /* coarse values: many exact ties */
      for (int i = 0; i < bins; ++i) {
        bin[i] = (rim_stats){1.0, (double)rimi_rng_below(&rng, 3) - 1.0, 1.0};
      }
    }
    rim_interval best;
    assert_int_equal(rimi_interval_find(bin, (size_t)bins, 0.0, &best), RIM_OK);
    const rim_interval plain = algorithm_8(bin, bins);
    assert_same(&best, &plain);
  }
}

static void least_count_is_kept(void **state) {
  (void)state;
  for (int round = 0; round < 500; ++round) {
    rim_stats bin[K];
    draw(bin, K);
    const double min_n = rimi_rng_below(&rng, 30);
    rim_interval best;
    assert_int_equal(rimi_interval_find(bin, K, min_n, &best), RIM_OK);
    double f = 0.0;
    for (int a = 0; a < K; ++a) {
      rim_stats sum = {0};
      for (int b = a; b < K; ++b) {
        rimi_stats_merge(&sum, &bin[b]);
        f = sum.n >= min_n ? fmax(f, rimi_stats_ln_anom(&sum)) : f;
      }
    }
    assert_true(best.ln_anom == f && (best.bins == 0 || best.n >= min_n));
  }
}

static void ties_and_empties(void **state) {
  (void)state;
  const rim_stats unit = {1.0, 2.0, 1.0}, none = {0};
  const rim_stats bin[6] = {none, unit, none, none, {1.0, -2.0, 1.0}, none};
  rim_interval best;
  assert_int_equal(rimi_interval_find(bin, 6, 0.0, &best), RIM_OK);
  assert_true(best.first == 1 && best.bins == 1 && best.ln_anom == 2.0);
  assert_int_equal(rimi_interval_find(&bin[2], 2, 0.0, &best), RIM_OK);
  assert_true(best.bins == 0 && best.n == 0.0 && best.ln_anom == 0.0);
  assert_int_equal(rimi_interval_find(bin, 0, 0.0, &best), RIM_OK);
  assert_int_equal(best.bins, 0);
  assert_int_equal(rimi_interval_find(bin, 6, 3.0, &best), RIM_OK);
  assert_int_equal(best.bins, 0);
  const rim_stats damaged[3] = {unit, {1.0, NAN, 1.0}, {1.0, 1.0, NAN}};
  assert_int_equal(rimi_interval_find(damaged, 3, 0.0, &best), RIM_OK);
  assert_true(best.first == 0 && best.bins == 1);
}

static void misuse_is_refused(void **state) {
  (void)state;
  rim_stats bin[2] = {{0}};
  rim_interval best = {.bins = 77};
  assert_int_equal(rimi_interval_find(NULL, 2, 0.0, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find(bin, 2, 0.0, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find(bin, RIM_INTERVAL_MAX_BINS + 1, 0.0, &best), RIM_E_RANGE);
  assert_int_equal(best.bins, 77);
  static const rim_stats most[RIM_INTERVAL_MAX_BINS];
  assert_int_equal(rimi_interval_find(most, RIM_INTERVAL_MAX_BINS, 0.0, &best), RIM_OK);
}

/* Without any variance nothing is known of a sum, however large it is. */
static void a_sum_without_variance_never_wins(void **state) {
  (void)state;
  const rim_stats bin[2] = {{.n = 5.0, .s = 3.0, .w = 0.0}, {.n = 5.0, .s = 1.0, .w = 2.0}};
  rim_interval best;
  assert_int_equal(rimi_interval_find(bin, 1, 1.0, &best), RIM_OK);
  assert_true(best.bins == 0 && best.ln_anom == 0.0);
  assert_int_equal(rimi_interval_find(bin, 2, 1.0, &best), RIM_OK);
  assert_true(best.first == 0 && best.bins == 2 && best.ln_anom == 4.0);
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(equals_algorithm_8), cmocka_unit_test(least_count_is_kept),
      cmocka_unit_test(ties_and_empties),   cmocka_unit_test(a_sum_without_variance_never_wins),
      cmocka_unit_test(misuse_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
