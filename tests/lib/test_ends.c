/* SPDX-License-Identifier: MIT */
/* Private functions at the ends of what they take: the last value that is good, the first that is
 * refused, counters that are full, and numbers that are none. */
#include <math.h>
#include <stdio.h>

#include "base/cholesky.h"
#include "base/ellipsoid.h"
#include "base/rng.h"
#include "batch/dmaps.h"
#include "batch/select_batch.h"
#include "batch/stats.h"
#include "image/correct.h"
#include "image/noise.h"
#include "interference/detector.h"
#include "interference_sample.h"
#include "refuses.h"
#include "search/cem.h"
#include "section_bytes.h"

#define SEED 4711u

/* ---- base ---- */

static void a_matrix_that_is_not_positive(void **state) {
  (void)state;
  double good[3] = {4.0, 2.0, 5.0};
  assert_true(cholesky_factor(2, good));
  assert_true(good[0] == 2.0 && good[1] == 1.0 && good[2] == 2.0);
  const double bad[][3] = {{-1.0, 0.0, 1.0},     {0.0, 0.0, 1.0},   {INFINITY, 0.0, 1.0},
                           {NAN, 0.0, 1.0},      {1.0, 1.0, 1.0},   {1.0, 0.0, -1e-300},
                           {1.0, NAN, 1.0},      {1.0, 1e200, 1.0}, {1.0, 1.0, 1.0 + 0x1p-48},
                           {1.0, 0.0, -INFINITY}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    double a[3];
    memcpy(a, bad[i], sizeof a);
    assert_false(cholesky_factor(2, a));
  }
  double near_one[3] = {1.0, 1.0, 1.0 + 0x1p-40}; /* more than rounding is left */
  assert_true(cholesky_factor(2, near_one));
}

static void ellipsoids_that_are_no_regions(void **state) {
  (void)state;
  const uint16_t feature[RIM_REGION_MAX_DIMS + 1] = {0, 1, 2};
  const double center[RIM_ELLIPSOID_MAX_DIMS] = {0.5, 0.5, 0.5};
  const rim_ellipsoid ball = rimi_ellipsoid_ball(2, center, 0.25);
  rim_unit_region out;
  REFUSES(out, RIM_E_ARGUMENT, rimi_ellipsoid_region(NULL, feature, &out));
  REFUSES(out, RIM_E_ARGUMENT, rimi_ellipsoid_region(&ball, NULL, &out));
  assert_int_equal(rimi_ellipsoid_region(&ball, feature, NULL), RIM_E_ARGUMENT);
  rim_ellipsoid e = ball;
  const uint8_t dims[2] = {0, RIM_REGION_MAX_DIMS + 1};
  for (size_t i = 0; i < 2; ++i) {
    e.dims = dims[i];
    REFUSES(out, RIM_E_RANGE, rimi_ellipsoid_region(&e, feature, &out));
  }
  e = rimi_ellipsoid_ball(1, center, 1e-200); /* its inverse square has no number */
  memset(&out, 0x5a, sizeof out);
  const rim_unit_region before = out;
  assert_int_not_equal(rimi_ellipsoid_region(&e, feature, &out), RIM_OK);
  assert_memory_equal(&out, &before, sizeof out);
  assert_int_equal(rimi_ellipsoid_region(&ball, feature, &out), RIM_OK);
  assert_true(out.unit.dims == 2 && out.unit.upper[1] == 0.75);
}

static void boxes_without_an_end(void **state) {
  (void)state;
  const uint16_t feature[1] = {3};
  const double end[1] = {1.0};
  rim_region out;
  REFUSES(out, RIM_E_ARGUMENT, rimi_region_from_box(&out, 1, NULL, end, end));
  REFUSES(out, RIM_E_ARGUMENT, rimi_region_from_box(&out, 1, feature, NULL, end));
  REFUSES(out, RIM_E_ARGUMENT, rimi_region_from_box(&out, 1, feature, end, NULL));
  assert_int_equal(rimi_region_from_box(NULL, 0, NULL, NULL, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_region_from_box(&out, 0, NULL, NULL, NULL), RIM_OK); /* everywhere */
  assert_int_equal(out.dims, 0);
}

/* A shape must be the same on both sides of its diagonal, in every place. */
static void shapes_that_are_not_symmetric(void **state) {
  (void)state;
  const uint16_t feature[3] = {0, 1, 2};
  const double low[3] = {0.0, 0.0, 0.0}, high[3] = {1.0, 2.0, 3.0};
  rim_region good;
  assert_int_equal(rimi_region_from_box(&good, 3, feature, low, high), RIM_OK);
  assert_true(rimi_region_is_valid(&good));
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      rim_region r = good;
      r.inverse_shape[3 * i + j] += i == j ? 0.0 : 0.1;
      assert_int_equal(rimi_region_is_valid(&r), i == j);
      r = good;
      r.feature[i] = r.feature[j];
      assert_int_equal(rimi_region_is_valid(&r), i == j);
    }
  }
}

/* ---- batch ---- */

static void weights_that_overflow_are_refused(void **state) {
  (void)state;
  rim_stats sum = {0};
  assert_int_equal(rimi_stats_add(&sum, 0.0, 1e-308), RIM_OK);
  const rim_stats before = sum;
  assert_int_equal(rimi_stats_add(&sum, 0.0, 1e-308), RIM_E_DATA); /* of weights alone */
  assert_int_equal(rimi_stats_add(&sum, 1e308, 1e-3), RIM_E_DATA); /* of the weighted sum alone */
  assert_int_equal(rimi_stats_add(&sum, 0.0, 1e-320), RIM_E_DATA);
  assert_memory_equal(&sum, &before, sizeof sum);
}

enum { N = 240, D = 4, NODES = 20 };

/* A shift where features 0, 1 and 3 are all small: found in that order or another, the set is
 * ascending and the region is theirs. The first observation is all 0 and the last all 1. */
static void three_features_in_any_order(void **state) {
  (void)state;
  static double u[N * D], r[N];
  static uint64_t work[RIM_BATCH_SIZE(N, D, NODES) / 8 + 4];
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i * D + f] = i == 0 ? 0.0 : i == N - 1 ? 1.0 : rimi_rng_uniform(&rng);
    /* the later the feature, the sharper its edge: it is the first to be explored */
    const bool in = u[i * D] < 0.8 && u[i * D + 1] < 0.65 && u[i * D + 3] < 0.5;
    r[i] = 0.5 * rimi_rng_normal(&rng) + (in ? 3.0 : 0.0);
  }
  const rim_batch_data data = {N, D, 1, u, r};
  const rim_batch_config c = {
      .heuristic = RIM_HEURISTIC_H3, .nodes = NODES, .max_dims = 3, .seed = SEED};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_true(result.found);
  assert_int_equal(result.dims, 3);
  assert_true(result.feature[0] == 0 && result.feature[1] == 1 && result.feature[2] == 3);
  uint32_t inside = 0;
  double sum = 0.0;
  for (int i = 0; i < N; ++i) {
    const double x[3] = {u[i * D], u[i * D + 1], u[i * D + 3]};
    if (rimi_ellipsoid_contains(&result.ellipsoid, x)) {
      ++inside;
      sum += r[i];
    }
  }
  assert_int_equal(result.inside, inside);
  assert_true(fabs(result.ln_anom - 0.5 * sum * sum / inside) < 1e-9 * result.ln_anom);
}

/* A single observation at either end of a feature's range is in its first or last bin. */
static void ends_of_a_range_are_in_a_bin(void **state) {
  (void)state;
  double u[8], r[8];
  static uint64_t work[RIM_BATCH_SIZE(8, 1, 4) / 8 + 4];
  for (int end = 0; end < 2; ++end) {
    for (int i = 0; i < 8; ++i) {
      u[i] = i == 3 ? end : 0.2 + 0.075 * i;
      r[i] = i == 3 ? 9.0 : 0.0;
    }
    const rim_batch_data data = {8, 1, 1, u, r};
    const rim_batch_config c = {.nodes = 4, .max_dims = 1, .bins = 16, .seed = SEED};
    rim_batch_result result;
    assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
    assert_true(result.dims == 1 && fabs(result.ln_anom - 40.5) < 1e-9);
    assert_true(result.region.unit.lower[0] <= end && result.region.unit.upper[0] >= end);
    assert_true(result.region.unit.upper[0] - result.region.unit.lower[0] < 2.0 / 16.0);
  }
}

/* Two features that are one: what spans two regions over both has no volume. The regions found hold
 * what they say all the same. */
static void features_that_are_the_same(void **state) {
  (void)state;
  enum { M = 200, K = 8 };
  static double u[M * 2], r[M];
  static uint8_t given[M];
  static uint64_t work[RIM_DMAPS_SIZE(M, 2, 1, K) / 8 + 8];
  rim_rng rng;
  rimi_rng_seed(&rng, 1, 1);
  for (int i = 0; i < M; ++i) {
    const double x = u[2 * i] = u[2 * i + 1] = rimi_rng_uniform(&rng);
    r[i] = rimi_rng_normal(&rng) + (x > 0.2 && x < 0.7 ? 2.0 : 0.0);
  }
  const rim_batch_data data = {M, 2, 1, u, r};
  const rim_dmaps_config c = {
      .lambda = 1.0, .lambda_dim = 1e-9, .border = 0.3, .search = {.nodes = K, .seed = 1}};
  rim_dmaps_result result;
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, sizeof work, &result), RIM_OK);
  assert_int_equal(rimi_dmaps_assign(&result, &data, NULL, given), RIM_OK);
  assert_true(result.count >= 1);
  for (uint8_t k = 1; k <= result.count; ++k) {
    double sum = 0.0, n = 0.0;
    for (int i = 0; i < M; ++i) {
      sum += given[i] == k ? r[i] : 0.0;
      n += given[i] == k;
      assert_true(given[i] != k ||
                  rimi_unit_region_contains(&result.region[k - 1].region, u + 2 * i));
    }
    assert_int_equal(result.region[k - 1].count, n);
    assert_true(fabs(result.region[k - 1].ln_anom - 0.5 * sum * sum / n) < 1e-9);
  }
}

static double nothing(const rim_ellipsoid *e, void *context) {
  (void)e, (void)context;
  return 0.0;
}

static void climbs_that_cannot_begin(void **state) {
  (void)state;
  const double center[RIM_ELLIPSOID_MAX_DIMS] = {0};
  const rim_ellipsoid ball = rimi_ellipsoid_ball(2, center, 0.25);
  const rim_cem_config good = {0};
  rim_ellipsoid e = ball;
  double value;
  IS_ARGUMENT(rimi_cem_optimise(NULL, nothing, NULL, 1, 1, &e, &value));
  IS_ARGUMENT(rimi_cem_optimise(&good, NULL, NULL, 1, 1, &e, &value));
  IS_ARGUMENT(rimi_cem_optimise(&good, nothing, NULL, 1, 1, NULL, &value));
  IS_ARGUMENT(rimi_cem_optimise(&good, nothing, NULL, 1, 1, &e, NULL));
  for (int i = 0; i < 5; ++i) {
    e = ball;
    if (i == 0)
      e.dims = 0;
    else if (i == 1)
      e.dims = RIM_CEM_MAX_DIMS + 1;
    else if (i == 2)
      e.center[1] = NAN;
    else
      e.factor[2] = i == 3 ? 0.0 : NAN;
    const rim_ellipsoid before = e;
    value = 7.0;
    assert_int_equal(rimi_cem_optimise(&good, nothing, NULL, 1, 1, &e, &value), RIM_E_CONFIG);
    assert_memory_equal(&e, &before, sizeof e);
    assert_true(value == 7.0);
  }
  const rim_cem_config bad[] = {{.most_axis = INFINITY},
                                {.most_axis = NAN},
                                {.least_axis = 2.0},
                                {.least_axis = -1.0},
                                {.spread = INFINITY},
                                {.spread = -1.0},
                                {.smoothing = 1.0},
                                {.smoothing = -0.1},
                                {.samples = 1},
                                {.samples = RIM_CEM_MAX_SAMPLES + 1},
                                {.elites = RIM_CEM_MAX_ELITES + 1},
                                {.samples = 4, .elites = 5}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
    assert_false(rimi_cem_is_valid(&bad[i], 2));
  assert_true(rimi_cem_is_valid(&good, 1) && rimi_cem_is_valid(&good, RIM_CEM_MAX_DIMS));
  assert_false(rimi_cem_is_valid(&good, 0) || rimi_cem_is_valid(&good, RIM_CEM_MAX_DIMS + 1) ||
               rimi_cem_is_valid(NULL, 2));
}

/* ---- image ---- */

/* One region of outcome 0 where feature 0 is in 0..2, with certainty. */
static rim_correct corrected(uint8_t *section, size_t room, double shift) {
  static rim_correct_region region;
  const uint16_t feature[1] = {0};
  const double low[1] = {0.0}, high[1] = {2.0};
  memset(&region, 0, sizeof region);
  assert_int_equal(rimi_region_from_box(&region.region, 1, feature, low, high), RIM_OK);
  region.confidence = 1.0;
  const rim_correct_model m = {
      .features = 1, .outcomes = 1, .regions = 1, .kinds = 1, .region = &region, .shift = &shift};
  rim_correct c = {0};
  assert_true(room >= RIM_CORRECT_BYTES(1, 1));
  assert_int_equal(rimi_correct_pack(&m, section, RIM_CORRECT_BYTES(1, 1)), RIM_OK);
  assert_int_equal(rimi_correct_open(&c, section, RIM_CORRECT_BYTES(1, 1)), RIM_OK);
  return c;
}

static void corrections_without_a_number(void **state) {
  (void)state;
  _Alignas(8) uint8_t section[RIM_CORRECT_BYTES(1, 1)];
  (void)corrected(section, sizeof section, 3.0);
  /* A shift that is none, with a good check sum. */
  rim_correct again = {0};
  const double infinite = INFINITY;
  memcpy(section + sizeof section - 8, &infinite, 8);
  enum { CRC_AT = 28 }; /* the sum is of everything but itself */
  const uint32_t crc = rimi_crc32(0, section, CRC_AT);
  put_u32(section + CRC_AT, rimi_crc32(crc, section + CRC_AT + 4, sizeof section - CRC_AT - 4));
  assert_int_equal(rimi_correct_open(&again, section, sizeof section), RIM_E_DATA);
  assert_null(again.section);
}

static void more_means_than_noise_has_room_for(void **state) {
  (void)state;
  bytes b = {.size = 0};
  const uint32_t header[4] = {NOISE_LAYOUT, 1, NOISE_MAX_RAW + 1, 1};
  for (size_t i = 0; i < 4; ++i)
    u32(&b, header[i]);
  for (size_t i = 0; i < 100; ++i)
    f32(&b, 1.0);
  rim_noise view;
  assert_int_equal(rimi_noise_open(&view, b.byte, b.size, 1, NOISE_MAX_RAW + 1 - NOISE_RAW_FIRST),
                   RIM_E_RANGE);
  put_u32(b.byte + 8, NOISE_MAX_RAW); /* so many are allowed: the section is of another length */
  assert_int_equal(rimi_noise_open(&view, b.byte, b.size, 1, NOISE_MAX_RAW - NOISE_RAW_FIRST),
                   RIM_E_TRUNCATED);
}

/* ---- interference ---- */

static void drive(rim_interference *s, uint32_t from, uint32_t to, double *score) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 9);
  for (uint32_t i = 0; i < to; ++i) {
    const double noise = 0.03 * rimi_rng_normal(&rng);
    rim_interference_verdict v;
    if (i < from)
      continue;
    assert_int_equal(rimi_interference_step(s, 0.05 * i, 0.5 * sin(0.05 * i), noise, &v), RIM_OK);
    for (size_t k = 0; k < 2; ++k)
      score[2 * i + k] = v.score[k];
    assert_true(v.valid || i == 0);
  }
}

/* After 2^32 rows, which is seven years at 20 Hz, everything is as it was after few. */
static void rows_are_counted_on_and_on(void **state) {
  (void)state;
  const rim_interference_model m = sample_interference();
  static rim_interference few, many;
  static double of_few[400], of_many[400];
  assert_int_equal(rimi_interference_init(&few, &m), RIM_OK);
  drive(&few, 0, 100, of_few);
  many = few;
  const uint32_t near_end = UINT32_MAX - 20u;
  many.rows = near_end - (near_end - few.rows) % RIM_INTERFERENCE_J_ROWS;
  drive(&few, 100, 200, of_few);
  drive(&many, 100, 200, of_many);
  assert_memory_equal(of_few + 200, of_many + 200, 200 * sizeof of_few[0]);
  assert_true(many.rows > RIM_INTERFERENCE_J_ROWS && many.rows < UINT32_MAX / 2 + 200);
  assert_int_equal(many.rows % RIM_INTERFERENCE_J_ROWS, few.rows % RIM_INTERFERENCE_J_ROWS);
  double a[RIM_INTERFERENCE_GAUSSIANS], b[RIM_INTERFERENCE_GAUSSIANS];
  assert_true(rimi_interference_observation(&few, a) && rimi_interference_observation(&many, b));
  assert_memory_equal(a, b, sizeof a);
}

/* Counters stay at their end. */
static void counters_of_interference_saturate(void **state) {
  (void)state;
  const rim_interference_model m = sample_interference();
  static rim_interference s;
  rim_interference_verdict v;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  memset(&s.health, 0xff, sizeof s.health);
  const rim_interference_health full = s.health;
  assert_int_equal(rimi_interference_step(&s, 1.0, 0.0, NAN, &v), RIM_OK);
  assert_false(v.valid);
  for (uint32_t i = 0; i < 3 * RIM_INTERFERENCE_COMMANDS; ++i)
    (void)rimi_interference_step(&s, 1.0 + 1e-4 * i, i, 0.0, &v);
  (void)rimi_interference_step(&s, 0.5, 0.0, 0.0, &v);  /* back */
  (void)rimi_interference_step(&s, 50.0, 0.0, 0.0, &v); /* a gap */
  assert_memory_equal(&s.health, &full, sizeof full);
}

/* Commands that wait take effect one after another, each from its own time. */
static void commands_that_wait(void **state) {
  (void)state;
  const rim_interference_model m = sample_interference(); /* 0.1 s, 1 and 2 m/s^2 */
  static rim_interference s;
  rim_interference_verdict v;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  const double t[] = {0.0, 0.02, 0.04, 0.06, 0.4}, command[] = {0.0, 5.0, -5.0, 1.0, 1.0};
  for (size_t i = 0; i < 5; ++i)
    assert_int_equal(rimi_interference_step(&s, t[i], command[i], 0.0, &v), RIM_OK);
  /* At .12 s 5, at .14 s -5, at .16 s 1: up .02, down .04 (past 0 at 2), then up to the end. */
  assert_true(s.in_force == 1.0 && s.commands == 0);
  const double after = 0.02 - 0.04;
  const double expected = after + 2.0 * 0.24; /* towards 1 from below 0 the speed falls first */
  const double most = fmin(expected, 1.0);
  assert_true(fabs(s.open_loop[0] - s.open_loop[1]) < 1e-12);
  assert_true(s.open_loop[0] > 0.0 && s.open_loop[0] <= most + 1e-12);
  assert_true(fabs(v.one_step_mps + s.open_loop[0]) < 1e-12);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_matrix_that_is_not_positive),
      cmocka_unit_test(ellipsoids_that_are_no_regions),
      cmocka_unit_test(boxes_without_an_end),
      cmocka_unit_test(shapes_that_are_not_symmetric),
      cmocka_unit_test(weights_that_overflow_are_refused),
      cmocka_unit_test(three_features_in_any_order),
      cmocka_unit_test(ends_of_a_range_are_in_a_bin),
      cmocka_unit_test(features_that_are_the_same),
      cmocka_unit_test(climbs_that_cannot_begin),
      cmocka_unit_test(corrections_without_a_number),
      cmocka_unit_test(more_means_than_noise_has_room_for),
      cmocka_unit_test(rows_are_counted_on_and_on),
      cmocka_unit_test(counters_of_interference_saturate),
      cmocka_unit_test(commands_that_wait),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
