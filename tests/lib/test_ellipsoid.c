/* SPDX-License-Identifier: MIT */
/* Regions in every frame: an ellipsoid by its factor, by its inverse shape and in the features'
 * units is the same set; its box is the smallest; closed boxes, also around an angle's end. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "base/ellipsoid.h"
#include "base/rng.h"

#define SEED 31u
static rim_rng rng;

/* Of 1 to 3 dimensions, turn by turn; another one every time. */
static rim_ellipsoid any_ellipsoid(int round) {
  const double x[3] = {0.5, 0.5, 0.5};
  rim_ellipsoid e = rimi_ellipsoid_ball((uint8_t)(1 + round % 3), x, 0.3);
  for (int i = 0; i < e.dims * (e.dims + 1) / 2; ++i)
    e.factor[i] += 0.25 * rimi_rng_uniform(&rng);
  return e;
}

static void region_is_the_same_set(void **state) {
  (void)state;
  const uint16_t feature[3] = {4, 0, 2};
  int inside = 0;
  for (int round = 0; round < 200; ++round) {
    const rim_ellipsoid e = any_ellipsoid(round);
    const uint8_t dims = e.dims;
    rim_unit_region region;
    assert_int_equal(rimi_ellipsoid_region(&e, feature, &region), RIM_OK);
    assert_true(rimi_region_is_valid(&region.unit));
    for (size_t i = 0; i < 3; ++i) { /* its box, and nothing where it has no dimension */
      const double half = i < dims ? rimi_ellipsoid_half_side(&e, i) : 0.0;
      assert_true(fabs(region.unit.upper[i] - (i < dims ? 0.5 : 0.0) - half) < 1e-12);
      assert_true(i < dims || (region.unit.feature[i] == 0 && region.unit.center[i] == 0.0));
    }
    for (int k = 0; k < 50; ++k) {
      double full[5] = {0};
      double own[3];
      for (int i = 0; i < dims; ++i) {
        own[i] = rimi_rng_uniform(&rng);
        full[feature[i]] = own[i];
      }
      const double d2 = rimi_region_distance2(&region.unit, full);
      if (fabs(d2 - 1.0) < 1e-9)
        continue;
      assert_int_equal(rimi_ellipsoid_contains(&e, own), d2 < 1.0);
      assert_int_equal(rimi_unit_region_contains(&region, full), d2 < 1.0);
      inside += d2 < 1.0;
    }
  }
  assert_in_range(inside, 500, 9500);
}

/* In features' units the same contexts are inside, and the bounds are the units' bounds. */
static void units_hold_the_same_contexts(void **state) {
  (void)state;
  const uint16_t own[2] = {0, 1}, feature[2] = {3, 1};
  const double low[2] = {-50.0, 1e6}, width[2] = {100.0, 1e-3};
  int inside = 0;
  for (int round = 0; round < 100; ++round) {
    const double middle[2] = {0.4, 0.6};
    rim_ellipsoid e = rimi_ellipsoid_ball(2, middle, 0.3);
    e.factor[1] = 0.4 * rimi_rng_uniform(&rng) - 0.2;
    rim_unit_region unit;
    assert_int_equal(rimi_ellipsoid_region(&e, own, &unit), RIM_OK);
    const rim_region region = rimi_region_from_unit(&unit, feature, low, width);
    assert_true(rimi_region_is_valid(&region));
    assert_int_equal(region.feature[0], 3);
    for (size_t k = 0; k < 2; ++k) {
      const double half = rimi_ellipsoid_half_side(&e, k);
      assert_true(fabs(unit.unit.upper[k] - (e.center[k] + half)) < 1e-12);
      assert_true(fabs(region.upper[k] - (low[k] + unit.unit.upper[k] * width[k])) <=
                  1e-9 * width[k]);
    }
    for (int i = 0; i < 50; ++i) {
      const double u[2] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
      const double x[4] = {0.0, low[1] + u[1] * width[1], 0.0, low[0] + u[0] * width[0]};
      const double d2 = rimi_region_distance2(&unit.unit, u);
      if (fabs(d2 - 1.0) < 1e-5) /* a context's last digits in its own unit */
        continue;
      assert_int_equal(rim_region_contains(&region, x), rimi_unit_region_contains(&unit, u));
      inside += d2 < 1.0;
    }
  }
  assert_in_range(inside, 500, 4500);
}

/* With is_box the largest coordinate of L^-1 (x - center) counts. */
static void boxes_have_corners(void **state) {
  (void)state;
  const double center[2] = {0.5, 0.5}, corner[2] = {0.68, 0.32}, beyond[2] = {0.71, 0.5};
  const rim_ellipsoid e = rimi_ellipsoid_ball(2, center, 0.2);
  const ellipsoid_test box = rimi_ellipsoid_test(&e, true), ball = rimi_ellipsoid_test(&e, false);
  assert_true(rimi_ellipsoid_holds(&box, corner) && !rimi_ellipsoid_holds(&ball, corner));
  assert_false(rimi_ellipsoid_holds(&box, beyond));
  const double nan_first[2] = {NAN, 0.5}, nan_last[2] = {0.5, NAN};
  assert_false(rimi_ellipsoid_holds(&box, nan_first) || rimi_ellipsoid_holds(&box, nan_last));
  assert_false(rimi_ellipsoid_contains(&e, nan_first) || rimi_ellipsoid_contains(&e, nan_last));
}

/* What lies exactly on the edge is outside: no two neighbours hold the same place. */
static void the_edge_is_outside(void **state) {
  (void)state;
  const double center[2] = {0.5, 0.5}, edge[2] = {0.75, 0.5}, next[2] = {0.75 - 0x1p-40, 0.5};
  const rim_ellipsoid e = rimi_ellipsoid_ball(2, center, 0.25);
  for (int box = 0; box < 2; ++box) {
    const ellipsoid_test test = rimi_ellipsoid_test(&e, box != 0);
    assert_false(rimi_ellipsoid_holds(&test, edge));
    assert_true(rimi_ellipsoid_holds(&test, next));
  }
}

static void closed_boxes_and_angles(void **state) {
  (void)state;
  const uint16_t feature[1] = {1};
  const double lower[1] = {2.0}, upper[1] = {3.0};
  rim_region region;
  assert_int_equal(rimi_region_from_box(&region, 1, feature, lower, upper), RIM_OK);
  const double x[][2] = {{9, 2.0}, {9, 3.0}, {9, 2.5}, {9, 1.999}, {9, 3.001}, {9, NAN}};
  const bool in[] = {true, true, true, false, false, false};
  for (size_t i = 0; i < 6; ++i)
    assert_int_equal(rimi_region_box_contains(&region, x[i]), in[i]);
  region.lower[0] = 3.0; /* from 3 over the angle's end to 2 */
  region.upper[0] = 2.0;
  const bool outer[] = {true, true, false, true, true, false};
  for (size_t i = 0; i < 6; ++i)
    assert_int_equal(rimi_region_box_contains(&region, x[i]), outer[i]);
  assert_true(rimi_region_names_features(&region, 2));
  assert_false(rimi_region_names_features(&region, 1));
}

/* A is the inverse of A^-1, and refused where there is none. */
static void shape_is_the_inverse(void **state) {
  (void)state;
  for (int round = 0; round < 100; ++round) {
    const uint16_t feature[3] = {0, 1, 2};
    const rim_ellipsoid e = any_ellipsoid(round);
    const uint8_t dims = e.dims;
    rim_unit_region region;
    assert_int_equal(rimi_ellipsoid_region(&e, feature, &region), RIM_OK);
    double shape[9];
    assert_true(rimi_region_shape(&region.unit, shape));
    for (size_t i = 0; i < dims; ++i) {
      for (size_t j = 0; j < dims; ++j) {
        double product = 0.0;
        for (size_t k = 0; k < dims; ++k)
          product += region.unit.inverse_shape[i * dims + k] * shape[k * dims + j];
        assert_true(fabs(product - (i == j ? 1.0 : 0.0)) < 1e-9);
      }
    }
    region.unit.inverse_shape[0] = 0.0;
    assert_false(rimi_region_shape(&region.unit, shape));
  }
}

/* Of as many dimensions as there may be, in each of which it ends. */
static void the_most_dimensions(void **state) {
  (void)state;
  double x[RIM_ELLIPSOID_MAX_DIMS] = {0.0};
  const rim_ellipsoid e = rimi_ellipsoid_ball(RIM_ELLIPSOID_MAX_DIMS, x, 0.25);
  for (size_t i = 0; i < RIM_ELLIPSOID_MAX_DIMS; ++i) {
    x[i] = 0.249;
    assert_true(rimi_ellipsoid_contains(&e, x));
    x[i] = 0.251;
    assert_false(rimi_ellipsoid_contains(&e, x));
    x[i] = 0.0;
  }
}

static void bad_input_is_refused(void **state) {
  (void)state;
  const double x[2] = {0.5, 0.5};
  const uint16_t feature[3] = {0, 1, 2};
  rim_ellipsoid odd = rimi_ellipsoid_ball(2, x, 0.2);
  odd.factor[2] = 0.0;
  rim_unit_region region;
  assert_int_equal(rimi_ellipsoid_region(NULL, feature, &region), RIM_E_ARGUMENT);
  assert_int_equal(rimi_ellipsoid_region(&odd, feature, &region), RIM_E_SINGULAR);
  odd.dims = 4;
  assert_int_equal(rimi_ellipsoid_region(&odd, feature, &region), RIM_E_RANGE);
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(region_is_the_same_set),  cmocka_unit_test(units_hold_the_same_contexts),
      cmocka_unit_test(boxes_have_corners),      cmocka_unit_test(the_edge_is_outside),
      cmocka_unit_test(closed_boxes_and_angles), cmocka_unit_test(shape_is_the_inverse),
      cmocka_unit_test(the_most_dimensions),     cmocka_unit_test(bad_input_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
