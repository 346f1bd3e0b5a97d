/* SPDX-License-Identifier: MIT */
/* Alg. 3 step by step: two planted balls, none twice; the pool stays bounded; a copy goes on. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "batch/dmaps.h"
#include "batch/stats.h"

#define SEED 43u
enum { N = 260 };

static void near(double a, double b, double tolerance) { assert_true(fabs(a - b) <= tolerance); }

typedef struct data {
  double x[N][2], r[N];
  int region[N];
  uint32_t n;
} data;

static double ln_anom(const rim_ellipsoid *e, const rim_ellipsoid *taken, uint32_t count,
                      void *context) {
  const data *d = (const data *)context;
  rim_stats s = {0};
  for (uint32_t i = 0; i < d->n; ++i) {
    bool explained = false;
    for (uint32_t k = 0; k < count; ++k)
      explained = explained || rimi_ellipsoid_contains(&taken[k], d->x[i]);
    if (!explained && rimi_ellipsoid_contains(e, d->x[i]))
      (void)rimi_stats_add(&s, d->r[i], 1.0);
  }
  return s.n < 5.0 ? 0.0 : rimi_stats_ln_anom(&s);
}

static void make(data *d, double shift) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  for (int i = 0; i < N; ++i) {
    d->x[i][0] = rimi_rng_uniform(&rng);
    d->x[i][1] = rimi_rng_uniform(&rng);
    d->region[i] = hypot(d->x[i][0] - 0.75, d->x[i][1] - 0.3) < 0.2   ? 1
                   : hypot(d->x[i][0] - 0.25, d->x[i][1] - 0.7) < 0.2 ? 2
                                                                      : 0;
    d->r[i] = rimi_rng_normal(&rng) + (d->region[i] == 1   ? shift
                                       : d->region[i] == 2 ? -shift
                                                           : 0.0);
  }
}

static const rim_dmaps_pool_config config = {
    .dims = 2, .candidates = 6, .spare = 3, .lambda = 14.0, .seed = SEED, .cem = {.iterations = 3}};

static void two_balls_are_found(void **state) {
  (void)state;
  static data d;
  static rim_dmaps_pool pool;
  make(&d, 2.0);
  assert_int_equal(rimi_dmaps_pool_init(&pool, &config), RIM_OK);
  for (d.n = 1; d.n <= N; ++d.n) {
    assert_int_equal(rimi_dmaps_step(&pool, d.x[d.n - 1], ln_anom, &d), RIM_OK);
    assert_true(pool.found <= pool.count && pool.count <= 6 && pool.count - pool.found <= 3);
    double total = 0.0;
    for (uint32_t k = 0; k < pool.found; ++k) {
      assert_true(pool.value[k] >= 14.0);
      /* what it is worth is what the regions before it leave */
      assert_true(ln_anom(&pool.candidate[k], pool.candidate, k, &d) == pool.value[k]);
      total += pool.value[k] - 14.0;
    }
    near(pool.total, total, 1e-9);
  }
  d.n = N;
  assert_int_equal(pool.found, 2);
  for (int planted = 1; planted <= 2; ++planted) {
    double best = 0.0;
    for (uint32_t k = 0; k < pool.found; ++k) {
      double hit = 0.0;
      double wrong = 0.0;
      for (int i = 0; i < N; ++i) {
        const bool in = rimi_ellipsoid_contains(&pool.candidate[k], d.x[i]);
        hit += in && d.region[i] == planted;
        wrong += in != (d.region[i] == planted);
      }
      best = fmax(best, 2.0 * hit / (2.0 * hit + wrong));
    }
    assert_true(best > 0.8);
  }
}

/* Without spares nothing below lambda survives: Alg. 3 as printed. */
static void nothing_is_found_in_noise(void **state) {
  (void)state;
  static data d;
  static rim_dmaps_pool pool;
  make(&d, 0.0);
  rim_dmaps_pool_config c = config;
  c.spare = 0;
  assert_int_equal(rimi_dmaps_pool_init(&pool, &c), RIM_OK);
  for (d.n = 1; d.n <= 120; ++d.n) {
    assert_int_equal(rimi_dmaps_step(&pool, d.x[d.n - 1], ln_anom, &d), RIM_OK);
    assert_int_equal(pool.found, 0);
    assert_int_equal(pool.count, 0);
    assert_true(pool.total == 0.0);
  }
}

static void a_copy_goes_on(void **state) {
  (void)state;
  static data d;
  static rim_dmaps_pool one;
  static rim_dmaps_pool two;
  make(&d, 2.0);
  assert_int_equal(rimi_dmaps_pool_init(&one, &config), RIM_OK);
  for (d.n = 1; d.n <= 80; ++d.n) {
    if (d.n == 40)
      two = one;
    assert_int_equal(rimi_dmaps_step(&one, d.x[d.n - 1], ln_anom, &d), RIM_OK);
  }
  for (d.n = 40; d.n <= 80; ++d.n)
    assert_int_equal(rimi_dmaps_step(&two, d.x[d.n - 1], ln_anom, &d), RIM_OK);
  assert_memory_equal(one.value, two.value, one.count * sizeof *one.value);
  assert_int_equal(one.count, two.count);
  assert_int_equal(one.found, two.found);
}

/* The pool is never larger than it says, at a lambda that lets everything in. */
static void the_pool_is_bounded(void **state) {
  (void)state;
  static data d;
  static rim_dmaps_pool pool;
  make(&d, 2.0);
  const rim_dmaps_pool_config c = {.dims = 2, .lambda = 0.0, .seed = 1, .cem = {.iterations = 1}};
  assert_int_equal(rimi_dmaps_pool_init(&pool, &c), RIM_OK);
  for (d.n = 1; d.n <= 40; ++d.n) {
    assert_int_equal(rimi_dmaps_step(&pool, d.x[d.n - 1], ln_anom, &d), RIM_OK);
    assert_true(pool.found == pool.count && pool.count <= RIM_DMAPS_MAX_REGIONS);
  }
  assert_int_equal(pool.count, RIM_DMAPS_MAX_REGIONS);
}

static void bad_input_is_refused(void **state) {
  (void)state;
  static data d;
  static rim_dmaps_pool pool;
  make(&d, 0.0);
  const rim_dmaps_pool_config bad[] = {{.dims = 0},
                                       {.dims = 7},
                                       {.dims = 2, .candidates = 9},
                                       {.dims = 2, .candidates = 2, .spare = 3},
                                       {.dims = 2, .radius = -1.0},
                                       {.dims = 2, .radius = (double)NAN},
                                       {.dims = 2, .lambda = -1.0},
                                       {.dims = 2, .lambda = (double)NAN},
                                       {.dims = 2, .cem = {.samples = 1}}};
  memset(&pool, 0x5a, sizeof pool);
  const rim_dmaps_pool before = pool;
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
    assert_int_equal(rimi_dmaps_pool_init(&pool, &bad[i]), RIM_E_CONFIG);
  assert_memory_equal(&before, &pool, sizeof pool);
  assert_int_equal(rimi_dmaps_pool_init(NULL, &config), RIM_E_ARGUMENT);
  assert_int_equal(rimi_dmaps_pool_init(&pool, &config), RIM_OK);
  const double point[2] = {0.5, (double)NAN};
  assert_int_equal(rimi_dmaps_step(&pool, point, ln_anom, &d), RIM_E_DATA);
  assert_int_equal(rimi_dmaps_step(&pool, NULL, ln_anom, &d), RIM_E_ARGUMENT);
  assert_int_equal(pool.steps, 0);
  assert_int_equal(pool.count, 0);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(two_balls_are_found), cmocka_unit_test(nothing_is_found_in_noise),
      cmocka_unit_test(a_copy_goes_on), cmocka_unit_test(the_pool_is_bounded),
      cmocka_unit_test(bad_input_is_refused)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
