/* SPDX-License-Identifier: MIT */
/* Alg. 2 finds a planted ball; the set stays bounded and sorted; a copy goes on to the same bits.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "batch/faro.h"
#include "batch/stats.h"

#define SEED 31u
enum { N = 300 };

typedef struct data {
  double x[N][2], r[N];
  bool anomalous[N];
  uint32_t n;
} data;

static double ln_anom(const rim_ellipsoid *e, void *context) {
  const data *d = (const data *)context;
  rim_stats s = {0};
  for (uint32_t i = 0; i < d->n; ++i) {
    if (rimi_ellipsoid_contains(e, d->x[i]))
      (void)rimi_stats_add(&s, d->r[i], 1.0);
  }
  return rimi_stats_ln_anom(&s);
}

static void make(data *d, double shift) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  for (int i = 0; i < N; ++i) {
    d->x[i][0] = rimi_rng_uniform(&rng);
    d->x[i][1] = rimi_rng_uniform(&rng);
    d->anomalous[i] = hypot(d->x[i][0] - 0.7, d->x[i][1] - 0.3) < 0.2;
    d->r[i] = rimi_rng_normal(&rng) + (d->anomalous[i] ? shift : 0.0);
  }
}

static const rim_faro_config config = {.dims = 2, .seed = SEED, .cem = {.iterations = 3}};

static void finds_a_planted_ball(void **state) {
  (void)state;
  static data d;
  static rim_faro faro;
  make(&d, -2.0);
  assert_int_equal(rimi_faro_init(&faro, &config), RIM_OK);
  bool found = true;
  for (d.n = 1; d.n <= N; ++d.n) {
    assert_int_equal(rimi_faro_step(&faro, d.x[d.n - 1], ln_anom, &d, 20.0, &found), RIM_OK);
    if (d.n == 1)
      assert_false(found);
    assert_true(faro.count <= 5);
    for (uint32_t i = 0; i < faro.count; ++i) { /* each by the newest observation */
      assert_true(faro.value[i] == ln_anom(&faro.candidate[i], &d));
      assert_true(i == 0 || faro.value[i] <= faro.value[i - 1]);
    }
  }
  d.n = N;
  assert_true(found);
  int hit = 0;
  int wrong = 0;
  for (int i = 0; i < N; ++i) {
    const bool in = rimi_ellipsoid_contains(&faro.candidate[0], d.x[i]);
    hit += in && d.anomalous[i];
    wrong += in != d.anomalous[i];
  }
  assert_true(2.0 * hit / (2.0 * hit + wrong) > 0.85);
}

static void finds_nothing_in_noise(void **state) {
  (void)state;
  static data d;
  static rim_faro faro;
  make(&d, 0.0);
  assert_int_equal(rimi_faro_init(&faro, &config), RIM_OK);
  bool found = true;
  for (d.n = 1; d.n <= N; ++d.n) {
    assert_int_equal(rimi_faro_step(&faro, d.x[d.n - 1], ln_anom, &d, 20.0, &found), RIM_OK);
    assert_false(found);
  }
}

static void a_copy_goes_on(void **state) {
  (void)state;
  static data d;
  static rim_faro one;
  static rim_faro two;
  make(&d, -2.0);
  assert_int_equal(rimi_faro_init(&one, &config), RIM_OK);
  bool found;
  for (d.n = 1; d.n <= 80; ++d.n) {
    if (d.n == 40)
      two = one;
    assert_int_equal(rimi_faro_step(&one, d.x[d.n - 1], ln_anom, &d, 1.0, &found), RIM_OK);
  }
  for (d.n = 40; d.n <= 80; ++d.n) {
    assert_int_equal(rimi_faro_step(&two, d.x[d.n - 1], ln_anom, &d, 1.0, &found), RIM_OK);
  }
  assert_int_equal(one.count, two.count);
  for (uint32_t i = 0; i < one.count; ++i) {
    assert_true(one.value[i] == two.value[i]);
    assert_memory_equal(one.candidate[i].center, two.candidate[i].center, 2 * sizeof(double));
  }
}

static double always(const rim_ellipsoid *e, void *context) {
  (void)e;
  return *(const double *)context;
}

/* Whatever the value is, negative or 0: the threshold itself is found, and of equals the earlier
 * one stays first. What lies behind the point is not looked at. */
static void of_equals_the_earlier_is_first(void **state) {
  (void)state;
  for (double value = -1.0; value < 2.0; value += 1.0) {
    rim_faro faro;
    bool found = false;
    assert_int_equal(rimi_faro_init(&faro, &config), RIM_OK);
    for (uint32_t i = 0; i < 8; ++i) {
      const double x[3] = {100.0 * i, 0.0, NAN};
      assert_int_equal(rimi_faro_step(&faro, x, always, &value, value, &found), RIM_OK);
      assert_true(found && faro.value[0] == value);
      assert_int_equal(faro.count, i < 5 ? i + 1 : 5);
      for (uint32_t k = 0; k < faro.count; ++k)
        assert_true(fabs(faro.candidate[k].center[0] - 100.0 * k) < 50.0);
      rim_faro other = faro;
      assert_int_equal(rimi_faro_step(&other, x, always, &value, value + 0.5, &found), RIM_OK);
      assert_false(found);
    }
  }
}

static void the_most_is_accepted(void **state) {
  (void)state;
  static rim_faro faro;
  const rim_faro_config most = {.dims = RIM_CEM_MAX_DIMS, .candidates = RIM_FARO_MAX_CANDIDATES};
  assert_int_equal(rimi_faro_init(&faro, &most), RIM_OK);
  const rim_faro_config least = {.dims = 1, .candidates = 1};
  static rim_faro small;
  assert_int_equal(rimi_faro_init(&small, &least), RIM_OK);
  const double x[RIM_CEM_MAX_DIMS] = {0.0};
  double value = 1.0;
  bool found = false;
  for (uint32_t i = 0; i < RIM_FARO_MAX_CANDIDATES + 2; ++i) {
    assert_int_equal(rimi_faro_step(&faro, x, always, &value, 2.0, &found), RIM_OK);
    assert_false(found);
  }
  assert_int_equal(faro.count, RIM_FARO_MAX_CANDIDATES);
}

static void bad_input_is_refused(void **state) {
  (void)state;
  static data d;
  static rim_faro faro;
  make(&d, 0.0);
  rim_faro_config bad[] = {{.dims = 0},
                           {.dims = 7},
                           {.dims = 2, .candidates = 17},
                           {.dims = 2, .radius = -1.0},
                           {.dims = 2, .radius = NAN}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    assert_int_equal(rimi_faro_init(&faro, &bad[i]), RIM_E_CONFIG);
  }
  assert_int_equal(rimi_faro_init(NULL, &config), RIM_E_ARGUMENT);
  rim_faro_config wrong = config;
  wrong.cem.samples = 1;
  assert_int_equal(rimi_faro_init(&faro, &wrong), RIM_OK);
  bool found = true;
  assert_int_equal(rimi_faro_step(&faro, d.x[0], ln_anom, &d, 0.0, &found), RIM_E_CONFIG);
  assert_int_equal(faro.count, 0);
  const double bad_point[2] = {0.5, NAN};
  assert_int_equal(rimi_faro_init(&faro, &config), RIM_OK);
  assert_int_equal(rimi_faro_step(&faro, bad_point, ln_anom, &d, 0.0, &found), RIM_E_DATA);
  const double bad_first[2] = {NAN, 0.5};
  assert_int_equal(rimi_faro_step(&faro, bad_first, ln_anom, &d, 0.0, &found), RIM_E_DATA);
  assert_int_equal(faro.steps, 0);
  assert_true(found);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(finds_a_planted_ball), cmocka_unit_test(finds_nothing_in_noise),
      cmocka_unit_test(a_copy_goes_on),       cmocka_unit_test(of_equals_the_earlier_is_first),
      cmocka_unit_test(the_most_is_accepted), cmocka_unit_test(bad_input_is_refused)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
