/* SPDX-License-Identifier: MIT */
/* search/explain.c: of many features that explain a finding since its onset three are looked at,
 * and the best of them is said, in whatever order they come. */
#define BENCH_FEATURES 12
#include "search_bench.h"

enum { BLOCKS = 150, ONSET = 60, MIDDLE = 128 };

/* From block ONSET on the outcome reads high where feature `best` is in its upper half. Feature k
 * tells of it the less the farther k is from `best`: it is elsewhere in so many more blocks. */
static world ranked(uint32_t best, uint32_t seed) {
  world w = make_world(false, 0.4, 0.0);
  draw(&w, BLOCKS, seed);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    const uint8_t place = w.feature[i][best];
    for (uint32_t k = 0; k < FEATURES; ++k) {
      const uint32_t off = k > best ? k - best : best - k;
      if (k != best && (7u * i + k) % 26u >= 3u * off + 2u)
        w.feature[i][k] = place;
    }
    w.r[i] += i >= ONSET && place >= MIDDLE ? 4.0 * w.s : 0.0;
  }
  return w;
}

static void the_best_of_many_is_said(void **state) {
  (void)state;
  static bench b;
  for (uint32_t best = 0; best < FEATURES; ++best) {
    const world w = ranked(best, 40 + best);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, TURN);
    search_hypothesis h;
    double sd;
    rimi_search_explain(b.search, 0, &h, &sd);
    print_message("best %u: feature %u, family %u, onset %u\n", best, h.feature[0], h.family,
                  h.onset);
    assert_int_equal(search_dims(&h), 1);
    assert_int_equal(h.feature[0], best);
    assert_in_range(h.onset, ONSET - 6, ONSET + 6);
    assert_true(h.shift > 0.0f);
    assert_in_range(h.first[0], SEARCH_BINS / 2 - 1, SEARCH_BINS / 2 + 1);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_best_of_many_is_said)};
  printf("seeds 40 to 51\n");
  return cmocka_run_group_tests(tests, NULL, NULL);
}
