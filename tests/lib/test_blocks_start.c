/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c: whether a run begins as healthy runs do, where readings are out of range. */
#include "image/basis.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

#include <math.h>

enum { COMMAND, SENSOR, OTHER, D, O = 2, BLOCK = 5 };

/* A command, which is the model's one term, and two outcomes. Healthy runs begin where all are 0,
 * +-.25; the command goes to +-1, the outcomes to +-10 and +-4. Later on all are .7, +-.1, or that
 * is not known, where late_nats is NAN. */
static blocks *started(double late_nats) {
  static bytes basis, outcome_feature, range;
  static _Alignas(8) uint8_t memory[4096];
  static const uint8_t role[D] = {BLOCKS_COMMAND, 0, 0};
  static const double widest[D] = {1.0, 10.0, 4.0};
  basis.size = outcome_feature.size = range.size = 0;
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, 1, 0, isnan(late_nats) ? 2 : 4, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(&basis, header[i]);
  u16(&basis, COMMAND);
  u16(&basis, BASIS_PLAIN);
  f32(&basis, 1.0); /* share of the time constant: the row itself */
  for (size_t i = 0; i < 4; ++i)
    u16(&basis, i == 0 ? BASIS_MEAN : 0);
  f32(&basis, 0.0);
  f32(&basis, 1.0);
  for (size_t i = 0; i < 2 * O + 2 * D; ++i) /* first, first_sd; start, start_sd */
    f32(&basis, i < O || (i >= 2 * O && i < 2 * O + D) ? 0.0 : 0.25);
  if (!isnan(late_nats)) {
    const double learnt_s = 100.0, begin[2] = {0.0, 1.0};
    f32(&basis, learnt_s);
    f32(&basis, begin[0]);
    f32(&basis, begin[1]);
    f32(&basis, late_nats);
    for (size_t i = 0; i < 2 * D; ++i)
      f32(&basis, i < D ? 0.7 : 0.1);
    for (size_t k = 0; k < 2; ++k) { /* features go by themselves */
      for (size_t i = 0; i < D; ++i) {
        for (size_t j = 0; j <= i; ++j)
          f32(&basis, i == j ? 1.0 : 0.0);
      }
    }
  }
  u16(&outcome_feature, SENSOR);
  u16(&outcome_feature, OTHER);
  for (size_t f = 0; f < 2 * D; ++f)
    f32(&range, f < D ? -widest[f] : widest[f - D]);
  blocks_config config = {.features = D,
                          .outcomes = O,
                          .block_rows = BLOCK,
                          .period_s = 0.1,
                          .outcome_feature = outcome_feature.byte,
                          .role = role,
                          .range = range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, basis.byte, basis.size, D, O), RIM_OK);
  blocks *b;
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  return b;
}

/* Two outcomes at which no healthy run begins are another start; but those of them that are out of
 * range, beyond it and twice its width, are a wrong sensor or unit. */
static void outcomes_out_of_range_are_no_other_start(void **state) {
  (void)state;
  const struct {
    double command, sensor, other;
    bool is_start;
  } cases[] = {
      {0.0, 3.0, 0.0, true},    {0.0, 3.0, 3.0, false},   {0.0, 49.0, 3.0, false},
      {0.0, 51.0, 3.0, true},   {0.0, -49.0, 3.0, false}, {0.0, -51.0, 3.0, true},
      {0.0, 49.0, 19.0, false}, {0.0, 49.0, -21.0, true}, {0.0, 51.0, 21.0, true},
      {1.1, 51.0, 21.0, false}, {1.9, 51.0, 21.0, false}, /* a command was given to the vehicle */
  };
  for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
    blocks *const b = started(NAN);
    const double x[D] = {cases[k].command, cases[k].sensor, cases[k].other};
    for (uint32_t t = 0; t < BLOCK; ++t)
      (void)rimi_blocks_row(b, 0.1 * t, x, NULL, NULL, NULL);
    assert_int_equal(rimi_blocks_count(b), 1);
    assert_int_equal(rimi_blocks_knows_start(b), cases[k].is_start);
  }
}

/* Features of which each could be that of a first block, and which together are those of a later
 * one: 2.8 standard deviations, 4.84 nats each. The outcome that says most for it does not count:
 * it may be a sensor that is wrong. */
static void what_is_rather_a_later_block_is_no_start(void **state) {
  (void)state;
  const struct {
    double command, sensor, other, late_nats;
    bool is_start;
  } cases[] = {
      {0.7, 0.7, 0.7, 9.6, false},
      {0.7, 0.7, 0.7, 9.8, true},
      {0.7, 0.7, 0.7, NAN, true},
      {0.0, 0.7, 0.7, 3.0, true},
      {0.7, 0.7, 0.0, 3.0, true},
      {0.0, 0.0, 0.0, 3.0, true},
      {0.7, 51.0, 0.7, 3.0, false},
      {0.7, 51.0, 0.7, 9.8, true}, /* the sensor that does not count is the one out of range */
      /* Rather a first block, by 12.7 and 51.2 nats, than a later one: those that were learnt from
       * may all have been that by more. */
      {0.35, 0.35, 0.35, -12.0, true},
      {0.35, 0.35, 0.35, -13.0, false},
      {0.0, 0.0, 0.0, -51.0, true},
      /* Sensors that are out of range say nothing; of two of them, the rest says too little. */
      {0.35, 51.0, 0.35, -8.0, true},
      {0.35, 51.0, 0.35, -9.0, false},
      {0.35, 51.0, 21.0, -9.0, true},
  };
  for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
    blocks *const b = started(cases[k].late_nats);
    const double x[D] = {cases[k].command, cases[k].sensor, cases[k].other};
    for (uint32_t t = 0; t < BLOCK; ++t)
      (void)rimi_blocks_row(b, 0.1 * t, x, NULL, NULL, NULL);
    assert_int_equal(rimi_blocks_knows_start(b), cases[k].is_start);
  }
}

/* A reading is out of range in a block where half of its rows or more are, of either sign. A
 * command and a feature that there is not never are. */
static void half_of_a_block_is_out_of_range(void **state) {
  (void)state;
  for (uint32_t rows = 0; rows <= BLOCK; ++rows) {
    blocks *const b = started(NAN);
    for (uint32_t t = 0; t < 3 * BLOCK; ++t) {
      const bool is_far = t / BLOCK == 1 && t % BLOCK < rows;
      const double far = t % 2 == 0 ? 1e300 : -1e300;
      const double x[D] = {is_far ? far : 0.1, is_far ? far : 0.2, 0.3};
      const bool ended = rimi_blocks_row(b, 0.1 * t, x, NULL, NULL, NULL) == BLOCKS_DONE;
      if (!ended)
        continue;
      const bool is_out = t / BLOCK == 1 && rows > 2; /* of five */
      assert_int_equal(rimi_blocks_is_out(b, SENSOR), is_out);
      assert_false(rimi_blocks_is_out(b, COMMAND));
      assert_false(rimi_blocks_is_out(b, OTHER));
      assert_false(rimi_blocks_is_out(b, D));
      assert_int_equal(rimi_blocks_knows_all(b), !is_out);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(outcomes_out_of_range_are_no_other_start),
                                     cmocka_unit_test(what_is_rather_a_later_block_is_no_start),
                                     cmocka_unit_test(half_of_a_block_is_out_of_range)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
