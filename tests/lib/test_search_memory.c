/* SPDX-License-Identifier: MIT */
/* The memory of a search: how much it is, nothing beyond it, and what configurations ask for. */
#include "search_bench.h"

static void memory_is_checked_and_not_left(void **state) {
  (void)state;
  const world w = world_variant(7, 150);
  bench b;
  start(&b, &w, RING);
  const size_t need = rimi_search_size(&b.config);
  rim_search *s = NULL;
  /* Beside the structures, whose size is the compiler's: per ring, channel, feature and mean. */
  const size_t blocks = RING, fine = 2 * OUTCOMES, triangle = FIELDS * (FIELDS + 1) / 2;
  const size_t parts[] = {4 * (CHANNELS * (triangle + FIELDS) + OUTCOMES),
                          4 * blocks,
                          4 * blocks * (3 + FIELDS),
                          2 * blocks * fine,
                          blocks * (CHANNELS - fine),
                          blocks * FEATURES,
                          blocks * MEANS,
                          blocks * fine,
                          2 * blocks,
                          blocks,
                          CHANNELS * FEATURES,
                          OUTCOMES,
                          sizeof(noise_level) * fine,
                          sizeof(rim_search),
                          CHANNELS * sizeof(channel_state)};
  size_t sum = 0;
  for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i)
    sum += (parts[i] + 7) / 8 * 8;
  assert_int_equal(need, sum);
  assert_true(need > 0 && need + 64 < sizeof b.memory);
  assert_int_equal(rimi_search_init(&s, b.memory, need - 1, &b.config), RIM_E_SIZE);
  for (size_t shift = 1; shift < 8; ++shift)
    assert_int_equal(rimi_search_init(&s, b.memory + shift, need, &b.config), RIM_E_ALIGN);
  assert_null(s);
  memset(b.memory, 0x5a, sizeof b.memory);
  assert_int_equal(rimi_search_init(&b.search, b.memory + 64, need, &b.config), RIM_OK);
  feed(&b, 0, w.blocks, TURN);
  search_hypothesis h;
  double onset_sd;
  for (uint32_t c = 0; c < CHANNELS; ++c)
    rimi_search_explain(b.search, c, &h, &onset_sd);
  for (size_t i = 0; i < sizeof b.memory; ++i) {
    if (i < 64 || i >= 64 + need)
      assert_int_equal(b.memory[i], 0x5a);
  }
}

/* Where no block is inside, there is no onset to be found: what was said stays. */
static void an_onset_of_nothing_stays(void **state) {
  (void)state;
  const world w = world_variant(0, 40);
  bench b;
  start(&b, &w, RING);
  feed(&b, 0, w.blocks, TURN);
  const search_mask nowhere = {.dims = 1, .low = {255}, .high = {0}, .to = 0};
  search_hypothesis h = {.family = SEARCH_INTERVAL_SINCE, .onset = 7, .score = 1.0f};
  const search_hypothesis before = h;
  double onset_sd = 0.0;
  rimi_search_scan_onset(b.search, &nowhere, &h, &onset_sd);
  assert_memory_equal(&h, &before, sizeof h);
  assert_true(onset_sd > 0.0);
}

static void configurations_out_of_range_are_refused(void **state) {
  (void)state;
  const world w = world_variant(0, 8);
  bench b;
  start(&b, &w, RING);
  const search_config good = b.config;
  assert_int_equal(rimi_search_size(NULL), 0);
#define REFUSES(field, value)                                                                      \
  do {                                                                                             \
    search_config bad = good;                                                                      \
    bad.field = (value);                                                                           \
    assert_int_equal(rimi_search_size(&bad), 0);                                                   \
    assert_int_equal(rimi_search_init(&b.search, b.memory, sizeof b.memory, &bad), RIM_E_CONFIG);  \
  } while (0)
  REFUSES(features, 0);
  REFUSES(features, SEARCH_MAX_FEATURES + 1);
  REFUSES(channels, 0);
  REFUSES(channels, CHANNELS - 1);
  REFUSES(channels, CHANNELS + 1);
  REFUSES(outcomes, 0);
  REFUSES(outcomes, CHANNELS + 1);
  REFUSES(means, MEANS + 1);
  REFUSES(ring, 7);
  REFUSES(ring, SEARCH_MAX_RING + 1);
  REFUSES(noise, NULL);
  REFUSES(cuts, NULL);
#undef REFUSES
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(memory_is_checked_and_not_left),
      cmocka_unit_test(an_onset_of_nothing_stays),
      cmocka_unit_test(configurations_out_of_range_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
