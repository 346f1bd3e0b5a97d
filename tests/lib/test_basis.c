/* SPDX-License-Identifier: MIT */
/* basis: the sections BASIS, BEHAVIOUR and AGREEMENT are refused in every damaged form; what they
 * evaluate is held to a straightforward computation. (Terms over rows: test_blocks.c.) */
#include <math.h>
#include <stdio.h>

#include "base/bytes.h"
#include "base/rng.h"
#include "image/basis.h"
#include "rim/image.h"
#include "section_bytes.h"

enum { FEATURES = 5, OUTCOMES = 3, INPUTS = 3, TIMES = 2, FILTERS = INPUTS * TIMES };
#define SEED 99u

static const uint16_t input[INPUTS][2] = {
    {0, BASIS_PLAIN}, {4, BASIS_MAGNITUDE}, {1, 3 | BASIS_OF_PRODUCT}};
static const uint16_t term[][4] = {
    {BASIS_MEAN, 5, 0},      {BASIS_PRODUCT, 5, 4},     {BASIS_ABS, 0, 0},  {BASIS_DECAY, 0, 1},
    {BASIS_INTEGRAL, 2, 0},  {BASIS_INITIAL, 2, 1},     {BASIS_TIME, 0, 0}, {BASIS_TIME, 0, 0},
    {BASIS_TRIPLE, 5, 4, 3}, {BASIS_SIDE, 5, 0, 0x3f80}};
enum { TERMS = sizeof term / sizeof *term, MEANS = 2 };
enum { INPUT_AT = 32, SHARE_AT = INPUT_AT + 4 * INPUTS, TERM_AT = SHARE_AT + 4 * TIMES };
enum {
  CENTER_AT = TERM_AT + 8 * TERMS,
  SD_AT = CENTER_AT + 4 * TERMS,
  MEAN_AT = SD_AT + 4 * TERMS
};
enum { MEAN_SD_AT = MEAN_AT + 8 * MEANS, FIRST_AT = MEAN_SD_AT + 4 * MEANS };

static bytes basis(void) {
  bytes b = {.size = 0};
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, TERMS, MEANS, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(&b, header[i]);
  for (size_t i = 0; i < 2 * INPUTS; ++i)
    u16(&b, input[i / 2][i % 2]);
  for (size_t t = 0; t < TIMES; ++t)
    f32(&b, t == 0 ? 1.0 : 0.5);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(&b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(&b, i < TERMS ? -1.0 : 2.0);
  for (size_t i = 0; i < 2 * MEANS; ++i)
    u16(&b, i % 2 == 0 ? 5 : 0);
  for (size_t i = 0; i < 2 * MEANS; ++i)
    f32(&b, i < MEANS ? -1.0 : 2.0);
  for (size_t o = 0; o < OUTCOMES; ++o)
    f32(&b, 0.5);
  return b;
}

static rim_status basis_status(const bytes *b) {
  rim_basis view, before;
  memset(&view, 0x5a, sizeof view);
  before = view;
  const rim_status status = rimi_basis_open(&view, b->byte, b->size, FEATURES, OUTCOMES);
  if (status != RIM_OK)
    assert_memory_equal(&view, &before, sizeof view);
  return status;
}

static void a_basis_is_read_back(void **state) {
  (void)state;
  const bytes b = basis();
  rim_basis v;
  assert_int_equal(b.size, FIRST_AT + 4 * OUTCOMES);
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(v.inputs == INPUTS && v.times == TIMES && v.terms == TERMS && v.means == MEANS);
  assert_true(rimi_le_u16(v.input, 5) == (3 | BASIS_OF_PRODUCT));
  assert_true(rimi_le_f32(v.share, 1) == 0.5f && rimi_le_u16(v.term, 4 * 7) == BASIS_TIME);
  assert_true(rimi_le_f32(v.center, TERMS - 1) == -1.0f);
  assert_true(rimi_le_f32(v.inverse_sd, 0) == 2.0f && rimi_le_u16(v.mean, 2) == 5);
  assert_true(rimi_le_f32(v.mean_center, MEANS - 1) == -1.0f);
  assert_true(rimi_le_f32(v.mean_inverse_sd, 0) == 2.0f);
  assert_true(rimi_le_f32(v.first, OUTCOMES - 1) == 0.5f);
}

static void a_basis_of_another_size_is_refused(void **state) {
  (void)state;
  const bytes good = basis();
  bytes b;
  only_the_whole_opens(basis_status, &good, RIM_E_SIZE);
  static const struct {
    size_t word;
    uint32_t value;
    rim_status status;
  } header[] = {{0, 0, RIM_E_VERSION},
                {0, BASIS_LAYOUT + 1, RIM_E_VERSION},
                {1, BASIS_MAX_INPUTS + 1, RIM_E_RANGE},
                {1, UINT32_MAX, RIM_E_RANGE},
                {2, BASIS_MAX_TIMES + 1, RIM_E_RANGE},
                {3, BASIS_MAX_TERMS + 1, RIM_E_RANGE},
                {3, UINT32_MAX, RIM_E_RANGE},
                {4, BASIS_MAX_MEANS + 1, RIM_E_RANGE},
                {1, BASIS_MAX_INPUTS, RIM_E_TRUNCATED}, /* in range, but not there */
                {2, BASIS_MAX_TIMES, RIM_E_TRUNCATED},
                {3, BASIS_MAX_TERMS, RIM_E_TRUNCATED},
                {4, BASIS_MAX_MEANS, RIM_E_TRUNCATED},
                {1, INPUTS + 1, RIM_E_TRUNCATED},
                {2, TIMES + 1, RIM_E_TRUNCATED},
                {3, TERMS + 1, RIM_E_TRUNCATED},
                {4, MEANS + 1, RIM_E_TRUNCATED},
                {3, TERMS - 1, RIM_E_SIZE}};
  for (size_t i = 0; i < sizeof header / sizeof *header; ++i) {
    b = good;
    put_u32(b.byte + 4 * header[i].word, header[i].value);
    assert_int_equal(basis_status(&b), header[i].status);
  }
}

static void indices_out_of_range_are_refused(void **state) {
  (void)state;
  static const struct {
    size_t at;
    unsigned value;
  } bad[] = {{INPUT_AT, FEATURES},
             {INPUT_AT + 2, FEATURES},
             {INPUT_AT + 2, FEATURES | BASIS_OF_PRODUCT},
             {INPUT_AT + 6, BASIS_LEAST_HARMONIC - 1u},
             {TERM_AT, BASIS_SIDE + 1},
             {TERM_AT, 0xffff},
             {TERM_AT + 2, FILTERS},     /* MEAN */
             {TERM_AT + 8 + 2, FILTERS}, /* PRODUCT */
             {TERM_AT + 8 + 4, FILTERS},
             {TERM_AT + 16 + 2, FILTERS},  /* ABS */
             {TERM_AT + 24 + 4, TIMES},    /* DECAY */
             {TERM_AT + 32 + 2, INPUTS},   /* INTEGRAL */
             {TERM_AT + 40 + 2, OUTCOMES}, /* INITIAL */
             {TERM_AT + 40 + 4, TIMES},
             {TERM_AT + 56, BASIS_ROLLED}, /* there are no states */
             {TERM_AT + 64 + 2, FILTERS},  /* TRIPLE */
             {TERM_AT + 64 + 4, FILTERS},
             {TERM_AT + 64 + 6, FILTERS},
             {TERM_AT + 72 + 2, FILTERS}, /* SIDE */
             {MEAN_AT, FILTERS},
             {MEAN_AT + 4 * (MEANS - 1), FILTERS}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    bytes b = basis();
    put_u16(b.byte + bad[i].at, bad[i].value);
    assert_int_equal(basis_status(&b), RIM_E_RANGE);
    put_u16(b.byte + bad[i].at, 0); /* and index 0 is always one */
    assert_int_equal(basis_status(&b), RIM_OK);
  }
}

/* Its high half: 0, -1, infinite, not a number. */
static void a_side_has_a_width(void **state) {
  (void)state;
  const unsigned bad[] = {0, 0xbf80, 0x7f80, 0x7fc0};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    bytes b = basis();
    put_u16(b.byte + TERM_AT + 72 + 6, bad[i]);
    assert_int_equal(basis_status(&b), RIM_E_RANGE);
  }
}

static void numbers_that_are_none_are_refused(void **state) {
  (void)state;
  const double absurd[2] = {NAN, INFINITY};
  for (size_t k = 0; k < 2; ++k) {
    for (size_t at = SHARE_AT; at < FIRST_AT + 4 * OUTCOMES; at += 4) {
      if ((at >= TERM_AT && at < CENTER_AT) || (at >= MEAN_AT && at < MEAN_AT + 4 * MEANS))
        continue; /* no floats */
      bytes b = basis();
      put_f32(b.byte + at, absurd[k]);
      assert_int_equal(basis_status(&b), at < TERM_AT ? RIM_E_RANGE : RIM_E_DATA);
    }
  }
  const double bad_share[] = {0.0, -0.5, 1.0001};
  for (size_t k = 0; k < 3; ++k) {
    bytes b = basis();
    put_f32(b.byte + SHARE_AT + 4, bad_share[k]);
    assert_int_equal(basis_status(&b), RIM_E_RANGE);
  }
  const size_t scales[] = {SD_AT, SD_AT + 4 * (TERMS - 1), MEAN_SD_AT};
  for (size_t k = 0; k < 3; ++k) {
    bytes b = basis();
    put_f32(b.byte + scales[k], 0.0);
    assert_int_equal(basis_status(&b), RIM_E_DATA);
  }
}

static void how_healthy_runs_begin_is_read_back(void **state) {
  (void)state;
  bytes b = basis();
  rim_basis v;
  put_u32(b.byte + 20, 2);
  for (size_t i = 0; i < OUTCOMES + 2 * FEATURES; ++i)
    f32(&b, 0.25 * (double)(i + 1));
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(rimi_le_f32(v.first_sd, 0) == 0.25f);
  assert_true(rimi_le_f32(v.start, 0) == 1.0f && rimi_le_f32(v.start_sd, 0) == 2.25f);
  /* Without how features begin: how outcomes do is still read. */
  bytes few = b;
  few.size -= 4 * 2 * FEATURES;
  put_u32(few.byte + 20, 1);
  assert_int_equal(rimi_basis_open(&v, few.byte, few.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(v.first_sd != NULL && rimi_le_f32(v.first_sd, 2) == 0.75f && v.start == NULL &&
              v.start_sd == NULL);
  put_f32(few.byte + few.size - 4, 0.0);
  assert_int_equal(basis_status(&few), RIM_E_DATA);
  put_f32(few.byte + few.size - 4, NAN);
  assert_int_equal(basis_status(&few), RIM_E_DATA);
  bytes bad = b;
  bad.size -= 4;
  assert_int_equal(basis_status(&bad), RIM_E_TRUNCATED);
  bad = b;
  put_u32(bad.byte + 20, 5);
  assert_int_equal(basis_status(&bad), RIM_E_RANGE);
  bad = b;
  put_f32(bad.byte + b.size - 4, 0.0);
  assert_int_equal(basis_status(&bad), RIM_E_DATA);
  bad = b;
  put_f32(bad.byte + b.size - 4 * 2 * FEATURES, INFINITY);
  assert_int_equal(basis_status(&bad), RIM_E_DATA);
}

/* Whichever rate or factor it is. */
static void a_wrong_index_of_a_rate_anywhere_is_refused(void **state) {
  (void)state;
  enum { STATES = 3, RATES = 3 };
  bytes good = basis();
  put_u32(good.byte + 24, STATES);
  put_u32(good.byte + 28, RATES);
  const size_t rate_at = good.size + 8 + 8 * STATES;
  for (size_t i = 0; i < 4; ++i)
    u16(&good, i < STATES ? OUTCOMES - 1 : 0);
  for (size_t i = 0; i < 2 * STATES; ++i)
    f32(&good, i % 2 == 0 ? -1.0 : 1.0);
  for (size_t i = 0; i < 4 * RATES; ++i)
    u16(&good, i % 4 == 0 ? STATES - 1 : BASIS_PLAIN);
  for (size_t i = 0; i < RATES; ++i)
    f32(&good, 0.5);
  assert_int_equal(basis_status(&good), RIM_OK);
  const unsigned last[] = {FILTERS - 1, BASIS_STATE + STATES - 1,
                           BASIS_STATE_MAGNITUDE + STATES - 1};
  for (size_t i = 0; i < 4 * RATES; ++i) {
    for (size_t k = 0; k < 3 && i % 4 != 0; ++k) {
      for (unsigned more = 0; more < 2; ++more) {
        bytes b = good;
        put_u16(b.byte + rate_at + 2 * i, last[k] + more);
        assert_int_equal(basis_status(&b), more ? RIM_E_RANGE : RIM_OK);
      }
    }
    bytes b = good;
    put_u16(b.byte + rate_at + 2 * i, i % 4 == 0 ? STATES : BASIS_PLAIN - 1u);
    assert_int_equal(basis_status(&b), RIM_E_RANGE);
  }
}

/* With all that a section may hold, each part is found behind the one before. */
static void states_are_read_behind_how_runs_begin(void **state) {
  (void)state;
  enum { STATES = 3, RATES = 2 };
  static const uint16_t outcome_of[4] = {2, 0, 1, 0};
  static const uint16_t rate[RATES][4] = {
      {2, FILTERS - 1, BASIS_STATE + STATES - 1, BASIS_PLAIN},
      {0, BASIS_STATE_MAGNITUDE + STATES - 1, BASIS_PLAIN, BASIS_PLAIN}};
  for (uint32_t spread = 0; spread < 4; ++spread) {
    bytes b = basis();
    rim_basis v;
    put_u32(b.byte + 20, spread);
    put_u32(b.byte + 24, STATES);
    put_u32(b.byte + 28, RATES);
    const size_t s2 = OUTCOMES + 2 * FEATURES, begins[] = {0, OUTCOMES, s2, s2 + 1 + 2 * FILTERS};
    for (size_t i = 0; i < begins[spread]; ++i)
      f32(&b, 0.5);
    for (size_t i = 0; i < 4; ++i)
      u16(&b, outcome_of[i]);
    for (size_t i = 0; i < 2 * STATES; ++i)
      f32(&b, (double)i);
    for (size_t i = 0; i < 4 * RATES; ++i)
      u16(&b, rate[i / 4][i % 4]);
    for (size_t i = 0; i < RATES; ++i)
      f32(&b, -2.0 - (double)i);
    assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
    assert_true(v.states == STATES && v.rates == RATES);
    for (size_t i = 0; i < STATES; ++i)
      assert_int_equal(rimi_le_u16(v.state, i), outcome_of[i]);
    for (size_t i = 0; i < 2 * STATES; ++i)
      assert_true(rimi_le_f32(v.limit, i) == (float)i);
    for (size_t i = 0; i < 4 * RATES; ++i)
      assert_int_equal(rimi_le_u16(v.rate, i), rate[i / 4][i % 4]);
    assert_true(rimi_le_f32(v.weight, 0) == -2.0f && rimi_le_f32(v.weight, 1) == -3.0f);
    only_the_whole_opens(basis_status, &b, RIM_E_SIZE);
  }
}

/* ---- behaviour ---- */

enum { TARGETS = 2 * OUTCOMES };

static double drawn(uint32_t i) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, i);
  return (double)(float)rimi_rng_normal(&rng);
}

static bytes behaviour(void) {
  bytes b = {.size = 0};
  const uint32_t header[4] = {1, TERMS, TARGETS, 0};
  for (size_t i = 0; i < 4; ++i)
    u32(&b, header[i]);
  for (size_t i = 0; i < TARGETS; ++i)
    u32(&b, i % 2);
  for (uint32_t i = 0; i < TARGETS * (1 + TERMS); ++i)
    f32(&b, drawn(i));
  return b;
}

static rim_status behaviour_status(const bytes *b) {
  rim_behaviour view;
  return rimi_behaviour_open(&view, b->byte, b->size, TERMS, OUTCOMES);
}

static void behaviour_is_a_sum_of_terms(void **state) {
  (void)state;
  const bytes b = behaviour();
  rim_behaviour v;
  assert_int_equal(rimi_behaviour_open(&v, b.byte, b.size, TERMS, OUTCOMES), RIM_OK);
  for (uint32_t run = 0; run < 10; ++run) {
    double x[TERMS], first[OUTCOMES], predicted[TARGETS];
    for (uint32_t i = 0; i < TERMS; ++i)
      x[i] = drawn(1000 + 100 * run + i);
    for (uint32_t o = 0; o < OUTCOMES; ++o)
      first[o] = drawn(1050 + 100 * run + o);
    rimi_behaviour_predict(&v, x, first, predicted);
    for (uint32_t o = 0; o < TARGETS; ++o) {
      /* The change since the first reading: of outcomes, never of their scatter. */
      double sum = drawn(o) + (o < OUTCOMES && o % 2 == 1 ? first[o] : 0.0);
      for (uint32_t i = 0; i < TERMS; ++i)
        sum += drawn(TARGETS + o * TERMS + i) * x[i];
      assert_true(fabs(predicted[o] - sum) < 1e-12);
    }
  }
}

static void behaviour_is_as_uncertain_as_its_terms(void **state) {
  (void)state;
  const bytes b = behaviour();
  rim_behaviour v;
  assert_int_equal(rimi_behaviour_open(&v, b.byte, b.size, TERMS, OUTCOMES), RIM_OK);
  uint16_t unknown[TERMS] = {0};
  double error[TARGETS];
  rimi_behaviour_error(&v, unknown, true, error);
  for (uint32_t o = 0; o < TARGETS; ++o)
    assert_true(!(error[o] > 0.0));
  for (uint32_t i = 0; i < TERMS; ++i)
    unknown[i] = (uint16_t)(500u + 7000u * i);
  for (int knows_start = 0; knows_start < 2; ++knows_start) {
    rimi_behaviour_error(&v, unknown, knows_start != 0, error);
    for (uint32_t o = 0; o < TARGETS; ++o) {
      double sum = 0.0;
      for (uint32_t i = 0; i < TERMS; ++i)
        sum += pow(drawn(TARGETS + o * TERMS + i) * unknown[i] / BASIS_UNKNOWN_SD, 2.0);
      if (!knows_start && o < OUTCOMES && o % 2 == 1)
        assert_true(error[o] >= 1e30);
      else
        assert_true(fabs(error[o] - sqrt(sum)) < 1e-9);
    }
  }
}

static void damaged_behaviour_is_refused(void **state) {
  (void)state;
  const bytes good = behaviour();
  bytes b;
  only_the_whole_opens(behaviour_status, &good, RIM_E_TRUNCATED);
  const rim_status of_header[3] = {RIM_E_VERSION, RIM_E_RANGE, RIM_E_RANGE};
  for (size_t i = 0; i < 3; ++i) {
    b = good;
    b.byte[4 * i] ^= 64u;
    assert_int_equal(behaviour_status(&b), of_header[i]);
  }
  for (size_t i = 0; i < TARGETS; ++i) {
    b = good;
    put_u32(b.byte + 16 + 4 * i, 2);
    assert_int_equal(behaviour_status(&b), RIM_E_RANGE);
  }
  for (size_t at = 16 + 4 * TARGETS; at < good.size; at += 4) {
    b = good;
    put_f32(b.byte + at, at % 8 == 0 ? NAN : -INFINITY);
    assert_int_equal(behaviour_status(&b), RIM_E_DATA);
  }
}

/* ---- agreement ---- */

enum {
  STRIDE = AGREEMENT_FIRST + OUTCOMES * (2 + MEANS),
  INTEGRANDS = 2,
  INTEGRANDS_AT = 16 + 4 * OUTCOMES,
  SCALES_AT = INTEGRANDS_AT + 8 * INTEGRANDS,
  ROWS_AT = SCALES_AT + 12 * INTEGRANDS
};

#define LAG 0.125
/* Outcome 0 from residuals, 1 from section LEVEL, 2 the integral of feature 0 and of the product of
 * features 0 and 1, LAG blocks late. */
static bytes agreement(void) {
  bytes b = {.size = 0};
  const uint32_t header[4] = {3, OUTCOMES, MEANS, INTEGRANDS};
  for (size_t i = 0; i < 4; ++i)
    u32(&b, header[i]);
  for (uint32_t i = 0; i < OUTCOMES; ++i)
    f32(&b, 2.0 + i);
  static const uint16_t integrand[INTEGRANDS][4] = {{AGREEMENT_PLAIN, 0, 0, 0},
                                                    {AGREEMENT_PRODUCT, 0, 1, 0}};
  for (size_t i = 0; i < INTEGRANDS; ++i) {
    for (size_t k = 0; k < 4; ++k)
      u16(&b, integrand[i][k]);
  }
  static const double numbers[3 * INTEGRANDS] = {0.5, 1.5, 1.0, 0.0, 3.0, -2.0};
  for (size_t i = 0; i < 3 * INTEGRANDS; ++i)
    f32(&b, numbers[i]);
  for (uint32_t o = 0; o < OUTCOMES; ++o) {
    const double head[AGREEMENT_FIRST] = {o, 0.25, o == 2 ? 0.0 : -1.0, o == 2 ? LAG : 0.0};
    for (size_t i = 0; i < AGREEMENT_FIRST; ++i)
      f32(&b, head[i]);
    for (uint32_t i = AGREEMENT_FIRST; i < STRIDE; ++i)
      f32(&b, drawn(5000 + o * STRIDE + i));
  }
  return b;
}

static double weight(uint32_t o, uint32_t set, uint32_t j) {
  return drawn(5000 + o * STRIDE + AGREEMENT_FIRST + set * OUTCOMES + j);
}

static rim_status agreement_status(const bytes *b) {
  rim_agreement view;
  return rimi_agreement_open(&view, b->byte, b->size, FEATURES, OUTCOMES, MEANS);
}

static rim_agreement opened(const bytes *b) {
  rim_agreement view;
  assert_int_equal(rimi_agreement_open(&view, b->byte, b->size, FEATURES, OUTCOMES, MEANS), RIM_OK);
  return view;
}

/* Whichever outcome or integrand it is: the last that may be, and the next. */
static void a_wrong_number_of_agreement_anywhere_is_refused(void **state) {
  (void)state;
  static const struct {
    size_t word;
    double good, bad;
  } of_row[] = {{0, 0.0, -0.001},
                {2, OUTCOMES - 1, OUTCOMES},
                {2, -1.0, -1.001},
                {3, AGREEMENT_LAG, 1.001 * AGREEMENT_LAG},
                {3, -AGREEMENT_LAG, -1.001 * AGREEMENT_LAG}};
  for (size_t o = 0; o < OUTCOMES; ++o) {
    for (size_t i = 0; i < sizeof of_row / sizeof *of_row; ++i) {
      bytes b = agreement();
      uint8_t *const at = b.byte + ROWS_AT + 4 * (o * STRIDE + of_row[i].word);
      put_f32(at, of_row[i].good);
      assert_int_equal(agreement_status(&b), RIM_OK);
      put_f32(at, of_row[i].bad);
      assert_int_equal(agreement_status(&b), RIM_E_RANGE);
    }
    bytes b = agreement();
    put_f32(b.byte + ROWS_AT + 4 * o * STRIDE, AGREEMENT_QUADRATIC - 0.999);
    assert_int_equal(agreement_status(&b), RIM_E_RANGE);
    /* Of another outcome, which is one. */
    put_f32(b.byte + ROWS_AT + 4 * o * STRIDE, AGREEMENT_INTO);
    for (size_t of = 0; of <= OUTCOMES; ++of) {
      put_f32(b.byte + ROWS_AT + 4 * (o * STRIDE + 1), (double)of);
      assert_int_equal(agreement_status(&b), of == o || of == OUTCOMES ? RIM_E_RANGE : RIM_OK);
    }
  }
  for (size_t i = 0; i < 6 * INTEGRANDS; ++i) { /* two of each of three numbers */
    bytes b = agreement();
    const size_t k = i / 2 % 3;
    const unsigned last = k == 0 ? AGREEMENT_SINE : FEATURES - 1;
    put_u16(b.byte + INTEGRANDS_AT + 8 * (i / 6) + 2 * k, last + i % 2);
    assert_int_equal(agreement_status(&b), i % 2 == 0 ? RIM_OK : RIM_E_RANGE);
  }
}

typedef struct record {
  double residual[OUTCOMES], measured[OUTCOMES], level[OUTCOMES], mean[MEANS];
  double early[INTEGRANDS], late[INTEGRANDS];
  bool follows;
} record;

static record make_record(uint32_t i) {
  record r;
  for (uint32_t o = 0; o < OUTCOMES; ++o) {
    r.residual[o] = drawn(7000 + 20 * i + o) * (i % 5 == 4 ? 50.0 : 1.0); /* some are clipped */
    r.measured[o] = drawn(7005 + 20 * i + o);
    r.level[o] = drawn(7010 + 20 * i + o);
  }
  for (uint32_t m = 0; m < MEANS; ++m)
    r.mean[m] = drawn(7015 + 20 * i + m);
  for (uint32_t g = 0; g < INTEGRANDS; ++g) {
    r.early[g] = drawn(7100 + 20 * i + g);
    r.late[g] = drawn(7105 + 20 * i + g);
  }
  r.follows = i % 7 != 3;
  return r;
}

static agreement_block block_of(const record *r, const double *predicted, const double *level) {
  return (agreement_block){.residual = r->residual,
                           .mean = r->mean,
                           .measured = r->measured,
                           .predicted = predicted,
                           .early = r->early,
                           .late = r->late,
                           .level = level,
                           .follows = r->follows};
}

static double clipped(const record *r, uint32_t j) {
  return fmax(-AGREEMENT_CLIP, fmin(AGREEMENT_CLIP, r->residual[j] * (2.0 + j)));
}

/* What outcome 0's residual is less what those of 1 and 2 say of it. */
static double residual_less_others(const record *now, const record *before) {
  double sum = 0.25;
  for (uint32_t j = 1; j < OUTCOMES; ++j) {
    sum += weight(0, 0, j) * clipped(now, j) + weight(0, 1, j) * clipped(before, j);
    for (uint32_t m = 0; m < MEANS; ++m)
      sum += weight(0, 2 + m, j) * clipped(now, j) * now->mean[m];
  }
  return now->residual[0] - sum / 2.0;
}

/* What the integrands of outcome 2 bring from block to block, which it shows LAG blocks late. */
static double integrated_change(const record *now, const record *before) {
  double change = 0.0;
  for (uint32_t g = 0; g < INTEGRANDS; ++g) {
    const double lagging = now->early[g] + now->late[g] - before->early[g] - before->late[g];
    change += weight(2, 0, g) * (0.5 + g) * (now->early[g] + before->late[g] - LAG * lagging);
  }
  return change;
}

/* The change of outcome 2 that they do not explain. */
static double unexplained_change(const record *now, const record *before) {
  double change = now->measured[2] - before->measured[2] - 0.25;
  return change - integrated_change(now, before);
}

static void what_remains_is_as_defined(void **state) {
  (void)state;
  const bytes b = agreement();
  for (int with_level = 0; with_level < 2; ++with_level) {
    const rim_agreement v = opened(&b);
    double kept[AGREEMENT_STATE * OUTCOMES] = {0.0}, sum = 0.0, integrated = 0.0;
    record before = {0};
    for (uint32_t i = 0; i < 40; ++i) {
      record now = make_record(i);
      now.follows = now.follows && i > 0;
      double remains[OUTCOMES], expected[OUTCOMES];
      const double predicted[OUTCOMES] = {0.5 * i, -1.0, 3.0};
      const agreement_block block = block_of(&now, predicted, with_level ? now.level : NULL);
      rimi_agreement_evaluate(&v, &block, kept, remains, expected);
      assert_true(fabs(remains[0] - residual_less_others(&now, &before)) < 1e-9);
      if (with_level)
        assert_true(remains[1] == now.measured[1] - now.level[1]);
      else
        assert_true(remains[1] != now.measured[1] - now.level[1]);
      if (now.follows) { /* across a gap the sums stay as they were */
        sum = AGREEMENT_KEEPS * sum + unexplained_change(&now, &before);
        integrated = AGREEMENT_KEEPS * integrated + 0.25 + integrated_change(&now, &before);
      }
      assert_true(fabs(remains[2] - sum) < 1e-9);
      assert_true(expected[0] == predicted[0]); /* of residuals: as of behaviour */
      assert_true(expected[1] == (with_level ? now.measured[1] - remains[1] : predicted[1]));
      assert_true(fabs(expected[2] - integrated) < 1e-9);
      before = now;
    }
  }
}

/* Whatever the residuals are: only what was measured in this block counts. */
static void few_others_say_what_is_expected(void **state) {
  (void)state;
  bytes b = agreement();
  put_f32(b.byte + ROWS_AT, AGREEMENT_FEW);
  put_f32(b.byte + ROWS_AT + 4 * 2 * STRIDE, AGREEMENT_FEW);
  const rim_agreement v = opened(&b);
  double kept[AGREEMENT_STATE * OUTCOMES] = {0.0};
  for (uint32_t i = 0; i < 20; ++i) {
    const record now = make_record(i);
    const agreement_block block = block_of(&now, now.level, NULL);
    double remains[OUTCOMES], let_expect[OUTCOMES], expected = now.measured[0] - 0.25;
    rimi_agreement_evaluate(&v, &block, kept, remains, let_expect);
    for (uint32_t j = 1; j < OUTCOMES; ++j)
      expected -= weight(0, 0, j) * now.measured[j];
    assert_true(fabs(remains[0] - expected) < 1e-12);
    assert_true(let_expect[0] == now.measured[0] - remains[0]);
    expected = now.measured[2] - 0.25;
    for (uint32_t j = 0; j < 2; ++j)
      expected -= weight(2, 0, j) * now.measured[j];
    assert_true(fabs(remains[2] - expected) < 1e-12);
  }
}

/* One other alone, by a weight above 0; of whatever source else, none. */
static void a_twin_is_the_only_other(void **state) {
  (void)state;
  static const double weights[][OUTCOMES] = {
      {0.0, 0.0, 0.9}, {0.0, 0.9, 0.0}, {0.0, 0.0, -0.9}, {0.0, 0.4, 0.5}, {0.0, 0.0, 0.0}};
  static const uint32_t twin[] = {2, 1, OUTCOMES, OUTCOMES, OUTCOMES};
  for (size_t k = 0; k < sizeof twin / sizeof *twin; ++k) {
    for (uint32_t source = AGREEMENT_RESIDUALS; source <= AGREEMENT_FEW; ++source) {
      bytes b = agreement();
      put_f32(b.byte + ROWS_AT, source);
      for (size_t j = 0; j < OUTCOMES; ++j)
        put_f32(b.byte + ROWS_AT + 4 * (AGREEMENT_FIRST + j), weights[k][j]);
      const rim_agreement v = opened(&b);
      assert_int_equal(rimi_agreement_source(&v, 0), source);
      double said = 0.0;
      const uint32_t found = rimi_agreement_twin(&v, 0, &said);
      assert_int_equal(found, source == AGREEMENT_FEW ? twin[k] : OUTCOMES);
      assert_true(found == OUTCOMES || said == (double)0.9f);
      assert_int_equal(rimi_agreement_twin(&v, 0, NULL), found);
    }
  }
}

/* Outcome 1 as the integral of outcome 2, and of what else its row names: what the integral gives
 * more than outcome 1's change. */
static void what_it_moves_tells(void **state) {
  (void)state;
  bytes b = agreement();
  put_f32(b.byte + ROWS_AT + 4 * 2 * STRIDE, AGREEMENT_INTO);
  put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + 1), 1.0);
  const rim_agreement v = opened(&b);
  assert_int_equal(rimi_agreement_source(&v, 2), AGREEMENT_INTO);
  assert_int_equal(rimi_agreement_integral(&v, 2), 1);
  assert_int_equal(rimi_agreement_integral(&v, 0), OUTCOMES);
  const bytes usual = agreement();
  const rim_agreement u = opened(&usual);
  assert_int_equal(rimi_agreement_integral(&u, 2), 2);
  for (uint16_t j = 0; j < OUTCOMES; ++j) /* what remains has the other sign */
    assert_true(rimi_agreement_gain(&v, 2, j, j).sum == -rimi_agreement_gain(&u, 2, j, j).sum);
  double kept[AGREEMENT_STATE * OUTCOMES] = {0.0}, sum = 0.0, integrated = 0.0;
  record before;
  memset(&before, 0, sizeof before);
  for (uint32_t i = 0; i < 40; ++i) {
    record now = make_record(i);
    now.follows = now.follows && i > 0;
    double remains[OUTCOMES], expected[OUTCOMES];
    const agreement_block block = block_of(&now, now.level, NULL);
    rimi_agreement_evaluate(&v, &block, kept, remains, expected);
    if (now.follows) {
      const double change = integrated_change(&now, &before);
      sum = AGREEMENT_KEEPS * sum + change - (now.measured[1] - before.measured[1]);
      integrated = AGREEMENT_KEEPS * integrated + change;
    }
    assert_true(fabs(remains[2] - sum) < 1e-9);
    assert_true(fabs(expected[2] - integrated) < 1e-9);
    before = now;
  }
  static const double no_other[] = {-1.0, 2.0, OUTCOMES}; /* 2 is itself */
  for (size_t i = 0; i < sizeof no_other / sizeof *no_other; ++i) {
    put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + 1), no_other[i]);
    assert_int_equal(agreement_status(&b), RIM_E_RANGE);
  }
  put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + 1), 0.0);
  assert_int_equal(agreement_status(&b), RIM_OK);
  put_f32(b.byte + ROWS_AT + 4 * 2 * STRIDE, AGREEMENT_QUADRATIC + 1);
  assert_int_equal(agreement_status(&b), RIM_E_RANGE);
}

static void integrands_are_named(void **state) {
  (void)state;
  bytes b = agreement();
  const rim_agreement v = opened(&b);
  for (uint32_t o = 0; o < OUTCOMES; ++o) {
    assert_int_equal(rimi_agreement_source(&v, o), o); /* as agreement() has it */
    for (uint32_t j = 0; j < OUTCOMES; ++j) {
      const agreement_gain gain = rimi_agreement_gain(&v, o, j, (uint16_t)j);
      /* Feature 0 alone and in the product, whose other factor is 3; feature 1 with -2 beside. */
      const double plain = j == 0 ? 2.0 * weight(2, 0, 0) * 0.5 : 0.0;
      const double other = j == 0 ? 3.0 : j == 1 ? -2.0 : 0.0;
      const double product = 2.0 * weight(2, 0, 1) * 1.5 * other;
      assert_true(fabs(gain.sum - (o == 2 ? plain + product : 0.0)) < 1e-12);
      assert_true(fabs(gain.of_products - (o == 2 ? product : 0.0)) < 1e-12);
      assert_int_equal(gain.mostly, o == 2 && j == 0);
    }
  }
  put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + 2), -1.0);
  assert_false(rimi_agreement_gain(&v, 2, 0, 0).mostly);
  put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + AGREEMENT_FIRST + 1), 0.0);
  for (int sign = -1; sign <= 1; ++sign) { /* an integrand without weight has no factor */
    put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + AGREEMENT_FIRST), 0.5 * sign);
    assert_true(rimi_agreement_gain(&v, 2, 0, 0).factor == (sign != 0));
  }
}

static void damaged_agreement_is_refused(void **state) {
  (void)state;
  const bytes good = agreement();
  bytes b;
  only_the_whole_opens(agreement_status, &good, RIM_E_TRUNCATED);
  const rim_status of_header[3] = {RIM_E_VERSION, RIM_E_RANGE, RIM_E_RANGE};
  for (size_t i = 0; i < 3; ++i) {
    b = good;
    b.byte[4 * i] ^= 64u;
    assert_int_equal(agreement_status(&b), of_header[i]);
  }
  for (size_t at = 16; at < good.size; at += 4) {
    if (at >= INTEGRANDS_AT && at < SCALES_AT)
      continue; /* whole numbers */
    b = good;
    put_f32(b.byte + at, at % 8 == 0 ? NAN : INFINITY);
    assert_int_equal(agreement_status(&b), RIM_E_DATA);
  }
  for (size_t i = 0; i < OUTCOMES + INTEGRANDS; ++i) {
    b = good;
    put_f32(b.byte + (i < OUTCOMES ? 16 + 4 * i : SCALES_AT + 4 * (i - OUTCOMES)), 0.0);
    assert_int_equal(agreement_status(&b), RIM_E_DATA);
  }
  static const uint8_t of_integrand[3] = {AGREEMENT_SINE + 1, FEATURES, FEATURES};
  for (size_t i = 0; i < 3; ++i) {
    b = good;
    b.byte[INTEGRANDS_AT + 8 + 2 * i] = of_integrand[i];
    assert_int_equal(agreement_status(&b), RIM_E_RANGE);
  }
  static const struct {
    size_t word;
    double value;
  } bad[] = {{0, -1.0}, {0, 6.0}, {2, -2.0}, {2, OUTCOMES}, {3, -1.001}, {3, 1.001}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    b = good;
    put_f32(b.byte + ROWS_AT + 4 * (2 * STRIDE + bad[i].word), bad[i].value);
    assert_int_equal(agreement_status(&b), RIM_E_RANGE);
  }
}

/* More integrands than any outcome may have, and than outcomes could share. */
static void integrands_are_bounded(void **state) {
  (void)state;
  rim_agreement view;
  bytes b = agreement();
  const uint32_t many[] = {AGREEMENT_INTEGRANDS * OUTCOMES + 1, UINT32_MAX};
  for (size_t i = 0; i < 2; ++i) {
    put_u32(b.byte + 12, many[i]);
    assert_int_equal(agreement_status(&b), RIM_E_RANGE);
  }
  put_u32(b.byte + 12, AGREEMENT_INTEGRANDS * OUTCOMES); /* as many as may be: their bytes lack */
  assert_int_equal(agreement_status(&b), RIM_E_TRUNCATED);
  put_u32(b.byte + 8, 0); /* without means outcomes share two each */
  put_u32(b.byte + 12, 2 * OUTCOMES + 1);
  assert_int_equal(rimi_agreement_open(&view, b.byte, b.size, FEATURES, OUTCOMES, 0), RIM_E_RANGE);
  put_u32(b.byte + 12, 2 * OUTCOMES);
  assert_int_equal(rimi_agreement_open(&view, b.byte, b.size, FEATURES, OUTCOMES, 0),
                   RIM_E_TRUNCATED);
}

/* What others' residuals say is as uncertain as they are; nothing but residuals adds any. */
static void agreement_is_as_uncertain_as_its_residuals(void **state) {
  (void)state;
  const bytes b = agreement();
  const rim_agreement v = opened(&b);
  const double mean[MEANS] = {0.5, -1.25}, error[OUTCOMES] = {0.3, 0.2, 100.0};
  double sum = 0.3 * 0.3 * 2.0 * 2.0;
  for (uint32_t j = 1; j < OUTCOMES; ++j) {
    double w = weight(0, 0, j) + weight(0, 1, j);
    for (uint32_t m = 0; m < MEANS; ++m)
      w += weight(0, 2 + m, j) * mean[m];
    w *= fmin(error[j] * (2.0 + j), AGREEMENT_CLIP);
    sum += w * w;
  }
  assert_true(fabs(rimi_agreement_error(&v, 0, mean, error) - sqrt(sum) / 2.0) < 1e-6);
  assert_true(rimi_agreement_error(&v, 1, mean, error) == 0.0);
  assert_true(rimi_agreement_error(&v, 2, mean, error) == 0.0);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_basis_is_read_back),
      cmocka_unit_test(a_basis_of_another_size_is_refused),
      cmocka_unit_test(indices_out_of_range_are_refused),
      cmocka_unit_test(a_side_has_a_width),
      cmocka_unit_test(numbers_that_are_none_are_refused),
      cmocka_unit_test(how_healthy_runs_begin_is_read_back),
      cmocka_unit_test(a_wrong_index_of_a_rate_anywhere_is_refused),
      cmocka_unit_test(states_are_read_behind_how_runs_begin),
      cmocka_unit_test(behaviour_is_a_sum_of_terms),
      cmocka_unit_test(behaviour_is_as_uncertain_as_its_terms),
      cmocka_unit_test(a_wrong_number_of_agreement_anywhere_is_refused),
      cmocka_unit_test(damaged_behaviour_is_refused),
      cmocka_unit_test(what_remains_is_as_defined),
      cmocka_unit_test(few_others_say_what_is_expected),
      cmocka_unit_test(a_twin_is_the_only_other),
      cmocka_unit_test(what_it_moves_tells),
      cmocka_unit_test(integrands_are_named),
      cmocka_unit_test(damaged_agreement_is_refused),
      cmocka_unit_test(integrands_are_bounded),
      cmocka_unit_test(agreement_is_as_uncertain_as_its_residuals),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
