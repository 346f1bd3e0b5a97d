/* SPDX-License-Identifier: MIT */
/* search/search.c: a channel with a limit. A block that is far off is no lasting deviation, however
 * far it is; a deviation that lasts is found, dated and measured, however large it is. */
#include "search_bench.h"

static bench b;

enum { FROM = 24, OUTLIER = 12 };
#define LIMIT 3.0

static void start_limited(const world *w, double limit) {
  start(&b, w, RING);
  put_f32(b.section.byte + 4 * NOISE_HEADER_WORDS, limit);
}

/* The best of SINCE, RAMP, GAIN and FIELD after a whole ring. */
static search_hypothesis found_in(const world *w, double limit) {
  start_limited(w, limit);
  feed(&b, 0, RING, 0);
  rimi_search_work(b.search, 64);
  return *rimi_search_best(b.search, 0);
}

static world with_shift(uint32_t variant, uint32_t from, uint32_t to, double sds) {
  world w = world_variant(variant, RING);
  for (uint32_t i = from; i < to; ++i)
    w.r[i] += sds * w.s;
  return w;
}

static void one_block_far_off_is_no_lasting_deviation(void **state) {
  (void)state;
  for (uint32_t variant = 0; variant < WORLD_VARIANTS; ++variant) {
    const world healthy = with_shift(variant, 0, 0, 0.0);
    const double without = (double)found_in(&healthy, LIMIT).ln_ratio;
    /* Of a block alone, which was within 1.5 of 0: its own part in the root of the ratio. */
    const double most = pow(sqrt(2.0 * without) + LIMIT + 1.5, 2.0) / 2.0;
    for (int side = -1; side <= 1; side += 2) {
      const world w = with_shift(variant, OUTLIER, OUTLIER + 1, 300.0 * side);
      const double all = (double)found_in(&w, 1.0).ln_ratio;
      const double limited = (double)found_in(&w, LIMIT).ln_ratio;
      printf("variant %u: %.1f nats, %.1f with a block far off, %.1f without a limit\n", variant,
             without, limited, all);
      assert_true(limited < most && all > 10.0 * most);
    }
  }
}

static void what_lasts_is_measured_however_large_it_is(void **state) {
  (void)state;
  static const double sizes[] = {4.0, 5.0, 8.0, 30.0, -30.0, 250.0};
  for (uint32_t variant = 0; variant < WORLD_STEADY; ++variant) {
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
      const world w = with_shift(variant, FROM, RING, sizes[i]);
      const search_hypothesis h = found_in(&w, LIMIT);
      const double error = fabs((double)h.shift - sizes[i]);
      printf("variant %u, %.1f sd: %.1f +- %.1f since %u, family %u\n", variant, sizes[i],
             (double)h.shift, (double)h.sd, h.onset, h.family);
      assert_int_equal(h.family, SEARCH_SINCE);
      assert_in_range(h.onset, FROM, FROM + NOISE_PATIENCE);
      assert_true(error < 0.25 * fabs(sizes[i]) || error < 3.0 * (double)h.sd);
    }
  }
}

static void noise_within_the_limit_is_as_it_was(void **state) {
  (void)state;
  const world w = world_variant(7, RING);
  start_limited(&w, 1.0);
  feed(&b, 0, RING, 0);
  int16_t before[RING];
  for (uint32_t i = 0; i < RING; ++i)
    before[i] = search_fine_residuals(b.search, i)[0];
  start_limited(&w, 60.0);
  feed(&b, 0, RING, 0);
  for (uint32_t i = 0; i < RING; ++i)
    assert_int_equal(search_fine_residuals(b.search, i)[0], before[i]);
}

/* Of which nothing is known is no level, and none is before it. */
static void unknown_blocks_leave_the_level(void **state) {
  (void)state;
  world w = with_shift(2, 0, RING, 40.0);
  for (uint32_t i = FROM; i < FROM + 6; ++i) {
    w.unknown[i] = true;
    w.r[i] = -1000.0 * w.s;
  }
  start_limited(&w, LIMIT);
  feed(&b, 0, FROM, 0);
  const noise_level level = search_levels(b.search)[0];
  assert_true(level.level > 0);
  feed(&b, FROM, FROM + 6, 0);
  assert_memory_equal(search_levels(b.search), &level, sizeof level);
  for (uint32_t i = FROM; i < FROM + 6; ++i)
    assert_false(search_is_known(b.search, 0, i));
  rimi_search_reset(b.search);
  assert_int_equal(search_levels(b.search)[0].level, 0);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(one_block_far_off_is_no_lasting_deviation),
      cmocka_unit_test(what_lasts_is_measured_however_large_it_is),
      cmocka_unit_test(noise_within_the_limit_is_as_it_was),
      cmocka_unit_test(unknown_blocks_leave_the_level),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
