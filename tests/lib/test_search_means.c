/* SPDX-License-Identifier: MIT */
/* search/search.c: a block keeps each of the means of the commands, of which there are as many as
 * there is room for. */
#define BENCH_MEANS 8
#include "search_bench.h"

enum { BLOCKS = 24 };

static void every_mean_is_kept(void **state) {
  (void)state;
  world w = make_world(true, 0.4, 0.0);
  draw(&w, BLOCKS, 1);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    for (uint32_t m = 0; m < MEANS; ++m)
      w.mean[i][m] = 0.1 * i - 0.5 * (double)m;
  }
  assert_int_equal(RAW, NOISE_MAX_RAW);
  static bench b;
  start(&b, &w, RING);
  feed(&b, 0, BLOCKS, 0);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    for (uint32_t m = 0; m < MEANS; ++m) {
      const double kept = (double)search_means(b.search, i)[m] * SEARCH_BYTE_STEP;
      assert_true(fabs(kept - w.mean[i][m]) <= 0.5 * SEARCH_BYTE_STEP + 1e-9);
    }
  }
  search_hypothesis h = {.family = SEARCH_SINCE, .onset = SEARCH_FROM_START};
  assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(every_mean_is_kept)};
  printf("seed %u\n", SEED);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
