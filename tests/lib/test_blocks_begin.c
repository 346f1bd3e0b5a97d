/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c: what an exponential mean of a command was before the first row, and what is
 * known of it in a run that is longer than those that were learnt. */
#include <math.h>

#include "base/bytes.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { BLOCK = 5, TIMES = 2, INPUTS = 2, FILTERS = INPUTS * TIMES, BLOCKS = 6, MISSING = 7 };
enum { GATHERED = FILTERS, TIME, DECAY, PRODUCT, TERMS }; /* terms behind the filters */
#define LEARNT_S 3.0
#define DECAY_SCALE 4.0 /* 1 / standard deviation */

static const double share[TIMES] = {1.0, 0.03125};

/* {offset, slope} of every filter: those of one row never keep what was before. */
static const double begin[FILTERS][2] = {{7.0, 7.0}, {0.5, 0.25}, {7.0, 7.0}, {-1.5, 0.0}};

static const uint16_t further[TERMS - FILTERS][4] = {
    {BASIS_INTEGRAL, 0, 0}, {BASIS_TIME, 0, 0}, {BASIS_DECAY, 0, 1}, {BASIS_PRODUCT, 1, 3}};

/* One command, as it is and as its magnitude; every filter is a term. how: S of the section. */
static bytes basis_of(uint32_t how) {
  bytes b = {.size = 0};
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, TERMS, 0, how, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(&b, header[i]);
  for (size_t i = 0; i < INPUTS; ++i) {
    u16(&b, 0);
    u16(&b, i == 0 ? BASIS_PLAIN : BASIS_MAGNITUDE);
  }
  for (size_t t = 0; t < TIMES; ++t)
    f32(&b, share[t]);
  for (size_t i = 0; i < 4 * FILTERS; ++i)
    u16(&b, i % 4 == 1 ? (unsigned)i / 4 : BASIS_MEAN);
  for (size_t i = 0; i < 4 * (TERMS - FILTERS); ++i)
    u16(&b, further[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(&b, i < TERMS ? 0.0 : i == TERMS + DECAY ? DECAY_SCALE : 1.0);
  for (size_t i = 0; i < 2 + 4; ++i) /* first, first_sd; start, start_sd: any is one */
    f32(&b, i < 2 ? 1.0 : i < 4 ? 0.0 : 1e30);
  if (how > 2)
    f32(&b, LEARNT_S);
  for (size_t i = 0; i < 2 * FILTERS && how > 2; ++i)
    f32(&b, begin[i / 2][i % 2]);
  return b;
}

/* A command and an outcome. */
static blocks *started(bytes *basis) {
  static bytes outcome_feature, range;
  static _Alignas(8) uint8_t memory[4096];
  static const uint8_t role[2] = {1, 0};
  blocks *b;
  outcome_feature.size = range.size = 0;
  u16(&outcome_feature, 1);
  for (size_t i = 0; i < 4; ++i)
    f32(&range, i < 2 ? -10.0 : 10.0);
  blocks_config config = {.features = 2,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .period_s = 0.1,
                          .outcome_feature = outcome_feature.byte,
                          .role = role,
                          .range = range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, basis->byte, basis->size, 2, 1), RIM_OK);
  assert_true((config.basis.begin != NULL) == (rimi_le_u32(basis->byte, 5) > 2));
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  return b;
}

static double command(uint32_t t) { return t == 0 ? -2.0 : 0.125 * (double)(t % 7); }

/* By the definition, from the sum over all rows. */
static double mean_at(uint32_t t, size_t filter, bool with_begin) {
  const double keep = 1.0 - share[filter % TIMES];
  const bool magnitude = filter / TIMES == 1;
  const double first = magnitude ? fabs(command(0)) : command(0);
  const double before = with_begin ? begin[filter][0] + begin[filter][1] * first : first;
  double sum = before * pow(keep, t + 1.0);
  for (uint32_t k = 0; k <= t; ++k) {
    const double u = magnitude ? fabs(command(k)) : command(k);
    sum += u * share[filter % TIMES] * pow(keep, t - k);
  }
  return sum;
}

static void a_mean_begins_where_healthy_runs_do(void **state) {
  (void)state;
  for (uint32_t how = 2; how <= 3; ++how) {
    bytes basis = basis_of(how);
    blocks *b = started(&basis);
    double sum[FILTERS] = {0.0};
    for (uint32_t t = 0; t < BLOCKS * BLOCK; ++t) {
      const double row[2] = {command(t), 1.0};
      for (size_t f = 0; f < FILTERS; ++f)
        sum[f] += mean_at(t, f, how == 3) / BLOCK;
      if (rimi_blocks_row(b, 0.1 * t, row, NULL, NULL, NULL) != BLOCKS_DONE)
        continue;
      for (size_t f = 0; f < FILTERS; ++f) {
        assert_true(fabs(rimi_blocks_terms(b)[f] - sum[f]) < 1e-9);
        sum[f] = 0.0;
      }
    }
  }
}

/* The second row comes late: over the gap the command is taken to have gone to it on a line, in
 * each missing row by as much. */
static void a_gap_after_the_first_row_keeps_it(void **state) {
  (void)state;
  bytes basis = basis_of(3);
  blocks *b = started(&basis);
  const double row[2] = {2.0, 1.0}, next[2] = {-1.0, 1.0};
  (void)rimi_blocks_row(b, 0.0, row, NULL, NULL, NULL);
  const double keep = 1.0 - share[1];
  double filter = 2.0 + (begin[1][0] + begin[1][1] * 2.0 - 2.0) * keep, mean = 0.0;
  for (uint32_t t = 0; t < MISSING; ++t) {
    const double on_line = 2.0 - 3.0 * (t + 1.0) / (MISSING + 1.0);
    filter = on_line + (filter - on_line) * keep;
  }
  for (uint32_t t = 0; t < BLOCK; ++t) {
    (void)rimi_blocks_row(b, 0.1 * (1 + MISSING + t), next, NULL, NULL, NULL);
    filter = -1.0 + (filter + 1.0) * keep;
    mean += filter / BLOCK;
  }
  assert_true(fabs(rimi_blocks_terms(b)[1] - mean) < 1e-9);
}

/* Up to the length that was learnt all is known. From then on a slow mean is from rows that are
 * farther back than any healthy run went, and what gathers has never been as large. */
static void less_is_known_the_longer_a_run_is(void **state) {
  (void)state;
  bytes basis = basis_of(3);
  blocks *b = started(&basis);
  const double keep = 1.0 - share[1];
  for (uint32_t t = 0; t < 90; ++t) { /* up to three times as long */
    const double row[2] = {command(t), 1.0};
    if (rimi_blocks_row(b, 0.1 * t, row, NULL, NULL, NULL) != BLOCKS_DONE)
      continue;
    const double middle_s = 0.1 * (t - 2.0),
                 beyond = fmin(fmax(middle_s / LEARNT_S - 1.0, 0.0), 1.0);
    assert_true(fabs(rimi_blocks_beyond_learnt(b) - beyond) < 1e-9);
    assert_true(rimi_blocks_knows_all(b) == !(beyond > 0.0));
    if (rimi_blocks_knows_all(b))
      continue;
    const double old = pow(keep, LEARNT_S / 0.1) - pow(keep, middle_s / 0.1);
    const double left = DECAY_SCALE * pow(keep, fmin(middle_s / 0.1, 35.0)); /* it ends at 1.1 L */
    const double expected[TERMS] = {0.0,           2.0 * old,           0.0,
                                    2.0 * old,     2.0 * beyond,        2.0 * beyond,
                                    beyond * left, fmin(4.0 * old, 1.0)};
    for (size_t i = 0; i < TERMS; ++i) {
      const double sd = rimi_blocks_unknown(b)[i] / BASIS_UNKNOWN_SD;
      if (i != DECAY)
        assert_true(fabs(sd - expected[i]) < 1e-3);
      else /* a block's mean */
        assert_true(sd > 0.5 * expected[i] && sd < 2.0 * expected[i]);
    }
  }
  assert_true(rimi_blocks_beyond_learnt(b) >= 1.0);
}

static void numbers_that_are_none_are_refused(void **state) {
  (void)state;
  rim_basis v;
  const double no_length[] = {0.0, -1.0, NAN, INFINITY};
  for (size_t i = 0; i < 4; ++i) {
    bytes b = basis_of(3);
    put_f32(b.byte + b.size - 4 * (2 * FILTERS + 1), no_length[i]);
    assert_int_equal(rimi_basis_open(&v, b.byte, b.size, 2, 1), RIM_E_DATA);
  }
  for (size_t i = 0; i < 2 * FILTERS; ++i) {
    bytes b = basis_of(3);
    put_f32(b.byte + b.size - 4 * (i + 1), i % 2 == 0 ? NAN : INFINITY);
    assert_int_equal(rimi_basis_open(&v, b.byte, b.size, 2, 1), RIM_E_DATA);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_mean_begins_where_healthy_runs_do),
                                     cmocka_unit_test(a_gap_after_the_first_row_keeps_it),
                                     cmocka_unit_test(less_is_known_the_longer_a_run_is),
                                     cmocka_unit_test(numbers_that_are_none_are_refused)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
