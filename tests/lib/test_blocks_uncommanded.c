/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c where nothing is filtered, because nothing commands what is watched: time goes
 * on all the same. */
#include <math.h>

#include "monitor/blocks.h"
#include "section_bytes.h"

enum { BLOCK = 5, TIMES = 2, TERMS = 2, BLOCKS = 6 };
#define FIRST_MEAN (-0.5)

static const double share[TIMES] = {0.0625, 0.03125}; /* longer than all rows */

/* A decay, and the first reading as it comes to count, both by the second time constant. */
static const uint16_t terms[TERMS][4] = {{BASIS_DECAY, 0, 1}, {BASIS_INITIAL, 0, 1}};

static void put_basis(bytes *b) {
  const uint32_t header[8] = {BASIS_LAYOUT, 0, TIMES, TERMS, 0, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  for (size_t t = 0; t < TIMES; ++t)
    f32(b, share[t]);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(b, terms[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(b, i < TERMS ? 0.0 : 1.0);
  f32(b, FIRST_MEAN);
}

/* One outcome, which nothing commands. */
static blocks_config one_outcome(double period_s) {
  static bytes outcome_feature, range;
  static const uint8_t role[1] = {0};
  outcome_feature.size = range.size = 0;
  u16(&outcome_feature, 0);
  f32(&range, -10.0);
  f32(&range, 10.0);
  return (blocks_config){.features = 1,
                         .outcomes = 1,
                         .block_rows = BLOCK,
                         .period_s = period_s,
                         .outcome_feature = outcome_feature.byte,
                         .role = role,
                         .range = range.byte};
}

static void decays_without_inputs(void **state) {
  (void)state;
  static bytes basis;
  static _Alignas(8) uint8_t memory[4096];
  blocks *b;
  put_basis(&basis);
  blocks_config config = one_outcome(0.1);
  assert_int_equal(rimi_basis_open(&config.basis, basis.byte, basis.size, 1, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  for (uint32_t t = 0; t < BLOCKS * BLOCK; ++t) {
    const double reading = 2.0;
    if (rimi_blocks_row(b, 0.1 * t, &reading, NULL, NULL, NULL) != BLOCKS_DONE)
      continue;
    const double decay = pow(1.0 - share[1], t);
    assert_true(decay > 0.1);
    assert_true(rimi_blocks_knows_all(b)); /* what lies behind the terms is as it was */
    assert_true(fabs(rimi_blocks_terms(b)[0] - decay) < 1e-12);
    assert_true(fabs(rimi_blocks_terms(b)[1] - (2.0 - FIRST_MEAN) * (1.0 - decay)) < 1e-12);
  }
}

/* Nothing is filtered at all: the integrands of a block are of its own rows all the same. */
static void integrands_without_times(void **state) {
  (void)state;
  static bytes integrand;
  static _Alignas(8) uint8_t memory[4096];
  blocks *b;
  for (size_t i = 0; i < 4; ++i)
    u16(&integrand, i == 0 ? AGREEMENT_PLAIN : 0);
  blocks_config config = one_outcome(0.1);
  config.integrands = 1;
  config.integrand = integrand.byte;
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  for (uint32_t t = 0; t < BLOCKS * BLOCK; ++t) {
    const double reading = 2.0;
    if (rimi_blocks_row(b, 0.1 * t, &reading, NULL, NULL, NULL) != BLOCKS_DONE)
      continue;
    /* A mean of 2 in a block's first and second half alike. */
    assert_true(fabs(rimi_blocks_early(b)[0] + rimi_blocks_late(b)[0] - 4.0) < 1e-12);
    assert_true(fabs(rimi_blocks_late(b)[0] - 2.0) < 1e-12);
  }
}

/* A row that is late by half of a period is no gap, one that is later is. */
static void a_late_row_is_no_gap(void **state) {
  (void)state;
  static _Alignas(8) uint8_t memory[4096];
  const double reading = 2.0;
  blocks *b;
  const blocks_config config = one_outcome(0.25);
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  (void)rimi_blocks_row(b, 8.0, &reading, NULL, NULL, NULL);
  (void)rimi_blocks_row(b, 8.375, &reading, NULL, NULL, NULL);
  assert_int_equal(rimi_blocks_get_health(b).gaps, 0);
  (void)rimi_blocks_row(b, 8.8125, &reading, NULL, NULL, NULL);
  assert_int_equal(rimi_blocks_get_health(b).gaps, 1);
}

/* A block of five rows bears one missing row, which counts as its own; with two it begins anew. */
static void a_block_begins_anew_after_two_missing_rows(void **state) {
  (void)state;
  static _Alignas(8) uint8_t memory[4096];
  const double reading = 2.0;
  for (uint32_t missing = 1; missing <= 2; ++missing) {
    blocks *b;
    const blocks_config config = one_outcome(0.25);
    assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
    for (uint32_t t = 0; t < 2 + BLOCK; ++t) {
      const double t_s = 8.0 + 0.25 * (t < 2 ? t : t + missing);
      const bool ends = t + 1 == (missing == 1 ? BLOCK - 1 : 2 + BLOCK);
      if (t + 1 == BLOCK && missing == 1)
        break;
      assert_int_equal(rimi_blocks_row(b, t_s, &reading, NULL, NULL, NULL),
                       ends ? BLOCKS_DONE : BLOCKS_NONE);
    }
  }
}

/* An angle goes on through its end from the second row on, in either direction. */
static void an_angle_goes_on_from_the_second_row(void **state) {
  (void)state;
  static const uint8_t angle[1] = {BLOCKS_ANGLE_RAD};
  for (int sign = -1; sign <= 1; sign += 2) {
    static _Alignas(8) uint8_t memory[4096];
    blocks *b;
    blocks_config config = one_outcome(0.25);
    config.role = angle;
    assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
    for (uint32_t t = 0; t < BLOCK; ++t) { /* past half a turn, and so it stays */
      const double reading = sign * (t == 0 ? 3.0 : -3.0);
      (void)rimi_blocks_row(b, 8.0 + 0.25 * t, &reading, NULL, NULL, NULL);
    }
    const double beyond = 2.0 * 3.14159265358979323846 - 3.0;
    const double mean = sign * (3.0 + 4.0 * beyond) / BLOCK; /* whole turns go out again */
    assert_true(cos(rimi_blocks_context(b)[0] - mean) > 1.0 - 1e-12);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(decays_without_inputs),
                                     cmocka_unit_test(an_angle_goes_on_from_the_second_row),
                                     cmocka_unit_test(integrands_without_times),
                                     cmocka_unit_test(a_late_row_is_no_gap),
                                     cmocka_unit_test(a_block_begins_anew_after_two_missing_rows)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
