/* SPDX-License-Identifier: MIT */
/* Alg. 4: every heuristic finds the planted pair; H3 equals brute force; bounds hold. */
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
#include "batch/select_batch.h"

#define SEED 37u
enum { N = 250, D = 12, O = 4, NODES = 30, X = 3, Y = 9 };

static double u[N * D], r[N * O];
static bool anomalous[N];
static uint64_t work[RIM_BATCH_SIZE(N, D, NODES) / 8 + 4];

/* A shift of outcome 0 in a box of features X and Y. */
static void make(uint64_t stream, double shift, int outcomes) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, stream);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i * D + f] = rimi_rng_uniform(&rng);
    anomalous[i] = fabs(u[i * D + X] - 0.3) < 0.2 && fabs(u[i * D + Y] - 0.6) < 0.2;
    for (int o = 0; o < outcomes; ++o) {
      r[i * outcomes + o] = rimi_rng_normal(&rng) + (o == 0 && anomalous[i] ? shift : 0.0);
    }
  }
}

static double f1(const rim_batch_result *result) {
  double hit = 0.0;
  double wrong = 0.0;
  for (int i = 0; i < N; ++i) {
    const bool in = rimi_unit_region_contains(&result->region, &u[i * D]);
    hit += in && anomalous[i];
    wrong += in != anomalous[i];
  }
  return 2.0 * hit / (2.0 * hit + wrong);
}

static void every_heuristic_finds_the_pair(void **state) {
  (void)state;
  for (int outcomes = 1; outcomes <= O; outcomes += 3) {
    make((uint64_t)outcomes, -2.0, outcomes);
    const rim_batch_data data = {N, D, (uint16_t)outcomes, u, r};
    for (int h = RIM_HEURISTIC_H3; h <= RIM_HEURISTIC_H1; ++h) {
      const rim_batch_config c = {
          .heuristic = (rim_heuristic)h, .nodes = NODES, .threshold = 20.0, .seed = SEED};
      rim_batch_result result;
      assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
      assert_true(result.found);
      assert_int_equal(result.dims, 2);
      assert_int_equal(result.feature[0], X);
      assert_int_equal(result.feature[1], Y);
      assert_true(rimi_region_is_valid(&result.region.unit));
      assert_true(f1(&result) > 0.7);
      assert_true(result.nodes <= NODES);
      /* two features: at most 3 starts of 24 x 10 + 1 each */
      assert_true(result.evaluations <= NODES * 3 * 241);
    }
  }
}

/* The best interval of any feature, by trying them all. */
static double best_of_all(int bins, int *feature) {
  double best = 0.0;
  for (int f = 0; f < D; ++f) {
    for (int first = 0; first < bins; ++first) {
      for (int last = first; last < bins; ++last) {
        double s = 0.0;
        double n = 0.0;
        for (int i = 0; i < N; ++i) {
          const double x = u[i * D + f];
          if (x < first / (double)bins || x >= (last + 1) / (double)bins)
            continue;
          s += r[i];
          n += 1.0;
        }
        if (n > 0.0 && s * s / (2.0 * n) > best) {
          best = s * s / (2.0 * n);
          *feature = f;
        }
      }
    }
  }
  return best;
}

/* With root and singles only, the best is the exact interval of the best feature; with as many bins
 * as there may be, too. */
static void single_features_equal_brute_force(void **state) {
  (void)state;
  make(7, -1.5, 1);
  const rim_batch_data data = {N, D, 1, u, r};
  for (uint8_t bins = 16; bins <= RIM_BATCH_MAX_BINS; bins = (uint8_t)(bins * 2u)) {
    const rim_batch_config c = {.nodes = NODES, .max_dims = 1, .bins = bins, .seed = 1};
    rim_batch_result result;
    int feature = -1;
    const double best = best_of_all(bins, &feature);
    assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
    assert_int_equal(result.nodes, 1 + D);
    assert_int_equal(result.feature[0], feature);
    assert_true(fabs(result.ln_anom - best) < 1e-9 * best);
  }
}

static void breadth_first_takes_all_singles_first(void **state) {
  (void)state;
  make(8, -2.0, 1);
  const rim_batch_data data = {N, D, 1, u, r};
  rim_batch_config c = {.heuristic = RIM_HEURISTIC_BREADTH, .nodes = 1 + D, .seed = 1};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_int_equal(result.evaluations, 0);
  assert_int_equal(result.dims, 1);
  c.nodes = 2 + D;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_int_equal(result.evaluations, 3 * 241);
}

static void without_selection_all_features_are_used(void **state) {
  (void)state;
  make(9, -2.0, 1);
  rim_batch_data data = {N, D, 1, u, r};
  const rim_batch_config c = {.heuristic = RIM_HEURISTIC_NONE, .nodes = 1, .seed = 1};
  rim_batch_result result;
  memset(&result, 0x5a, sizeof result);
  const rim_batch_result before = result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_E_CONFIG);
  assert_memory_equal(&before, &result, sizeof result);
  static double few[N * 6];
  for (int i = 0; i < N; ++i)
    memcpy(&few[i * 6], &u[i * D], 6 * sizeof(double));
  data.features = 6;
  data.u = few;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_int_equal(result.dims, 6);
  assert_int_equal(result.region.unit.dims, 0);
  assert_int_equal(result.nodes, 1);
}

static void nothing_is_found_in_noise(void **state) {
  (void)state;
  make(10, 0.0, 1);
  const rim_batch_data data = {N, D, 1, u, r};
  const rim_batch_config c = {.nodes = NODES, .threshold = 20.0, .seed = 1};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_false(result.found);
  rim_batch_result again;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &again), RIM_OK);
  assert_true(again.ln_anom == result.ln_anom && again.evaluations == result.evaluations);
}

/* An interval begins and ends at a bin that holds something, and of equals it is the first: of one
 * outcome, and of two. */
static void an_interval_is_the_first_and_shortest(void **state) {
  (void)state;
  for (uint16_t outcomes = 1; outcomes <= 2; ++outcomes) {
    for (uint32_t n = 1; n <= 2; ++n) { /* the second deviates as much, the other way */
      const double at[2] = {0.3, 0.8}, off[4] = {1.0, outcomes == 1 ? -1.0 : 0.0, -1.0, 0.0};
      const rim_batch_data data = {n, 1, outcomes, at, off};
      const rim_batch_config c = {.nodes = 2, .max_dims = 1, .bins = 8};
      rim_batch_result result;
      assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
      assert_true(result.dims == (n == 1 ? 0 : 1) && result.ln_anom == 0.5);
      if (n == 2) /* bin 2 of 8 */
        assert_true(fabs(result.ellipsoid.center[0] - 0.3125) < 1e-12 &&
                    fabs(result.ellipsoid.factor[0] - 0.0625) < 1e-12);
    }
  }
}

/* Where nothing deviates all are equal: everything at once is the region, edges are taken in their
 * order, so that no two features are looked at before each alone, and nothing is found. */
static void of_equals_the_first_is_taken(void **state) {
  (void)state;
  make(12, 0.0, O);
  memset(r, 0, sizeof r);
  for (uint16_t outcomes = 1; outcomes <= O; outcomes = (uint16_t)(outcomes + 3)) {
    const rim_batch_data data = {N, D, outcomes, u, r};
    const rim_batch_config c = {.nodes = 1 + D, .bins = RIM_BATCH_MAX_BINS, .threshold = 0.0};
    rim_batch_result result;
    assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
    assert_true(result.dims == 0 && result.inside == N && !result.found && result.ln_anom == 0.0);
    assert_true(result.evaluations == 0 && result.nodes == 1 + D);
  }
  const rim_batch_data two = {N, 2, 1, u, r};
  const rim_batch_config all = {.heuristic = RIM_HEURISTIC_NONE};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&all, &two, work, sizeof work, &result), RIM_OK);
  assert_true(result.ellipsoid.center[0] == 0.5 && result.ellipsoid.center[1] == 0.5);
}

/* Readings on the edges of bins: the lower edge belongs to an interval, the upper one to the next.
 * Feature X deviates more by itself: with room for three nodes the pair is reached only where the
 * heuristic says at once what of X lies in the interval of Y. */
static void edges_belong_to_one_interval(void **state) {
  (void)state;
  make(13, 0.0, 1);
  for (int i = 0; i < N; ++i) {
    const double x = u[i * D + X], y = floor(4.0 * u[i * D + Y]) / 4.0;
    const bool in_x = x >= 0.25 && x < 0.5;
    u[i * D + Y] = y;
    r[i] = 0.1 * r[i] + (!in_x ? 0.0 : y == 0.5 ? 5.0 : y == 0.75 ? -3.0 : 2.0);
  }
  const rim_batch_data data = {N, D, 1, u, r};
  const rim_batch_config c = {
      .heuristic = RIM_HEURISTIC_H2, .nodes = 3, .bins = 4, .threshold = 20.0, .seed = SEED};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  assert_true(result.dims == 2 && result.feature[0] == X && result.feature[1] == Y);
}

/* As many features, or outcomes, as there may be. */
static void the_most_is_accepted(void **state) {
  (void)state;
  enum { MOST = 128 };
  static double one[2 * (MOST + 1)];
  for (uint16_t more = 0; more < 2; ++more) {
    const uint16_t most = (uint16_t)(MOST + more);
    const rim_batch_data wide = {2, most, 1, one, one}, deep = {2, 1, most, one, one};
    const rim_batch_config c = {.nodes = 1};
    const rim_status expected = more == 0 ? RIM_OK : RIM_E_CONFIG;
    rim_batch_result result;
    assert_int_equal(rimi_select_batch(&c, &wide, work, sizeof work, &result), expected);
    assert_int_equal(rimi_select_batch(&c, &deep, work, sizeof work, &result), expected);
  }
}

static void memory_is_respected(void **state) {
  (void)state;
  make(11, -2.0, 1);
  const rim_batch_data data = {N, D, 1, u, r};
  const rim_batch_config c = {.nodes = NODES, .seed = 1};
  const size_t bytes = RIM_BATCH_SIZE(N, D, NODES);
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, bytes - 1, &result), RIM_E_SIZE);
  rim_batch_data many = data; /* the work space's size would not fit into 32 bits */
  many.n = UINT32_C(1) << 27;
  assert_int_equal(rimi_select_batch(&c, &many, work, SIZE_MAX, &result), RIM_E_SIZE);
  assert_int_equal(rimi_select_batch(&c, &data, (char *)work + 4, bytes, &result), RIM_E_ALIGN);
  assert_int_equal(rimi_select_batch(&c, &data, NULL, bytes, &result), RIM_E_ARGUMENT);
  memset(work, 0xa5, sizeof work);
  assert_int_equal(rimi_select_batch(&c, &data, work, bytes, &result), RIM_OK);
  for (size_t i = bytes; i < sizeof work; ++i)
    assert_int_equal(((uint8_t *)work)[i], 0xa5);
  rim_batch_data none = data;
  none.n = 0;
  assert_int_equal(rimi_select_batch(&c, &none, work, sizeof work, &result), RIM_E_DATA);
  const rim_batch_config bad[] = {{.nodes = 1025},
                                  {.max_dims = 4},
                                  {.bins = 3},
                                  {.bins = 65},
                                  {.heuristic = (rim_heuristic)5},
                                  {.cem = {.samples = 1}}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    assert_int_equal(rimi_select_batch(&bad[i], &data, work, sizeof work, &result), RIM_E_CONFIG);
  }
  const rim_batch_config most = {
      .nodes = RIM_BATCH_MAX_NODES, .max_dims = RIM_REGION_MAX_DIMS, .bins = RIM_BATCH_MAX_BINS};
  assert_int_equal(rimi_select_batch(&most, &data, work, 8, &result), RIM_E_SIZE); /* no more */
}

/* Up to the limit, and not one more, where it is a whole number of observations. */
static void sizes_are_limited(void **state) {
  (void)state;
  rim_batch_data data = {.features = 2, .outcomes = 1};
  data.n = RIM_BATCH_MOST / 8u; /* 2 + 1 + 2 nodes + 3 */
  assert_true(rimi_batch_fits(&data, 2));
  assert_false(rimi_batch_fits(&data, 3));
  data.n++;
  assert_false(rimi_batch_fits(&data, 2));
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(every_heuristic_finds_the_pair),
                                     cmocka_unit_test(single_features_equal_brute_force),
                                     cmocka_unit_test(breadth_first_takes_all_singles_first),
                                     cmocka_unit_test(without_selection_all_features_are_used),
                                     cmocka_unit_test(nothing_is_found_in_noise),
                                     cmocka_unit_test(an_interval_is_the_first_and_shortest),
                                     cmocka_unit_test(of_equals_the_first_is_taken),
                                     cmocka_unit_test(edges_belong_to_one_interval),
                                     cmocka_unit_test(the_most_is_accepted),
                                     cmocka_unit_test(sizes_are_limited),
                                     cmocka_unit_test(memory_is_respected)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
