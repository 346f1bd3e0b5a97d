/* SPDX-License-Identifier: MIT */
/* A deviation that lasts longer than the ring holds: what leaves the ring inside it must not become
 * what is usual in this run. */
#include "search_bench.h"

enum { BEGINS = 40, ENDS = 160 };
#define STANDS 10.0f /* nats: the score from which the deviation is said to stand */

static bench b;

/* A shift of `size` s from block BEGINS on, where feature 0 is at least `least`. */
static world shifted(uint32_t variant, double size, uint8_t least) {
  world w = world_variant(variant, ENDS);
  for (uint32_t i = BEGINS; i < ENDS; ++i)
    w.r[i] += w.feature[i][0] >= least ? size * w.s : 0.0;
  return w;
}

/* The best hypothesis of channel 0 after all blocks. */
static search_hypothesis outlast(const world *w, bool lets_go) {
  start(&b, w, RING);
  for (uint32_t i = 0; i < ENDS; ++i) {
    const search_hypothesis now = *rimi_search_best(b.search, 0);
    if (lets_go && now.score > STANDS)
      rimi_search_let_go(b.search, &now);
    feed(&b, i, i + 1, TURN);
  }
  return *rimi_search_best(b.search, 0);
}

static void a_lasting_shift_keeps_its_size(void **state) {
  (void)state;
  for (uint32_t v = 1; v < WORLD_VARIANTS; v += 2) { /* those with run effects */
    for (int sign = -1; sign <= 1; sign += 2) {
      const double size = sign * 6.0;
      const world w = shifted(v, size, 0);
      const search_hypothesis kept = outlast(&w, true), lost = outlast(&w, false);
      print_message("variant %u: %.1f is %.2f +- %.2f; otherwise %.2f\n", v, size,
                    (double)kept.shift, (double)kept.sd, (double)lost.shift);
      assert_true(kept.score > STANDS && fabs((double)kept.shift - size) < 3.0 * (double)kept.sd);
      assert_true(lost.score < kept.score);
    }
  }
}

/* Blocks beside the deviation go on to teach the run's effects; all of a region's do not. */
static void a_lasting_shift_in_a_region_keeps_its_size(void **state) {
  (void)state;
  const world w = shifted(1, 4.0, 128);
  const search_hypothesis kept = outlast(&w, true);
  assert_true(kept.family == SEARCH_INTERVAL || kept.family == SEARCH_INTERVAL_SINCE);
  assert_int_equal(kept.feature[0], 0);
  assert_true(kept.score > STANDS && fabs((double)kept.shift - 4.0) < 3.0 * (double)kept.sd);
}

static bool changes(const search_hypothesis *h) {
  static uint8_t before[sizeof b.memory];
  memcpy(before, b.memory, sizeof before);
  rimi_search_let_go(b.search, h);
  return memcmp(before, b.memory, sizeof before) != 0;
}

static void only_what_leaves_inside_is_let_go(void **state) {
  (void)state;
  const world w = shifted(1, 4.0, 0);
  search_hypothesis h = {.family = SEARCH_SINCE, .onset = 0};
  start(&b, &w, RING);
  feed(&b, 0, RING - 1, 0);
  assert_false(changes(&h)); /* nothing leaves a ring that is not full */
  feed(&b, RING - 1, RING, 0);
  h.onset = 2;
  assert_false(changes(&h)); /* 0 leaves, and leads to 1: both are before the onset */
  h.onset = 1;
  h.family = SEARCH_FIELD;
  assert_false(changes(&h)); /* it is about the effects themselves */
  h.family = SEARCH_SINCE;
  assert_true(changes(&h));
  feed(&b, RING, RING + 1, 0);
  h.family = SEARCH_DURING;
  h.end = 1;
  assert_false(changes(&h)); /* 1 leaves: after the end */
  h.end = 2;
  assert_true(changes(&h)); /* the innovation of 2 takes 1, which is inside */
  feed(&b, RING + 1, RING + 2, 0);
  for (uint8_t shape = SEARCH_CONSTANT; shape <= SEARCH_KEPT; ++shape) {
    h = (search_hypothesis){.family = SEARCH_INTERVAL_SINCE, .shape = shape, .first = {1}};
    assert_int_equal(changes(&h), shape == SEARCH_KEPT); /* none is inside, yet all deviate */
  }
}

/* One block that was taken and let go, and the effects are those of the others. */
static void what_is_let_go_has_taught_nothing(void **state) {
  (void)state;
  double l[2][NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], effects[2][NOISE_MAX_FIELDS];
  for (uint32_t twice = 0; twice < 2; ++twice) {
    world w = make_world(true, 0.0, 0.0);
    draw(&w, RING + 1, 3);
    w.unknown[1] = twice == 1;
    start(&b, &w, RING);
    feed(&b, 0, RING, 0);
    const search_hypothesis h = {.family = SEARCH_SINCE, .onset = 1};
    if (twice == 0)
      rimi_search_let_go(b.search, &h);
    feed(&b, RING, RING + 1, 0);
    const noise_channel c = rimi_noise_channel(&b.noise, 0);
    rimi_search_effects(b.search, &c, l[twice], effects[twice]);
  }
  for (uint32_t k = 0; k < FIELDS; ++k)
    assert_true(fabs(effects[0][k] - effects[1][k]) < 1e-4);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_lasting_shift_keeps_its_size),
      cmocka_unit_test(a_lasting_shift_in_a_region_keeps_its_size),
      cmocka_unit_test(only_what_leaves_inside_is_let_go),
      cmocka_unit_test(what_is_let_go_has_taught_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
