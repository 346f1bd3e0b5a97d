/* SPDX-License-Identifier: MIT */
/* The search for deviations of a trained monitor (search/search.c, statistic.c, scan.c) keeps its
 * bits (bits.h): every family's hypotheses while a run goes on, with run effects, unknown blocks,
 * gaps, changing noise and an exclusion. How an alarm is described and dated is not held here. */
#include "search_bench.h"

/* What is planted in a run of noise. */
typedef enum planted { NOTHING, STEP, SLOPE, PLACE, BOX, PLACE_SINCE, SPELL, PLANTED } planted;

static double planted_at(const world *w, planted what, uint32_t i) {
  const uint8_t *x = w->feature[i];
  switch (what) {
  case STEP:
    return i >= 60 ? 2.0 : 0.0;
  case SLOPE:
    return i >= 40 ? 0.06 * (i - 40u) : 0.0;
  case PLACE:
    return x[1] < 90 ? -2.0 : 0.0;
  case BOX:
    return x[0] > 100 && x[2] < 150 ? 2.2 : 0.0;
  case PLACE_SINCE:
    return i >= 70 && x[2] >= 128 ? 2.5 : 0.0;
  case SPELL:
    return i >= 60 && i < 85 ? -2.5 : 0.0;
  default:
    return 0.0;
  }
}

/* Questions about hypotheses of every family. */
static void take_questions(uint64_t *digest, rim_search *search, const world *w) {
  for (uint32_t family = SEARCH_SINCE; family <= SEARCH_DURING; ++family) {
    search_hypothesis h = {.family = (uint8_t)family, .onset = SEARCH_FROM_START}, beside;
    h.first[0] = 4;
    h.last[0] = 11;
    h.feature[1] = 2;
    h.first[1] = 0;
    h.last[1] = 15;
    if (family == SEARCH_SINCE || family == SEARCH_RAMP || family == SEARCH_INTERVAL_SINCE ||
        family == SEARCH_BOX_SINCE || family == SEARCH_DURING)
      h.onset = 110;
    h.end = 125;
    take_bits(digest, rimi_search_evaluate_channel(search, 0, &h));
    take_hypothesis(digest, &h);
    take_bits(digest, rimi_search_first_inside(search, &h));
    take_bits(digest, rimi_search_beside(search, 0, &h, &beside));
    take_hypothesis(digest, &beside);
    for (uint32_t i = 90; i < 140; i += 7)
      take_bits(digest, rimi_search_inside(search, &h, w->feature[i], i));
    take_real(digest, rimi_search_description((search_family)family));
  }
  for (uint32_t f = 0; f < FEATURES; ++f) {
    uint32_t low, high;
    rimi_search_edges(search, f, 3, 3 + 4 * f, &low, &high);
    take_bits(digest, (uint64_t)low << 32 | high);
  }
}

static uint64_t search_of(planted what, bool effects, uint16_t ring, uint32_t seed) {
  static bench b;
  static float maxima[CHANNELS * NOISE_FAMILIES];
  uint64_t digest = BITS_START;
  world w = make_world(effects, effects ? 0.3 : 0.0, effects ? 0.2 : 0.0);
  draw(&w, 140, seed);
  for (uint32_t i = 0; i < w.blocks; ++i) {
    w.r[i] += w.s * planted_at(&w, what, i);
    w.unknown[i] = effects && i % 37 == 20;
  }
  memset(&b, 0, sizeof b);
  memset(maxima, 0, sizeof maxima);
  start(&b, &w, ring);
  rimi_search_keep_maxima(b.search, maxima);
  for (uint32_t i = 0; i < w.blocks; ++i) {
    double outcome[CHANNELS], residual[CHANNELS];
    search_block block = block_of(&w, i, outcome, residual);
    residual[OUTCOMES] = 0.5 * residual[0] + 0.1 * (double)(i % 5);
    residual[2 * OUTCOMES] = i % 11 == 3 ? 1.5 : -0.2;
    block.apart = i == 50;
    block.disturbance = i % 9 == 0 ? 0.7 : 0.0;
    assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
    rimi_search_work(b.search, 5);
    if (i == 100 && what == SPELL)
      take_bits(&digest, rimi_search_exclude(b.search, 60, 85));
    if (i % 6 != 5)
      continue;
    for (uint32_t c = 0; c < CHANNELS; ++c)
      take_hypothesis(&digest, rimi_search_best(b.search, c));
    take_bits(&digest, (uint64_t)rimi_search_blocks(b.search) << 32 | rimi_search_oldest(b.search));
    take_bits(&digest, rimi_search_held(b.search));
    take_real(&digest, rimi_search_time_of(b.search, i / 2));
    take_bits(&digest, rimi_search_indices_hold(b.search));
  }
  for (size_t i = 0; i < sizeof maxima / sizeof *maxima; ++i)
    take_real(&digest, (double)maxima[i]);
  take_questions(&digest, b.search, &w);
  return digest;
}

static void every_family_keeps_its_bits(void **state) {
  (void)state;
  static const uint64_t expected[PLANTED] = {
      UINT64_C(0xaa03e2707599b2e7), UINT64_C(0xbaedc7d8b64cd92b), UINT64_C(0x255989db2d126105),
      UINT64_C(0x52ae3f2fd699a681), UINT64_C(0xc443283321bc685f), UINT64_C(0xdcc82fe85a8ba5c2),
      UINT64_C(0xc76e6d024ce36384)};
  for (int what = NOTHING; what < PLANTED; ++what) {
    uint64_t digest = BITS_START;
    for (int effects = 0; effects < 2; ++effects)
      for (uint32_t seed = 0; seed < 2; ++seed)
        take_bits(&digest, search_of((planted)what, effects != 0, seed == 0 ? RING : 100, seed));
    print_message("planted %d\n", what);
    bits_are(digest, expected[what]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_family_keeps_its_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
