/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c where an input is how another one moves. */
#include <math.h>

#include "monitor/blocks.h"
#include "section_bytes.h"

enum { FEATURES = 3, INPUTS = 4, TIMES = 3, COMMAND = 0, OTHER = 1, OUTCOME = 2 };
enum { FILTERS = INPUTS * TIMES, LEFT_OUT_FROM = 30, LEFT_OUT_TO = 34 };

static const double share[TIMES] = {1.0, 0.33, 0.1};

/* The command, the other one, and how the command moves, as a direction and as a size. */
static void put_basis(bytes *b, uint16_t direction) {
  const uint16_t input[INPUTS][2] = {{OTHER, BASIS_PLAIN},
                                     {COMMAND, BASIS_PLAIN},
                                     {COMMAND, direction},
                                     {COMMAND, BASIS_MOVEMENT + 1u + BASIS_OF_SIZE}};
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, FILTERS, 0, 0, 0, 0};
  b->size = 0;
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < INPUTS; ++i) {
    u16(b, input[i][0]);
    u16(b, input[i][1]);
  }
  for (size_t t = 0; t < TIMES; ++t)
    f32(b, share[t]);
  for (uint16_t i = 0; i < FILTERS; ++i) {
    const uint16_t term[4] = {BASIS_MEAN, i, 0, 0};
    for (size_t k = 0; k < 4; ++k)
      u16(b, term[k]);
  }
  for (size_t i = 0; i < 2 * FILTERS; ++i)
    f32(b, i < FILTERS ? 0.0 : 0x1p-40); /* small enough that nothing is clipped */
  f32(b, 0.0);
}

static blocks *start(const bytes *basis) {
  static const uint8_t role[FEATURES] = {1, 1, 0};
  static _Alignas(8) uint8_t memory[4096];
  static bytes outcome_feature, range;
  blocks_config config = {.features = FEATURES, .outcomes = 1, .block_rows = 1, .period_s = 1.0};
  blocks *b;
  outcome_feature.size = range.size = 0;
  u16(&outcome_feature, OUTCOME);
  for (size_t f = 0; f < 2 * FEATURES; ++f)
    f32(&range, f < FEATURES ? -400.0 : 400.0);
  config.outcome_feature = outcome_feature.byte;
  config.role = role;
  config.range = range.byte;
  assert_int_equal(rimi_basis_open(&config.basis, basis->byte, basis->size, FEATURES, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&b, memory, sizeof memory, &config), RIM_OK);
  return b;
}

static double command_at(unsigned t) { return t < 10u ? 5.0 : t < 60u ? -20.0 : 3.0; }

static double term(const blocks *b, unsigned input, unsigned time) {
  return rimi_blocks_terms(b)[input * TIMES + time] * 0x1p40;
}

/* A step, and one in a gap, of which nobody knows more than that it was in between. */
static void a_movement_is_what_its_own_mean_lacks(void **state) {
  (void)state;
  static bytes basis;
  put_basis(&basis, BASIS_MOVEMENT + 1u);
  blocks *const b = start(&basis);
  double lag = command_at(0), slow[2] = {0.0, 0.0}, largest = 0.0;
  for (unsigned t = 0; t < 90u; ++t) {
    if (t >= LEFT_OUT_FROM && t < LEFT_OUT_TO)
      continue;
    const double row[FEATURES] = {command_at(t), 100.0 * sin(0.7 * t), 1.0};
    if (rimi_blocks_row(b, (double)t, row, NULL, NULL, NULL) != BLOCKS_DONE)
      continue;
    const unsigned rows = t == LEFT_OUT_TO ? 1u + LEFT_OUT_TO - LEFT_OUT_FROM : 1u;
    for (unsigned k = 0; k < rows; ++k) /* the command stands still in the gap */
      lag += share[1] * (row[COMMAND] - lag);
    const double off = row[COMMAND] - lag;
    const double now[2] = {copysign(sqrt(fabs(off)), off), fabs(off)};
    largest = fmax(largest, now[1]);
    for (unsigned i = 0; i < 2; ++i) {
      assert_true(fabs(term(b, 2u + i, 0) - now[i]) < 1e-5 * (1.0 + now[1]));
      slow[i] += share[2] * (now[i] - slow[i]);
      if (t < LEFT_OUT_FROM) /* behind the gap its means are interpolated */
        assert_true(fabs(term(b, 2u + i, 2) - slow[i]) < 1e-5 * (1.0 + largest));
    }
  }
  assert_true(largest > 10.0);
  assert_true(fabs(term(b, 3, 0)) < 1e-3); /* after the last step it has come to rest */
}

static void a_movement_is_of_a_plain_input_before_it(void **state) {
  (void)state;
  static bytes basis;
  rim_basis view;
  const struct {
    uint16_t direction;
    rim_status status;
  } of[] = {{BASIS_MOVEMENT + 1u, RIM_OK},
            {BASIS_MOVEMENT + 0u, RIM_E_RANGE},  /* of another feature */
            {BASIS_MOVEMENT + 2u, RIM_E_RANGE},  /* itself */
            {BASIS_MOVEMENT + 3u, RIM_E_RANGE}}; /* a movement, which comes later */
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    put_basis(&basis, of[i].direction);
    assert_int_equal(rimi_basis_open(&view, basis.byte, basis.size, FEATURES, 1), of[i].status);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_movement_is_what_its_own_mean_lacks),
                                     cmocka_unit_test(a_movement_is_of_a_plain_input_before_it)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
