/* SPDX-License-Identifier: MIT */
/* The memory of blocks: what each thing that is kept adds to it, counted by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "monitor/blocks.h"

static size_t more_than(const blocks_config *less, blocks_config more) {
  return rimi_blocks_size(&more) - rimi_blocks_size(less);
}

static const blocks_config one = {.features = 1, .outcomes = 1};

/* Doubles of 8 bytes; of a feature half as much for its turns, rounded up to whole doubles. */
static void features_outcomes_and_integrands(void **state) {
  (void)state;
  const blocks_config two = {.features = 2, .outcomes = 1};
  assert_int_equal(more_than(&one, two), 2 * 8);
  assert_int_equal(more_than(&two, (blocks_config){.features = 3, .outcomes = 1}), 2 * 8 + 8);
  assert_int_equal(more_than(&one, (blocks_config){.features = 1, .outcomes = 2}), 8 * 8);
  blocks_config more = one;
  more.integrands = 3; /* early and late */
  assert_int_equal(more_than(&one, more), 2 * 3 * 8);
}

/* Rows that bring predictions: the sums of what is left, of means and of deviations, and the latter
 * two of the block. */
static void predictions(void **state) {
  (void)state;
  const blocks_config external = {.features = 1, .outcomes = 1, .external = true};
  assert_int_equal(more_than(&one, external), 5 * 8);
  const blocks_config two = {.features = 1, .outcomes = 2, .external = true};
  assert_int_equal(more_than(&external, two), 13 * 8);
}

static size_t basis_adds(rim_basis basis) {
  blocks_config more = one;
  more.basis = basis;
  return more_than(&one, more);
}

static void the_basis(void **state) {
  (void)state;
  /* A filter and its sum of every input and time, three of a time, one of an input, and its count
   * and age of half as much, rounded up to whole doubles. */
  assert_int_equal(basis_adds((rim_basis){.inputs = 3, .times = 2}),
                   (2 * 3 * 2 + 3 * 2 + 3 + 2) * 8);
  assert_int_equal(basis_adds((rim_basis){.inputs = 4, .times = 2}),
                   (2 * 4 * 2 + 3 * 2 + 4 + 2) * 8);
  /* A state, its variance, and what is left of it. */
  assert_int_equal(basis_adds((rim_basis){.states = 5}), 3 * 5 * 8);
  assert_int_equal(basis_adds((rim_basis){.rates = 5}), 5 * 8);
  assert_int_equal(basis_adds((rim_basis){.means = 5}), 5 * 8);
  /* A term, and two bytes for what of it is unknown, rounded up to whole doubles. */
  const uint32_t terms[4] = {1, 4, 5, 8}, doubles[4] = {1 + 1, 4 + 1, 5 + 2, 8 + 2};
  for (size_t i = 0; i < 4; ++i)
    assert_int_equal(basis_adds((rim_basis){.terms = terms[i]}), 8 * doubles[i]);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(features_outcomes_and_integrands),
                                     cmocka_unit_test(predictions), cmocka_unit_test(the_basis)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
