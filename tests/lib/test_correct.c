/* SPDX-License-Identifier: MIT */
/* The corrected model against numbers worked out by hand; its bytes against damage. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/ellipsoid.h"
#include "base/rng.h"
#include "image/correct.h"

#define SEED 47u
enum { F = 4, O = 2, R = 3, BYTES = RIM_CORRECT_BYTES(O, R) };

static uint64_t words[BYTES / 8 + 2];
static uint8_t *const bytes = (uint8_t *)words;
static rim_correct_region region[R];
static const double shift[R * O] = {1.0, 0.0, -2.0, 3.0, 0.5, 0.25};

static void near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

/* 0: an ellipse over features 1 and 3; 1: an interval of 1 that overlaps it; 2: a box that wraps.
 */
static rim_correct_model model(rim_overlap overlap) {
  const uint16_t pair[2] = {1, 3};
  const uint16_t one[1] = {1};
  const double low[2] = {0.0, 0.0};
  const double high[2] = {2.0, 4.0};
  const double from[1] = {1.5};
  const double to[1] = {3.0};
  memset(region, 0, sizeof region);
  assert_int_equal(rimi_region_from_box(&region[0].region, 2, pair, low, high), RIM_OK);
  assert_int_equal(rimi_region_from_box(&region[1].region, 1, one, from, to), RIM_OK);
  region[2].is_box = true;
  region[2].region.dims = 1;
  region[2].region.feature[0] = 2;
  region[2].region.lower[0] = 3.0; /* an angle, through pi */
  region[2].region.upper[0] = -3.0;
  region[0].confidence = 0.75;
  region[1].confidence = 0.5;
  region[2].confidence = 1.0;
  const rim_correct_model m = {.features = F,
                               .outcomes = O,
                               .regions = R,
                               .overlap = overlap,
                               .kinds = 1,
                               .region = region,
                               .shift = shift};
  return m;
}

static rim_correct opened(rim_overlap overlap) {
  const rim_correct_model m = model(overlap);
  rim_correct c = {0};
  memset(words, 0xff, sizeof words); /* no numbers */
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_OK);
  for (size_t i = BYTES; i < sizeof words; ++i) /* nothing beyond the section is written */
    assert_int_equal(bytes[i], 0xff);
  assert_int_equal(rimi_correct_open(&c, bytes, BYTES), RIM_OK);
  assert_int_equal(c.kinds, 1);
  return c;
}

static const double outside[F] = {9.0, -1.0, 0.0, 9.0};
static const double in_0[F] = {9.0, 1.0, 0.0, 2.0};
static const double in_0_and_1[F] = {9.0, 1.6, 0.0, 2.0};
static const double in_2[F] = {9.0, -1.0, -3.1, 9.0};
static const double in_all[F] = {9.0, 1.6, 3.1, 2.0};
static const double nominal[O] = {10.0, 20.0};

static void mean_is(const rim_correct *c, const double *x, double a, double b) {
  double mean[O];
  assert_int_equal(rimi_correct_mean(c, x, nominal, mean), RIM_OK);
  near(mean[0], a, 1e-15 * 32);
  near(mean[1], b, 1e-15 * 32);
}

/* Eq. 3.30: mu + delta P inside, mu elsewhere. */
static void means(void **state) {
  (void)state;
  for (int overlap = RIM_OVERLAP_FIRST; overlap <= RIM_OVERLAP_SUM; ++overlap) {
    const rim_correct c = opened((rim_overlap)overlap);
    mean_is(&c, outside, 10.0, 20.0);
    mean_is(&c, in_0, 10.0 + 0.75 * 1.0, 20.0);
    mean_is(&c, in_2, 10.0 + 0.5, 20.0 + 0.25);
  }
}

static void overlaps(void **state) {
  (void)state;
  rim_correct c = opened(RIM_OVERLAP_FIRST);
  mean_is(&c, in_0_and_1, 10.75, 20.0);
  c = opened(RIM_OVERLAP_SUM);
  mean_is(&c, in_0_and_1, 10.0 + 0.75 - 0.5 * 2.0, 20.0 + 0.5 * 3.0);
  mean_is(&c, in_all, 10.0 + 0.75 - 1.0 + 0.5, 20.0 + 1.5 + 0.25);
  c = opened(RIM_OVERLAP_MIXTURE);
  /* confidences of .75 and .5 exceed 1: scaled to .6 and .4 */
  mean_is(&c, in_0_and_1, 10.0 + 0.6 - 0.8, 20.0 + 1.2);
}

static void a_mean_may_be_written_over(void **state) {
  (void)state;
  const rim_correct c = opened(RIM_OVERLAP_SUM);
  double mean[O] = {10.0, 20.0};
  double apart[O];
  assert_int_equal(rimi_correct_mean(&c, in_all, nominal, apart), RIM_OK);
  assert_int_equal(rimi_correct_mean(&c, in_all, mean, mean), RIM_OK);
  assert_memory_equal(mean, apart, sizeof mean);
}

static void no_regions_are_the_nominal_model(void **state) {
  (void)state;
  const rim_correct_model none = {.features = F, .outcomes = O};
  rim_correct c;
  assert_int_equal(rimi_correct_pack(&none, bytes, RIM_CORRECT_BYTES(O, 0)), RIM_OK);
  assert_int_equal(rimi_correct_open(&c, bytes, RIM_CORRECT_BYTES(O, 0)), RIM_OK);
  mean_is(&c, in_all, 10.0, 20.0);
  const rim_correct_model most = {.features = RIM_CORRECT_MAX_FEATURES, .outcomes = O};
  assert_int_equal(rimi_correct_pack(&most, bytes, RIM_CORRECT_BYTES(O, 0)), RIM_OK);
}

/* The most of each: regions of three features, all of them everywhere, and so many outcomes. */
static void the_most_of_each(void **state) {
  (void)state;
  enum { MOST = RIM_CORRECT_MAX_OUTCOMES, REGIONS = RIM_CORRECT_MAX_REGIONS };
  static uint64_t memory[RIM_CORRECT_BYTES(MOST, REGIONS) / 8];
  static double shifts[REGIONS * MOST];
  const double lower[3] = {-1.0, -1.0, -1.0}, upper[3] = {1.0, 1.0, 1.0};
  const uint16_t feature[3] = {0, 1, 2};
  rim_correct_region all[REGIONS];
  memset(all, 0, sizeof all);
  for (size_t k = 0; k < REGIONS; ++k) {
    assert_int_equal(rimi_region_from_box(&all[k].region, 3, feature, lower, upper), RIM_OK);
    all[k].confidence = 0.5;
    for (size_t o = 0; o < MOST; ++o)
      shifts[k * MOST + o] = (double)(k + o);
  }
  const rim_correct_model m = {.features = 3,
                               .outcomes = MOST,
                               .regions = REGIONS,
                               .overlap = RIM_OVERLAP_MIXTURE,
                               .region = all,
                               .shift = shifts};
  uint8_t *const section = (uint8_t *)memory;
  rim_correct c;
  assert_int_equal(rimi_correct_pack(&m, section, sizeof memory), RIM_OK);
  assert_int_equal(rimi_correct_open(&c, section, sizeof memory), RIM_OK);
  const double x[3] = {0.0, 0.0, 0.0};
  double mean[MOST] = {0.0};
  assert_int_equal(rimi_correct_mean(&c, x, mean, mean), RIM_OK);
  for (size_t o = 0; o < MOST; ++o) /* each counts an eighth: the mean of their shifts */
    near(mean[o], 3.5 + (double)o, 1e-12);
}

/* What the dimensions leave unused, and a region without any confidence, are no fault. */
static void what_is_not_used_is_left_out(void **state) {
  (void)state;
  rim_correct_model m = model(RIM_OVERLAP_SUM);
  static uint8_t clean[BYTES];
  region[1].confidence = 0.0;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_OK);
  memcpy(clean, bytes, BYTES);
  for (size_t i = 1; i < 9; ++i)
    region[1].region.inverse_shape[i] = 7.0; /* one dimension has one number */
  for (size_t i = 1; i < 3; ++i)
    region[1].region.center[i] = region[1].region.lower[i] = region[1].region.upper[i] = 7.0;
  region[1].region.feature[1] = 3;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_OK);
  assert_memory_equal(bytes, clean, BYTES);
  rim_correct c;
  assert_int_equal(rimi_correct_open(&c, bytes, BYTES), RIM_OK);
  mean_is(&c, in_0_and_1, 10.0 + 0.75, 20.0);
}

static void everywhere_and_nowhere(void **state) {
  (void)state;
  rim_correct_region all = {.confidence = 1.0};
  const rim_correct_model m = {
      .features = F, .outcomes = O, .regions = 1, .region = &all, .shift = shift};
  rim_correct c;
  assert_int_equal(rimi_correct_pack(&m, bytes, RIM_CORRECT_BYTES(O, 1)), RIM_OK);
  assert_int_equal(rimi_correct_open(&c, bytes, RIM_CORRECT_BYTES(O, 1)), RIM_OK);
  mean_is(&c, outside, 11.0, 20.0);
  c = opened(RIM_OVERLAP_SUM);
  double nowhere[F] = {9.0, (double)NAN, (double)NAN, 2.0};
  mean_is(&c, nowhere, 10.0, 20.0);
}

/* Every way in which a view can be asked wrongly leaves the answer alone. */
static void bad_questions_are_refused(void **state) {
  (void)state;
  const rim_correct closed = {0};
  const rim_correct c = opened(RIM_OVERLAP_SUM);
  double a[O] = {7.0, 7.0};
  assert_int_equal(rimi_correct_mean(&closed, in_0, nominal, a), RIM_E_ARGUMENT);
  assert_int_equal(rimi_correct_mean(&c, NULL, nominal, a), RIM_E_ARGUMENT);
  assert_true(a[0] == 7.0 && a[1] == 7.0);
}

static void bad_models_are_not_packed(void **state) {
  (void)state;
  rim_correct_model m = model(RIM_OVERLAP_SUM);
  memset(bytes, 0x5a, BYTES);
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES - 1), RIM_E_SIZE);
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES + 1), RIM_E_SIZE);
  assert_int_equal(rimi_correct_pack(NULL, bytes, BYTES), RIM_E_ARGUMENT);
  m.region = NULL;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_ARGUMENT);
  const rim_correct_model bad[] = {
      {.features = 0, .outcomes = O},
      {.features = 129, .outcomes = O},
      {.features = F, .outcomes = 129},
      {.features = F, .outcomes = O, .regions = 9},
      {.features = F, .outcomes = O, .overlap = (rim_overlap)3},
      {.features = F, .outcomes = O, .kinds = 32},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
    assert_int_equal(rimi_correct_pack(&bad[i], bytes, BYTES), RIM_E_RANGE);
  m = model(RIM_OVERLAP_SUM);
  region[0].confidence = 1.1;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_DATA);
  m = model(RIM_OVERLAP_SUM);
  region[0].region.feature[1] = F;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_RANGE);
  m = model(RIM_OVERLAP_SUM);
  region[0].region.dims = 4;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_RANGE);
  m = model(RIM_OVERLAP_SUM);
  region[0].region.inverse_shape[0] = -1.0;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_SINGULAR);
  m = model(RIM_OVERLAP_SUM);
  region[2].region.lower[0] = (double)NAN;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_DATA);
  m = model(RIM_OVERLAP_SUM);
  const double infinite[R * O] = {0.0, (double)INFINITY};
  m.shift = infinite;
  assert_int_equal(rimi_correct_pack(&m, bytes, BYTES), RIM_E_DATA);
  for (size_t i = 0; i < BYTES; ++i)
    assert_int_equal(bytes[i], 0x5a);
}

static void mend_crc(void) {
  uint32_t crc = rimi_crc32(0, bytes, 28);
  crc = rimi_crc32(crc, bytes + 32, BYTES - 32);
  for (size_t i = 0; i < 4; ++i)
    bytes[28 + i] = (uint8_t)(crc >> 8 * i & 255u);
}

/* Any byte changed is noticed; with a mended check sum what it says is still looked at. */
static void damage_is_refused(void **state) {
  (void)state;
  const rim_correct before = {.regions = 77};
  rim_correct c = before;
  for (size_t i = 0; i < BYTES; ++i) {
    (void)opened(RIM_OVERLAP_SUM);
    bytes[i] ^= 0x10;
    assert_int_not_equal(rimi_correct_open(&c, bytes, BYTES), RIM_OK);
  }
  (void)opened(RIM_OVERLAP_SUM);
  for (size_t n = 0; n < BYTES; ++n)
    assert_int_equal(rimi_correct_open(&c, bytes, n), RIM_E_TRUNCATED);
  assert_int_equal(rimi_correct_open(&c, bytes, BYTES + 1), RIM_E_SIZE);
  assert_int_equal(rimi_correct_open(&c, bytes + 1, BYTES), RIM_E_ALIGN);
  assert_int_equal(rimi_correct_open(&c, NULL, BYTES), RIM_E_ARGUMENT);
  bytes[0] = 2;
  mend_crc();
  assert_int_equal(rimi_correct_open(&c, bytes, BYTES), RIM_E_VERSION);
  const struct {
    size_t at;
    uint8_t value;
    rim_status status;
  } bad[] = {
      {8, 0, RIM_E_RANGE},            /* features */
      {12, 0, RIM_E_RANGE},           /* outcomes */
      {12, O - 1, RIM_E_SIZE},        /* fewer than there are */
      {12, O + 1, RIM_E_TRUNCATED},   /* more */
      {16, 9, RIM_E_RANGE},           /* regions */
      {20, 3, RIM_E_RANGE},           /* overlap */
      {24, 32, RIM_E_RANGE},          /* kinds */
      {32, 1, RIM_E_DATA},            /* dims 1, but numbers of a second feature */
      {33, 2, RIM_E_DATA},            /* a box is 0 or 1 */
      {34, 3, RIM_E_RANGE},           /* feature twice */
      {38, 1, RIM_E_DATA},            /* a feature beyond dims */
      {32 + 8 + 7, 0x40, RIM_E_DATA}, /* confidence above 1 */
      {32 + 40 + 7, 0xbf, RIM_E_SINGULAR},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    (void)opened(RIM_OVERLAP_SUM);
    bytes[bad[i].at] = bad[i].value;
    mend_crc();
    assert_int_equal(rimi_correct_open(&c, bytes, BYTES), bad[i].status);
  }
  assert_memory_equal(&c, &before, sizeof c);
}

/* Random bytes behind a right check sum never read outside or return NaN. */
static void any_bytes_are_judged(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  unsigned accepted = 0;
  for (int round = 0; round < 20000; ++round) {
    (void)opened(RIM_OVERLAP_SUM);
    for (int i = 0; i < 2; ++i) {
      const uint32_t at = 8 + rimi_rng_below(&rng, BYTES - 8);
      bytes[at] = (uint8_t)rimi_rng_u32(&rng);
    }
    mend_crc();
    rim_correct c;
    if (rimi_correct_open(&c, bytes, BYTES) != RIM_OK)
      continue;
    ++accepted;
    double mean[O];
    assert_int_equal(rimi_correct_mean(&c, in_all, nominal, mean), RIM_OK);
    assert_true(mean[0] == mean[0] && mean[1] == mean[1]);
  }
  assert_true(accepted > 100);
}

/* In a flight image, in place. */
static void an_image_carries_it(void **state) {
  (void)state;
  enum { AT = 64 + 16, ALL = AT + BYTES };
  static uint64_t memory[ALL / 8 + 1];
  uint8_t *image = (uint8_t *)memory;
  (void)opened(RIM_OVERLAP_SUM);
  memset(memory, 0, sizeof memory);
  memcpy(image, RIM_IMAGE_MAGIC, 8);
  const uint32_t header[] = {RIM_IMAGE_ENDIAN_TAG, RIM_IMAGE_MAJOR, ALL, 5, 1};
  const uint32_t entry[] = {RIM_SECTION_CORRECT, AT, BYTES, R};
  for (size_t i = 0; i < 20; ++i)
    image[8 + i] = (uint8_t)(header[i / 4] >> 8 * (i % 4) & 255u);
  for (size_t i = 0; i < 16; ++i)
    image[64 + i] = (uint8_t)(entry[i / 4] >> 8 * (i % 4) & 255u);
  memcpy(image + AT, bytes, BYTES);
  const uint32_t content = rimi_crc32(0, image + 64, ALL - 64);
  for (size_t i = 0; i < 4; ++i)
    image[28 + i] = (uint8_t)(content >> 8 * i & 255u);
  const uint32_t own = rimi_crc32(0, image, 64);
  for (size_t i = 0; i < 4; ++i)
    image[32 + i] = (uint8_t)(own >> 8 * i & 255u);
  rim_image view;
  assert_int_equal(rim_image_open(&view, image, ALL), RIM_OK);
  rim_correct c = {0};
  const uint8_t *section;
  size_t found;
  assert_int_equal(rim_image_section(&view, RIM_SECTION_CORRECT, &section, &found), RIM_OK);
  assert_int_equal(rimi_correct_open(&c, section, found), RIM_OK);
  assert_ptr_equal(c.section, image + AT);
  mean_is(&c, in_0, 10.75, 20.0);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(means),
                                     cmocka_unit_test(overlaps),
                                     cmocka_unit_test(a_mean_may_be_written_over),
                                     cmocka_unit_test(no_regions_are_the_nominal_model),
                                     cmocka_unit_test(the_most_of_each),
                                     cmocka_unit_test(what_is_not_used_is_left_out),
                                     cmocka_unit_test(everywhere_and_nowhere),
                                     cmocka_unit_test(bad_questions_are_refused),
                                     cmocka_unit_test(bad_models_are_not_packed),
                                     cmocka_unit_test(damage_is_refused),
                                     cmocka_unit_test(any_bytes_are_judged),
                                     cmocka_unit_test(an_image_carries_it)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
