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
enum { K = 24, O = 3 };

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

static void floats_equal_doubles(void **state) {
  (void)state;
  for (int round = 0; round < 300; ++round) {
    rim_stats bin[K];
    float table[K][5];
    draw(bin, K);
    for (int i = 0; i < K; ++i) {
      /* volatile: gcc 12 -O2 folds pairs of (double)(float)x into x (SLP vectoriser, wrong code).
       */
      const volatile float n = (float)bin[i].n, s = (float)bin[i].s, w = (float)bin[i].w;
      table[i][1] = n;
      table[i][2] = s;
      table[i][4] = w;
      table[i][0] = table[i][3] = (float)NAN; /* what belongs to others is not read */
      bin[i] = (rim_stats){(double)n, (double)s, (double)w};
    }
    rim_interval best, plain;
    assert_int_equal(rimi_interval_find(bin, K, 6.0, &plain), RIM_OK);
    assert_int_equal(
        rimi_interval_find_f32(&table[0][1], &table[0][2], &table[0][4], 5, K, 6.0, &best), RIM_OK);
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

static void run_level_equals_brute_force(void **state) {
  (void)state;
  for (int round = 0; round < 1000; ++round) {
    double n[K], s[K], own[K], f = 0.0;
    float table[K][4];
    const rim_interval_run run = {0.5 + rimi_rng_uniform(&rng),
                                  round % 2 ? 0.1 * rimi_rng_uniform(&rng) : 0.0, round % 7};
    const int with_own = round % 3 != 0;
    for (int i = 0; i < K; ++i) {
      table[i][0] = (float)rimi_rng_below(&rng, 6);
      table[i][1] = table[i][0] > 0.0f ? (float)(rimi_rng_normal(&rng) + 0.5) * table[i][0] : 0.0f;
      table[i][2] = (float)(0.2 * rimi_rng_uniform(&rng));
      n[i] = (double)table[i][0];
      s[i] = (double)table[i][1];
      own[i] = (double)table[i][2];
    }
    rim_interval best, narrow;
    assert_int_equal(rimi_interval_find_run(n, s, with_own ? own : NULL, 1, K, &run, &best),
                     RIM_OK);
    assert_int_equal(rimi_interval_find_run_f32(&table[0][0], &table[0][1],
                                                with_own ? &table[0][2] : NULL, 4, K, &run,
                                                &narrow),
                     RIM_OK);
    assert_same(&best, &narrow);
    for (int a = 0; a < K; ++a) {
      for (int b = a; b < K; ++b) {
        double count = 0.0, sum = 0.0, extra = 0.0;
        for (int i = a; i <= b; ++i) {
          count += n[i];
          sum += s[i];
          extra += with_own ? n[i] * own[i] : 0.0;
        }
        const double variance = run.a * count + run.b * count * count + count * extra;
        if (count > 0.0 && count >= run.min_n) {
          f = fmax(f, 0.5 * sum * sum / variance);
        }
      }
    }
    assert_true(fabs(best.ln_anom - f) <= 1e-12 * f);
    if (!with_own) {
      assert_true(best.ln_anom == rimi_stats_ln_anom_run(best.s, best.n, run.a, run.b));
    }
  }
}

static void score_equals_brute_force(void **state) {
  (void)state;
  for (int round = 0; round < 200; ++round) {
    rim_stats bin[K * O], scratch[O];
    draw(bin, K * O);
    rim_interval best;
    assert_int_equal(rimi_interval_find_score(bin, K, O, 4.0, scratch, &best), RIM_OK);
    rim_interval plain = {0};
    for (uint32_t bins = 1; bins <= K; ++bins) {
      for (uint32_t first = 0; first + bins <= K; ++first) {
        rim_stats sum[O] = {{0}};
        for (uint32_t i = first; i < first + bins; ++i) {
          rimi_stats_merge_all(sum, &bin[i * O], O);
        }
        const double f = rimi_stats_score_all(sum, O);
        const double n = fmax(fmax(sum[0].n, sum[1].n), sum[2].n);
        if (n >= 4.0 && f > plain.ln_anom) {
          plain = (rim_interval){.first = first, .bins = bins, .n = n, .ln_anom = f};
        }
      }
    }
    assert_same(&best, &plain);
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
  rim_stats bin[2] = {{0}}, scratch[1];
  const double d[2] = {0};
  const float f[2] = {0};
  const rim_interval_run run = {1.0, 0.0, 0.0};
  rim_interval best = {.bins = 77};
  const size_t many = RIM_INTERVAL_MAX_BINS + 1;
  assert_int_equal(rimi_interval_find(NULL, 2, 0.0, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find(bin, 2, 0.0, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find(bin, many, 0.0, &best), RIM_E_RANGE);
  assert_int_equal(rimi_interval_find_f32(f, f, f, 0, 2, 0.0, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_f32(f, f, NULL, 1, 2, 0.0, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_f32(f, f, f, 1, many, 0.0, &best), RIM_E_RANGE);
  assert_int_equal(rimi_interval_find_run(d, NULL, d, 1, 2, &run, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_run(d, d, d, 1, 2, NULL, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_run(d, d, d, 1, many, &run, &best), RIM_E_RANGE);
  assert_int_equal(rimi_interval_find_run_f32(NULL, f, f, 1, 2, &run, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_run_f32(f, f, f, 1, many, &run, &best), RIM_E_RANGE);
  assert_int_equal(rimi_interval_find_score(bin, 2, 0, 0.0, scratch, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_score(bin, 2, 1, 0.0, NULL, &best), RIM_E_ARGUMENT);
  assert_int_equal(rimi_interval_find_score(bin, many, 1, 0.0, scratch, &best), RIM_E_RANGE);
  assert_int_equal(best.bins, 77);
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(equals_algorithm_8),       cmocka_unit_test(floats_equal_doubles),
      cmocka_unit_test(least_count_is_kept),      cmocka_unit_test(run_level_equals_brute_force),
      cmocka_unit_test(score_equals_brute_force), cmocka_unit_test(ties_and_empties),
      cmocka_unit_test(misuse_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
