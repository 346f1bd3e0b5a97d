/* SPDX-License-Identifier: MIT */
/* Alg. 3 over a finished set: planted regions are found, each observation is explained once, and
 * the simpler explanation wins. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/ellipsoid.h"
#include "base/rng.h"
#include "batch/dmaps.h"
#include "bits.h"

#define SEED 41u
enum { N = 900, D = 6, O = 3, NODES = 20 };

static void near(double a, double b, double tolerance) { assert_true(fabs(a - b) <= tolerance); }

static double u[N * D], r[N * O];
static uint8_t truth[N], given[N];
static uint64_t work[RIM_DMAPS_SIZE(N, D, O, NODES) / 8 + 8];

static double square(double x) { return x * x; }

/* Region 1: an ellipse over features 1 and 3; region 2: one over 2 and 4. */
static void make(uint64_t stream, double shift1, double shift2, int outcomes) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, stream);
  for (int i = 0; i < N; ++i) {
    double *x = &u[i * D];
    for (int f = 0; f < D; ++f)
      x[f] = rimi_rng_uniform(&rng);
    const bool in1 = square((x[1] - 0.3) / 0.22) + square((x[3] - 0.6) / 0.25) < 1.0;
    const bool in2 = square((x[2] - 0.7) / 0.2) + square((x[4] - 0.65) / 0.25) < 1.0;
    truth[i] = in1 ? 1 : in2 ? 2 : 0;
    for (int o = 0; o < outcomes; ++o)
      r[i * outcomes + o] = rimi_rng_normal(&rng);
    r[i * outcomes] += truth[i] == 1 ? shift1 : truth[i] == 2 ? shift2 : 0.0;
  }
}

static rim_batch_data with(int outcomes) {
  const rim_batch_data data = {N, D, (uint16_t)outcomes, u, r};
  return data;
}

static rim_dmaps_result find(const rim_dmaps_config *config, const rim_batch_data *data,
                             const uint8_t *skip) {
  rim_dmaps_result result;
  assert_int_equal(rimi_dmaps_find(config, data, skip, work, sizeof work, &result), RIM_OK);
  assert_int_equal(rimi_dmaps_assign(&result, data, skip, given), RIM_OK);
  return result;
}

static double f1(uint8_t number, uint8_t planted) {
  double hit = 0.0;
  double wrong = 0.0;
  for (int i = 0; i < N; ++i) {
    hit += given[i] == number && truth[i] == planted;
    wrong += (given[i] == number) != (truth[i] == planted);
  }
  return 2.0 * hit / (2.0 * hit + wrong);
}

/* What every result promises, by itself: own observations, own value, price and sum. */
static void is_consistent(const rim_dmaps_result *result, const rim_batch_data *data) {
  double value = 0.0;
  for (uint8_t k = 1; k <= result->count; ++k) {
    const rim_dmaps_region *region = &result->region[k - 1];
    double sum[O] = {0.0};
    double n = 0.0;
    double ln_anom = 0.0;
    for (uint32_t i = 0; i < data->n; ++i) {
      assert_true(given[i] != k || rimi_unit_region_contains(&region->region, &u[i * D]));
      assert_true(given[i] <= result->count);
      if (given[i] != k)
        continue;
      n += 1.0;
      for (int o = 0; o < data->outcomes; ++o)
        sum[o] += r[i * (uint32_t)data->outcomes + (uint32_t)o];
    }
    double shift[O];
    assert_int_equal(rimi_dmaps_shift(data, given, k, shift), RIM_OK);
    for (int o = 0; o < data->outcomes; ++o) {
      ln_anom += sum[o] * sum[o] / (2.0 * n);
      near(shift[o], sum[o] / n, 1e-12);
    }
    assert_true(fabs(n - (double)region->count) <= 1.0); /* a point on the very edge */
    near(region->ln_anom, ln_anom, 0.02 * ln_anom);
    assert_true(region->price <= region->ln_anom);
    assert_true(rimi_region_is_valid(&region->region.unit));
    value += region->ln_anom - region->price;
  }
  near(result->value, value, 1e-9);
}

static void two_regions_are_recovered(void **state) {
  (void)state;
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  for (int outcomes = 1; outcomes <= O; outcomes += 2) {
    make((uint64_t)outcomes, 1.5, -1.5, outcomes);
    const rim_batch_data data = with(outcomes);
    const rim_dmaps_result result = find(&c, &data, NULL);
    assert_int_equal(result.count, 2);
    is_consistent(&result, &data);
    const uint8_t first = result.region[0].region.unit.feature[0] == 1 ? 1 : 2;
    assert_int_equal(result.region[first - 1].region.unit.feature[1], 3);
    assert_int_equal(result.region[2 - first].region.unit.feature[0], 2);
    assert_int_equal(result.region[2 - first].region.unit.feature[1], 4);
    assert_true(f1(first, 1) > 0.85);
    assert_true(f1((uint8_t)(3 - first), 2) > 0.85);
    double shift[O];
    assert_int_equal(rimi_dmaps_shift(&data, given, first, shift), RIM_OK);
    near(shift[0], 1.5, 0.3);
  }
}

/* Overlapping regions with opposite shifts: what both contain is explained by one of them. */
/* Nothing of what was in the result before is left in it. */
static void a_result_is_all_its_own(void **state) {
  (void)state;
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  make(1, 1.5, -1.5, 1);
  const rim_batch_data data = with(1);
  rim_dmaps_result result[2];
  for (int i = 0; i < 2; ++i) {
    memset(&result[i], i == 0 ? 0 : 0x5a, sizeof result[i]);
    assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, sizeof work, &result[i]), RIM_OK);
  }
  assert_true(result[0].count > 0);
  assert_memory_equal(&result[0], &result[1], sizeof result[0]);
}

static void each_observation_is_explained_once(void **state) {
  (void)state;
  make(5, 2.0, -2.0, 1);
  const rim_batch_data data = with(1);
  const rim_dmaps_config c = {.lambda = 6.0, .border = 0.01, .search = {.seed = SEED}};
  const rim_dmaps_result result = find(&c, &data, NULL);
  assert_true(result.count >= 2);
  is_consistent(&result, &data);
  uint32_t total = 0;
  uint32_t assigned = 0;
  uint32_t in_several = 0;
  for (uint8_t k = 0; k < result.count; ++k)
    total += result.region[k].count;
  for (int i = 0; i < N; ++i) {
    int containing = 0;
    for (uint8_t k = 0; k < result.count; ++k)
      containing += rimi_unit_region_contains(&result.region[k].region, &u[i * D]);
    in_several += containing > 1;
    assigned += given[i] > 0;
  }
  assert_true(in_several > 0);
  assert_int_equal(total, assigned);
}

/* One planted region of a strong effect, box-shaped so that an ellipsoid leaves its corners. */
static void one_region_is_not_split(void **state) {
  (void)state;
  for (uint64_t stream = 20; stream < 26; ++stream) {
    make(stream, 0.0, 0.0, 1);
    for (int i = 0; i < N; ++i) {
      truth[i] = fabs(u[i * D + 1] - 0.4) < 0.25 && fabs(u[i * D + 3] - 0.6) < 0.25;
      r[i] += truth[i] ? 2.0 : 0.0;
    }
    const rim_batch_data data = with(1);
    const rim_dmaps_config c = {.search = {.seed = stream}};
    const rim_dmaps_result result = find(&c, &data, NULL);
    assert_int_equal(result.count, 1);
    assert_true(f1(1, 1) > 0.8);
  }
}

/* A strip along the diagonal is often found piece by piece; even where borders cost nothing the
 * pieces become one where that is worth as much. */
static void pieces_become_one(void **state) {
  (void)state;
  int regions = 0;
  for (uint64_t stream = 100; stream < 108; ++stream) {
    make(stream, 0.0, 0.0, 1);
    for (int i = 0; i < N; ++i) {
      const double across = u[i * D + 1] - u[i * D + 3];
      const double along = u[i * D + 1] + u[i * D + 3] - 1.0;
      r[i] += fabs(across) < 0.17 && fabs(along) < 0.85 ? 2.0 : 0.0;
    }
    const rim_batch_data data = with(1);
    const rim_dmaps_config c = {.border = 1e-9, .search = {.seed = stream}};
    regions += find(&c, &data, NULL).count;
  }
  printf("%d regions in 8 strips\n", regions);
  assert_true(regions <= 10);
}

/* A shift along one feature is not described by two. */
static void a_dimension_must_pay(void **state) {
  (void)state;
  for (uint64_t stream = 30; stream < 34; ++stream) {
    make(stream, 0.0, 0.0, 1);
    for (int i = 0; i < N; ++i)
      r[i] += u[i * D + 2] > 0.55 && u[i * D + 2] < 0.8 ? 0.8 : 0.0;
    const rim_batch_data data = with(1);
    rim_dmaps_config c = {.lambda_dim = 6.0, .search = {.seed = stream}};
    const rim_dmaps_result result = find(&c, &data, NULL);
    assert_int_equal(result.count, 1);
    assert_int_equal(result.region[0].region.unit.dims, 1);
    assert_int_equal(result.region[0].region.unit.feature[0], 2);
    near(result.region[0].price, 14.0 + 6.0, 0.0);
  }
}

/* A shift of everything is one region without a feature. */
static void everywhere_is_a_region(void **state) {
  (void)state;
  make(40, 0.0, 0.0, 1);
  for (int i = 0; i < N; ++i)
    r[i] += 1.0;
  const rim_batch_data data = with(1);
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result result = find(&c, &data, NULL);
  assert_int_equal(result.count, 1);
  assert_int_equal(result.region[0].region.unit.dims, 0);
  assert_int_equal(result.region[0].count, N);
}

/* The last observation belongs to the region, and nothing lies behind it: the address sanitizer
 * looks on. */
static void the_data_end_with_the_last_observation(void **state) {
  (void)state;
  make(41, 0.0, 0.0, 2);
  double *exact = malloc(sizeof *exact * 2 * N);
  assert_non_null(exact);
  for (int i = 0; i < 2 * N; ++i)
    exact[i] = r[i] + (i % 2 == 0 ? 2.0 : 0.0);
  const rim_batch_data data = {N, D, 2, u, exact};
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result result = find(&c, &data, NULL);
  assert_true(result.count > 0);
  assert_int_equal(given[N - 1], 1);
  free(exact);
}

/* The same in memory that ends with its last byte, of as many features as a region may have:
 * along a diagonal, whose pieces are tried as one, and beside it another. */
static void the_most_features_in_memory_without_room(void **state) {
  (void)state;
  enum { FEW = 224, THREE = 3, FEW_NODES = 8 }; /* FEW a multiple of 8: no byte is left over */
  const size_t bytes = RIM_DMAPS_SIZE(FEW, THREE, 1, FEW_NODES);
  double *exact = malloc(sizeof *exact * FEW * (THREE + 1));
  void *room = malloc(bytes);
  uint8_t *owner = malloc(FEW);
  assert_true(exact != NULL && room != NULL && owner != NULL);
  bool has_three = false;
  for (uint64_t stream = 0; stream < 3; ++stream) {
    double *residual = exact + FEW * THREE;
    make(200 + stream, 0.0, 0.0, 1);
    for (int i = 0; i < FEW; ++i) {
      double *x = exact + THREE * i;
      memcpy(x, &u[i * D], THREE * sizeof *x);
      const double off = fabs(x[0] - x[1]) + fabs(x[0] - x[2]);
      residual[i] = r[i] + (off < 0.45 ? 4.0 : x[0] > 0.75 && x[1] < 0.4 ? -4.0 : 0.0);
    }
    const rim_batch_data data = {FEW, THREE, 1, exact, residual};
    const rim_dmaps_config c = {.lambda = 4.0,
                                .border = 1e-9,
                                .least = 4,
                                .search = {.seed = stream, .max_dims = 3, .nodes = FEW_NODES}};
    rim_dmaps_result result;
    assert_int_equal(rimi_dmaps_find(&c, &data, NULL, room, bytes, &result), RIM_OK);
    assert_int_equal(rimi_dmaps_assign(&result, &data, NULL, owner), RIM_OK);
    assert_true(result.count > 0);
    for (uint8_t k = 0; k < result.count; ++k)
      has_three = has_three || result.region[k].region.unit.dims == THREE;
  }
  assert_true(has_three);
  free(exact);
  free(room);
  free(owner);
}

/* One feature is enough. */
static void one_feature_has_its_interval(void **state) {
  (void)state;
  make(42, 0.0, 0.0, 1);
  for (int i = 0; i < N; ++i)
    r[i] += u[i] > 0.3 && u[i] < 0.5 ? 2.0 : 0.0;
  const rim_batch_data data = {N, 1, 1, u, r};
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  rim_dmaps_result result;
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, sizeof work, &result), RIM_OK);
  assert_true(result.count == 1 && result.region[0].region.unit.dims == 1);
  near(result.region[0].region.unit.center[0], 0.4, 0.05);
}

static void noise_gives_none(void **state) {
  (void)state;
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  for (uint64_t stream = 50; stream < 60; ++stream) {
    make(stream, 0.0, 0.0, 1);
    const rim_batch_data data = with(1);
    const rim_dmaps_result result = find(&c, &data, NULL);
    assert_int_equal(result.count, 0);
    assert_true(result.value == 0.0);
  }
}

static void lambda_limits_the_set(void **state) {
  (void)state;
  make(1, 1.5, -1.0, 1);
  const rim_batch_data data = with(1);
  rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result two = find(&c, &data, NULL);
  assert_int_equal(two.count, 2);
  c.lambda = 0.5 * (two.region[0].ln_anom + two.region[1].ln_anom);
  assert_int_equal(find(&c, &data, NULL).count, 1);
  c.lambda = two.region[0].ln_anom + 1.0;
  assert_int_equal(find(&c, &data, NULL).count, 0);
  c.lambda = 1e-9;
  c.regions = 3;
  const rim_dmaps_result three = find(&c, &data, NULL);
  assert_int_equal(three.count, 3);
  is_consistent(&three, &data);
}

static void what_is_skipped_is_not_looked_at(void **state) {
  (void)state;
  make(1, 1.5, -1.5, 1);
  uint8_t skip[N];
  for (int i = 0; i < N; ++i) {
    skip[i] = truth[i] == 1;
    r[i] = skip[i] ? (double)NAN : r[i];
  }
  const rim_batch_data data = with(1);
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result result = find(&c, &data, skip);
  assert_int_equal(result.count, 1);
  assert_true(f1(1, 2) > 0.85);
  for (int i = 0; i < N; ++i)
    assert_true(!skip[i] || given[i] == 0);
  memset(skip, 1, sizeof skip);
  assert_int_equal(find(&c, &data, skip).count, 0);
}

/* As many observations as a region must hold are enough to look for one, one less is not. */
static void the_least_is_enough(void **state) {
  (void)state;
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  make(1, 1.5, -1.5, 1);
  const rim_batch_data data = with(1);
  static uint8_t skip[N];
  memset(skip, 1, sizeof skip);
  for (int kept = 7; kept <= 8; ++kept) {
    memset(skip, 0, (size_t)kept);
    const rim_dmaps_result result = find(&c, &data, skip);
    assert_int_equal(result.searches > 0, kept == 8);
  }
}

/* Regions in a chain, each across the next: which comes first takes several rounds to settle. */
static void overlapping_regions_keep_their_bits(void **state) {
  (void)state;
  enum { FEW = 220, CHAIN = 6 };
  uint64_t digest = BITS_START;
  for (uint64_t stream = 0; stream < 10; ++stream) {
    rim_rng rng;
    rimi_rng_seed(&rng, SEED, 700 + stream);
    for (int i = 0; i < FEW; ++i) {
      double shift = 0.0;
      for (int f = 0; f < D; ++f)
        u[i * D + f] = rimi_rng_uniform(&rng);
      for (int k = 0; k < CHAIN; ++k)
        if (square((u[i * D] - 0.15 * (k + 0.7)) / 0.13) + square((u[i * D + 1] - 0.5) / 0.4) < 1.0)
          shift += k % 2 == 0 ? 2.5 + 0.2 * k : -2.2;
      r[i] = shift + rimi_rng_normal(&rng);
    }
    const rim_dmaps_config c = {
        .lambda = 5.0, .least = 4, .search = {.seed = SEED + stream, .nodes = 6}};
    const rim_batch_data data = {FEW, D, 1, u, r};
    const rim_dmaps_result result = find(&c, &data, NULL);
    take_real(&digest, result.value);
    take_bits(&digest, (uint64_t)result.searches << 32 | result.evaluations);
    for (uint8_t k = 0; k < result.count; ++k) {
      take_real(&digest, result.region[k].ln_anom);
      take_real(&digest, result.region[k].price);
      take_bits(&digest, result.region[k].count);
    }
  }
  bits_are(digest, UINT64_C(0x16fc7e85a24dc54b));
}

static void the_same_bits_again(void **state) {
  (void)state;
  make(1, 1.5, -1.5, 1);
  const rim_batch_data data = with(1);
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result one = find(&c, &data, NULL);
  memset(work, 0x5a, sizeof work);
  const rim_dmaps_result two = find(&c, &data, NULL);
  assert_int_equal(one.count, two.count);
  assert_int_equal(one.evaluations, two.evaluations);
  for (uint8_t k = 0; k < one.count; ++k) {
    assert_true(one.region[k].ln_anom == two.region[k].ln_anom);
    assert_memory_equal(one.region[k].region.unit.center, two.region[k].region.unit.center,
                        sizeof one.region[k].region.unit.center);
  }
}

/* ln anom grows with the square of the residuals; work stays below the bound of the header. */
static void scaling(void **state) {
  (void)state;
  make(1, 1.5, -1.5, 1);
  const rim_batch_data data = with(1);
  rim_dmaps_config c = {.search = {.seed = SEED}};
  const rim_dmaps_result one = find(&c, &data, NULL);
  for (int i = 0; i < N; ++i)
    r[i] *= 2.0;
  c.lambda = 4.0 * 14.0; /* all prices times 4: the same choices, the same bits times 4 */
  c.lambda_dim = 4.0 * 2.0;
  const rim_dmaps_result two = find(&c, &data, NULL);
  assert_int_equal(one.count, two.count);
  for (uint8_t k = 0; k < one.count; ++k) {
    assert_true(two.region[k].ln_anom == 4.0 * one.region[k].ln_anom);
    assert_int_equal(two.region[k].count, one.region[k].count);
  }
  assert_true(one.searches <= 5 * 8 * 2);
  const uint32_t fs_rim = NODES * 3 * (16 * 5 + 1);
  const uint32_t climbs = one.searches + 3 * 8 * 3 + 2 * 8 * 8;
  assert_true(one.evaluations <= one.searches * fs_rim + climbs * (241 + 1));
}

static void memory_is_respected(void **state) {
  (void)state;
  make(1, 1.5, -1.5, O);
  const rim_batch_data data = with(O);
  const rim_dmaps_config c = {.search = {.seed = SEED}};
  const size_t bytes = RIM_DMAPS_SIZE(N, D, O, NODES);
  rim_dmaps_result result;
  memset(&result, 0x5a, sizeof result);
  const rim_dmaps_result before = result;
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, bytes - 1, &result), RIM_E_SIZE);
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, (char *)work + 4, bytes, &result), RIM_E_ALIGN);
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, NULL, bytes, &result), RIM_E_ARGUMENT);
  assert_int_equal(rimi_dmaps_find(NULL, &data, NULL, work, bytes, &result), RIM_E_ARGUMENT);
  rim_batch_data none = data;
  none.n = 0;
  assert_int_equal(rimi_dmaps_find(&c, &none, NULL, work, bytes, &result), RIM_E_DATA);
  assert_memory_equal(&before, &result, sizeof result);
  memset(work, 0xa5, sizeof work);
  assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, bytes, &result), RIM_OK);
  for (size_t i = bytes; i < sizeof work; ++i)
    assert_int_equal(((uint8_t *)work)[i], 0xa5);
}

static void bad_configuration_is_refused(void **state) {
  (void)state;
  make(1, 1.5, -1.5, 1);
  const rim_batch_data data = with(1);
  const rim_dmaps_config bad[] = {{.regions = 9},
                                  {.sweeps = 9},
                                  {.lambda = -1.0},
                                  {.lambda = (double)NAN},
                                  {.lambda_dim = (double)INFINITY},
                                  {.border = 1.5},
                                  {.search = {.heuristic = RIM_HEURISTIC_NONE}},
                                  {.search = {.max_dims = 4}},
                                  {.search = {.nodes = 1025}},
                                  {.search = {.bins = 3}},
                                  {.search = {.cem = {.samples = 1}}},
                                  {.cem = {.samples = 1}}};
  rim_dmaps_result result;
  memset(&result, 0x5a, sizeof result);
  const rim_dmaps_result before = result;
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    assert_int_equal(rimi_dmaps_find(&bad[i], &data, NULL, work, sizeof work, &result),
                     RIM_E_CONFIG);
  }
  assert_memory_equal(&before, &result, sizeof result);
  rim_dmaps_result far = {.count = 1};
  far.region[0].region.unit.dims = 1;
  far.region[0].region.unit.feature[0] = D;
  assert_int_equal(rimi_dmaps_assign(&far, &data, NULL, given), RIM_E_RANGE);
  double shift[O];
  assert_int_equal(rimi_dmaps_shift(&data, given, 0, shift), RIM_E_ARGUMENT);
}

/* The ends of what is taken: only the work space is too small for it. */
static void the_least_and_the_most_are_taken(void **state) {
  (void)state;
  enum { MOST_OF_ALL = 128 };
  const rim_dmaps_config c = {.regions = RIM_DMAPS_MAX_REGIONS,
                              .sweeps = 8,
                              .border = 1.0,
                              .search = {.max_dims = 3, .nodes = RIM_BATCH_MAX_NODES}};
  const uint16_t count[] = {0, 1, MOST_OF_ALL, MOST_OF_ALL + 1};
  for (size_t i = 0; i < 4; ++i) {
    const bool fits = i == 1 || i == 2;
    rim_batch_data data = {N, count[i], 1, u, r};
    rim_dmaps_result result;
    assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, 8, &result),
                     fits ? RIM_E_SIZE : RIM_E_CONFIG);
    data = (rim_batch_data){N, 1, count[i], u, r};
    assert_int_equal(rimi_dmaps_find(&c, &data, NULL, work, 8, &result),
                     fits ? RIM_E_SIZE : RIM_E_CONFIG);
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(two_regions_are_recovered),
                                     cmocka_unit_test(a_result_is_all_its_own),
                                     cmocka_unit_test(each_observation_is_explained_once),
                                     cmocka_unit_test(one_region_is_not_split),
                                     cmocka_unit_test(pieces_become_one),
                                     cmocka_unit_test(a_dimension_must_pay),
                                     cmocka_unit_test(everywhere_is_a_region),
                                     cmocka_unit_test(the_data_end_with_the_last_observation),
                                     cmocka_unit_test(the_most_features_in_memory_without_room),
                                     cmocka_unit_test(one_feature_has_its_interval),
                                     cmocka_unit_test(noise_gives_none),
                                     cmocka_unit_test(lambda_limits_the_set),
                                     cmocka_unit_test(what_is_skipped_is_not_looked_at),
                                     cmocka_unit_test(the_least_is_enough),
                                     cmocka_unit_test(overlapping_regions_keep_their_bits),
                                     cmocka_unit_test(the_same_bits_again),
                                     cmocka_unit_test(scaling),
                                     cmocka_unit_test(memory_is_respected),
                                     cmocka_unit_test(bad_configuration_is_refused),
                                     cmocka_unit_test(the_least_and_the_most_are_taken)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
