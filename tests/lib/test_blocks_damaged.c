/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c where section BASIS was damaged after it was opened: until the image's own check
 * finds that, an index behind the last feature is the first one's, and nothing else is read. */
#include <math.h>

#include "monitor/blocks.h"
#include "section_bytes.h"

enum { BLOCK = 5, INPUT = 32 }; /* where the first input is: after the header */

/* One input, a product of the one feature by itself, as it is; one term, its mean. */
static void put_basis(bytes *b) {
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, 1, 0, 0, 0, 0};
  b->size = 0;
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  u16(b, 0);
  u16(b, 0);
  f32(b, 1.0);
  const uint16_t mean[4] = {BASIS_MEAN, 0, 0, 0};
  for (size_t i = 0; i < 4; ++i)
    u16(b, mean[i]);
  f32(b, 0.0);
  f32(b, 1.0);
  f32(b, 0.0); /* the first reading's mean */
}

/* The square of the reading that the term says after a block, with these in place of the input's
 * two features. */
static double square_of(double reading, unsigned first, unsigned second) {
  static bytes basis, outcome_feature, range;
  static const uint8_t role[1] = {0};
  static _Alignas(8) uint8_t memory[4096];
  put_basis(&basis);
  outcome_feature.size = range.size = 0;
  u16(&outcome_feature, 0);
  f32(&range, -10.0);
  f32(&range, 10.0);
  blocks_config config = {.features = 1,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .period_s = 0.25,
                          .outcome_feature = outcome_feature.byte,
                          .role = role,
                          .range = range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, basis.byte, basis.size, 1, 1), RIM_OK);
  blocks *b;
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  put_u16(basis.byte + INPUT, first);
  put_u16(basis.byte + INPUT + 2, second);
  for (uint32_t t = 0; t < BLOCK; ++t)
    assert_int_equal(rimi_blocks_row(b, 8.0 + 0.25 * t, &reading, NULL, NULL, NULL),
                     t + 1 < BLOCK ? BLOCKS_NONE : BLOCKS_DONE);
  return rimi_blocks_terms(b)[0];
}

static void an_index_behind_the_last_is_the_first(void **state) {
  (void)state;
  static const unsigned wrong[] = {0, 1, 2, 3, 0x7ff0};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    assert_true(fabs(square_of(1.25, wrong[i], 0) - 1.5625) < 1e-12);
    assert_true(fabs(square_of(1.25, 0, wrong[i]) - 1.5625) < 1e-12);
    assert_true(fabs(square_of(-1.25, 0, wrong[i]) - 1.5625) < 1e-12);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(an_index_behind_the_last_is_the_first)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
