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
enum { N = 60, O = 4, PO = RIM_STATS_PACKED(O) };

static rim_rng rng;
static double dz[N], var[N], p[N];
static int event[N];

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
    p[i] = 0.05 + 0.9 * rimi_rng_uniform(&rng);
    event[i] = rimi_rng_uniform(&rng) < 0.3 + 0.6 * p[i];
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
  double w = 0.0;
  for (int i = 0; i < N; ++i) {
    w += 1.0 / var[i];
  }
  assert_near(rimi_stats_shift_sd(&stats), 1.0 / sqrt(w), 1e-14);
}

static void empty_says_nothing(void **state) {
  (void)state;
  const rim_stats stats = {0};
  const rim_stats_variance variance = {0};
  const rim_stats_bernoulli bernoulli = {0};
  assert_true(rimi_stats_ln_anom(&stats) == 0.0 && rimi_stats_shift(&stats) == 0.0);
  assert_true(isinf(rimi_stats_shift_sd(&stats)));
  assert_true(rimi_stats_ln_anom_run(0.0, 0.0, 1.0, 1.0) == 0.0);
  assert_true(rimi_stats_ln_anom_run(1.0, 3.0, 0.0, 0.0) == 0.0);
  assert_true(rimi_stats_variance_ln_anom(&variance) == 0.0);
  assert_true(rimi_stats_variance_ratio(&variance) == 1.0);
  assert_true(isinf(rimi_stats_variance_ratio_sd(&variance)));
  assert_true(rimi_stats_bernoulli_ln_anom(&bernoulli) == 0.0);
  assert_true(rimi_stats_bernoulli_log_odds(&bernoulli) == 0.0);
}

static void merge_and_subtract(void **state) {
  (void)state;
  for (int round = 0; round < 200; ++round) {
    draw();
    const int a = 1 + (int)rimi_rng_below(&rng, N / 2),
              b = a + 1 + (int)rimi_rng_below(&rng, N / 3);
    const rim_stats x = sums(0, a), y = sums(a, b), z = sums(b, N), all = sums(0, N);
    rim_stats left = x, right = y, back;
    rimi_stats_merge(&left, &y);
    rimi_stats_merge(&left, &z);
    rimi_stats_merge(&right, &z);
    back = right;
    rimi_stats_merge(&right, &x);
    assert_true(left.n == all.n && right.n == all.n);
    assert_near(left.s, right.s, 1e-14);
    assert_near(left.w, right.w, 1e-14);
    assert_near(rimi_stats_ln_anom(&left), rimi_stats_ln_anom(&all), 1e-13);
    rimi_stats_subtract(&right, &x);
    assert_near(rimi_stats_ln_anom(&right), rimi_stats_ln_anom(&back), 1e-12);
    rimi_stats_subtract(&left, &all);
    assert_true(left.n == 0.0 && left.s == 0.0 && left.w == 0.0);
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
  assert_near(rimi_stats_shift_sd(&feet), 3.28 * rimi_stats_shift_sd(&metres), 1e-13);
  assert_near(rimi_stats_ln_anom(&twice), 4.0 * rimi_stats_ln_anom(&metres), 1e-13);
}

static void weights(void **state) {
  (void)state;
  rim_stats one = {0}, half = {0}, plain = {0};
  for (int i = 0; i < N; ++i) {
    (void)rimi_stats_add(&plain, dz[i], var[i]);
    assert_int_equal(rimi_stats_add_weighted(&one, dz[i], var[i], 1.0), RIM_OK);
    (void)rimi_stats_add_weighted(&half, dz[i], var[i], 0.5);
  }
  assert_memory_equal(&one, &plain, sizeof one);
  assert_near(2.0 * rimi_stats_ln_anom(&half), rimi_stats_ln_anom(&plain), 1e-13);
  assert_int_equal(rimi_stats_add_weighted(&one, 1.0, 1.0, 1.5), RIM_E_DATA);
  assert_int_equal(rimi_stats_add_weighted(&one, 1.0, 1.0, -0.1), RIM_E_DATA);
  assert_int_equal(rimi_stats_add_weighted(&one, 1.0, 1.0, NAN), RIM_E_DATA);
  assert_memory_equal(&one, &plain, sizeof one);
}

static void gain_is_found(void **state) {
  (void)state;
  rim_stats stats = {0};
  double num = 0.0, den = 0.0, f = 0.0;
  for (int i = 0; i < N; ++i) {
    const double g = 1.0 + 0.1 * i, d = 0.07 * g;
    assert_int_equal(rimi_stats_add_gain(&stats, d, g, var[i]), RIM_OK);
    num += g * d / var[i];
    den += g * g / var[i];
  }
  assert_near(rimi_stats_shift(&stats), 0.07, 1e-13);
  f = 0.5 * num * num / den;
  assert_near(rimi_stats_ln_anom(&stats), f, 1e-13);
  assert_int_equal(rimi_stats_add_gain(&stats, 1.0, INFINITY, 1.0), RIM_E_DATA);
}

static void bad_numbers_are_refused(void **state) {
  (void)state;
  static const double bad[][2] = {{NAN, 1.0}, {INFINITY, 1.0}, {1.0, 0.0},   {1.0, -1.0},
                                  {1.0, NAN}, {1.0, INFINITY}, {1.0, 5e-324}};
  const rim_stats before = sums(0, 5);
  rim_stats stats = before, pair[2] = {before, before};
  rim_stats_variance variance = {3.0, 2.0};
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
    assert_int_equal(rimi_stats_add(&stats, bad[i][0], bad[i][1]), RIM_E_DATA);
    assert_int_equal(rimi_stats_add_gain(&stats, bad[i][0], 1.0, bad[i][1]), RIM_E_DATA);
    assert_int_equal(rimi_stats_add_weighted(&stats, bad[i][0], bad[i][1], 0.5), RIM_E_DATA);
    assert_int_equal(rimi_stats_variance_add(&variance, bad[i][0], bad[i][1]), RIM_E_DATA);
    const double two_dz[2] = {1.0, bad[i][0]}, two_var[2] = {1.0, bad[i][1]};
    assert_int_equal(rimi_stats_add_all(pair, 2, two_dz, two_var), RIM_E_DATA);
  }
  assert_memory_equal(&stats, &before, sizeof stats);
  assert_memory_equal(&pair[0], &before, sizeof before);
  assert_memory_equal(&pair[1], &before, sizeof before);
  assert_true(variance.n == 3.0 && variance.q == 2.0);
}

static void outcomes_and_score(void **state) {
  (void)state;
  rim_stats stats[3] = {{0}}, other[3] = {{0}}, all[3] = {{0}};
  for (int i = 0; i + 2 < N; ++i) {
    const double d[3] = {dz[i], 0.1 * dz[i + 1], 3.0 * dz[i + 2]};
    assert_int_equal(rimi_stats_add_all(i < 20 ? stats : other, 3, d, &var[i]), RIM_OK);
    assert_int_equal(rimi_stats_add_all(all, 3, d, &var[i]), RIM_OK);
  }
  rimi_stats_merge_all(stats, other, 3);
  double f = 0.0, score = 0.0;
  for (int o = 0; o < 3; ++o) {
    f += rimi_stats_ln_anom(&all[o]);
    score += fmax(0.0, rimi_stats_ln_anom(&all[o]) - 2.0);
  }
  assert_near(rimi_stats_ln_anom_all(stats, 3), f, 1e-13);
  assert_near(rimi_stats_score_all(stats, 3), score, 1e-13);
  assert_true(rimi_stats_score(1.9) == 0.0 && rimi_stats_score(3.0) == 1.0);
  rimi_stats_subtract_all(stats, all, 3);
  assert_true(rimi_stats_ln_anom_all(stats, 3) == 0.0);
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

/* A random positive definite matrix, packed. */
static void covariance(double c[PO]) {
  double b[O][O];
  for (int i = 0; i < O; ++i) {
    for (int j = 0; j < O; ++j) {
      b[i][j] = rimi_rng_normal(&rng);
    }
  }
  for (int i = 0, at = 0; i < O; ++i) {
    for (int j = 0; j <= i; ++j, ++at) {
      c[at] = i == j ? 0.1 : 0.0;
      for (int k = 0; k < O; ++k) {
        c[at] += b[i][k] * b[j][k];
      }
    }
  }
}

static double at(const double *packed, int i, int j) {
  return i >= j ? packed[i * (i + 1) / 2 + j] : packed[j * (j + 1) / 2 + i];
}

static void full_inverse_is_one(void **state) {
  (void)state;
  for (int round = 0; round < 100; ++round) {
    double c[PO], q[PO];
    covariance(c);
    assert_int_equal(rimi_stats_full_precision(O, c, q), RIM_OK);
    for (int i = 0; i < O; ++i) {
      for (int j = 0; j < O; ++j) {
        double sum = 0.0;
        for (int k = 0; k < O; ++k) {
          sum += at(c, i, k) * at(q, k, j);
        }
        assert_near(sum, i == j ? 1.0 : 0.0, 1e-9);
      }
    }
  }
}

static void full_equals_diagonal(void **state) {
  (void)state;
  rim_stats_full full;
  rim_stats diagonal[O] = {{0}};
  assert_int_equal(rimi_stats_full_init(&full, O), RIM_OK);
  for (int i = 0; i + O <= N; ++i) {
    double c[PO] = {0};
    for (int o = 0; o < O; ++o) {
      c[o * (o + 1) / 2 + o] = var[i + o];
    }
    assert_int_equal(rimi_stats_full_add(&full, &dz[i], c), RIM_OK);
    assert_int_equal(rimi_stats_add_all(diagonal, O, &dz[i], &var[i]), RIM_OK);
  }
  double f, shift[O], cov[PO];
  assert_int_equal(rimi_stats_full_solve(&full, &f, shift, cov), RIM_OK);
  assert_near(f, rimi_stats_ln_anom_all(diagonal, O), 1e-12);
  for (int o = 0; o < O; ++o) {
    assert_near(shift[o], rimi_stats_shift(&diagonal[o]), 1e-12);
    assert_near(sqrt(at(cov, o, o)), rimi_stats_shift_sd(&diagonal[o]), 1e-12);
  }
}

static void full_maximises_the_ratio(void **state) {
  (void)state;
  enum { M = 12 };
  double q[M][PO], f, best[O], cov[PO];
  rim_stats_full full, half, rest;
  assert_int_equal(rimi_stats_full_init(&full, O), RIM_OK);
  assert_int_equal(rimi_stats_full_init(&half, O), RIM_OK);
  for (int i = 0; i < M; ++i) {
    double c[PO];
    covariance(c);
    assert_int_equal(rimi_stats_full_precision(O, c, q[i]), RIM_OK);
    assert_int_equal(rimi_stats_full_add(&full, &dz[O * i], c), RIM_OK);
    assert_int_equal(rimi_stats_full_add_precision(i % 2 ? &half : &full, &dz[O * i], q[i]),
                     RIM_OK);
  }
  rest = full;
  assert_int_equal(rimi_stats_full_merge(&full, &half), RIM_OK);
  assert_int_equal(rimi_stats_full_solve(&full, &f, best, cov), RIM_OK);
  for (int round = 0; round < 300; ++round) {
    double value = 0.0, shift[O];
    for (int o = 0; o < O; ++o) {
      shift[o] = best[o] + (round == 0 ? 0.0 : 0.1 * rimi_rng_normal(&rng));
    }
    for (int i = 0; i < M; ++i) { /* every observation was added twice */
      for (int a = 0; a < O; ++a) {
        for (int b = 0; b < O; ++b) {
          const double *d = &dz[O * i];
          value += at(q[i], a, b) * (d[a] * d[b] - (d[a] - shift[a]) * (d[b] - shift[b]));
        }
      }
    }
    assert_true(value <= f * (1.0 + 1e-9));
    assert_true(round > 0 || fabs(value - f) <= 1e-9 * f);
  }
  double g, h;
  assert_int_equal(rimi_stats_full_subtract(&full, &half), RIM_OK);
  assert_int_equal(rimi_stats_full_solve(&full, &g, NULL, NULL), RIM_OK);
  assert_int_equal(rimi_stats_full_solve(&rest, &h, NULL, NULL), RIM_OK);
  assert_near(g, h, 1e-9);
}

static void full_refuses(void **state) {
  (void)state;
  rim_stats_full full, zero = {0}, other;
  double c[PO] = {1.0, 1.0, 1.0, 0, 0, 1.0, 0, 0, 0, 1.0}, f = -1.0, shift[O] = {-1.0}, cov[PO];
  assert_int_equal(rimi_stats_full_init(NULL, 2), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_init(&full, 0), RIM_E_RANGE);
  assert_int_equal(rimi_stats_full_init(&full, RIM_STATS_MAX_OUTCOMES + 1), RIM_E_RANGE);
  assert_int_equal(rimi_stats_full_init(&full, O), RIM_OK);
  assert_int_equal(rimi_stats_full_init(&other, O - 1), RIM_OK);
  assert_int_equal(rimi_stats_full_solve(&full, &f, shift, cov), RIM_E_SINGULAR);
  assert_int_equal(rimi_stats_full_add(&full, dz, c), RIM_E_SINGULAR); /* outcomes 0 and 1 alike */
  c[1] = NAN;
  assert_int_equal(rimi_stats_full_add(&full, dz, c), RIM_E_SINGULAR);
  c[1] = 0.0;
  c[0] = INFINITY;
  assert_int_equal(rimi_stats_full_add(&full, dz, c), RIM_E_SINGULAR);
  c[0] = 1.0;
  const double bad[O] = {1.0, NAN, 0.0, 0.0};
  assert_int_equal(rimi_stats_full_add(&full, bad, c), RIM_E_DATA);
  assert_true(full.n == 0.0 && full.s[0] == 0.0 && full.w[0] == 0.0);
  assert_int_equal(rimi_stats_full_add(&zero, dz, c), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_add_precision(&zero, dz, c), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_merge(&full, &other), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_subtract(&full, &zero), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_solve(&zero, &f, NULL, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_stats_full_precision(0, c, cov), RIM_E_RANGE);
  assert_true(f == -1.0 && shift[0] == -1.0);
}

static void variance_change(void **state) {
  (void)state;
  rim_stats_variance stats = {0}, a = {0}, b = {0};
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_stats_variance_add(&stats, dz[i], var[i]), RIM_OK);
    assert_int_equal(rimi_stats_variance_add(i < 25 ? &a : &b, dz[i], var[i]), RIM_OK);
  }
  const double v = rimi_stats_variance_ratio(&stats), f = rimi_stats_variance_ln_anom(&stats);
  for (int k = -20; k <= 20; ++k) { /* the ratio of likelihoods, term by term */
    const double u = v * exp(0.05 * k);
    double value = 0.0;
    for (int i = 0; i < N; ++i) {
      value += 0.5 * dz[i] * dz[i] / var[i] * (1.0 - 1.0 / u) - 0.5 * log(u);
    }
    assert_true(value <= f + 1e-10);
    assert_true(k != 0 || fabs(value - f) < 1e-10);
  }
  rimi_stats_variance_merge(&a, &b);
  assert_near(rimi_stats_variance_ln_anom(&a), f, 1e-12);
  rimi_stats_variance_subtract(&a, &b);
  assert_near(a.n, 25.0, 0.0);
  rimi_stats_variance_subtract(&b, &b);
  assert_true(b.n == 0.0 && b.q == 0.0);
  const rim_stats_variance nominal = {50.0, 50.0}, stuck = {50.0, 0.0};
  assert_true(rimi_stats_variance_ln_anom(&nominal) == 0.0);
  assert_true(rimi_stats_variance_ln_anom(&stuck) > 500.0);
  assert_true(isfinite(rimi_stats_variance_ln_anom(&stuck)));
  assert_near(rimi_stats_variance_ratio_sd(&nominal), 0.2, 1e-14);
}

/* F of a shift of the log odds over the trials themselves, by golden section. */
static double brute_bernoulli(int trials, double k) {
  double low = -30.0, high = 30.0, f[2], beta[2];
  for (int step = 0; step < 120; ++step) {
    for (int side = 0; side < 2; ++side) {
      beta[side] = side ? low + 0.618 * (high - low) : high - 0.618 * (high - low);
      f[side] = beta[side] * k;
      for (int i = 0; i < trials; ++i) {
        f[side] -= log1p(p[i] * expm1(beta[side]));
      }
    }
    if (f[0] < f[1]) {
      low = beta[0];
    } else {
      high = beta[1];
    }
  }
  return f[0];
}

static double add_trials(rim_stats_bernoulli *stats) {
  double k = 0.0;
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_stats_bernoulli_add(stats, event[i], p[i]), RIM_OK);
    k += event[i];
  }
  return k;
}

static void bernoulli_constant_is_kulldorffs(void **state) {
  (void)state;
  for (int round = 0; round < 200; ++round) {
    draw();
    const double q = 0.01 + 0.98 * rimi_rng_uniform(&rng);
    rim_stats_bernoulli stats = {0};
    for (int i = 0; i < N; ++i) {
      p[i] = q;
    }
    const double k = add_trials(&stats);
    const double kulldorff = (k > 0 ? k * log(k / (N * q)) : 0.0) +
                             (k < N ? (N - k) * log((N - k) / (N * (1 - q))) : 0.0);
    assert_near(rimi_stats_bernoulli_ln_anom(&stats), kulldorff, 1e-10);
    assert_near(rimi_stats_bernoulli_ln_anom(&stats), brute_bernoulli(N, k), 1e-6);
  }
}

/* Two-valued probabilities, half and half, are what the closed form assumes: exact there. */
static void bernoulli_two_values_are_exact(void **state) {
  (void)state;
  for (int round = 0; round < 100; ++round) {
    draw();
    rim_stats_bernoulli stats = {0};
    const double q = 0.2 + 0.4 * rimi_rng_uniform(&rng);
    for (int i = 0; i < N; ++i) {
      p[i] = i % 2 ? q : q + 0.15;
    }
    const double k = add_trials(&stats);
    assert_near(rimi_stats_bernoulli_ln_anom(&stats), brute_bernoulli(N, k), 1e-7);
  }
}

static void bernoulli_varying_is_close(void **state) {
  (void)state;
  double worst = 0.0;
  for (int round = 0; round < 300; ++round) {
    draw();
    rim_stats_bernoulli stats = {0};
    const double k = add_trials(&stats), brute = brute_bernoulli(N, k);
    const double f = rimi_stats_bernoulli_ln_anom(&stats);
    worst = fmax(worst, fabs(f - brute) / (0.5 + brute));
  }
  printf("varying p in .05 to .95: error of F over F + 1/2 at most %.3f\n", worst);
  assert_true(worst < 0.05);
}

static void bernoulli_at_its_ends(void **state) {
  (void)state;
  rim_stats_bernoulli all = {0}, none = {0}, sum;
  for (int i = 0; i < 10; ++i) {
    (void)rimi_stats_bernoulli_add(&all, 1, 0.2);
    (void)rimi_stats_bernoulli_add(&none, 0, 0.2);
  }
  assert_near(rimi_stats_bernoulli_ln_anom(&all), -10.0 * log(0.2), 1e-12);
  assert_near(rimi_stats_bernoulli_ln_anom(&none), -10.0 * log(0.8), 1e-12);
  assert_true(rimi_stats_bernoulli_log_odds(&all) == RIM_STATS_MAX_LOG_ODDS);
  assert_true(rimi_stats_bernoulli_log_odds(&none) == -RIM_STATS_MAX_LOG_ODDS);
  sum = all;
  rimi_stats_bernoulli_merge(&sum, &none);
  assert_near(rimi_stats_bernoulli_log_odds(&sum), log(4.0), 1e-12);
  rimi_stats_bernoulli_subtract(&sum, &none);
  assert_near(rimi_stats_bernoulli_ln_anom(&sum), rimi_stats_bernoulli_ln_anom(&all), 1e-9);
  rimi_stats_bernoulli_subtract(&none, &none);
  assert_true(none.n == 0.0 && none.p == 0.0);
  const rim_stats_bernoulli before = all;
  assert_int_equal(rimi_stats_bernoulli_add(&all, 2, 0.2), RIM_E_DATA);
  assert_int_equal(rimi_stats_bernoulli_add(&all, 1, 0.0), RIM_E_DATA);
  assert_int_equal(rimi_stats_bernoulli_add(&all, 1, 1.0), RIM_E_DATA);
  assert_int_equal(rimi_stats_bernoulli_add(&all, 1, NAN), RIM_E_DATA);
  assert_memory_equal(&all, &before, sizeof all);
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  draw();
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(scalar_maximises_the_ratio),
      cmocka_unit_test(empty_says_nothing),
      cmocka_unit_test(merge_and_subtract),
      cmocka_unit_test(units_do_not_matter),
      cmocka_unit_test(weights),
      cmocka_unit_test(gain_is_found),
      cmocka_unit_test(bad_numbers_are_refused),
      cmocka_unit_test(outcomes_and_score),
      cmocka_unit_test(run_level),
      cmocka_unit_test(full_inverse_is_one),
      cmocka_unit_test(full_equals_diagonal),
      cmocka_unit_test(full_maximises_the_ratio),
      cmocka_unit_test(full_refuses),
      cmocka_unit_test(variance_change),
      cmocka_unit_test(bernoulli_constant_is_kulldorffs),
      cmocka_unit_test(bernoulli_two_values_are_exact),
      cmocka_unit_test(bernoulli_varying_is_close),
      cmocka_unit_test(bernoulli_at_its_ends),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
