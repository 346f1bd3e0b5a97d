/* SPDX-License-Identifier: MIT */
/* search/search.c: who gets the search's turns. A channel that is watched alone gets all of them,
 * whichever it is, or what it shows would be found late. */
#include "search_bench.h"

static bench b;

/* Whether a channel is watched: 1, and anything up to a half is no. */
static void watch(uint32_t channel, double active) {
  put_f32(b.section.byte + 4 * (NOISE_HEADER_WORDS + channel * b.noise.stride), active);
}

static void the_only_channel_that_is_watched_gets_all_turns(void **state) {
  (void)state;
  enum { UNITS = 5 + FEATURES + 6, ROUNDS = 7 }; /* a whole turn, with six pairs of features */
  const world w = world_variant(1, RING);
  for (uint32_t only = 0; only < CHANNELS; ++only) {
    start(&b, &w, RING);
    for (uint32_t c = 0; c < CHANNELS; ++c)
      watch(c, c == only ? 1.0 : c % 2 == 0 ? 0.0 : 0.5);
    feed(&b, 0, RING, 0);
    for (uint32_t round = 1; round <= ROUNDS; ++round) {
      rimi_search_work(b.search, UNITS);
      assert_int_equal(b.search->channel, only);
      assert_int_equal(b.search->next_pair, 6 * round);
    }
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_only_channel_that_is_watched_gets_all_turns),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
