/* SPDX-License-Identifier: MIT */
/* noise: the section is refused in every damaged form; what a channel says is read back. */
#include <math.h>

#include "base/bytes.h"
#include "image/noise.h"
#include "rim/image.h"
#include "section_bytes.h"

enum { CHANNELS = 3, MEANS = 2, RAW = NOISE_RAW_FIRST + MEANS, FIELDS = 2 };
enum { STRIDE = NOISE_CHANNEL_WORDS + FIELDS * (1 + RAW) + NOISE_FAMILIES };

enum { RHO_RISE = 7 + NOISE_SIGMA_TERMS };

static double number(uint32_t channel, uint32_t word) {
  return word == RHO_RISE ? 0.125 : 1.0 + 0.01 * word + channel;
}

static bytes section(void) {
  bytes b = {.size = 0};
  const uint32_t header[4] = {NOISE_LAYOUT, CHANNELS, RAW, FIELDS};
  for (size_t i = 0; i < 4; ++i)
    u32(&b, header[i]);
  const double rest[5] = {100.0, 10.0, 1000.0, 0.0, -1.5};
  for (size_t i = 0; i < 5; ++i)
    f32(&b, rest[i]);
  for (uint32_t c = 0; c < CHANNELS; ++c) {
    for (uint32_t i = 0; i < STRIDE; ++i)
      f32(&b, i == 0 ? 1.0 : i == 1 ? c : i == 2 ? 0.25 * c : number(c, i));
  }
  return b;
}

static uint8_t *word_of(bytes *b, uint32_t channel, uint32_t word) {
  return b->byte + 4 * (NOISE_HEADER_WORDS + channel * STRIDE + word);
}

static rim_status status_of(const bytes *b) {
  rim_noise view, before;
  memset(&view, 0x5a, sizeof view);
  before = view;
  const rim_status status = rimi_noise_open(&view, b->byte, b->size, CHANNELS, MEANS);
  if (status != RIM_OK)
    assert_memory_equal(&view, &before, sizeof view);
  return status;
}

static void numbers_are_read_back(void **state) {
  (void)state;
  const bytes b = section();
  rim_noise view;
  assert_int_equal(rimi_noise_open(&view, b.byte, b.size, CHANNELS, MEANS), RIM_OK);
  assert_true(view.channels == CHANNELS && view.raw == RAW && view.fields == FIELDS);
  assert_true(view.run_s == 100.0 && view.decay_s == 10.0 && view.trend_s == 1000.0);
  assert_true(view.activity == -1.5);
  for (uint32_t c = 0; c < CHANNELS; ++c) {
    const noise_channel n = rimi_noise_channel(&view, c);
    assert_true(n.active == 1.0f && n.fields == c && n.rho == 0.25f * (float)c);
    assert_true(n.s == (float)number(c, 3) && n.p_center == (float)number(c, 4));
    assert_true(n.p_scale == (float)number(c, 5));
    for (uint32_t i = 0; i < NOISE_SIGMA_TERMS; ++i)
      assert_true(n.ln_sigma[i] == (float)number(c, 6 + i));
    assert_true(n.mean == (float)number(c, 6 + NOISE_SIGMA_TERMS));
    assert_true(rimi_noise_rho(&n, false) == 0.25 * c);
    assert_true(rimi_noise_rho(&n, true) == 0.25 * c + 0.125);
    uint32_t at = NOISE_CHANNEL_WORDS;
    for (uint32_t i = 0; i < FIELDS; ++i)
      assert_true(rimi_le_f32(n.inverse_prior, i) == (float)number(c, at++));
    for (uint32_t i = 0; i < FIELDS * RAW; ++i)
      assert_true(rimi_le_f32(n.combination, i) == (float)number(c, at++));
    for (uint32_t i = 0; i < NOISE_FAMILIES; ++i)
      assert_true(rimi_le_f32(n.phi, i) == (float)number(c, at++));
  }
}

static void damage_is_refused(void **state) {
  (void)state;
  const bytes good = section();
  only_the_whole_opens(status_of, &good, RIM_E_TRUNCATED);
  static const struct {
    size_t word;
    uint32_t value;
    rim_status status;
  } headers[] = {{0, 0, RIM_E_VERSION},
                 {0, 2, RIM_E_VERSION},
                 {0, 3, RIM_E_VERSION}, /* a word less per channel, as layout 4 */
                 {0, 5, RIM_E_VERSION}, /* ln sigma(x) was limited to 1.2 */
                 {0, 7, RIM_E_VERSION}, /* one rho per channel */
                 {0, NOISE_LAYOUT - 1, RIM_E_VERSION},
                 {0, NOISE_LAYOUT_GAPS + 1, RIM_E_VERSION},
                 {1, CHANNELS + 1, RIM_E_RANGE},
                 {1, 0, RIM_E_RANGE},
                 {2, RAW + 1, RIM_E_RANGE},
                 {2, UINT32_MAX, RIM_E_RANGE},
                 {3, 0, RIM_E_RANGE},
                 {3, NOISE_MAX_FIELDS + 1, RIM_E_RANGE},
                 {3, NOISE_MAX_FIELDS, RIM_E_TRUNCATED},
                 {3, UINT32_MAX, RIM_E_RANGE},
                 {3, FIELDS + 1, RIM_E_TRUNCATED}};
  for (size_t i = 0; i < sizeof headers / sizeof *headers; ++i) {
    bytes b = good;
    put_u32(b.byte + 4 * headers[i].word, headers[i].value);
    assert_int_equal(status_of(&b), headers[i].status);
  }
  const double bad_times[] = {0.0, -1.0, NAN, INFINITY};
  for (size_t i = 0; i < 3 * 4; ++i) {
    bytes b = good;
    put_f32(b.byte + 4 * (4 + i / 4), bad_times[i % 4]);
    assert_int_equal(status_of(&b), RIM_E_RANGE);
  }
  const double no_number[] = {NAN, INFINITY, -INFINITY};
  for (size_t i = 0; i < 3; ++i) {
    bytes b = good;
    put_f32(b.byte + 4 * 8, no_number[i]);
    assert_int_equal(status_of(&b), RIM_E_RANGE);
  }
  rim_noise view;
  assert_int_equal(rimi_noise_open(&view, good.byte, good.size, CHANNELS, 9), RIM_E_RANGE);
}

static void no_channel_may_have_a_number_that_is_none(void **state) {
  (void)state;
  const double absurd[2] = {NAN, -INFINITY};
  for (uint32_t c = 0; c < CHANNELS; ++c) {
    for (uint32_t i = 0; i < STRIDE; ++i) {
      for (size_t k = 0; k < 2; ++k) {
        bytes b = section();
        put_f32(word_of(&b, c, i), absurd[k]);
        assert_int_equal(status_of(&b), RIM_E_DATA);
      }
    }
  }
}

/* A number of fields that was hit after the section was opened leads to none, not out of it. */
static void fields_that_were_hit(void **state) {
  (void)state;
  const double hit[] = {-1.0, NAN, NOISE_MAX_FIELDS + 1.0, 1e30, -INFINITY};
  bytes b = section();
  rim_noise view;
  assert_int_equal(rimi_noise_open(&view, b.byte, b.size, CHANNELS, MEANS), RIM_OK);
  for (size_t i = 0; i < sizeof hit / sizeof *hit; ++i) {
    put_f32(word_of(&b, 1, 1), hit[i]);
    assert_int_equal(rimi_noise_channel(&view, 1).fields, 0);
  }
  put_f32(word_of(&b, 1, 1), NOISE_MAX_FIELDS);
  assert_int_equal(rimi_noise_channel(&view, 1).fields, NOISE_MAX_FIELDS);
}

static void numbers_out_of_range_are_refused(void **state) {
  (void)state;
  const uint32_t prior = NOISE_CHANNEL_WORDS, phi = STRIDE - NOISE_FAMILIES;
  static const struct {
    uint32_t word;
    double value;
    bool good;
  } cases[] = {{1, -1.0, false},        {1, FIELDS + 1, false}, {1, FIELDS, true},
               {1, 0.0, true},          {2, -0.1, false},       {2, 0.875, false},
               {2, 0.87, true},         {3, 0.0, false},        {3, -1.0, false},
               {5, 0.0, false},         {5, -2.0, false},       {6, -9.0, true},
               {RHO_RISE, -0.1, false}, {RHO_RISE, 0.0, true},  {RHO_RISE, 0.74, true},
               {RHO_RISE, 0.75, false}}; /* rho is .25 */
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
    bytes b = section();
    put_f32(word_of(&b, 1, cases[i].word), cases[i].value);
    assert_int_equal(status_of(&b), cases[i].good ? RIM_OK : RIM_E_DATA);
  }
  for (uint32_t k = 0; k < FIELDS; ++k) {
    bytes b = section();
    put_f32(word_of(&b, 2, prior + k), 0.0);
    assert_int_equal(status_of(&b), RIM_E_DATA);
  }
  for (uint32_t f = 0; f < NOISE_FAMILIES; ++f) {
    bytes b = section();
    put_f32(word_of(&b, 2, phi + f), 0.999);
    assert_int_equal(status_of(&b), RIM_E_DATA);
  }
}

/* A field's weights may have any sign; a header alone says of which layout it is. */
static void what_is_just_allowed(void **state) {
  (void)state;
  bytes b = section();
  for (uint32_t i = 0; i < FIELDS * RAW; ++i)
    put_f32(word_of(&b, 1, NOISE_CHANNEL_WORDS + FIELDS + i), i % 2 == 0 ? -1.0 : 0.0);
  assert_int_equal(status_of(&b), RIM_OK);
  b.size = 4 * NOISE_HEADER_WORDS;
  assert_int_equal(status_of(&b), RIM_E_TRUNCATED);
  put_u32(b.byte, 2);
  assert_int_equal(status_of(&b), RIM_E_VERSION);
}

static void the_weight_is_that_of_the_scale(void **state) {
  (void)state;
  noise_channel n = {.ln_sigma = {0.25f, -0.125f, 0.5f, 0.375f, 0.125f}};
  for (double p = -4.0; p <= 4.0; p += 0.5) {
    for (double a = -3.0; a <= 3.0; a += 0.5) {
      const double ln = 0.25 * p - 0.125 * (p * p - 1.0) + 0.5 * a + 0.375 * (a * a - 1.0) - 0.25;
      const double limited = fmax(-NOISE_LN_SIGMA, fmin(NOISE_LN_SIGMA, ln));
      assert_true(fabs(rimi_noise_weight(&n, p, a, -2.0) - exp(-limited)) < 1e-12);
    }
  }
}

/* By the definition: each outcome in its own standard deviations, and none counts for more than
 * NOISE_MOVED of them. */
static void the_activity_is_how_quickly_predictions_move(void **state) {
  (void)state;
  bytes b = section();
  rim_noise view;
  put_f32(word_of(&b, 0, 5), 2.0);
  put_f32(word_of(&b, 1, 5), 0.5);
  assert_int_equal(rimi_noise_open(&view, b.byte, b.size, CHANNELS, MEANS), RIM_OK);
  const float before[2] = {1.0f, -2.0f};
  const double still[2] = {1.0, -2.0}, moved[2] = {4.0, -2.25}, far[2] = {4.0, -1e9};
  const double mean = -1.5;
  assert_true(fabs(rimi_noise_activity(&view, still, before, 2) - (log(NOISE_STILL) - mean)) <
              1e-9);
  assert_true(fabs(rimi_noise_activity(&view, moved, before, 2) -
                   (log(NOISE_STILL + sqrt((1.5 * 1.5 + 0.5 * 0.5) / 2.0)) - mean)) < 1e-9);
  assert_true(
      fabs(rimi_noise_activity(&view, far, before, 2) -
           (log(NOISE_STILL + sqrt((1.5 * 1.5 + NOISE_MOVED * NOISE_MOVED) / 2.0)) - mean)) < 1e-9);
  assert_true(fabs(rimi_noise_activity(&view, moved, before, 1) - (log(NOISE_STILL + 1.5) - mean)) <
              1e-9);
}

/* 1 has none, and so has what is not quite the least. */
static void a_channel_may_have_a_limit(void **state) {
  (void)state;
  static const struct {
    double word;
    float limit;
  } cases[] = {{0.0, 0.0f}, {1.0, 0.0f}, {1.9375, 0.0f}, {2.0, 2.0f}, {3.5, 3.5f}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
    bytes b = section();
    rim_noise view;
    put_f32(word_of(&b, 1, 0), cases[i].word);
    assert_int_equal(rimi_noise_open(&view, b.byte, b.size, CHANNELS, MEANS), RIM_OK);
    assert_true(rimi_noise_channel(&view, 1).limit == cases[i].limit);
    assert_true(rimi_noise_channel(&view, 0).limit == 0.0f);
  }
}

/* What is counted of a row of blocks, either way up. */
static void counts(const double *fresh, const double *counted, size_t blocks) {
  for (int side = -1; side <= 1; side += 2) {
    noise_level of_late = {0, 0};
    for (size_t i = 0; i < blocks; ++i) {
      const double got = side * rimi_noise_counted(side * fresh[i], 3.0, &of_late);
      if (fabs(got - counted[i]) > 0.03) /* the level is kept in steps */
        fail_msg("block %zu: %.3f counts, not %.3f", i, got, counted[i]);
    }
  }
}

static void of_a_block_counts_what_is_below_the_limit(void **state) {
  (void)state;
  /* Levels: 0, .75, .56, .42 and so on; limits 3 and twice as much above, 3 below. */
  counts((const double[]){50.0, 0.0, 0.0, -50.0, 2.9}, (const double[]){3.0, 0.0, 0.0, -3.0, 2.9},
         5);
  counts((const double[]){50.0, 50.0, 50.0, 1.0}, (const double[]){3.0, 4.5, 6.375, 1.0}, 4);
  /* The fourth in a row is no chance; what lasts counts, and so does its end. */
  counts((const double[]){50.0, 50.0, 50.0, 50.0, 48.0, 52.0, 0.0, 0.0},
         (const double[]){3.0, 4.5, 6.375, 50.0, 48.0, 52.0, 0.0, 0.0}, 8);
  /* Nor may the sides change. */
  counts((const double[]){50.0, 50.0, -50.0, -50.0, -50.0, 50.0},
         (const double[]){3.0, 4.5, -3.0, -3.0, -3.72, 3.0}, 6);
}

static void no_level_is_too_large(void **state) {
  (void)state;
  noise_level of_late = {0, 0};
  for (int i = 0; i < 40; ++i)
    (void)rimi_noise_counted(1e300, 3.0, &of_late);
  assert_int_equal(of_late.level, 32000);
  for (int i = 0; i < 40; ++i)
    (void)rimi_noise_counted(-1e300, 3.0, &of_late);
  assert_int_equal(of_late.level, -32000);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(numbers_are_read_back),
      cmocka_unit_test(damage_is_refused),
      cmocka_unit_test(no_channel_may_have_a_number_that_is_none),
      cmocka_unit_test(numbers_out_of_range_are_refused),
      cmocka_unit_test(fields_that_were_hit),
      cmocka_unit_test(what_is_just_allowed),
      cmocka_unit_test(the_weight_is_that_of_the_scale),
      cmocka_unit_test(a_channel_may_have_a_limit),
      cmocka_unit_test(of_a_block_counts_what_is_below_the_limit),
      cmocka_unit_test(no_level_is_too_large),
      cmocka_unit_test(the_activity_is_how_quickly_predictions_move),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
