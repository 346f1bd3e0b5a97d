/* SPDX-License-Identifier: MIT */
/* How the search keeps scatter and repeats: in bytes, and of scatter no more of one block alone
 * than counts. */
#include <math.h>

#include "search_bench.h"

#define FIRST (RIM_CHANNEL_SCATTER * OUTCOMES) /* channel of the scatter of the first outcome */

/* Repeats, as scatter, are kept in bytes: to a quarter of a standard deviation, up to 31. */
static void coarse_residuals_are_kept_in_bytes(void **state) {
  (void)state;
  const world w = make_world(false, 0.0, 0.0);
  static const double z[] = {0.0, 0.1, -0.1, 3.3, -7.7, 31.0, 1e9, -1e9};
  for (uint32_t c = RIM_CHANNEL_REPEAT * OUTCOMES; c < CHANNELS; ++c) {
    bench b;
    start(&b, &w, RING);
    for (uint32_t i = 0; i < sizeof z / sizeof *z; ++i) {
      double outcome[CHANNELS], residual[CHANNELS];
      const search_block block = block_of(&w, i, outcome, residual);
      residual[c] = z[i] * w.s;
      assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
      const double kept = search_residual(b.search, c, i);
      assert_true(fabs(kept - fmax(-31.75, fmin(31.75, z[i]))) <= 0.126);
      assert_true(search_residual(b.search, c - 1, i) == 0.0);
    }
  }
}

/* What healthy runs have in common is no deviation: a share of repeats that is as usual is 0. */
static void the_usual_share_is_no_deviation(void **state) {
  (void)state;
  world w = make_world(false, 0.0, 0.0);
  w.common = 2.5 * w.s;
  static const double z[] = {0.0, 0.5, -2.5, 12.0};
  for (uint32_t c = 0; c < CHANNELS; ++c) {
    if (c / OUTCOMES == RIM_CHANNEL_SCATTER) /* of one block alone little counts */
      continue;
    bench b;
    start(&b, &w, RING);
    for (uint32_t i = 0; i < sizeof z / sizeof *z; ++i) {
      double outcome[CHANNELS], residual[CHANNELS];
      const search_block block = block_of(&w, i, outcome, residual);
      residual[c] = w.common + z[i] * w.s;
      assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
      assert_true(fabs(search_residual(b.search, c, i) - z[i]) <= 0.126);
    }
  }
}

/* Into the search: z of scatter in every outcome but the last, where it is 0. What was kept. */
static void keep_scatter(const double *z, const double *kept, uint32_t n, uint32_t gap) {
  const world w = make_world(false, 0.0, 0.0);
  bench b;
  start(&b, &w, RING);
  for (uint32_t i = 0; i < n; ++i) {
    double outcome[CHANNELS], residual[CHANNELS];
    search_block block = block_of(&w, i, outcome, residual);
    block.apart = i == gap;
    for (uint32_t o = 0; o + 1 < OUTCOMES; ++o)
      residual[FIRST + o] = z[i] * w.s;
    assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
    for (uint32_t o = 0; o + 1 < OUTCOMES; ++o)
      assert_true(fabs(search_residual(b.search, RIM_CHANNEL_SCATTER * OUTCOMES + o, i) -
                       kept[i]) <= 0.126);
    assert_true(search_residual(b.search, RIM_CHANNEL_SCATTER * OUTCOMES + OUTCOMES - 1, i) == 0.0);
  }
  rimi_search_reset(b.search); /* nothing of it is left */
  double outcome[CHANNELS], residual[CHANNELS];
  const search_block block = block_of(&w, n, outcome, residual);
  residual[FIRST] = 9.0 * w.s;
  assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
  assert_true(search_residual(b.search, FIRST, 0) == SEARCH_ALONE);
}

static void one_block_alone_scatters_little(void **state) {
  (void)state;
  enum { N = 12 };
  /* One block; two; one below; from then on; not across a gap. */
  static const double z[N] = {0.5, 9.0, 0.0, 9.0, 9.0, -1.0, -9.0, 0.0, 6.0, 7.0, 8.0, 8.0};
  static const double kept[N] = {0.5, 2.5, 0.0, 2.0, 9.0, -1.0, -3.0, 0.0, 2.0, 7.0, 8.0, 2.0};
  keep_scatter(z, kept, N, N - 1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(coarse_residuals_are_kept_in_bytes),
      cmocka_unit_test(the_usual_share_is_no_deviation),
      cmocka_unit_test(one_block_alone_scatters_little),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
