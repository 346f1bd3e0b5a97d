/* SPDX-License-Identifier: MIT */
/* A rate that deviates in a region (SEARCH_KEPT): what the blocks inside add to a state decays
 * slowly, and is there outside of the region too. Judged as whole matrices judge such a shape. */
#include <stdlib.h>

#include "search_bench.h"

enum { BLOCKS = 150, EDGE = 160, EDGE_BIN = EDGE * SEARCH_BINS / 256 };

static bool is_inside(const world *w, uint32_t i, const search_hypothesis *h) {
  const uint32_t bin = w->feature[i][h->feature[0]] * SEARCH_BINS / 256u;
  const bool is_since = h->onset == SEARCH_FROM_START || i >= h->onset;
  return bin >= h->first[0] && bin <= h->last[0] && is_since && !w->unknown[i];
}

static void kept_in(const world *w, const search_hypothesis *h, double keeps, double *shape) {
  double kept = 0.0;
  for (uint32_t i = 0; i < w->blocks; ++i) {
    kept = keeps * kept + (is_inside(w, i, h) ? 1.0 : 0.0);
    shape[i] = kept;
  }
}

/* A world with what a rate of `shift` s per block inside h has left after each block. */
static world planted(world w, const search_hypothesis *h, double keeps, double shift) {
  double shape[MOST_BLOCKS];
  kept_in(&w, h, keeps, shape);
  for (uint32_t i = 0; i < w.blocks; ++i)
    w.r[i] += shift * w.s * shape[i];
  return w;
}

static search_hypothesis region(uint8_t feature, uint8_t first, uint8_t last, uint32_t onset) {
  return (search_hypothesis){.family = onset == SEARCH_FROM_START ? SEARCH_INTERVAL
                                                                  : SEARCH_INTERVAL_SINCE,
                             .shape = SEARCH_KEPT,
                             .feature = {feature},
                             .first = {first},
                             .last = {last},
                             .onset = onset};
}

static void a_rate_is_judged_by_least_squares(void **state) {
  (void)state;
  static bench b;
  for (uint32_t i = 0; i < 2 * WORLD_VARIANTS; ++i) {
    world w = world_variant(i % WORLD_VARIANTS, BLOCKS);
    for (uint32_t k = 0; k < BLOCKS; ++k)
      w.unknown[k] = i >= WORLD_VARIANTS && k % 11 == 3;
    const search_hypothesis truth = region((uint8_t)(i % FEATURES), EDGE_BIN, SEARCH_BINS - 1,
                                           i % 2 != 0 ? 60 : SEARCH_FROM_START);
    const world off = planted(w, &truth, SEARCH_KEEPS, 0.7);
    start(&b, &off, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    double shape[MOST_BLOCKS], sum = 0.0, n = 0.0;
    kept_in(&off, &truth, SEARCH_KEEPS, shape);
    const gls expected = dense(&off, shape);
    search_hypothesis h = truth;
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
    assert_true(fabs((double)h.shift * off.s - expected.shift) < 1e-3 * expected.sd);
    assert_true(fabs((double)h.sd * off.s - expected.sd) < 1e-3 * expected.sd);
    assert_true(fabs((double)h.ln_ratio - expected.ln_ratio) < 1e-2 + 1e-3 * expected.ln_ratio);
    for (uint32_t k = 0; k < BLOCKS; ++k) {
      sum += is_inside(&off, k, &truth) ? shape[k] : 0.0;
      n += is_inside(&off, k, &truth) ? 1.0 : 0.0;
    }
    if (i < WORLD_VARIANTS)
      assert_true(fabs(rimi_search_kept_mean(b.search, &h) - sum / n) < 1e-9);
    search_hypothesis shift = truth; /* and then a constant shift again, and a gain */
    shift.shape = SEARCH_CONSTANT;
    const search_hypothesis before = shift;
    assert_true(rimi_search_evaluate_channel(b.search, 0, &shift));
    for (uint8_t other = SEARCH_PROPORTIONAL; other <= SEARCH_KEPT; ++other) {
      search_hypothesis again = before;
      again.shape = other;
      rimi_search_evaluate(b.search, &again);
      again = before;
      rimi_search_evaluate(b.search, &again);
      assert_memory_equal(&again, &shift, sizeof again);
    }
  }
}

/* Whatever interval or onset is tried, none explains more than the one that is found. */
static void the_best_interval_and_onset_are_found(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 4; ++seed) {
    world w = make_world(true, seed % 2 == 0 ? 0.0 : 0.5, 0.0);
    draw(&w, BLOCKS, seed);
    const search_hypothesis truth = region(1, 5, EDGE_BIN, 50);
    w = planted(w, &truth, SEARCH_KEEPS, seed < 2 ? 0.5 : -0.5);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    search_hypothesis found = region(1, 0, SEARCH_BINS - 1, 50);
    assert_true(rimi_search_evaluate_channel(b.search, 0, &found));
    const search_mask since = rimi_search_mask_of(b.search, &found, 0);
    rimi_search_scan_interval(b.search, &since, 1, &found, 0);
    for (uint8_t first = 0; first < SEARCH_BINS; ++first) {
      for (uint8_t last = first; last < SEARCH_BINS; ++last) {
        search_hypothesis h = region(1, first, last, 50);
        rimi_search_evaluate(b.search, &h);
        assert_true((double)h.ln_ratio <= (double)found.ln_ratio * (1.0 + 1e-3));
      }
    }
    search_hypothesis dated = found;
    const search_mask mask = rimi_search_mask_of(b.search, &dated, -1);
    rimi_search_scan_onset(b.search, &mask, &dated, NULL);
    for (uint32_t onset = 0; onset + SEARCH_LEAST < BLOCKS; ++onset) {
      search_hypothesis h = found;
      h.onset = onset;
      rimi_search_evaluate(b.search, &h);
      assert_true((double)h.ln_ratio <= (double)dated.ln_ratio * (1.0 + 1e-4));
    }
    assert_true(dated.onset + 6 >= 50 && dated.onset <= 56);
  }
}

/* The place of a rate is told, whether the state keeps more of what is added than is assumed, as a
 * tank, or less. Of one that keeps little, a shift in the place explains nearly as much. */
static void the_region_of_a_rate_is_told(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    world w = make_world(true, 0.0, 0.0);
    draw(&w, BLOCKS, seed);
    for (uint32_t i = 0; i < BLOCKS; ++i) /* a place is visited for a while */
      w.feature[i][2] = (uint8_t)(127.5 + 127.5 * sin(0.11 * i + seed));
    const search_hypothesis truth = region(2, EDGE_BIN, SEARCH_BINS - 1, 40);
    w = planted(w, &truth, seed % 2 == 0 ? 0.88 : 0.96, seed < 4 ? 0.9 : -0.9);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS - 1, TURN); /* the turn of feature 2 */
    search_hypothesis h;
    double onset_sd = -1.0;
    rimi_search_explain(b.search, 0, &h, &onset_sd);
    assert_int_equal(h.feature[0], 2);
    assert_int_equal(h.last[0], SEARCH_BINS - 1);
    assert_true(abs(h.first[0] - EDGE_BIN) <= 4);
    assert_true(seed % 2 == 0 || h.shape == SEARCH_KEPT);
    assert_true(seed < 4 ? h.shift > 0.0f : h.shift < 0.0f);
  }
}

/* On every target, and in every session. */
static void a_rate_keeps_its_bits(void **state) {
  (void)state;
  static bench b;
  const search_hypothesis truth = region(0, EDGE_BIN, SEARCH_BINS - 1, 60);
  const world w = planted(world_variant(7, BLOCKS), &truth, 0.9, 1.5);
  uint64_t digest = BITS_START;
  start(&b, &w, BLOCKS);
  for (uint32_t at = 0; at < BLOCKS; ++at) {
    feed(&b, at, at + 1, TURN);
    search_hypothesis h;
    double onset_sd;
    if (at % 8 != 7 || at < 2 * SEARCH_LEAST)
      continue;
    rimi_search_explain(b.search, 0, &h, &onset_sd);
    take_hypothesis(&digest, &h);
    take_bits(&digest, h.shape);
    if (h.shape == SEARCH_KEPT)
      take_real(&digest, rimi_search_kept_mean(b.search, &h));
  }
  bits_are(digest, UINT64_C(0x69ebb5084104b0fe));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_rate_is_judged_by_least_squares),
      cmocka_unit_test(the_best_interval_and_onset_are_found),
      cmocka_unit_test(the_region_of_a_rate_is_told),
      cmocka_unit_test(a_rate_keeps_its_bits),
  };
  printf("seed %u\n", SEED);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
