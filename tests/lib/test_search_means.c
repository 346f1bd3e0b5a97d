/* SPDX-License-Identifier: MIT */
/* The search with as many means of the commands and run effects as there is room for: a block keeps
 * each mean, and a deviation is found, dated and placed as with few. */
#define BENCH_MEANS 8
#define BENCH_FIELDS 6
#include "search_bench.h"

enum { BLOCKS = 24 };

static void every_mean_is_kept(void **state) {
  (void)state;
  world w = make_world(true, 0.4, 0.0);
  draw(&w, BLOCKS, 1);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    for (uint32_t m = 0; m < MEANS; ++m)
      w.mean[i][m] = 0.1 * i - 0.5 * (double)m;
  }
  assert_int_equal(RAW, NOISE_MAX_RAW);
  static bench b;
  start(&b, &w, RING);
  feed(&b, 0, BLOCKS, 0);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    for (uint32_t m = 0; m < MEANS; ++m) {
      const double kept = (double)search_means(b.search, i)[m] * SEARCH_BYTE_STEP;
      assert_true(fabs(kept - w.mean[i][m]) <= 0.5 * SEARCH_BYTE_STEP + 1e-9);
    }
  }
}

static void a_step_is_found_beside_all_effects(void **state) {
  (void)state;
  enum { ONSET = 70, LONG = 140 };
  world w = make_world(true, 0.4, 0.0);
  draw(&w, LONG, 2);
  for (uint32_t i = ONSET; i < LONG; ++i)
    w.r[i] += 6.0 * w.s;
  assert_int_equal(FIELDS, NOISE_MAX_FIELDS);
  static bench b;
  start(&b, &w, MOST_BLOCKS);
  feed(&b, 0, LONG, 0);
  rimi_search_work(b.search, 200);
  search_hypothesis found;
  double onset_sd;
  rimi_search_explain(b.search, 0, &found, &onset_sd);
  assert_true(found.score > 20.0f && found.onset + 2 >= ONSET && found.onset <= ONSET + 2);
  assert_true(fabs((double)found.shift - 6.0) < 4.0 * (double)found.sd);
  assert_true(onset_sd < 3.0);
}

/* What is asked of a deviation takes every effect along and none beyond: a run that is off but in a
 * region, or in one, what came and went, and a gain. */
static void every_question_takes_all_effects(void **state) {
  (void)state;
  enum { LONG = 140, EDGE = 160, EDGE_BIN = EDGE * SEARCH_BINS / 256 };
  static bench b;
  for (uint32_t kind = 0; kind < 4; ++kind) {
    world w = make_world(true, 0.4, 0.31);
    draw(&w, LONG, 3);
    for (uint32_t i = 0; i < LONG; ++i) {
      const bool inside = kind < 2 ? w.feature[i][0] >= EDGE : i >= 40 && i < 80;
      w.r[i] += (inside == (kind != 0) ? 9.0 : 0.0) * w.s * (kind == 3 ? w.p[i] : 1.0);
    }
    start(&b, &w, MOST_BLOCKS);
    feed(&b, 0, LONG, 4);
    search_hypothesis found, beside, passed;
    double onset_sd = -1.0;
    rimi_search_explain(b.search, 0, &found, &onset_sd);
    assert_true(found.score > 20.0f && onset_sd >= 0.0);
    search_hypothesis h = {.family = SEARCH_INTERVAL,
                           .first = {EDGE_BIN},
                           .last = {SEARCH_BINS - 1},
                           .onset = SEARCH_FROM_START};
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
    assert_true(rimi_search_beside(b.search, 0, &h, &beside));
    (void)rimi_search_passed(b.search, 0, NULL, &passed);
    const bool turned = rimi_search_against_nominal(b.search, 0, &h, false, &onset_sd);
    if (kind < 2)
      assert_int_equal(turned, kind == 0);
  }
}

/* The least and the most of each are taken, and no more. */
static void the_ends_of_a_configuration(void **state) {
  (void)state;
  const world w = make_world(true, 0.4, 0.0);
  static bench b;
  start(&b, &w, RING);
  const search_config good = b.config;
  static const uint32_t channels[3] = {1, SEARCH_MAX_CHANNELS, SEARCH_MAX_CHANNELS + 1};
  static const uint32_t features[3] = {1, SEARCH_MAX_FEATURES, SEARCH_MAX_FEATURES + 1};
  static const uint32_t rings[3] = {8, SEARCH_MAX_RING, SEARCH_MAX_RING + 1};
  for (size_t i = 0; i < 3; ++i) {
    rim_noise noise = *good.noise;
    search_config c = good;
    c.noise = &noise;
    noise.channels = channels[i];
    c.channels = (uint16_t)channels[i];
    c.outcomes = c.channels; /* one kind of channel */
    assert_int_equal(rimi_search_size(&c) > 0, i < 2);
    c = good;
    c.features = (uint16_t)features[i];
    assert_int_equal(rimi_search_size(&c) > 0, i < 2);
    c = good;
    c.ring = (uint16_t)rings[i];
    assert_int_equal(rimi_search_size(&c) > 0, i < 2);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_ends_of_a_configuration),
                                     cmocka_unit_test(every_mean_is_kept),
                                     cmocka_unit_test(every_question_takes_all_effects),
                                     cmocka_unit_test(a_step_is_found_beside_all_effects)};
  printf("seed %u\n", SEED);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
