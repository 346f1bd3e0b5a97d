/* SPDX-License-Identifier: MIT */
/* Statistics against sums and maximisations written out in the plainest way, and their laws. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "batch/stats.h"

#define SEED 314u
enum { N = 60 };

static rim_rng rng;
static double dz[N], var[N];

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance * (1.0 + fabs(b)))) {
    print_error("%.17g is not %.17g\n", a, b);
    fail();
  }
}

static void draw(void) {
  for (int i = 0; i < N; ++i) {
    var[i] = 0.1 + rimi_rng_uniform(&rng);
    dz[i] = 0.5 + sqrt(var[i]) * rimi_rng_normal(&rng);
  }
}

static rim_stats sums(int first, int last) {
  rim_stats stats = {0};
  for (int i = first; i < last; ++i) {
    assert_int_equal(rimi_stats_add(&stats, dz[i], var[i]), RIM_OK);
  }
  return stats;
}

static double ln_ratio(double shift) { /* eq. 3.5 before any sum is split off */
  double f = 0.0;
  for (int i = 0; i < N; ++i) {
    f += 0.5 * (dz[i] * dz[i] - (dz[i] - shift) * (dz[i] - shift)) / var[i];
  }
  return f;
}

static void scalar_maximises_the_ratio(void **state) {
  (void)state;
  const rim_stats stats = sums(0, N);
  const double shift = rimi_stats_shift(&stats), f = rimi_stats_ln_anom(&stats);
  assert_near(f, ln_ratio(shift), 1e-12);
  for (int i = -50; i <= 50; ++i) {
    assert_true(ln_ratio(shift + 0.01 * i) <= f * (1.0 + 1e-12));
  }
}

static void empty_says_nothing(void **state) {
  (void)state;
  const rim_stats stats = {0};
  assert_true(rimi_stats_ln_anom(&stats) == 0.0 && rimi_stats_shift(&stats) == 0.0);
  const double sum[2] = {0.0, 0.0};
  assert_true(rimi_stats_ln_anom_sums(sum, 2, 0.0) == 0.0);
  assert_true(rimi_stats_ln_anom_run(0.0, 0.0, 1.0, 1.0) == 0.0);
  assert_true(rimi_stats_ln_anom_run(1.0, 3.0, 0.0, 0.0) == 0.0);
}

static void sets_merge(void **state) {
  (void)state;
  for (int round = 0; round < 200; ++round) {
    draw();
    const int a = 1 + (int)rimi_rng_below(&rng, N / 2),
              b = a + 1 + (int)rimi_rng_below(&rng, N / 3);
    const rim_stats x = sums(0, a), y = sums(a, b), z = sums(b, N), all = sums(0, N);
    rim_stats left = x, right = y;
    rimi_stats_merge(&left, &y);
    rimi_stats_merge(&left, &z);
    rimi_stats_merge(&right, &z);
    rimi_stats_merge(&right, &x);
    assert_true(left.n == all.n && right.n == all.n);
    assert_near(left.s, right.s, 1e-14);
    assert_near(left.w, right.w, 1e-14);
    assert_near(rimi_stats_ln_anom(&left), rimi_stats_ln_anom(&all), 1e-13);
  }
}

static void units_do_not_matter(void **state) {
  (void)state;
  rim_stats metres = {0}, feet = {0}, twice = {0};
  for (int i = 0; i < N; ++i) {
    (void)rimi_stats_add(&metres, dz[i], var[i]);
    (void)rimi_stats_add(&feet, dz[i] * 3.28, var[i] * 3.28 * 3.28);
    (void)rimi_stats_add(&twice, 2.0 * dz[i], var[i]);
  }
  assert_near(rimi_stats_ln_anom(&feet), rimi_stats_ln_anom(&metres), 1e-13);
  assert_near(rimi_stats_shift(&feet), 3.28 * rimi_stats_shift(&metres), 1e-13);
  assert_near(rimi_stats_ln_anom(&twice), 4.0 * rimi_stats_ln_anom(&metres), 1e-13);
}

static void bad_numbers_are_refused(void **state) {
  (void)state;
  static const double bad[][2] = {{NAN, 1.0}, {INFINITY, 1.0}, {1.0, 0.0},   {1.0, -1.0},
                                  {1.0, NAN}, {1.0, INFINITY}, {1.0, 5e-324}};
  const rim_stats before = sums(0, 5);
  rim_stats stats = before;
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i)
    assert_int_equal(rimi_stats_add(&stats, bad[i][0], bad[i][1]), RIM_E_DATA);
  assert_memory_equal(&stats, &before, sizeof stats);
}

static void run_level(void **state) {
  (void)state;
  assert_near(rimi_stats_ln_anom_run(6.0, 4.0, 2.0, 0.5), 36.0 / (2.0 * (8.0 + 8.0)), 1e-15);
  rim_stats stats = {0};
  double s = 0.0;
  for (int i = 0; i < N; ++i) {
    (void)rimi_stats_add(&stats, dz[i], 0.7);
    s += dz[i];
  }
  assert_near(rimi_stats_ln_anom_run(s, N, 0.7, 0.0), rimi_stats_ln_anom(&stats), 1e-13);
  /* Its variance is that of the sum: by simulation, within 5 standard errors. */
  double square = 0.0;
  for (int run = 0; run < 20000; ++run) {
    const double offset = sqrt(0.5) * rimi_rng_normal(&rng);
    double sum = 0.0;
    for (int i = 0; i < 6; ++i) {
      sum += offset + sqrt(2.0) * rimi_rng_normal(&rng);
    }
    square += 2.0 * rimi_stats_ln_anom_run(sum, 6.0, 2.0, 0.5) / 20000.0;
  }
  assert_true(fabs(square - 1.0) < 5.0 * sqrt(2.0 / 20000.0));
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  draw();
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(scalar_maximises_the_ratio),
      cmocka_unit_test(empty_says_nothing),
      cmocka_unit_test(sets_merge),
      cmocka_unit_test(units_do_not_matter),
      cmocka_unit_test(bad_numbers_are_refused),
      cmocka_unit_test(run_level),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
