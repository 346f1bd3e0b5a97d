/* SPDX-License-Identifier: MIT */
/* search/search_guard.c: the last index that may be followed holds, the next one does not. */
#include "search_bench.h"

static bench b;

static void search_some_blocks(void) {
  const world w = world_variant(1, 40);
  start(&b, &w, RING);
  feed(&b, 0, w.blocks, TURN);
  assert_true(rimi_search_indices_hold(b.search));
}

/* A number takes the largest value that is allowed, then one more. */
#define ENDS_AT(field, last)                                                                       \
  do {                                                                                             \
    const unsigned was = (field);                                                                  \
    (field) = (last);                                                                              \
    assert_true(rimi_search_indices_hold(b.search));                                               \
    (field) = (last) + 1;                                                                          \
    assert_false(rimi_search_indices_hold(b.search));                                              \
    (field) = (uint8_t)was;                                                                        \
  } while (0)

static void the_ends_of_a_hypothesis(void **state) {
  (void)state;
  search_some_blocks();
  for (uint32_t i = 0; i < 3;
       ++i) { /* so many channels in succession are looked at, from that in turn */
    channel_state *const of = search_state(b.search, (b.search->channel + i) % CHANNELS);
    for (uint32_t k = 0; k < 2; ++k) {
      search_hypothesis *const h = k == 0 ? &of->time : &of->region;
      ENDS_AT(h->family, SEARCH_DURING);
      ENDS_AT(h->shape, SEARCH_KEPT);
      for (uint32_t d = 0; d < 2; ++d) {
        ENDS_AT(h->feature[d], FEATURES - 1);
        ENDS_AT(h->first[d], SEARCH_BINS - 1);
        ENDS_AT(h->last[d], SEARCH_BINS - 1);
      }
    }
  }
  /* The others wait for their turn: looking at all of them would take too long in one row. */
  search_state(b.search, (b.search->channel + 3u) % CHANNELS)->time.feature[0] = FEATURES;
  assert_true(rimi_search_indices_hold(b.search));
}

static void the_ends_of_the_turn(void **state) {
  (void)state;
  search_some_blocks();
  ENDS_AT(b.search->top_feature, FEATURES - 1);
  ENDS_AT(b.search->p_at, 2 * OUTCOMES - 1);
}

/* What the guard sums are all numbers before the work arrays, which every turn overwrites. */
static void what_is_summed_ends_where_work_begins(void **state) {
  (void)state;
  search_some_blocks();
  size_t size = 0;
  const uint8_t *control = rimi_search_control(b.search, &size);
  assert_ptr_equal(control, b.search);
  assert_ptr_equal(control + size, &b.search->bins);
}

/* Each channel that still holds what was taken out is one that waits. */
static void every_channel_may_wait(void **state) {
  (void)state;
  search_some_blocks();
  assert_false(rimi_search_is_taking_out(b.search));
  for (uint32_t c = 0; c < SEARCH_MAX_CHANNELS; ++c) {
    b.search->excludes[c / 32u] = UINT32_C(1) << (c % 32u);
    assert_true(rimi_search_is_taking_out(b.search));
    b.search->excludes[c / 32u] = 0;
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_ends_of_a_hypothesis),
      cmocka_unit_test(the_ends_of_the_turn),
      cmocka_unit_test(what_is_summed_ends_where_work_begins),
      cmocka_unit_test(every_channel_may_wait),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
