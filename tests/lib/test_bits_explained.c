/* SPDX-License-Identifier: MIT */
/* What a search makes of its best hypothesis keeps its bits (bits.h): search/explain.c, date.c and
 * contrary.c on deviations of every shape in time and place, with and without run effects,
 * autocorrelation and noise that depends on the prediction, and blocks that are missing. */
#include "search_bench.h"

enum { BLOCKS = 150, ONSET = 55, END = 95 };

typedef enum planted {
  NOTHING,
  STEP,
  STEP_AND_RAMP,
  BEND,
  GROWING_GAIN,
  SQUARE,
  SPELL,
  TWO_SPELLS,
  PLACE_AND_TIME,
  REST,
  GAIN_IN_A_PLACE,
  BOX,
  BOX_SINCE,
  FIRST_BLOCKS,
  SPIKE,
  PLANTED
} planted;

/* In the channel's s; age: 0..1 of the run since the onset. */
static double planted_at(const world *w, planted what, uint32_t i) {
  const uint8_t *x = w->feature[i];
  const double age = i < ONSET ? 0.0 : (double)(i - ONSET) / (BLOCKS - ONSET);
  const double p = predicted(w, i) / 3.0, on = i < ONSET ? 0.0 : 1.0;
  switch (what) {
  case STEP:
    return -2.5 * on;
  case STEP_AND_RAMP:
    return on * (2.0 + 9.0 * age);
  case BEND:
    return 2.0 * age + 14.0 * age * age;
  case GROWING_GAIN:
    return -12.0 * age * p;
  case SQUARE:
    return 16.0 * age * age;
  case SPELL:
    return i >= ONSET && i < END ? 2.5 : 0.0;
  case TWO_SPELLS:
    return i >= 20 && i < 50 ? -2.0 : i >= END && i < 125 ? 2.5 : 0.0;
  case PLACE_AND_TIME:
    return x[1] >= 96 && i < END ? 1.6 : 0.0;
  case REST:
    return x[0] >= 160 ? 0.0 : -7.0;
  case GAIN_IN_A_PLACE:
    return x[0] >= 128 ? 2.0 * (p - 1.0) : 0.0;
  case BOX:
    return x[0] >= 112 && x[1] < 144 ? -4.0 : 0.0;
  case BOX_SINCE:
    return x[0] < 144 && x[2] >= 96 ? 4.0 * on : 0.0;
  case FIRST_BLOCKS:
    return i < 25 ? 3.0 : 0.0;
  case SPIKE:
    return i >= ONSET && i < ONSET + 4 ? 9.0 : 0.0;
  default:
    return 0.0;
  }
}

static void take_all(uint64_t *digest, rim_search *search) {
  search_hypothesis h, other;
  double onset_sd = -1.0;
  rimi_search_explain(search, 0, &h, &onset_sd);
  take_hypothesis(digest, &h);
  take_bits(digest, h.shape);
  take_real(digest, onset_sd);
  if (!(h.score > -1e9f))
    return;
  take_real(digest, rimi_search_baseline(search, &h));
  take_real(digest, rimi_search_worth(search, 0, &h));
  take_real(digest, rimi_search_sd_of_onset(search, &h));
  for (int known = 0; known < 2; ++known) {
    other = h;
    take_bits(digest, rimi_search_against_nominal(search, 0, &other, known != 0, &onset_sd));
    take_hypothesis(digest, &other);
    take_real(digest, onset_sd);
  }
  take_bits(digest, rimi_search_beside(search, 0, &h, &other));
  take_hypothesis(digest, &other);
  take_bits(digest, rimi_search_passed(search, 0, NULL, &other));
  take_hypothesis(digest, &other);
  const search_hypothesis since = {.family = SEARCH_SINCE, .onset = ONSET};
  take_bits(digest, rimi_search_passed(search, 0, &since, &other));
  take_hypothesis(digest, &other);
}

static uint64_t explained(planted what, uint32_t variant) {
  static bench b;
  uint64_t digest = BITS_START;
  world w = make_world((variant & 1) != 0, (variant & 2) != 0 ? 0.5 : 0.0,
                       (variant & 4) != 0 ? 0.3 : 0.0);
  w.phi = (variant & 1) != 0 ? 1.3f : 1.0f;
  draw(&w, BLOCKS, 40u + variant);
  if (what == REST || what == GAIN_IN_A_PLACE)
    for (uint32_t i = 0; i < BLOCKS; ++i)
      w.r[i] *= 0.3;
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    w.r[i] += w.s * planted_at(&w, what, i);
    w.unknown[i] = variant == 5 && i % 17 == 9;
  }
  start(&b, &w, variant == 3 ? 100 : BLOCKS);
  for (uint32_t i = 0; i < BLOCKS; ++i) {
    feed(&b, i, i + 1, TURN);
    if (i % 50 == 49 && i > 60)
      take_all(&digest, b.search);
  }
  return digest;
}

static void what_is_explained_keeps_its_bits(void **state) {
  (void)state;
  static const uint64_t expected[PLANTED] = {
      UINT64_C(0xa89ed94accc09caa), UINT64_C(0xae43c17f72f8b002), UINT64_C(0xdbad70413c7647a2),
      UINT64_C(0x427d9d752b5cc15d), UINT64_C(0xcdb1495b497153d1), UINT64_C(0xad383b0d329a2443),
      UINT64_C(0xcd933adb99a66b04), UINT64_C(0x29963a64cd472e95), UINT64_C(0x839ecfd1c63dbf5a),
      UINT64_C(0x1549688291af9dbd), UINT64_C(0xf747bf40c8383ff7), UINT64_C(0x3e3484eadef53f41),
      UINT64_C(0xd6dac3a45a6ab3da), UINT64_C(0xe17e76582fbba590), UINT64_C(0xa466f3e53d131304)};
  for (int what = NOTHING; what < PLANTED; ++what) {
    uint64_t digest = BITS_START;
    for (uint32_t variant = 0; variant < 8; ++variant)
      take_bits(&digest, explained((planted)what, variant));
    print_message("planted %d: %016llx\n", what, (unsigned long long)digest);
    bits_are(digest, expected[what]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_is_explained_keeps_its_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
