/* SPDX-License-Identifier: MIT */
/* search/scan.c: where bins and hypotheses begin and end; what is not known, or does not deviate,
 * changes nothing. */
#include "search_bench.h"

static bench b;

static void search_over(const world *w) {
  start(&b, w, RING);
  feed(&b, 0, w->blocks, 0);
  rimi_search_ready(b.search, 0);
}

/* The first bin begins at byte 0 and the last one ends at 255, wherever their cuts are. */
static void bins_have_edges(void **state) {
  (void)state;
  const world w = world_variant(0, 40);
  search_over(&w);
  uint32_t low = 7, high = 7;
  rimi_search_edges(b.search, 1, 0, SEARCH_BINS - 1, &low, &high);
  assert_true(low == 0 && high == 255);
  rimi_search_edges(b.search, 1, 3, 5, &low, &high);
  assert_true(low == b.cuts[1][2] && high == b.cuts[1][5] - 1u);
  b.cuts[1][0] = b.cuts[1][1] = 0; /* every reading lies above two cuts */
  rimi_search_edges(b.search, 1, 0, 1, &low, &high);
  assert_true(low == 0 && high == 0);
}

/* What ended when the ring's oldest block began has left it; a block later it has not, where noise
 * lasts: the oldest block tells of the next. */
static void what_came_and_went_leaves_the_ring(void **state) {
  (void)state;
  world w = world_variant(2, 3 * RING);
  search_over(&w);
  const uint32_t oldest = rimi_search_oldest(b.search), newest = 3 * RING;
  assert_int_equal(oldest, 2 * RING);
  for (uint32_t end = oldest - 1; end <= oldest + 2; ++end) {
    const search_hypothesis h = {.family = SEARCH_DURING, .onset = oldest - 5, .end = end};
    assert_int_equal(rimi_search_first_inside(b.search, &h), end > oldest ? oldest : newest);
    search_sums sums;
    rimi_search_sum(b.search, &h, &sums);
    assert_true(sums.n == (end > oldest ? end - oldest : 0.0));
    assert_int_equal(rimi_search_inside(b.search, &h, w.feature[0], oldest), end > oldest);
  }
  for (uint32_t onset = oldest; onset <= oldest + 1; ++onset) {
    const search_hypothesis h = {.family = SEARCH_SINCE, .onset = onset};
    assert_int_equal(rimi_search_first_inside(b.search, &h), onset);
    assert_true(rimi_search_inside(b.search, &h, w.feature[0], onset));
    assert_false(rimi_search_inside(b.search, &h, w.feature[0], onset - 1));
  }
}

/* Where nothing deviates there is no box, no interval and nothing that came and went. */
static void what_does_not_deviate_has_no_place(void **state) {
  (void)state;
  world w = world_variant(0, 40);
  memset(w.r, 0, sizeof w.r);
  search_over(&w);
  search_hypothesis h;
  const search_mask all = {0};
  rimi_search_scan_box(b.search, 0, 1, &h);
  assert_true(h.family == SEARCH_BOX && h.score == SEARCH_NONE && h.onset == SEARCH_FROM_START);
  h = (search_hypothesis){.family = SEARCH_INTERVAL, .onset = SEARCH_FROM_START};
  rimi_search_scan_interval(b.search, &all, 0, &h, 0);
  assert_true(h.score == SEARCH_NONE);
  rimi_search_scan_during(b.search, &h);
  assert_true(h.score == SEARCH_NONE);
}

/* Where blocks lie that say nothing of a channel does not matter to it. */
static void unknown_blocks_have_no_place(void **state) {
  (void)state;
  const search_mask all = {0};
  uint32_t found = 0;
  for (uint32_t seed = 0; seed < 40; ++seed) {
    world w = make_world(seed % 2 == 0, 0.0, 0.0);
    draw(&w, RING, 900 + seed);
    for (uint32_t i = 0; i < RING; ++i) {
      w.unknown[i] = i % 8 != seed % 8;
      w.r[i] += i % 16 < 8 ? 6.0 * w.s : 0.0;
    }
    search_hypothesis h[2][2];
    for (uint32_t moved = 0; moved < 2; ++moved) {
      for (uint32_t i = 0; i < RING && moved == 1; ++i) {
        for (uint32_t f = 0; f < FEATURES && w.unknown[i]; ++f)
          w.feature[i][f] = (uint8_t)(w.feature[i][f] + 101u);
      }
      search_over(&w);
      memset(h[moved], 0, sizeof h[moved]);
      rimi_search_scan_box(b.search, 0, 1, &h[moved][0]);
      h[moved][1].family = SEARCH_INTERVAL;
      h[moved][1].onset = SEARCH_FROM_START;
      rimi_search_scan_interval(b.search, &all, 2, &h[moved][1], 0);
    }
    for (uint32_t k = 0; k < 2; ++k) {
      assert_true(h[0][k].score == h[1][k].score);
      if (h[0][k].score > SEARCH_NONE)
        assert_memory_equal(&h[0][k], &h[1][k], sizeof h[0][k]);
      found += h[0][k].score > SEARCH_NONE;
    }
  }
  assert_true(found > 10);
}

/* What was to be taken out goes with the run. */
static void a_reset_has_nothing_to_take_out(void **state) {
  (void)state;
  const world w = world_variant(0, 40);
  search_over(&w);
  assert_true(rimi_search_exclude(b.search, 10, 20));
  assert_true(rimi_search_is_taking_out(b.search));
  rimi_search_reset(b.search);
  assert_false(rimi_search_is_taking_out(b.search));
  feed(&b, 0, w.blocks, 0);
  assert_true(rimi_search_exclude(b.search, 10, 20)); /* and no earlier call is waited for */
}

static uint64_t searched(const world *w) {
  uint64_t digest = BITS_START;
  for (uint32_t i = 0; i < w->blocks; ++i) {
    feed(&b, i, i + 1, 3);
    for (uint32_t c = 0; c < CHANNELS; ++c)
      take_hypothesis(&digest, rimi_search_best(b.search, c));
  }
  search_hypothesis h;
  double onset_sd = 0.0;
  rimi_search_explain(b.search, 0, &h, &onset_sd);
  take_hypothesis(&digest, &h);
  take_real(&digest, onset_sd);
  return digest;
}

/* A run after another one, of which some was taken out, is searched as the first. */
static void a_reset_is_a_start(void **state) {
  (void)state;
  for (uint32_t variant = 0; variant < WORLD_VARIANTS; ++variant) {
    world w = world_variant(variant, 60), other = world_variant(variant ^ 1u, 75);
    for (uint32_t i = 30; i < 60; ++i)
      w.r[i] += 5.0 * w.s;
    memset(b.memory, 0x5a, sizeof b.memory);
    start(&b, &w, RING);
    const uint64_t first = searched(&w);
    b.w = other;
    b.w.fields = w.fields;
    feed(&b, 60, 75, 5);
    assert_true(rimi_search_exclude(b.search, 40, 50));
    feed(&b, 60, 64, 1);
    rimi_search_reset(b.search);
    assert_int_equal(rimi_search_blocks(b.search), 0);
    for (uint32_t c = 0; c < CHANNELS; ++c)
      assert_true(rimi_search_best(b.search, c)->score == SEARCH_NONE);
    b.w = w;
    assert_true(searched(&w) == first);
  }
}

/* A block that scatters by itself counts little, one after another counts whole: each outcome by
 * its own block before. */
static void scatter_is_limited_outcome_by_outcome(void **state) {
  (void)state;
  const world w = world_variant(0, 8);
  start(&b, &w, RING);
  for (uint32_t i = 0; i < 8; ++i) {
    double outcome[CHANNELS], residual[CHANNELS] = {0.0};
    search_block block = block_of(&w, i, outcome, residual);
    for (uint32_t o = 0; o < OUTCOMES; ++o) /* the first since block 2, the next later */
      residual[RIM_CHANNEL_SCATTER * OUTCOMES + o] = i >= 2 + 2 * o ? 10.0 * w.s : 0.0;
    assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
    for (uint32_t o = 0; o < OUTCOMES; ++o) {
      const double kept = search_residual(b.search, RIM_CHANNEL_SCATTER * OUTCOMES + o, i);
      const uint32_t since = 2 + 2 * o;
      assert_true(fabs(kept - (i < since ? 0.0 : i == since ? SEARCH_ALONE : 10.0)) < 0.13);
    }
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(bins_have_edges),
      cmocka_unit_test(what_came_and_went_leaves_the_ring),
      cmocka_unit_test(what_does_not_deviate_has_no_place),
      cmocka_unit_test(a_reset_has_nothing_to_take_out),
      cmocka_unit_test(a_reset_is_a_start),
      cmocka_unit_test(scatter_is_limited_outcome_by_outcome),
      cmocka_unit_test(unknown_blocks_have_no_place),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
