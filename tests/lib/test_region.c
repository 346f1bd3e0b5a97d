/* SPDX-License-Identifier: MIT */
/* Regions against Monte Carlo, and refused in every ill form. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/ellipsoid.h"
#include "base/rng.h"
#include "rim/region.h"

#define SEED 19u
enum { FEATURES = 9 };

static rim_rng rng;

/* A random valid region of `dims`: A^-1 = B B^T + 0.3 I. */
static rim_region random_region(uint8_t dims) {
  rim_region region = {.dims = dims};
  double b[3][3];
  for (int i = 0; i < dims; ++i) {
    region.feature[i] = (uint16_t)((7 - 3 * i) % FEATURES);
    region.center[i] = rimi_rng_normal(&rng);
    for (int j = 0; j < dims; ++j) {
      b[i][j] = rimi_rng_normal(&rng);
    }
  }
  for (int i = 0; i < dims; ++i) {
    for (int j = 0; j < dims; ++j) {
      double sum = i == j ? 0.3 : 0.0;
      for (int k = 0; k < dims; ++k) {
        sum += b[i][k] * b[j][k];
      }
      region.inverse_shape[i * dims + j] = sum;
    }
  }
  return region;
}

/* Both halves of a matrix may differ by a rounding error: by 1e-9 of its diagonal's
 * geometric mean, and no more. */
static void halves_may_differ_a_little(void **state) {
  (void)state;
  rim_region region = {.dims = 2, .feature = {0, 1}};
  for (uint32_t at = 1; at <= 2; ++at) {
    const double most = 1e-9 * 6.0, apart[2] = {most, nextafter(most, 1.0)};
    for (int k = 0; k < 2; ++k) {
      const double m[4] = {4.0, at == 1 ? apart[k] : 0.0, at == 2 ? apart[k] : 0.0, 9.0};
      memcpy(region.inverse_shape, m, sizeof m);
      assert_int_equal(rimi_region_is_valid(&region), k == 0);
    }
  }
}

static void volume_and_bounds_by_monte_carlo(void **state) {
  (void)state;
  enum { N = 20000 };
  for (int round = 0; round < 12; ++round) {
    rim_region region = random_region((uint8_t)(1 + round % 3));
    assert_true(rimi_region_is_valid(&region));
    assert_int_equal(rim_region_bounds(&region), RIM_OK);
    double box = 1.0, x[FEATURES], reach[6];
    for (int i = 0; i < region.dims; ++i) {
      box *= region.upper[i] - region.lower[i];
      reach[2 * i] = reach[2 * i + 1] = region.center[i];
    }
    int inside = 0;
    for (int k = 0; k < N; ++k) {
      for (int i = 0; i < FEATURES; ++i) {
        x[i] = 100.0 * rimi_rng_normal(&rng); /* features not named do not matter */
      }
      for (int i = 0; i < region.dims; ++i) { /* one tenth beyond the box on every side */
        const double u = 1.2 * rimi_rng_uniform(&rng) - 0.1;
        x[region.feature[i]] = region.lower[i] + u * (region.upper[i] - region.lower[i]);
      }
      if (rim_region_contains(&region, x)) {
        inside += 1;
        for (int i = 0; i < region.dims; ++i) {
          const double v = x[region.feature[i]];
          assert_true(v > region.lower[i] && v < region.upper[i]);
          reach[2 * i] = fmin(reach[2 * i], v);
          reach[2 * i + 1] = fmax(reach[2 * i + 1], v);
        }
      }
    }
    const double outer = box * pow(1.2, region.dims), share = rimi_region_volume(&region) / outer;
    assert_true(fabs((double)inside / N - share) < 5.0 * sqrt(share * (1.0 - share) / N));
    for (int i = 0; i < region.dims; ++i) { /* the box is tight */
      const double width = region.upper[i] - region.lower[i];
      assert_true(reach[2 * i + 1] - reach[2 * i] > 0.8 * width);
    }
  }
}

static void extremes_of_the_box_are_touched(void **state) {
  (void)state;
  for (int round = 0; round < 100; ++round) {
    rim_region region = random_region((uint8_t)(2 + round % 2));
    assert_int_equal(rim_region_bounds(&region), RIM_OK);
    /* The largest x_0 over the ellipsoid, from its points in many directions, is the bound or less.
     */
    double most = -INFINITY, x[FEATURES] = {0};
    for (int k = 0; k < 4000; ++k) {
      for (int i = 0; i < region.dims; ++i) {
        x[region.feature[i]] = region.center[i] + rimi_rng_normal(&rng);
      }
      const double r = 1.0 / sqrt(rimi_region_distance2(&region, x));
      most = fmax(most, region.center[0] + r * (x[region.feature[0]] - region.center[0]));
    }
    assert_true(most <= region.upper[0] * (1.0 + 1e-12) + 1e-12);
    assert_true(most > region.center[0] + 0.7 * (region.upper[0] - region.center[0]));
  }
}

/* A shape and its inverse: their product is the identity, in every place. */
static void a_shape_is_the_inverse(void **state) {
  (void)state;
  for (int k = 0; k < 200; ++k) {
    const uint8_t dims = (uint8_t)(1 + k % RIM_REGION_MAX_DIMS);
    const rim_region region = random_region(dims);
    double shape[RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS];
    assert_true(rimi_region_shape(&region, shape));
    for (size_t i = 0; i < dims; ++i) {
      for (size_t j = 0; j < dims; ++j) {
        double sum = 0.0;
        for (size_t l = 0; l < dims; ++l)
          sum += shape[i * dims + l] * region.inverse_shape[l * dims + j];
        assert_true(fabs(sum - (i == j ? 1.0 : 0.0)) < 1e-6);
        assert_true(shape[i * dims + j] == shape[j * dims + i]);
      }
    }
  }
}

static void everywhere(void **state) {
  (void)state;
  rim_region region = {0};
  const double x[1] = {NAN};
  assert_true(rimi_region_is_valid(&region) && rim_region_contains(&region, x));
  assert_true(rimi_region_volume(&region) == 1.0 && rimi_region_distance2(&region, x) == 0.0);
  assert_int_equal(rim_region_bounds(&region), RIM_OK);
}

static void boxes(void **state) {
  (void)state;
  const uint16_t feature[3] = {4, 0, 2};
  const double lower[3] = {-1.0, 2.0, 0.0}, upper[3] = {3.0, 2.5, 1e-3};
  rim_region region;
  for (uint8_t dims = 0; dims <= 3; ++dims) {
    assert_int_equal(rimi_region_from_box(&region, dims, feature, lower, upper), RIM_OK);
    assert_true(rimi_region_is_valid(&region));
    const rim_region before = region;
    for (int i = dims; i < RIM_REGION_MAX_DIMS; ++i)
      region.lower[i] = region.upper[i] = region.center[i] = 7.0;
    assert_int_equal(rim_region_bounds(&region), RIM_OK);
    for (int i = dims; i < RIM_REGION_MAX_DIMS; ++i)
      assert_true(region.lower[i] == 0.0 && region.upper[i] == 0.0); /* not used: no numbers */
    for (int i = 0; i < dims; ++i) {
      assert_true(fabs(region.lower[i] - before.lower[i]) < 1e-12);
      assert_true(fabs(region.upper[i] - before.upper[i]) < 1e-12);
    }
  }
  assert_true(fabs(rimi_region_volume(&region) -
                   4.0 / 3.0 * 3.14159265358979323846 * 2.0 * 0.25 * 0.5e-3) < 1e-15);
  assert_int_equal(rimi_region_from_box(&region, 1, feature, lower, upper), RIM_OK);
  double x[FEATURES] = {0};
  static const struct {
    double value;
    int inside;
  } cases[] = {{-1.0, 0}, {-0.999, 1}, {1.0, 1}, {2.999, 1}, {3.0, 0}, {NAN, 0}, {INFINITY, 0}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
    x[4] = cases[i].value;
    assert_int_equal(rim_region_contains(&region, x), cases[i].inside);
  }
  assert_true(rimi_region_volume(&region) == 4.0);
}

/* A box without width holds its one place; no feature counts beyond its dimensions. */
static void a_box_without_width(void **state) {
  (void)state;
  const rim_region box = {.dims = 1, .feature = {1, 9}, .lower = {2.0}, .upper = {2.0}};
  const double below[2] = {0.0, 1.0}, at[2] = {0.0, 2.0}, above[2] = {0.0, 3.0};
  assert_true(rimi_region_box_contains(&box, at));
  assert_false(rimi_region_box_contains(&box, below) || rimi_region_box_contains(&box, above));
  assert_true(rimi_region_names_features(&box, 2));
}

/* Three dimensions are all that there are: none is taken beyond them. */
static void the_most_dimensions_in_their_units(void **state) {
  (void)state;
  for (uint8_t dims = 1; dims <= RIM_REGION_MAX_DIMS; ++dims) {
    const rim_unit_region unit = {.unit = random_region(dims)};
    const uint16_t feature[RIM_REGION_MAX_DIMS] = {7, 8, 9};
    const double low[4] = {1.0, 2.0, 3.0, 4.0}, width[4] = {2.0, 4.0, 8.0, 16.0};
    const rim_region out = rimi_region_from_unit(&unit, feature, low, width);
    for (size_t i = 0; i < RIM_REGION_MAX_DIMS; ++i) {
      const bool used = i < dims;
      assert_int_equal(out.feature[i], used ? feature[i] : unit.unit.feature[i]);
      assert_true(out.center[i] ==
                  (used ? low[i] + unit.unit.center[i] * width[i] : unit.unit.center[i]));
    }
    for (size_t i = 0; i < (size_t)RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS; ++i) {
      const double scale = i < (size_t)dims * dims ? width[i / dims] * width[i % dims] : 1.0;
      assert_true(out.inverse_shape[i] == unit.unit.inverse_shape[i] / scale);
    }
  }
}

static void bad_boxes_are_refused(void **state) {
  (void)state;
  const uint16_t feature[4] = {1, 2, 1, 3};
  const double lower[4] = {0}, upper[4] = {1.0, 1.0, 1.0, 1.0};
  rim_region region, before;
  assert_int_equal(rimi_region_from_box(&region, 2, feature, lower, upper), RIM_OK);
  before = region;
  assert_int_equal(rimi_region_from_box(NULL, 2, feature, lower, upper), RIM_E_ARGUMENT);
  assert_int_equal(rimi_region_from_box(&region, 2, NULL, lower, upper), RIM_E_ARGUMENT);
  assert_int_equal(rimi_region_from_box(&region, 2, feature, lower, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_region_from_box(&region, 4, feature, lower, upper), RIM_E_RANGE);
  assert_int_equal(rimi_region_from_box(&region, 3, feature, lower, upper), RIM_E_RANGE);
  static const double bad[][2] = {{1.0, 1.0},      {2.0, 1.0},       {NAN, 1.0},    {0.0, NAN},
                                  {0.0, INFINITY}, {-INFINITY, 0.0}, {0.0, 1e-200}, {0.0, 1e200}};
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
    assert_int_equal(rimi_region_from_box(&region, 1, feature, &bad[i][0], &bad[i][1]), RIM_E_DATA);
  }
  assert_memory_equal(&region, &before, sizeof region);
}

static void ill_regions_are_refused(void **state) {
  (void)state;
  for (size_t i = 0; i < 3; ++i) { /* whichever of its numbers it is */
    rim_region region = random_region(3);
    region.center[i] = i == 1 ? INFINITY : NAN;
    assert_false(rimi_region_is_valid(&region));
    region = random_region(3);
    region.inverse_shape[4 * i] = -1.0;
    assert_false(rimi_region_is_valid(&region));
  }
  assert_false(rimi_region_is_valid(NULL));
  assert_int_equal(rim_region_bounds(NULL), RIM_E_ARGUMENT);
  for (int kind = 0; kind < 8; ++kind) {
    rim_region region = random_region(3);
    double *m = region.inverse_shape;
    switch (kind) {
    case 0:
      region.dims = 4;
      break;
    case 1:
      region.feature[2] = region.feature[0];
      break;
    case 2:
      region.center[1] = NAN;
      break;
    case 3:
      m[1] += 0.01;
      break;
    case 4:
      m[4] = -m[4];
      break;
    case 5:
      m[8] = NAN;
      break;
    case 6: /* singular: x_0 - x_1 does not matter */
      m[0] = m[1] = m[3] = m[4] = 1.0;
      m[2] = m[5] = m[6] = m[7] = 0.0;
      break;
    default:
      memset(m, 0, sizeof region.inverse_shape);
    }
    assert_false(rimi_region_is_valid(&region));
    if (kind == 0 || kind >= 4) {
      assert_true(rimi_region_volume(&region) == 0.0);
      assert_int_equal(rim_region_bounds(&region), kind == 0 ? RIM_E_RANGE : RIM_E_SINGULAR);
      assert_true(region.lower[0] == 0.0 && region.upper[0] == 0.0);
    }
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(halves_may_differ_a_little),
      cmocka_unit_test(volume_and_bounds_by_monte_carlo),
      cmocka_unit_test(extremes_of_the_box_are_touched),
      cmocka_unit_test(a_shape_is_the_inverse),
      cmocka_unit_test(everywhere),
      cmocka_unit_test(boxes),
      cmocka_unit_test(a_box_without_width),
      cmocka_unit_test(the_most_dimensions_in_their_units),
      cmocka_unit_test(bad_boxes_are_refused),
      cmocka_unit_test(ill_regions_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
