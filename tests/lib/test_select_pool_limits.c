/* SPDX-License-Identifier: MIT */
/* search/select*.c with the most of everything that there may be, and the least: no array is left,
 * and what is found is told as with few. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "search/select.h"
#include "search/select_private.h"

#define SEED 61u
enum {
  D = RIM_SELECT_MAX_FEATURES,
  C = RIM_SELECT_MAX_CHANNELS,
  BINS = RIM_SELECT_MAX_BINS,
  GRID = RIM_SELECT_MAX_GRID,
  PAIRS = RIM_SELECT_MAX_PAIRS,
  RING = 64
};

static uint64_t memory[RIM_SELECT_SIZE(D, C, RING, BINS, GRID, PAIRS) / 8 + 1];
static double u[D + 1], r[C + 1];
static rim_rng rng;

/* The last channel is off where the last feature is in its upper half. */
static void feed(rim_select *e, int rows, double shift) {
  for (int i = 0; i < rows; ++i) {
    for (int f = 0; f < D; ++f)
      u[f] = rimi_rng_uniform(&rng);
    for (int c = 0; c < C; ++c)
      r[c] = 0.1 * rimi_rng_normal(&rng);
    r[C - 1] += u[D - 1] >= 0.5 ? shift : 0.0;
    u[D] = r[C] = (double)NAN; /* there is no more */
    assert_int_equal(rimi_select_observe(e, u, r), RIM_OK);
    rimi_select_work(e, 2);
  }
}

static void the_most_of_everything(void **state) {
  (void)state;
  const rim_select_config config = {.features = D,
                                    .channels = C,
                                    .ring = RING,
                                    .bins = BINS,
                                    .grid = GRID,
                                    .pairs = PAIRS,
                                    .scans = 400,
                                    .seed = SEED};
  rim_select *e = NULL;
  assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &config), RIM_OK);
  rimi_rng_seed(&rng, SEED, 0);
  feed(e, 3 * RING, 3.0);
  rim_candidate best, same;
  assert_true(rimi_select_best(e, &best));
  assert_int_equal(best.channel, C - 1);
  assert_true(best.shift > 1.0 && best.score > 20.0 && best.dims >= 1);
  assert_true(best.region.unit.feature[best.dims - 1] == D - 1);
  assert_true(rimi_select_best_of_channel(e, C - 1, &same));
  assert_true(same.score == best.score && same.since == best.since);
  assert_true(best.since >= 2 * RING && best.since < 3 * RING);
  assert_false(rimi_select_best_of_channel(e, C, &same));
  u[D - 1] = 0.75;
  assert_true(rimi_select_membership(e, C - 1, u) > 0.0 || best.dims == 2);
  assert_true(rimi_select_membership(e, C, u) == 0.0);
  rimi_select_reset(e);
  feed(e, 2, 0.0);
}

/* The sizes alone: each at its most, and one more. */
static void each_at_its_most(void **state) {
  (void)state;
  for (uint16_t more = 0; more < 2; ++more) {
    const rim_select_config most[] = {
        {.features = (uint16_t)(D + more)},
        {.features = 2, .channels = (uint16_t)(C + more)},
        {.features = 2, .ring = (uint16_t)(RIM_SELECT_MAX_RING + more)},
        {.features = 2, .bins = (uint16_t)(BINS + more)},
        {.features = 2, .grid = (uint16_t)(GRID + more)},
        {.features = 2, .pairs = (uint16_t)(PAIRS + more)},
        {.features = (uint16_t)(1 - more)},
        {.features = 2, .ring = (uint16_t)(16 - more)},
        {.features = 2, .bins = (uint16_t)(4 - more)},
        {.features = 2, .grid = (uint16_t)(8 - more)}};
    size_t bytes = 0;
    for (size_t i = 0; i < sizeof most / sizeof *most; ++i)
      assert_int_equal(rimi_select_size(&most[i], &bytes), more == 0 ? RIM_OK : RIM_E_CONFIG);
  }
}

/* One feature has no pairs, and what an ellipse costs is finite. */
static void one_feature_alone(void **state) {
  (void)state;
  const rim_select_config config = {.features = 1, .ring = RING};
  rim_select *e = NULL;
  assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &config), RIM_OK);
  assert_true(isfinite(e->penalty[1]) && isfinite(e->penalty[2]) && e->penalty[2] > 0.0f);
  rim_candidate best;
  assert_false(rimi_select_best(e, &best));
  for (uint32_t i = 0; i < RING + 3; ++i) { /* also when the ring begins anew */
    const double at = 0.25, off = 1.0;
    assert_int_equal(rimi_select_observe(e, &at, &off), RIM_OK);
    assert_true(rimi_select_best_of_channel(e, 0, &best));
    assert_true(best.dims == 0 && best.n == i + 1.0 && best.shift == 1.0);
    assert_int_equal(best.since, i < RING ? 0 : i - RING + 1);
  }
}

/* Sums are halved when they are full, before the next observation is added. */
static void sums_that_are_full_are_halved(void **state) {
  (void)state;
  const rim_select_config config = {.features = 1, .ring = RING};
  for (uint32_t full = 0; full < 2; ++full) {
    rim_select *e = NULL;
    const double at = 0.25, off = 1.0;
    assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &config), RIM_OK);
    e->count = RIM_BINS_MAX_COUNT - 1u + full;
    assert_int_equal(rimi_select_observe(e, &at, &off), RIM_OK);
    assert_int_equal(e->count, full ? RIM_BINS_MAX_COUNT / 2u + 1u : RIM_BINS_MAX_COUNT);
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_most_of_everything),
      cmocka_unit_test(each_at_its_most),
      cmocka_unit_test(one_feature_alone),
      cmocka_unit_test(sums_that_are_full_are_halved),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
