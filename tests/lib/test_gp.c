/* SPDX-License-Identifier: MIT */
/* gp: against a dense solution in long double, the laws of its updates, and attacks. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/rng.h"
#include "rim/plan/gp.h"

#define SEED 61u
enum { DIMS = 2, POINTS = 40, KERNELS = 3 };
#define BYTES RIM_GP_SIZE(DIMS, POINTS)

typedef struct block {
  _Alignas(8) uint8_t bytes[BYTES + 8];
} block;

static rim_rng rng;
static block memory, other;
static double x[POINTS][DIMS], y[POINTS], noise[POINTS];

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance * (1.0 + fabs(b)))) {
    print_error("%.17g is not %.17g\n", a, b);
    fail();
  }
}

static rim_gp_config config_of(int kernel) {
  const rim_gp_config c = {.kernel = (uint8_t)kernel,
                           .dims = DIMS,
                           .points = POINTS,
                           .mean = 0.3,
                           .signal_var = 1.7,
                           .noise_var = 0.02,
                           .length = {0.4, 0.9}};
  return c;
}

static rim_gp *make(block *b, const rim_gp_config *c) {
  rim_gp *gp = NULL;
  assert_int_equal(rim_gp_init(&gp, b->bytes, BYTES, c), RIM_OK);
  return gp;
}

static void draw(void) {
  for (int i = 0; i < POINTS; ++i) {
    for (int d = 0; d < DIMS; ++d)
      x[i][d] = 2.0 * rimi_rng_uniform(&rng);
    y[i] = 2.0 * x[i][0] * (1.5 - x[i][0]) + x[i][1] + 0.1 * rimi_rng_normal(&rng);
    noise[i] = i % 3 == 0 ? 0.05 * rimi_rng_uniform(&rng) : 0.0;
  }
}

static void fill(rim_gp *gp, int n) {
  for (int i = 0; i < n; ++i) {
    assert_int_equal(rim_gp_add(gp, x[i], y[i], noise[i], 0.0), RIM_OK);
  }
}

static long double kernel_of(const rim_gp_config *c, const double *a, const double *b) {
  long double r2 = 0.0L;
  for (int d = 0; d < DIMS; ++d) {
    const long double step = ((long double)a[d] - (long double)b[d]) / (long double)c->length[d];
    r2 += step * step;
  }
  const long double r = sqrtl(r2), s = (long double)c->signal_var;
  if (c->kernel == RIM_GP_SQUARED_EXPONENTIAL)
    return s * expl(-r2 / 2.0L);
  const long double q = (c->kernel == RIM_GP_MATERN_3_2 ? sqrtl(3.0L) : sqrtl(5.0L)) * r;
  return s * (1.0L + q + (c->kernel == RIM_GP_MATERN_5_2 ? q * q / 3.0L : 0.0L)) * expl(-q);
}

/* Mean, variance and log likelihood by Gauss elimination of [K | y | k]. */
static void dense(const rim_gp_config *c, int n, const double *at, double *out) {
  static long double m[POINTS][POINTS + 2];
  long double log_determinant = 0.0L, mean = (long double)c->mean, fit = 0.0L;
  long double var = kernel_of(c, at, at);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j)
      m[i][j] = kernel_of(c, x[i], x[j]);
    m[i][i] += (long double)c->noise_var + (long double)noise[i];
    m[i][n] = (long double)y[i] - (long double)c->mean;
    m[i][n + 1] = kernel_of(c, x[i], at);
  }
  for (int k = 0; k < n; ++k) {
    log_determinant += logl(m[k][k]);
    for (int i = 0; i < n; ++i) {
      const long double f = i == k ? 0.0L : m[i][k] / m[k][k];
      for (int j = k; i != k && j < n + 2; ++j)
        m[i][j] -= f * m[k][j];
    }
  }
  for (int i = 0; i < n; ++i) {
    mean += kernel_of(c, x[i], at) * (m[i][n] / m[i][i]);
    var -= kernel_of(c, x[i], at) * (m[i][n + 1] / m[i][i]);
    fit += ((long double)y[i] - (long double)c->mean) * (m[i][n] / m[i][i]);
  }
  out[0] = (double)mean;
  out[1] = (double)var;
  out[2] = (double)(-0.5L * (fit + log_determinant + (long double)n * logl(2.0L * acosl(-1.0L))));
}

static void agrees_with_a_dense_solution(void **state) {
  (void)state;
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    const rim_gp_config c = config_of(kernel);
    rim_gp *gp = make(&memory, &c);
    draw();
    for (int n = 0; n <= POINTS; n += n < 3 ? 1 : 7) {
      rim_gp_reset(gp);
      fill(gp, n);
      for (int k = 0; k < 20; ++k) {
        const double at[DIMS] = {3.0 * rimi_rng_uniform(&rng) - 0.5, 2.0 * rimi_rng_uniform(&rng)};
        double mean, var, expected[3];
        assert_int_equal(rim_gp_predict(gp, at, &mean, &var), RIM_OK);
        dense(&c, n, at, expected);
        assert_near(mean, expected[0], 1e-11);
        assert_near(var, expected[1], 1e-11);
        assert_near(rim_gp_log_likelihood(gp), expected[2], 1e-11);
      }
    }
  }
}

static void incremental_equals_batch(void **state) {
  (void)state;
  const rim_gp_config c = config_of(2);
  rim_gp *gp = make(&memory, &c);
  fill(gp, 30);
  other = memory;
  rim_gp_config wrong = c;
  wrong.length[0] = 0.1;
  assert_int_equal(rim_gp_set_config(gp, &wrong), RIM_OK);
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_OK);
  assert_memory_equal(memory.bytes, other.bytes, RIM_GP_HEADER_BYTES);
  for (int k = 0; k < 20; ++k) {
    double a[2], b[2];
    (void)rim_gp_predict(gp, x[k], a, a + 1);
    (void)rim_gp_predict((rim_gp *)(void *)other.bytes, x[k], b, b + 1);
    assert_memory_equal(a, b, sizeof a);
  }
}

static void removal_equals_never_having_seen_it(void **state) {
  (void)state;
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    const rim_gp_config c = config_of(kernel);
    draw();
    for (int gone = 0; gone < POINTS; gone += 3) {
      rim_gp *all = make(&memory, &c), *without = make(&other, &c);
      fill(all, POINTS);
      assert_int_equal(rim_gp_remove(all, (uint32_t)gone), RIM_OK);
      for (int i = 0; i < POINTS; ++i) {
        if (i != gone)
          (void)rim_gp_add(without, x[i], y[i], noise[i], 0.0);
      }
      assert_int_equal(rim_gp_points(all), POINTS - 1);
      for (int k = 0; k < 10; ++k) {
        const double at[DIMS] = {2.0 * rimi_rng_uniform(&rng), 2.0 * rimi_rng_uniform(&rng)};
        double a[2], b[2];
        (void)rim_gp_predict(all, at, a, a + 1);
        (void)rim_gp_predict(without, at, b, b + 1);
        assert_near(a[0], b[0], 1e-9);
        assert_near(a[1], b[1], 1e-9);
      }
      assert_near(rim_gp_log_likelihood(all), rim_gp_log_likelihood(without), 1e-9);
      assert_int_equal(rim_gp_least_informative(all), rim_gp_least_informative(without));
    }
    assert_int_equal(rim_gp_remove((rim_gp *)(void *)memory.bytes, POINTS - 1), RIM_E_RANGE);
  }
}

static double likelihood_at(const rim_gp_config *c, int parameter, double step) {
  rim_gp_config moved = *c;
  double *const value[] = {&moved.signal_var, &moved.noise_var, &moved.length[0], &moved.length[1]};
  *value[parameter] *= exp(step);
  rim_gp *gp = make(&other, &moved);
  fill(gp, POINTS);
  return rim_gp_log_likelihood(gp);
}

static void gradient_equals_differences(void **state) {
  (void)state;
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    const rim_gp_config c = config_of(kernel);
    double gradient[RIM_GP_PARAMETERS(DIMS)];
    draw();
    rim_gp *gp = make(&memory, &c);
    fill(gp, POINTS);
    rim_gp_log_likelihood_gradient(gp, gradient);
    for (int p = 0; p < 4; ++p) {
      const double h = 1e-4; /* fourth-order differences: error about 1e-12 */
      const double slope = (8.0 * (likelihood_at(&c, p, h) - likelihood_at(&c, p, -h)) -
                            (likelihood_at(&c, p, 2.0 * h) - likelihood_at(&c, p, -2.0 * h))) /
                           (12.0 * h);
      assert_near(gradient[p], slope, 1e-7);
    }
  }
}

/* As many dimensions as there may be: each has its length, and there is none behind the last. */
static void the_gradient_has_every_dimension(void **state) {
  (void)state;
  enum { MOST = RIM_GP_MAX_DIMS, FEW = 6 };
  static _Alignas(8) uint8_t bytes[RIM_GP_SIZE(MOST, FEW)];
  rim_gp_config c = config_of(RIM_GP_SQUARED_EXPONENTIAL);
  c.dims = MOST;
  c.points = FEW;
  double place[FEW][MOST], gradient[RIM_GP_PARAMETERS(MOST)], likelihood[2];
  for (int d = 0; d < MOST; ++d)
    c.length[d] = 1.0 + 0.3 * d;
  for (int i = 0; i < FEW * MOST; ++i)
    place[i / MOST][i % MOST] = rimi_rng_uniform(&rng);
  rim_gp *gp = NULL;
  for (int d = 0; d < MOST; ++d) {
    const double step = 1e-5;
    for (int side = 0; side < 2; ++side) {
      rim_gp_config moved = c;
      moved.length[d] *= exp(side == 0 ? step : -step);
      assert_int_equal(rim_gp_init(&gp, bytes, sizeof bytes, &moved), RIM_OK);
      for (int i = 0; i < FEW; ++i)
        assert_int_equal(rim_gp_add(gp, place[i], (double)(i % 3), 0.0, 0.0), RIM_OK);
      likelihood[side] = rim_gp_log_likelihood(gp);
      if (d == 0 && side == 0)
        rim_gp_log_likelihood_gradient(gp, gradient);
    }
    assert_near(gradient[2 + d], (likelihood[0] - likelihood[1]) / (2.0 * step), 1e-4);
  }
}

static void many_equal_one_by_one(void **state) {
  (void)state;
  const rim_gp_config c = config_of(1);
  rim_gp *gp = make(&memory, &c);
  double mean[POINTS], var[POINTS];
  for (int n = 0; n <= 30; n += 15) {
    rim_gp_reset(gp);
    fill(gp, n);
    for (uint32_t count = 1; count <= POINTS; count += 3) {
      assert_int_equal(rim_gp_predict_many(gp, x[0], count, mean, var), RIM_OK);
      for (uint32_t i = 0; i < count; ++i) {
        double m, v;
        (void)rim_gp_predict(gp, x[i], &m, &v);
        assert_memory_equal(&m, &mean[i], sizeof m);
        assert_memory_equal(&v, &var[i], sizeof v);
        assert_true(v >= 0.0 && v <= c.signal_var);
        (void)rim_gp_predict(gp, x[i], &m, NULL);
        assert_memory_equal(&m, &mean[i], sizeof m);
      }
    }
  }
}

static void duplicates_are_fine(void **state) {
  (void)state;
  rim_gp_config c = config_of(0);
  c.noise_var = 0.0;
  rim_gp *gp = make(&memory, &c);
  for (int i = 0; i < POINTS; ++i) {
    assert_int_equal(rim_gp_add(gp, x[0], 1.0, 0.0, 0.0), RIM_OK);
  }
  double mean, var;
  (void)rim_gp_predict(gp, x[0], &mean, &var);
  assert_near(mean, 1.0, 1e-6);
  assert_true(var >= 0.0 && var < 1e-6);
  assert_int_equal(rim_gp_get_counters(gp).jittered, POINTS - 1);
  /* With noise they average. */
  c.noise_var = 0.5;
  c.mean = 0.0;
  gp = make(&memory, &c);
  for (int i = 0; i < 10; ++i)
    (void)rim_gp_add(gp, x[0], (double)i, 0.0, 0.0);
  (void)rim_gp_predict(gp, x[0], &mean, &var);
  assert_near(mean, 4.5 * 1.7 / (1.7 + 0.05), 1e-12);
  assert_near(var, 1.0 / (1.0 / 1.7 + 10.0 / 0.5), 1e-12);
  assert_int_equal(rim_gp_get_counters(gp).jittered, 0);
}

/* What rounding leaves of a pivot is as large as the variances are. */
static void duplicates_of_large_values_are_fine(void **state) {
  (void)state;
  rim_gp_config c = config_of(0);
  c.noise_var = 0.0;
  for (int k = 0; k < 40; ++k) {
    c.signal_var = 1e6 + 31321.7 * k;
    rim_gp *gp = make(&memory, &c);
    for (int i = 0; i < 3; ++i)
      assert_int_equal(rim_gp_add(gp, x[0], 1.0, 0.0, 0.0), RIM_OK);
    assert_int_equal(rim_gp_get_counters(gp).jittered, 2);
  }
}

static void duplicates_make_room_first(void **state) {
  (void)state;
  const rim_gp_config c = config_of(0);
  rim_gp *gp = make(&memory, &c);
  for (int i = 0; i < POINTS - 1; ++i) {
    const double at[DIMS] = {(double)(i % 7), (double)(i / 7) * 2.0};
    (void)rim_gp_add(gp, at, y[i], 0.0, 0.0);
  }
  const double twin[DIMS] = {3.0, 2.0}; /* as point 10 */
  (void)rim_gp_add(gp, twin, 1e6, 0.0, 0.0);
  const uint32_t least = rim_gp_least_informative(gp);
  assert_true(least == 10 || least == POINTS - 1);
  const double far[DIMS] = {50.0, 50.0};
  assert_int_equal(rim_gp_add(gp, far, 0.0, 0.0, 0.0), RIM_OK);
  assert_int_equal(rim_gp_points(gp), POINTS);
  assert_int_equal(rim_gp_get_counters(gp).removed, 1);
  rim_gp_point point;
  for (uint32_t i = 0; i < POINTS; ++i) {
    assert_int_equal(rim_gp_get_point(gp, i, &point), RIM_OK);
    assert_true(point.serial != least);
  }
  assert_int_equal(point.serial, POINTS);
  assert_int_equal(rim_gp_get_point(gp, POINTS, &point), RIM_E_RANGE);
}

/* The noisiest of points far apart says least, wherever it stands. */
static void the_noisiest_says_least(void **state) {
  (void)state;
  const rim_gp_config c = config_of(0);
  for (uint32_t noisy = 0; noisy < 4; ++noisy) {
    rim_gp *gp = make(&memory, &c);
    for (uint32_t i = 0; i < 4; ++i) {
      const double at[DIMS] = {40.0 * i, 0.0};
      assert_int_equal(rim_gp_add(gp, at, 0.0, i == noisy ? 5.0 : 0.1, 0.0), RIM_OK);
    }
    assert_int_equal(rim_gp_least_informative(gp), noisy);
  }
}

/* The criterion kept up to date agrees with its definition after hundreds of replacements. */
static void criterion_does_not_drift(void **state) {
  (void)state;
  const rim_gp_config c = config_of(2);
  rim_gp *gp = make(&memory, &c);
  for (int i = 0; i < 500; ++i) {
    const double at[DIMS] = {2.0 * rimi_rng_uniform(&rng), 2.0 * rimi_rng_uniform(&rng)};
    assert_int_equal(rim_gp_add(gp, at, rimi_rng_normal(&rng), 0.0, 0.0), RIM_OK);
  }
  const uint32_t least = rim_gp_least_informative(gp);
  double most = 0.0, of_least = 0.0;
  for (uint32_t i = 0; i < POINTS; ++i) { /* 1/2 ln(1 + s^2 / noise) without the point */
    other = memory;
    rim_gp *copy = (rim_gp *)(void *)other.bytes;
    rim_gp_point point;
    double var;
    (void)rim_gp_get_point(copy, i, &point);
    const double at[DIMS] = {point.x[0], point.x[1]};
    (void)rim_gp_remove(copy, i);
    (void)rim_gp_predict(copy, at, NULL, &var);
    const double product = 1.0 / (var / point.noise + 1.0);
    most = fmax(most, product);
    if (i == least)
      of_least = product;
  }
  assert_near(of_least, most, 1e-9);
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_OK);
  assert_int_equal(rim_gp_least_informative(gp), least);
}

/* Of points that coincide without noise K^-1 has elements of 1e12. When they have made room, what
 * rounding left of those would make the last one seem to say nothing; it is computed afresh. */
static void nothing_is_left_of_duplicates_that_went(void **state) {
  (void)state;
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    rim_gp_config c = config_of(kernel);
    c.noise_var = 0.0;
    rim_gp *gp = make(&memory, &c), *afresh = (rim_gp *)(void *)other.bytes;
    const double place[DIMS] = {2.0, 4.0};
    for (int i = 0; i < 3; ++i)
      assert_int_equal(rim_gp_add(gp, place, 1.0, 0.0, 0.0), RIM_OK);
    for (int i = 3; i < 3 * POINTS; ++i) {
      const double at[DIMS] = {4.0 * rimi_rng_uniform(&rng), 9.0 * rimi_rng_uniform(&rng)};
      assert_int_equal(rim_gp_add(gp, at, 0.0, 0.0, 0.0), RIM_OK);
      other = memory;
      assert_int_equal(rim_gp_set_config(afresh, &c), RIM_OK); /* the factor and all from it */
      assert_int_equal(rim_gp_least_informative(gp), rim_gp_least_informative(afresh));
    }
    assert_int_equal(rim_gp_get_counters(gp).jittered, 2);
  }
}

static void offsets_are_explained_elsewhere(void **state) {
  (void)state;
  const rim_gp_config c = config_of(0);
  rim_gp *gp = make(&memory, &c), *shifted = make(&other, &c);
  for (int i = 0; i < 20; ++i) { /* given with the point, or afterwards */
    (void)rim_gp_add(gp, x[i], y[i] - 0.1 * i, noise[i], 0.0);
    (void)rim_gp_add(shifted, x[i], y[i], noise[i], i % 2 == 0 ? 0.1 * i : 9.0);
    if (i % 2 == 1)
      assert_int_equal(rim_gp_set_offset(shifted, (uint32_t)i, 0.1 * i), RIM_OK);
  }
  rim_gp_refresh(shifted);
  double a[2], b[2];
  (void)rim_gp_predict(gp, x[30], a, a + 1);
  (void)rim_gp_predict(shifted, x[30], b, b + 1);
  assert_near(a[0], b[0], 1e-12);
  assert_near(a[1], b[1], 0.0);
  assert_int_equal(rim_gp_set_offset(gp, 20, 0.0), RIM_E_RANGE);
  assert_int_equal(rim_gp_set_offset(gp, 0, NAN), RIM_E_DATA);
}

static void bad_numbers_are_counted(void **state) {
  (void)state;
  const rim_gp_config c = config_of(0);
  rim_gp *gp = make(&memory, &c);
  fill(gp, 5);
  const double bad[] = {NAN, INFINITY, -INFINITY, 1e200};
  double before[2], after[2];
  (void)rim_gp_predict(gp, x[7], before, before + 1);
  for (uint32_t i = 0; i < 4; ++i) {
    const double at[DIMS] = {0.5, bad[i]};
    double mean = 7.0;
    assert_int_equal(rim_gp_add(gp, at, 1.0, 0.0, 0.0), RIM_E_DATA);
    assert_int_equal(rim_gp_add(gp, x[6], bad[i], 0.0, 0.0), RIM_E_DATA);
    assert_int_equal(rim_gp_add(gp, x[6], 1.0, bad[i], 0.0), RIM_E_DATA);
    assert_int_equal(rim_gp_predict(gp, at, &mean, NULL), RIM_E_DATA);
    assert_int_equal(rim_gp_predict_many(gp, at, 1, &mean, NULL), RIM_E_DATA);
    assert_true(mean == 7.0);
  }
  assert_int_equal(rim_gp_add(gp, x[6], 1.0, -0.1, 0.0), RIM_E_DATA);
  assert_int_equal(rim_gp_get_counters(gp).refused, 13);
  assert_int_equal(rim_gp_points(gp), 5);
  (void)rim_gp_predict(gp, x[7], after, after + 1);
  assert_memory_equal(before, after, sizeof after);
}

/* A factor that is not one (memory damaged in flight) ends in a clear error, counted. */
static void singular_is_an_error(void **state) {
  (void)state;
  const rim_gp_config c = config_of(0);
  rim_gp *gp = make(&memory, &c);
  fill(gp, 3);
  const double nothing = 0.0;
  const size_t factor = BYTES - 4u * POINTS * (POINTS + 1u);
  memcpy(memory.bytes + factor, &nothing, sizeof nothing);
  assert_int_equal(rim_gp_add(gp, x[3], 1.0, 0.0, 0.0), RIM_E_SINGULAR);
  assert_int_equal(rim_gp_get_counters(gp).singular, 1);
  assert_int_equal(rim_gp_points(gp), 3);
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_OK); /* factors anew */
  assert_int_equal(rim_gp_add(gp, x[3], 1.0, 0.0, 0.0), RIM_OK);
}

/* A configuration with which nothing can be factored (a point was hit) leaves the one before. */
static void a_configuration_that_fails_is_not_taken(void **state) {
  (void)state;
  const rim_gp_config before = config_of(0);
  rim_gp *gp = make(&memory, &before);
  fill(gp, 4);
  rim_gp_point point;
  assert_int_equal(rim_gp_get_point(gp, 2, &point), RIM_OK);
  double *const hit = (double *)(uintptr_t)point.x;
  const double was = hit[0];
  hit[0] = NAN;
  rim_gp_config doubled = before;
  doubled.signal_var *= 2.0;
  assert_int_equal(rim_gp_set_config(gp, &doubled), RIM_E_SINGULAR);
  assert_int_equal(rim_gp_get_counters(gp).singular, 1);
  assert_true(rim_gp_get_config(gp).signal_var == before.signal_var);
  hit[0] = was;
  assert_int_equal(rim_gp_set_config(gp, &doubled), RIM_OK);
  assert_true(rim_gp_get_config(gp).signal_var == doubled.signal_var);
  double mean, again;
  (void)rim_gp_predict(gp, x[9], &mean, NULL);
  gp = make(&memory, &doubled);
  fill(gp, 4);
  (void)rim_gp_predict(gp, x[9], &again, NULL);
  assert_true(mean == again); /* it speaks by the new one */
}

static void misuse_is_refused(void **state) {
  (void)state;
  const rim_gp_config good = config_of(0);
  rim_gp *gp = NULL, *line = NULL;
  memset(&memory, 0x5a, sizeof memory);
  assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES - 1, &good), RIM_E_SIZE);
  assert_int_equal(rim_gp_init(&gp, memory.bytes + 4, BYTES, &good), RIM_E_ALIGN);
  assert_int_equal(rim_gp_init(NULL, memory.bytes, BYTES, &good), RIM_E_ARGUMENT);
  assert_int_equal(rim_gp_init(&gp, NULL, BYTES, &good), RIM_E_ARGUMENT);
  assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, NULL), RIM_E_ARGUMENT);
  rim_gp_config c = good;
  c.kernel = 3;
  assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_CONFIG);
  c = good;
  c.dims = 1; /* the least of both */
  c.points = 1;
  assert_int_equal(rim_gp_init(&line, other.bytes, BYTES, &c), RIM_OK);
  c.dims = RIM_GP_MAX_DIMS + 1;
  assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_CONFIG);
  c = good;
  c.points = 0;
  assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_CONFIG);
  const double bad[] = {NAN, -1.0, INFINITY};
  for (int i = 0; i < 3; ++i) {
    c = good;
    c.signal_var = bad[i];
    assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_RANGE);
    c = good;
    c.noise_var = bad[i];
    assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_RANGE);
    c = good;
    c.length[1] = bad[i];
    assert_int_equal(rim_gp_init(&gp, memory.bytes, BYTES, &c), RIM_E_RANGE);
  }
  for (size_t i = 0; i < sizeof memory.bytes; ++i)
    assert_int_equal(memory.bytes[i], 0x5a);
  assert_null(gp);
}

static void canary_survives(void **state) {
  (void)state;
  const rim_gp_config c = config_of(1);
  memset(&memory, 0x5a, sizeof memory);
  rim_gp *gp = make(&memory, &c);
  double out[POINTS], gradient[RIM_GP_PARAMETERS(DIMS)];
  for (int round = 0; round < 3; ++round) {
    draw();
    fill(gp, POINTS);
    (void)rim_gp_predict_many(gp, x[0], POINTS, out, out);
    rim_gp_log_likelihood_gradient(gp, gradient);
    (void)rim_gp_remove(gp, 3);
  }
  for (size_t i = BYTES; i < BYTES + 8; ++i)
    assert_int_equal(memory.bytes[i], 0x5a);
}

static uint64_t run(rim_gp *gp, int first, int last, uint64_t digest) {
  for (int i = first; i < last; ++i) {
    const double at[DIMS] = {x[i % POINTS][0] + 0.01 * i, x[i % POINTS][1]};
    double mean, var;
    (void)rim_gp_add(gp, at, y[i % POINTS], noise[i % POINTS], 0.0);
    (void)rim_gp_predict(gp, x[(i + 5) % POINTS], &mean, &var);
    digest = rimi_digest_f64(rimi_digest_f64(digest, mean), var);
  }
  return digest;
}

static void moved_memory_goes_on(void **state) {
  (void)state;
  const rim_gp_config c = config_of(2);
  rim_gp *gp = make(&memory, &c);
  const uint64_t half = run(gp, 0, 30, RIM_DIGEST_START);
  other = memory;
  const uint64_t there = run((rim_gp *)(void *)other.bytes, 30, 80, half);
  assert_true(run(gp, 30, 80, half) == there);
}

/* The same bits on every target and at every optimisation. The inputs use no libm. */
static void digest_is_constant(void **state) {
  (void)state;
  uint64_t digest = RIM_DIGEST_START;
  rim_rng own;
  rimi_rng_seed(&own, SEED, 7);
  for (int i = 0; i < POINTS; ++i) {
    for (int d = 0; d < DIMS; ++d)
      x[i][d] = rimi_rng_uniform(&own);
    y[i] = rimi_rng_normal(&own);
    noise[i] = 0.1 * rimi_rng_uniform(&own);
  }
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    const rim_gp_config c = config_of(kernel);
    double gradient[RIM_GP_PARAMETERS(DIMS)];
    rim_gp *gp = make(&memory, &c);
    digest = run(gp, 0, 60, digest);
    rim_gp_log_likelihood_gradient(gp, gradient);
    for (int p = 0; p < 4; ++p)
      digest = rimi_digest_f64(digest, gradient[p]);
    digest = rimi_digest_f64(digest, rim_gp_log_likelihood(gp));
  }
  print_message("digest %016llx\n", (unsigned long long)digest);
  assert_true(digest == UINT64_C(0x5ee544629906ac5b));
}

/* Of as many dimensions as there may be, with more contexts than one batch: each tells points
 * apart, a number behind the last is not looked at, and a point that went is as if it had never
 * come. */
static void the_most_dimensions(void **state) {
  (void)state;
  enum { MOST = RIM_GP_MAX_DIMS, FEW = 20, MANY = 2 * RIM_GP_BATCH + 3 };
  static _Alignas(8) uint8_t room[2][RIM_GP_SIZE(MOST, FEW)];
  for (int kernel = 0; kernel < KERNELS; ++kernel) {
    rim_gp_config c = {.kernel = (uint8_t)kernel, .dims = MOST, .points = FEW, .noise_var = 1e-4};
    rim_gp *whole = NULL, *fewer = NULL;
    for (int d = 0; d < MOST; ++d)
      c.length[d] = 0.8;
    assert_int_equal(rim_gp_init(&whole, room[0], sizeof room[0], &c), RIM_OK);
    assert_int_equal(rim_gp_init(&fewer, room[1], sizeof room[1], &c), RIM_OK);
    double at[FEW][MOST], to[MANY][MOST], mean[MANY], var[MANY];
    for (int p = 0; p < FEW; ++p) {
      double point[MOST + 1];
      for (int d = 0; d < MOST; ++d)
        point[d] = at[p][d] = p == d + 1 ? 1.0 : p <= MOST ? 0.0 : rimi_rng_uniform(&rng);
      point[MOST] = (double)NAN;
      assert_int_equal(rim_gp_add(whole, point, 1.0 + p, 0.0, 0.0), RIM_OK);
      if (p != 0 && p != FEW - 1)
        assert_int_equal(rim_gp_add(fewer, point, 1.0 + p, 0.0, 0.0), RIM_OK);
    }
    for (int p = 0; p < FEW; ++p) { /* each says its own */
      assert_int_equal(rim_gp_predict(whole, at[p], &mean[0], &var[0]), RIM_OK);
      assert_true(fabs(mean[0] - (1.0 + p)) < 0.1 && var[0] < 0.01);
    }
    double gradient[RIM_GP_PARAMETERS(MOST)];
    rim_gp_log_likelihood_gradient(whole, gradient);
    for (size_t k = 0; k < RIM_GP_PARAMETERS(MOST); ++k)
      assert_true(isfinite(gradient[k]) && gradient[k] != 0.0);
    assert_int_equal(rim_gp_remove(whole, FEW - 1), RIM_OK);
    assert_int_equal(rim_gp_remove(whole, 0), RIM_OK);
    for (int i = 0; i < MANY; ++i) {
      for (int d = 0; d < MOST; ++d)
        to[i][d] = rimi_rng_uniform(&rng);
    }
    assert_int_equal(rim_gp_predict_many(whole, to[0], MANY, mean, var), RIM_OK);
    for (int i = 0; i < MANY; ++i) {
      double one = 0.0, its_var = 0.0;
      assert_int_equal(rim_gp_predict(fewer, to[i], &one, &its_var), RIM_OK);
      assert_near(mean[i], one, 1e-6);
      assert_near(var[i], its_var, 1e-6);
    }
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  draw();
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_most_dimensions),
      cmocka_unit_test(agrees_with_a_dense_solution),
      cmocka_unit_test(incremental_equals_batch),
      cmocka_unit_test(removal_equals_never_having_seen_it),
      cmocka_unit_test(gradient_equals_differences),
      cmocka_unit_test(the_gradient_has_every_dimension),
      cmocka_unit_test(many_equal_one_by_one),
      cmocka_unit_test(duplicates_are_fine),
      cmocka_unit_test(duplicates_of_large_values_are_fine),
      cmocka_unit_test(duplicates_make_room_first),
      cmocka_unit_test(the_noisiest_says_least),
      cmocka_unit_test(criterion_does_not_drift),
      cmocka_unit_test(nothing_is_left_of_duplicates_that_went),
      cmocka_unit_test(offsets_are_explained_elsewhere),
      cmocka_unit_test(bad_numbers_are_counted),
      cmocka_unit_test(singular_is_an_error),
      cmocka_unit_test(a_configuration_that_fails_is_not_taken),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(canary_survives),
      cmocka_unit_test(moved_memory_goes_on),
      cmocka_unit_test(digest_is_constant),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
