/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c where an input is a harmonic: of the number of a mode, or of an angle. */
#include <math.h>

#include "base/real.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { FEATURES = 3, INPUTS = 2 * BASIS_HARMONICS, MODE = 0, ANGLE = 1, OUTCOME = 2 };

static uint16_t harmonic(unsigned k, bool is_sine) {
  return (uint16_t)((is_sine ? BASIS_SINE : BASIS_COSINE) - 2u * (k - 1u));
}

/* All harmonics of one feature, as they are in one row. */
static void put_basis(bytes *b, uint16_t feature, uint16_t lowest) {
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, 1, INPUTS, 0, 0, 0, 0};
  b->size = 0;
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  for (unsigned i = 0; i < INPUTS; ++i) {
    u16(b, feature);
    u16(b, i == INPUTS - 1u ? lowest : harmonic(1u + i / 2u, i % 2u == 1u));
  }
  f32(b, 1.0);
  for (size_t i = 0; i < INPUTS; ++i) {
    u16(b, BASIS_MEAN);
    u16(b, (uint16_t)i);
    u16(b, 0);
    u16(b, 0);
  }
  for (size_t i = 0; i < 2 * INPUTS; ++i)
    f32(b, i < INPUTS ? 0.0 : 1.0);
  f32(b, 0.0);
}

static const uint8_t role[FEATURES] = {1, 1 | BLOCKS_ANGLE_DEG, 0};

static blocks_config one_outcome(void) {
  static bytes outcome_feature, range;
  outcome_feature.size = range.size = 0;
  u16(&outcome_feature, OUTCOME);
  for (size_t f = 0; f < 2 * FEATURES; ++f)
    f32(&range, f < FEATURES ? -400.0 : 400.0);
  return (blocks_config){.features = FEATURES,
                         .outcomes = 1,
                         .block_rows = 1,
                         .period_s = 1.0,
                         .outcome_feature = outcome_feature.byte,
                         .role = role,
                         .range = range.byte};
}

static void harmonics_are_inputs(void **state) {
  (void)state;
  static bytes basis;
  static _Alignas(8) uint8_t memory[4096];
  for (uint16_t feature = MODE; feature <= ANGLE; ++feature) {
    blocks *b;
    put_basis(&basis, feature, BASIS_LEAST_HARMONIC);
    blocks_config config = one_outcome();
    assert_int_equal(rimi_basis_open(&config.basis, basis.byte, basis.size, FEATURES, 1), RIM_OK);
    assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
    unsigned blocks_done = 0;
    for (unsigned t = 0; t < 8; ++t) {
      const double row[FEATURES] = {(double)t, 40.0 * t, 1.0};
      if (rimi_blocks_row(b, (double)t, row, NULL, NULL, NULL) != BLOCKS_DONE)
        continue;
      ++blocks_done;
      const double of_row = feature == MODE ? row[MODE] : row[ANGLE] * 3.14159265358979324 / 180.0;
      for (unsigned i = 0; i < INPUTS; ++i) {
        const double angle = (1u + i / 2u) * of_row;
        assert_true(fabs(rimi_blocks_terms(b)[i] - (i % 2u == 1u ? sin(angle) : cos(angle))) <
                    1e-9);
      }
    }
    assert_true(blocks_done > 4);
  }
}

/* What lies below the highest harmonic is a product, of a feature that must exist. */
static void there_are_so_many_harmonics(void **state) {
  (void)state;
  static bytes basis;
  rim_basis view;
  assert_int_equal(harmonic(BASIS_HARMONICS, true), BASIS_LEAST_HARMONIC);
  put_basis(&basis, MODE, BASIS_LEAST_HARMONIC - 1u);
  assert_int_equal(rimi_basis_open(&view, basis.byte, basis.size, FEATURES, 1), RIM_E_RANGE);
}

/* Section LEVEL sees an angle as its cosine and, after all features, its sine. */
static void an_angle_is_two_inputs_of_a_level(void **state) {
  (void)state;
  const uint8_t roles[4] = {BLOCKS_ANGLE_DEG, BLOCKS_COMMAND, 0, BLOCKS_COMMAND | BLOCKS_ANGLE_RAD};
  const double context[4] = {210.0, 5.0, -7.0, 2.5};
  const double expected[6] = {cos(210.0 * RIM_PI / 180.0), 5.0,     -7.0, cos(2.5),
                              sin(210.0 * RIM_PI / 180.0), sin(2.5)};
  double x[7] = {[6] = 9.0};
  assert_int_equal(rimi_level_inputs(roles, 4, context, x), 6);
  for (size_t i = 0; i < 6; ++i)
    assert_true(fabs(x[i] - expected[i]) < 1e-12);
  assert_true(x[6] == 9.0);
  assert_int_equal(rimi_level_inputs(roles, 4, NULL, NULL), 6);
  assert_int_equal(rimi_level_inputs(roles + 1, 2, NULL, NULL), 2);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(harmonics_are_inputs),
                                     cmocka_unit_test(there_are_so_many_harmonics),
                                     cmocka_unit_test(an_angle_is_two_inputs_of_a_level)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
