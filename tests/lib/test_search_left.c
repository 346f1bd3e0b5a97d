/* SPDX-License-Identifier: MIT */
/* A ring that blocks have left: what they taught of the run's effects stays, and the oldest block
 * that is still held follows on one that nobody knows any more. Channels that are not known any
 * more are not looked at. */
#include "search_bench.h"

enum { ALL = 110, OLDEST = ALL - RING, COLUMNS = 1 + FIELDS };

static bench b;

static double inside(uint32_t i, uint32_t onset, uint8_t least, const world *w) {
  return i >= onset && w->feature[i][0] >= least ? w->s : 0.0;
}

/* Least squares of all blocks' innovations on a shift within the ring (from `onset` on, where
 * feature 0 is at least `least`) and the run's effects. The innovation of the oldest block says
 * nothing of the shift: it may have been there before. */
static gls by_innovations(const world *w, uint32_t onset, uint8_t least) {
  static double a[COLUMNS][MOST_BLOCKS], x[COLUMNS][2];
  memset(a, 0, sizeof a);
  memset(x, 0, sizeof x);
  for (uint32_t i = 0; i < w->blocks; ++i) {
    const double rho = rho_at(w, i), keeps = i == 0 ? 0.0 : rho;
    const double weight = sqrt(i == 0 ? 1.0 - rho * rho : 1.0) / (scale(w, i) * w->s);
    double row[COLUMNS] = {0.0}, now[FIELDS] = {0.0}, then[FIELDS] = {0.0};
    fields_of(w, i, now);
    fields_of(w, i == 0 ? 0 : i - 1, then);
    for (uint32_t k = 0; k < w->fields; ++k)
      row[1 + k] = weight * w->s * (now[k] - keeps * then[k]);
    if (i > OLDEST)
      row[0] = weight * (inside(i, onset, least, w) -
                         keeps * (i - 1 < OLDEST ? 0.0 : inside(i - 1, onset, least, w)));
    const double e = weight * (residual_of(w, i) - keeps * (i == 0 ? 0.0 : residual_of(w, i - 1)));
    for (uint32_t j = 0; j <= w->fields; ++j) {
      for (uint32_t k = 0; k <= w->fields; ++k)
        a[j][k] += row[j] * row[k];
      x[j][1] += row[j] * e;
    }
  }
  for (uint32_t k = 0; k < w->fields; ++k)
    a[1 + k][1 + k] += 1.0 / w->prior[k];
  x[0][0] = 1.0;
  solve(1 + w->fields, a, x);
  const double shift = x[0][1], variance = x[0][0];
  return (gls){shift, sqrt(variance), shift * shift / (2.0 * variance)};
}

static void is_near(double value, double expected, double least) {
  const double error = fabs(value - expected);
  if (!(error <= 2e-3 * fabs(expected) + least))
    fail_msg("%.9g instead of %.9g", value, expected);
}

static void the_oldest_block_tells_only_of_the_next(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    const world w = world_variant(v, ALL);
    start(&b, &w, RING);
    feed(&b, 0, ALL, 0);
    rimi_search_refresh(b.search, 0);
    for (uint32_t onset = OLDEST; onset < OLDEST + 3; ++onset) {
      for (uint32_t least = 0; least <= 128; least += 128) {
        search_hypothesis h = {.family = least == 0 ? SEARCH_SINCE : SEARCH_INTERVAL_SINCE,
                               .first = {(uint8_t)(least * SEARCH_BINS / 256u)},
                               .last = {SEARCH_BINS - 1},
                               .onset = onset};
        rimi_search_evaluate(b.search, &h);
        const gls g = by_innovations(&w, onset, (uint8_t)least);
        is_near((double)h.shift, g.shift, 1e-3 * g.sd);
        is_near((double)h.sd, g.sd, 0.0);
        is_near((double)h.ln_ratio, g.ln_ratio, 2e-3);
      }
    }
  }
}

/* While a channel is not known, its best finding stays what it was. */
static void what_is_not_known_any_more_is_not_looked_at(void **state) {
  (void)state;
  world w = world_variant(3, MOST_BLOCKS);
  for (uint32_t i = 30; i < MOST_BLOCKS; ++i)
    w.r[i] += 4.0 * w.s;
  for (uint32_t i = 60; i < 130; ++i)
    w.unknown[i] = true;
  start(&b, &w, RING);
  feed(&b, 0, 60, 200);
  uint64_t before = 0, after = 0, again = 0;
  take_hypothesis(&before, rimi_search_best(b.search, 0));
  assert_true(rimi_search_best(b.search, 0)->score > 10.0f);
  for (uint32_t i = 60; i < 130; ++i) {
    feed(&b, i, i + 1, 200);
    after = 0;
    take_hypothesis(&after, rimi_search_best(b.search, 0));
    assert_true(after == before);
  }
  feed(&b, 130, MOST_BLOCKS, 200);
  take_hypothesis(&again, rimi_search_best(b.search, 0));
  assert_true(again != before);
}

static void effects_of(double *effects) {
  double l[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2];
  const noise_channel c = rimi_noise_channel(&b.noise, 0);
  rimi_search_effects(b.search, &c, l, effects);
}

/* Whether the run's effects are others without the blocks from `first` to before `end`. */
static bool has_taught(uint32_t first, uint32_t end) {
  double before[NOISE_MAX_FIELDS], after[NOISE_MAX_FIELDS], most = 0.0;
  effects_of(before);
  assert_true(rimi_search_exclude(b.search, first, end));
  rimi_search_take_out(b.search, 0);
  effects_of(after);
  for (uint32_t k = 0; k < FIELDS; ++k)
    most = fmax(most, fabs(after[k] - before[k]));
  return most > 1e-4;
}

/* Blocks that are no evidence any more have taught nothing, but for the oldest of a ring that
 * others have left: what it taught came with the block before it, which nobody knows now. */
static void what_the_oldest_block_taught_stays(void **state) {
  (void)state;
  world w = make_world(true, 0.0, 0.0);
  draw(&w, ALL, 3);
  for (uint32_t left = 0; left < 2; ++left) {
    const uint32_t blocks = left ? ALL : RING, oldest = blocks - RING;
    start(&b, &w, RING);
    feed(&b, 0, blocks, 0);
    assert_int_equal(has_taught(oldest, oldest + 1), left == 0);
    start(&b, &w, RING);
    feed(&b, 0, blocks, 0);
    assert_true(has_taught(oldest + 1, oldest + 2));
  }
}

/* What is to be excluded next waits for the last channel that still holds the blocks before, of
 * whichever number it is. */
static void an_exclusion_waits_for_every_channel(void **state) {
  (void)state;
  const world w = world_variant(1, RING);
  for (uint32_t last = 0; last < CHANNELS; ++last) {
    start(&b, &w, RING);
    feed(&b, 0, RING, 0);
    assert_true(rimi_search_exclude(b.search, 10, 20));
    for (uint32_t c = 0; c < CHANNELS; ++c) {
      if (c != last)
        rimi_search_take_out(b.search, c);
    }
    assert_false(rimi_search_exclude(b.search, 30, 40));
    rimi_search_take_out(b.search, last);
    assert_true(rimi_search_exclude(b.search, 30, 40));
  }
}

/* A channel that is not known any more has no turn. It lets go of what is excluded all the same. */
static void an_unknown_channel_lets_go_too(void **state) {
  (void)state;
  world w = world_variant(1, ALL);
  for (uint32_t i = 60; i < ALL; ++i)
    w.unknown[i] = true; /* channel 0 */
  start(&b, &w, RING);
  feed(&b, 0, 70, TURN);
  assert_true(rimi_search_exclude(b.search, 50, 58));
  assert_true(rimi_search_is_taking_out(b.search));
  feed(&b, 70, 90, TURN);
  assert_false(rimi_search_is_taking_out(b.search));
  assert_true(rimi_search_exclude(b.search, 74, 78));
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_oldest_block_tells_only_of_the_next),
                                     cmocka_unit_test(what_the_oldest_block_taught_stays),
                                     cmocka_unit_test(an_exclusion_waits_for_every_channel),
                                     cmocka_unit_test(an_unknown_channel_lets_go_too),
                                     cmocka_unit_test(what_is_not_known_any_more_is_not_looked_at)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
