/* SPDX-License-Identifier: MIT */
/* The static bound of a step: the counts are the image's, the search never turns more often than
 * the bound says, and the bound grows with every count. That the instructions stay below it is held
 * by `make size`, on the Cortex-M7. */
#include "monitor_bench.h"

#include "monitor/inspect.h"
#include "monitor/work.h"
#include "search/select.h"

static int prepare(void **state) {
  (void)state;
  calibrate(false);
  calibrate(true);
  return 0;
}

static void counts_are_the_images(void **state) {
  (void)state;
  image m;
  rim_work_counts n;
  build(&m, &calibrated[true]);
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, &n), RIM_OK);
  assert_true(n.features == D && n.outcomes == O && n.region_features == REGION);
  assert_true(n.channels == O && n.ring == EXTERNAL_RING && n.bins == BINS && n.grid == GRID);
  assert_true(n.pairs == PAIRS && n.external && !n.trained && !n.corrected && !n.watched);
  assert_true(n.scans == RIM_SELECT_DEFAULT_SCANS && n.edges == RIM_SELECT_DEFAULT_EDGES);
  assert_true(n.moves == RIM_SELECT_DEFAULT_MOVES && n.budget == 1);
  assert_true(n.inputs + n.terms + n.means + n.fields + n.prototypes == 0);
  build(&m, &calibrated[false]);
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, &n), RIM_OK);
  assert_true(n.trained && !n.external && n.channels == CHANNELS && n.block_rows == BLOCK);
  assert_true(n.ring == TRAINED_RING && n.budget == 4 && n.inputs == INPUTS && n.times == TIMES);
  assert_true(n.terms == TERMS && n.means == MEANS && n.fields == FIELDS && n.prototypes == 0);
  recipe r = calibrated[false]; /* the command three times: no count is as large as another */
  bytes *basis = &r.section[RIM_SECTION_BASIS];
  memmove(basis->byte + 40, basis->byte + 32, basis->size - 32);
  for (size_t i = 0; i < 8; ++i)
    basis->byte[32 + i] = basis->byte[40 + i % 4];
  basis->size += 8;
  basis->byte[4] = 3;
  build(&m, &r);
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, &n), RIM_OK);
  assert_true(n.inputs == 3 && n.times == TIMES && n.terms == TERMS && n.means == MEANS);
  r = calibrated[true];
  set_word(&r, RIM_CONFIG_SMALL, 1);
  set_word(&r, RIM_CONFIG_EDGES, 7);
  set_word(&r, RIM_CONFIG_SCANS, 3);
  set_word(&r, RIM_CONFIG_MOVES, 9);
  set_word(&r, RIM_CONFIG_BUDGET, 2);
  build(&m, &r);
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, &n), RIM_OK);
  assert_true(n.edges == 7 && n.scans == 3 && n.moves == 9 && n.budget == 2 && n.small);
  n.edges = 99;
  m.byte[m.size / 2] ^= 1u;
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, &n), RIM_E_CRC);
  assert_int_equal(n.edges, 99);
  assert_int_equal(rimi_work_counts_of(NULL, 0, &n), RIM_E_ARGUMENT);
  assert_int_equal(rimi_work_counts_of(m.byte, m.size, NULL), RIM_E_ARGUMENT);
}

/* What monitor/work.h says of the turns, held to what the search counts of itself, step by step. */
static void assert_turns(bool small, uint32_t scans, uint32_t edges, uint32_t moves,
                         uint32_t budget) {
  recipe r = calibrated[true];
  set_word(&r, RIM_CONFIG_SMALL, small ? 1 : 0);
  set_word(&r, RIM_CONFIG_SCANS, scans);
  set_word(&r, RIM_CONFIG_EDGES, edges);
  set_word(&r, RIM_CONFIG_MOVES, moves);
  set_word(&r, RIM_CONFIG_BUDGET, budget);
  bench b;
  b.external = true;
  build(&b.blob, &r);
  start(&b);
  rim_work_counts n;
  assert_int_equal(rimi_work_counts_of(b.blob.byte, b.blob.size, &n), RIM_OK);
  if (small) { /* while the ring is nearly empty */
    edges *= 2u;
    moves *= 2u;
  }
  const uint32_t entries = small ? 1 : 2, beyond = 5;
  const uint32_t offers = (edges + beyond) / (beyond + 1) + 1;
  const uint32_t leads = small ? 0 : 2 * RIM_SELECT_CHAINS;
  rim_select_effort before = {0};
  uint32_t most_moves = 0, backfills = 0;
  for (uint32_t t = 0; t < 600; ++t) {
    (void)step(&b, 3, t, t > 200 ? 3.0 : 0.0);
    const rim_select_effort e = rimi_select_get_effort(rimi_monitor_search(b.monitor));
    const uint32_t moved = e.moves - before.moves;
    assert_true(e.scans - before.scans <= budget * n.scans);
    assert_true(e.edges - before.edges <= budget * (edges + beyond));
    assert_true(e.backfills - before.backfills <= budget * entries);
    assert_true(moved <= budget * (moves + entries * RIM_SELECT_CHAINS + offers + leads));
    most_moves = moved > most_moves ? moved : most_moves;
    backfills += e.backfills - before.backfills;
    before = e;
  }
  assert_true(most_moves >= moves && backfills > 0); /* it did search */
}

static void the_search_turns_no_more_often(void **state) {
  (void)state;
  assert_turns(true, 4, 4, 16, 1);
  assert_turns(true, 8, 12, 20, 1);
  assert_turns(false, 16, 48, 64, 1);
  assert_turns(false, 8, 12, 20, 1);
  assert_turns(true, 3, 20, 24, 3);
  assert_turns(true, 3, 24, 24, 2);
}

/* Six features, three outcomes, own predictions, the flight profile: make size measures it. */
static rim_work_counts rows(void) {
  return (rim_work_counts){.features = 6,
                           .outcomes = 3,
                           .channels = 3,
                           .region_features = 6,
                           .ring = 256,
                           .bins = 16,
                           .grid = 32,
                           .pairs = 5,
                           .scans = 4,
                           .edges = 4,
                           .moves = 20,
                           .budget = 1,
                           .block_rows = 1,
                           .external = true,
                           .small = true};
}

static rim_work_counts trained(void) {
  return (rim_work_counts){.features = 29,
                           .outcomes = 25,
                           .channels = 100,
                           .region_features = 11,
                           .ring = 192,
                           .budget = 3,
                           .block_rows = 35,
                           .inputs = 14,
                           .times = 9,
                           .terms = 213,
                           .means = 8,
                           .fields = 4,
                           .trained = true};
}

static uint32_t step_of(const rim_work_counts *n) {
  rim_work w;
  rimi_work_bound(n, &w);
  assert_true(w.step >= w.row && w.step >= w.search && w.step >= w.block && w.step >= w.judge);
  return w.step;
}

#define COSTS(field, value)                                                                        \
  do {                                                                                             \
    rim_work_counts more = n;                                                                      \
    more.field = (value);                                                                          \
    assert_true(step_of(&more) > step);                                                            \
  } while (0)

static void every_count_of_rows_counts(void **state) {
  (void)state;
  rim_work_counts n = rows();
  const uint32_t step = step_of(&n);
  COSTS(features, 7);
  COSTS(outcomes, 4);
  COSTS(channels, 4);
  COSTS(region_features, 7);
  COSTS(ring, 257);
  COSTS(bins, 17);
  COSTS(grid, 33);
  COSTS(pairs, 6);
  COSTS(scans, 5);
  COSTS(edges, 5);
  COSTS(edges, 48);
  COSTS(small, false);
  COSTS(moves, 60);
  COSTS(budget, 2);
  COSTS(watched, true);
  COSTS(corrected, true);
}

static void every_count_of_a_trained_image_counts(void **state) {
  (void)state;
  rim_work_counts n = trained();
  const uint32_t step = step_of(&n);
  COSTS(features, 30);
  COSTS(outcomes, 26);
  COSTS(channels, 101);
  COSTS(region_features, 12);
  COSTS(ring, 193);
  COSTS(budget, 4);
  COSTS(inputs, 15);
  COSTS(times, 10);
  COSTS(terms, 214);
  COSTS(means, 9);
  COSTS(fields, 5);
  COSTS(integrands, 1);
  COSTS(watched, true);
  COSTS(corrected, true);
  COSTS(prototypes, 1);
  n.prototypes = 16;
  n.top = 1;
  const uint32_t straight = step_of(&n);
  n.angles = 1;
  assert_true(step_of(&n) > straight);
  const uint32_t one = step_of(&n);
  n.top = 2;
  assert_true(step_of(&n) > one);
  rim_work w;
  rimi_work_bound(&n, &w);
  assert_int_equal(w.halving, 0); /* it has no tables */
}

static void a_bound_that_does_not_fit_saturates(void **state) {
  (void)state;
  rim_work_counts n = rows();
  n.budget = UINT32_MAX;
  assert_int_equal(step_of(&n), UINT32_MAX);
  rim_work w = {0};
  rimi_work_bound(NULL, &w);
  rimi_work_bound(&n, NULL);
  assert_int_equal(w.step, 0);
}

/* Without pairs nothing is searched but intervals; few scans of few slices are all there are. */
static void what_is_not_there_costs_nothing(void **state) {
  (void)state;
  rim_work_counts n = rows();
  rim_work pairs, none, all, more;
  rimi_work_bound(&n, &pairs);
  n.pairs = 0;
  rimi_work_bound(&n, &none);
  assert_true(10 * none.search < pairs.search);
  n.scans = 18;
  rimi_work_bound(&n, &all);
  n.scans = 400;
  rimi_work_bound(&n, &more);
  assert_int_equal(all.search, more.search);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(counts_are_the_images),
      cmocka_unit_test(the_search_turns_no_more_often),
      cmocka_unit_test(every_count_of_rows_counts),
      cmocka_unit_test(every_count_of_a_trained_image_counts),
      cmocka_unit_test(a_bound_that_does_not_fit_saturates),
      cmocka_unit_test(what_is_not_there_costs_nothing),
  };
  return cmocka_run_group_tests(tests, prepare, NULL);
}
