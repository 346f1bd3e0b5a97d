/* SPDX-License-Identifier: MIT */
/* search/contrary.c: how improbable a run's own effects are is as a direct computation says; what
 * reads low everywhere but in a region is not called high in that region; a region that deviates
 * from a baseline as healthy runs have it stays named. */
#include "base/cholesky.h"
#include "search_bench.h"

enum { BLOCKS = 150, EDGE = 160, EDGE_BIN = EDGE * SEARCH_BINS / 256 };

/* Channel 0 without the noise's own run effects: `inside` of a region, and `outside`, in its s. */
static world planted(uint32_t seed, double inside, double outside) {
  world w = make_world(true, 0.0, 0.0);
  draw(&w, BLOCKS, seed);
  for (uint32_t i = 0; i < BLOCKS; ++i)
    w.r[i] += w.s * (w.feature[i][0] >= EDGE ? inside : outside);
  return w;
}

static search_hypothesis region(uint8_t first, uint8_t last) {
  return (search_hypothesis){
      .family = SEARCH_INTERVAL, .first = {first}, .last = {last}, .onset = SEARCH_FROM_START};
}

/* b = (F'F + prior)^-1 F'(z - m shift), and what b'prior b is beyond chance. */
static double direct(const world *w, const search_hypothesis *h) {
  double gram[FIELDS * (FIELDS + 1) / 2] = {0.0}, b[FIELDS] = {0.0};
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    double field[FIELDS];
    fields_of(w, i, field);
    const uint32_t bin = w->feature[i][0] * SEARCH_BINS / 256u;
    const bool inside = bin >= h->first[0] && bin <= h->last[0];
    const double z = residual_of(w, i) / w->s - (inside ? (double)h->shift : 0.0);
    for (uint32_t k = 0, at = 0; k < FIELDS; ++k) {
      b[k] += field[k] * z;
      for (uint32_t j = 0; j <= k; ++j, ++at)
        gram[at] += field[k] * field[j] + (j == k && i == 0 ? 1.0 / w->prior[k] : 0.0);
    }
  }
  assert_true(cholesky_factor(FIELDS, gram));
  cholesky_forward(FIELDS, gram, b);
  cholesky_backward(FIELDS, gram, b);
  double q = 0.0;
  for (uint32_t k = 0; k < FIELDS; ++k)
    q += b[k] * b[k] / w->prior[k];
  /* The tail of a chi-square of 3 degrees: erfc(sqrt(q / 2)) + sqrt(2 q / pi) exp(-q / 2). */
  const double tail = erfc(sqrt(0.5 * q)) + sqrt(2.0 * q / RIM_PI) * exp(-0.5 * q);
  return q > FIELDS ? -log(tail) / (double)w->phi : 0.0;
}

static void a_baseline_is_as_improbable_as_its_effects(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    world w = planted(seed, seed % 2 == 0 ? 0.0 : 9.0, seed % 3 == 0 ? 0.0 : -9.0);
    w.phi = seed < 4 ? 1.0f : 2.5f;
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
    const double expected = direct(&w, &h);
    assert_true(fabs(rimi_search_baseline(b.search, &h) - expected) < 0.05 + 0.02 * expected);
    h.family = SEARCH_FIELD; /* says itself that the effects are impossible */
    assert_true(rimi_search_baseline(b.search, &h) == 0.0);
  }
}

/* One effect is enough to be impossible. */
static void one_effect_is_enough(void **state) {
  (void)state;
  static bench b;
  const world w = far_off(BLOCKS);
  start(&b, &w, BLOCKS);
  feed(&b, 0, BLOCKS, 0);
  search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
  assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
  assert_true(rimi_search_baseline(b.search, &h) > 2.0);
}

static void what_reads_low_elsewhere_is_not_high_here(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    const double sign = seed % 2 == 0 ? 1.0 : -1.0;
    const world w = planted(seed, 0.0, -9.0 * sign);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, TURN);
    search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h) && sign * (double)h.shift > 5.0);
    double onset_sd = -1.0;
    assert_true(rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd));
    assert_true(h.onset == SEARCH_FROM_START ? onset_sd == 0.0 : onset_sd > 0.0);
    assert_true(sign * (double)h.shift < -5.0);
    if (h.family == SEARCH_INTERVAL)
      assert_true(h.feature[0] == 0 && h.first[0] == 0 && h.last[0] + 2 >= EDGE_BIN);
    assert_false(
        rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd)); /* and so it stays */
  }
}

static void what_deviates_from_a_healthy_baseline_stays(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    const world w = planted(seed, 9.0, 0.0);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, TURN);
    search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
    const search_hypothesis before = h;
    double onset_sd = -1.0;
    assert_false(rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd));
    assert_memory_equal(&h, &before, sizeof h);
    assert_true(onset_sd == -1.0);
  }
}

/* A turn over one feature has no pairs: six units, as its stages are. */
static void one_feature_has_no_pairs(void **state) {
  (void)state;
  static bench b;
  const world w = planted(1, 9.0, 0.0);
  start(&b, &w, BLOCKS);
  search_config one = b.config;
  one.features = 1;
  assert_int_equal(rimi_search_init(&b.search, b.memory, sizeof b.memory, &one), RIM_OK);
  feed(&b, 0, BLOCKS, 0);
  for (int turn = 0; turn < 3; ++turn) {
    uint32_t units = 0;
    do {
      rimi_search_work(b.search, 1);
      ++units;
    } while (b.search->stage != 0 && units < 99);
    assert_int_equal(units, 6);
  }
}

/* What is looked at first is forgotten too. */
static void a_reset_forgets_what_was_best(void **state) {
  (void)state;
  static bench b;
  const world w = planted(1, 9.0, 0.0);
  start(&b, &w, BLOCKS);
  feed(&b, 0, BLOCKS, TURN);
  uint32_t before = 0, after = 0;
  for (size_t i = 0; i < (size_t)CHANNELS * FEATURES; ++i)
    before += search_feature_scores(b.search, 0)[i];
  rimi_search_reset(b.search);
  for (size_t i = 0; i < (size_t)CHANNELS * FEATURES; ++i)
    after += search_feature_scores(b.search, 0)[i];
  assert_true(before > 0 && after == 0);
}

/* A run in which the rest is off, and the region that seems to be. */
static search_hypothesis of_rest(bench *b) {
  const world w = planted(0, 0.0, -9.0);
  start(b, &w, BLOCKS);
  feed(b, 0, BLOCKS, TURN);
  search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
  assert_true(rimi_search_evaluate_channel(b->search, 0, &h));
  return h;
}

/* A gain and impossible effects are no shift: they have no contrary, however far off the run is. */
static void what_is_no_shift_has_no_contrary(void **state) {
  (void)state;
  static bench b;
  const search_hypothesis h = of_rest(&b);
  const uint8_t family[3] = {SEARCH_GAIN, SEARCH_FIELD, SEARCH_INTERVAL};
  for (size_t i = 0; i < 3; ++i) {
    search_hypothesis one = h;
    one.family = family[i];
    const search_hypothesis before = one;
    double onset_sd = -1.0;
    const bool changed = rimi_search_against_nominal(b.search, 0, &one, false, &onset_sd);
    assert_int_equal(changed, family[i] == SEARCH_INTERVAL);
    if (!changed)
      assert_memory_equal(&one, &before, sizeof one);
  }
}

/* The same of gains: what reads a share low outside a region is no gain inside. */
static void a_gain_of_the_rest_is_no_gain_here(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    world w = make_world(true, 0.0, 0.0);
    for (uint32_t k = 0; k < FIELDS; ++k)
      w.prior[k] *= 0.3;
    draw(&w, BLOCKS, seed);
    const double sign = seed % 2 == 0 ? 1.0 : -1.0;
    for (uint32_t i = 0; i < BLOCKS; ++i)
      w.r[i] -= sign * 0.1 * (w.feature[i][0] < EDGE ? predicted(&w, i) : 0.0);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, TURN);
    search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
    h.shape = SEARCH_PROPORTIONAL;
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h) && sign * (double)h.shift > 0.03);
    double onset_sd = -1.0;
    assert_true(rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd));
    assert_true(h.shape == SEARCH_PROPORTIONAL && h.family == SEARCH_INTERVAL && onset_sd == 0.0);
    assert_true(fabs((double)h.shift + sign * 0.1) < 0.03);
    assert_true(h.feature[0] == 0 && h.first[0] <= 1 && h.last[0] + 2 >= EDGE_BIN);
    assert_false(rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd));
  }
}

/* A sign that was said is turned where the baseline is more improbable, by a twentieth of its
 * score, than it must be otherwise (2 nats). */
static void what_was_said_first_needs_more(void **state) {
  (void)state;
  static bench b;
  const search_hypothesis h = of_rest(&b);
  const double just = 20.0 * (rimi_search_baseline(b.search, &h) - 2.0);
  assert_true(just > 1.0);
  for (uint32_t i = 0; i < 4; ++i) {
    search_hypothesis said = h;
    said.score = (float)((i % 2 == 0 ? 1.02 : 0.98) * just);
    const bool is_known = i < 2;
    double onset_sd = -1.0;
    const bool turned = rimi_search_against_nominal(b.search, 0, &said, is_known, &onset_sd);
    assert_int_equal(turned, !is_known || i == 1);
  }
}

/* Both sides of the edge are off, by `inside` and `outside`: what says so, and their baselines. */
typedef struct two_sides {
  search_hypothesis h, rest;
  double nats, left;
} two_sides;

static two_sides both_off(bench *b, uint32_t seed, double inside, double outside) {
  const world w = planted(seed, inside, outside);
  start(b, &w, BLOCKS);
  feed(b, 0, BLOCKS, TURN);
  two_sides both = {region(EDGE_BIN, SEARCH_BINS - 1), region(0, EDGE_BIN - 1), 0.0, 0.0};
  assert_true(rimi_search_evaluate_channel(b->search, 0, &both.rest) && both.rest.shift < 0.0f);
  assert_true(rimi_search_evaluate_channel(b->search, 0, &both.h) && both.h.shift > 0.0f);
  both.nats = rimi_search_baseline(b->search, &both.h);
  both.left = rimi_search_baseline(b->search, &both.rest);
  return both;
}

/* Both are off by as much, so that their baselines are alike: the ratio alone, which differs by
 * shapes too, turns no sign. */
static void ratios_alone_turn_no_sign(void **state) {
  (void)state;
  static bench b;
  uint32_t cases = 0;
  for (uint32_t seed = 0; seed < 96; ++seed) {
    const two_sides both = both_off(&b, seed, 7.5, -7.5);
    if (!(both.left < both.nats && both.left > both.nats - 1.5))
      continue; /* the noise of this run made it another case */
    ++cases;
    search_hypothesis said = both.h;
    double onset_sd;
    said.score = both.rest.score - 20.0f;
    assert_false(rimi_search_against_nominal(b.search, 0, &said, false, &onset_sd));
    assert_true(said.shift > 0.0f);
  }
  assert_true(cases > 2);
}

/* Both are off, the rest by more, so that neither leaves a baseline as healthy runs have it: the
 * one that is clearly likelier with its baseline counted is said, but not against a sign that was
 * said well. */
static void the_likelier_of_two_baselines_is_said(void **state) {
  (void)state;
  static bench b;
  uint32_t cases = 0;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    const two_sides both = both_off(&b, seed, 6.0, -9.0);
    if (both.left < 0.35 * both.nats ||
        both.rest.score - both.left < both.h.score - both.nats + 5.0)
      continue; /* the noise of this run made it another case */
    ++cases;
    for (int is_known = 0; is_known < 2; ++is_known) {
      search_hypothesis said = both.h;
      double onset_sd;
      if (is_known) /* small enough for its baseline to be looked at */
        said.score = (float)rimi_min((double)both.h.score, 19.0 * (both.nats - 2.0));
      const bool turned = rimi_search_against_nominal(b.search, 0, &said, is_known, &onset_sd);
      assert_int_equal(turned, !is_known);
      assert_true(turned ? said.shift < 0.0f : said.shift > 0.0f);
    }
  }
  assert_true(cases > 3);
}

/* Where the search has found no region yet, what lies beside is looked for all the same; where a
 * region takes in everything, nothing does. */
static void a_contrary_without_a_region(void **state) {
  (void)state;
  static bench b;
  const world w = planted(2, 0.0, -9.0);
  start(&b, &w, BLOCKS);
  feed(&b, 0, BLOCKS, 0);
  search_state(b.search, 0)->region.score = SEARCH_NONE;
  search_hypothesis h = region(EDGE_BIN, SEARCH_BINS - 1);
  assert_true(rimi_search_evaluate_channel(b.search, 0, &h) && h.shift > 0.0f);
  double onset_sd = -1.0;
  search_state(b.search, 0)->region.score = SEARCH_NONE;
  assert_true(rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd));
  assert_true(h.shift < 0.0f && h.family == SEARCH_INTERVAL && onset_sd == 0.0);
  assert_true(h.first[0] == 0 && h.last[0] + 2 >= EDGE_BIN);
  search_hypothesis all = region(0, SEARCH_BINS - 1), beside;
  assert_false(rimi_search_beside(b.search, 0, &all, &beside));
}

/* Refining its edges must not lead back to where the search came from. */
static void what_lies_beside_is_not_the_region_again(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    const world w = planted(seed, -2.0, 7.0);
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    search_hypothesis h = region(0, EDGE_BIN - 1), beside;
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h) && h.shift > 0.0f);
    assert_true(rimi_search_beside(b.search, 0, &h, &beside));
    assert_true(beside.shift < 0.0f && beside.first[0] + 1 >= EDGE_BIN);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_baseline_is_as_improbable_as_its_effects),
      cmocka_unit_test(one_effect_is_enough),
      cmocka_unit_test(what_reads_low_elsewhere_is_not_high_here),
      cmocka_unit_test(what_deviates_from_a_healthy_baseline_stays),
      cmocka_unit_test(a_reset_forgets_what_was_best),
      cmocka_unit_test(one_feature_has_no_pairs),
      cmocka_unit_test(what_is_no_shift_has_no_contrary),
      cmocka_unit_test(a_gain_of_the_rest_is_no_gain_here),
      cmocka_unit_test(the_likelier_of_two_baselines_is_said),
      cmocka_unit_test(ratios_alone_turn_no_sign),
      cmocka_unit_test(what_was_said_first_needs_more),
      cmocka_unit_test(a_contrary_without_a_region),
      cmocka_unit_test(what_lies_beside_is_not_the_region_again),
  };
  printf("seed %u\n", SEED);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
