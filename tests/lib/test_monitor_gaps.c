/* SPDX-License-Identifier: MIT */
/* What a trained monitor knows after a gap in the rows: of states that went on from a reading, and
 * of commands that nobody saw. */
#include <math.h>

#define BENCH_OUTCOMES 4
#include "rolled_bench.h"

#include "monitor/work.h"

enum { RHO = 2, GAP_AT = 30, GAP = 40, ENDS = 120, RUN = 921 }; /* blocks */

/* The autocorrelation of an outcome's residuals. */
static void put_rho(recipe *r, uint32_t outcome, double rho) {
  put_noise_number(r, outcome, RHO, rho);
}

static void begin(const recipe *r) {
  from(r, false);
  m->guard.busy = false;
}

static void take_rows(uint32_t from_block, uint32_t to_block) {
  for (uint32_t t = from_block * BLOCK; t < to_block * BLOCK; ++t)
    (void)step(&b, RUN, t, 0.0);
}

static bool newest_is_known(uint32_t channel) {
  return search_is_known(m->search, channel, search_slot(m->search, m->search->held - 1u));
}

static void assert_known(bool other, bool in, bool out, bool tank) {
  const bool known[O] = {other, in, out, tank};
  for (uint32_t o = 0; o < O; ++o)
    assert_true(newest_is_known(o) == known[o]);
}

/* Where noise lasts, as in the first flow here, what the reading added is noise as ever. Where it
 * does not, as in the second, nothing is said of that state, nor of the tank that it empties, until
 * the flow has forgotten what it was. The command's own outcome has no state. */
static void a_state_is_known_where_noise_lasts(void **state) {
  (void)state;
  recipe r = rolled(own);
  put_rho(&r, IN, 0.95);
  put_rho(&r, OUT, 0.85);
  put_rho(&r, TANK, 0.95);
  begin(&r);
  take_rows(0, GAP_AT);
  for (uint32_t o = 0; o < O; ++o)
    assert_true(newest_is_known(o));
  take_rows(GAP_AT + GAP, GAP_AT + GAP + 1);
  assert_known(true, true, false, false);
  take_rows(GAP_AT + GAP + 1, ENDS);
  assert_known(true, true, true, true);
  put_rho(&r, OUT, 0.9); /* as much is enough */
  begin(&r);
  take_rows(0, GAP_AT);
  take_rows(GAP_AT + GAP, GAP_AT + GAP + 1);
  assert_known(true, true, true, true);
  put_rho(&r, TANK, 0.85); /* which keeps what the reading added */
  begin(&r);
  take_rows(0, GAP_AT);
  take_rows(GAP_AT + GAP, ENDS);
  assert_known(true, true, true, false);
}

/* Healthy runs that had gaps have taught what the reading adds, and what an integral lacks. */
static void healthy_runs_with_gaps_teach_it(void **state) {
  (void)state;
  for (uint32_t layout = NOISE_LAYOUT; layout <= NOISE_LAYOUT_GAPS + 1u; ++layout) {
    recipe r = rolled(own);
    put_u32(r.section[RIM_SECTION_NOISE].byte, layout);
    if (layout > NOISE_LAYOUT_GAPS) {
      image blob;
      size_t size;
      build(&blob, &r);
      assert_int_equal(rim_monitor_size(blob.byte, blob.size, &size), RIM_E_VERSION);
      break;
    }
    put_u16(r.section[RIM_SECTION_BASIS].byte + 32 + 4 * INPUTS + 4 * TIMES, BASIS_INTEGRAL);
    begin(&r);
    take_rows(0, GAP_AT);
    const bool taught = layout == NOISE_LAYOUT_GAPS;
    take_rows(GAP_AT + GAP, GAP_AT + GAP + 1);
    assert_known(taught, taught, taught, taught);
    take_rows(GAP_AT + GAP + 1, ENDS); /* the flows have forgotten it */
    assert_known(taught, true, true, taught);
  }
}

/* Where all outcomes follow from a state that is not known any more, blocks are examined and say
 * nothing. That is no health, however much was seen before; nor is it an alarm. */
static void blocks_that_say_nothing_are_no_health(void **state) {
  (void)state;
  static const uint16_t none[O] = {NONE, NONE, NONE, NONE};
  recipe r = rolled(none);
  uint8_t *const weight = r.section[RIM_SECTION_BEHAVIOUR].byte + 16 + 4 * 4 * O;
  for (size_t o = 0; o < O; ++o) /* ever so little, and yet nobody knows how much the tank holds */
    put_f32(weight + 4 * (o * ROLLED_TERMS + 1 + Z_TANK), 1e-6);
  for (uint32_t c = 0; c < CHANNELS; ++c)
    put_noise_number(&r, c, RHO + 1, 1e6); /* what the rows do here is noise */
  begin(&r);
  take_rows(0, GAP_AT);
  rim_verdict v = step(&b, RUN, GAP_AT * BLOCK, 0.0);
  assert_true(v.level == RIM_LEVEL_OK && v.reason == RIM_REASON_NONE);
  const uint32_t begins = (GAP_AT + GAP) * BLOCK;
  for (uint32_t t = begins; t < ENDS * BLOCK; ++t) {
    v = step(&b, RUN, t, 0.0);
    const bool is_blind = (t + 1 - begins) / BLOCK >= RIM_MONITOR_LEAST_BLOCKS;
    assert_int_equal(v.level, is_blind ? RIM_LEVEL_STALE : RIM_LEVEL_OK);
    assert_int_equal(v.reason, is_blind ? RIM_REASON_TOO_FEW : RIM_REASON_NONE);
  }
  rim_monitor_restart(m, 0.0);
  v = step(&b, RUN, ENDS * BLOCK, 0.0);
  assert_int_equal(v.level, RIM_LEVEL_OK);
}

/* A step covers a short gap: nothing went on from a reading. */
static void a_short_gap_is_no_new_beginning(void **state) {
  (void)state;
  const recipe r = rolled(own);
  begin(&r);
  take_rows(0, GAP_AT);
  for (uint32_t t = GAP_AT * BLOCK + BLOCK / 2; t < ENDS * BLOCK; ++t)
    (void)step(&b, RUN, t, 0.0);
  assert_int_equal(rim_monitor_get_health(m).rows.gaps, 1);
  for (uint32_t o = 0; o < O; ++o)
    assert_true(newest_is_known(o));
}

/* An error of the commands that lasts shows in what is new in a block by 1 - rho of it. Until it
 * is small enough the blocks are partly known: ln(1 - rho) of its time constant fewer. */
static void commands_are_known_sooner_where_noise_lasts(void **state) {
  (void)state;
  const double rho = 0.5;
  uint32_t partly[2];
  for (int lasts = 0; lasts < 2; ++lasts) {
    recipe r = without_integrals();
    put_u16(r.section[RIM_SECTION_BASIS].byte + 32 + 4 * INPUTS + 4 * TIMES + 2, 1); /* slow */
    for (uint32_t c = 0; c < CHANNELS; ++c)
      put_rho(&r, c, lasts ? rho : 0.0);
    begin(&r);
    take_rows(0, GAP_AT);
    take_rows(GAP_AT + 2, ENDS);
    partly[lasts] = rim_monitor_get_health(m).partly;
  }
  const double share = (double)rimi_le_f32(rimi_blocks_basis(m->rows)->share, 1);
  const double fewer = log(1.0 - rho) / (BLOCK * log(1.0 - share));
  print_message("%u and %u blocks, expected %.2f fewer\n", partly[0], partly[1], fewer);
  assert_true(partly[1] > 0 && fewer > 1.0);
  assert_true(fabs((double)partly[0] - (double)partly[1] - fewer) <= 1.0);
}

/* What a gap leaves unknown counts where somebody looks: of channels that are not watched (anything
 * up to a half is no) no block is told as partly known. */
static void channels_that_are_not_watched_have_no_partly_known_blocks(void **state) {
  (void)state;
  static const double active[] = {0.0, 0.5, 1.0};
  for (size_t i = 0; i < 3; ++i) {
    recipe r = without_integrals();
    put_u16(r.section[RIM_SECTION_BASIS].byte + 32 + 4 * INPUTS + 4 * TIMES + 2, 1); /* slow */
    for (uint32_t c = 0; c < CHANNELS; ++c)
      put_noise_number(&r, c, 0, active[i]);
    begin(&r);
    take_rows(0, GAP_AT);
    take_rows(GAP_AT + 2, ENDS);
    assert_true((rim_monitor_get_health(m).partly > 0) == (active[i] > 0.5));
  }
}

/* How much the noise of an outcome scatters may follow from commands as well: where these are not
 * known, neither is that, and no other channel is touched. */
static void scatter_that_commands_explain_is_unknown_after_a_gap(void **state) {
  (void)state;
  enum { OF = 1 };
  recipe r = without_integrals();
  put_u16(r.section[RIM_SECTION_BASIS].byte + 32 + 4 * INPUTS + 4 * TIMES + 2, 1); /* slow */
  uint8_t *weight = r.section[RIM_SECTION_BEHAVIOUR].byte + 16 + 4 * 2 * 2 * O;
  for (uint32_t t = 0; t < 2 * O; ++t)
    put_f32(weight + 4 * t, t == O + OF ? 20.0 : 0.0);
  begin(&r);
  take_rows(0, GAP_AT);
  take_rows(GAP_AT + 2, GAP_AT + 4);
  for (uint32_t c = 0; c < CHANNELS; ++c)
    assert_true(newest_is_known(c) == (c != RIM_CHANNEL_SCATTER * O + OF));
}

/* States that are rolled forward cost, by the number of their rates. */
static void rates_are_in_the_bound(void **state) {
  (void)state;
  const recipe r = rolled(own);
  rim_work_counts n;
  rim_work with, without;
  begin(&r);
  assert_int_equal(rimi_work_counts_of(b.blob.byte, b.blob.size, &n), RIM_OK);
  assert_int_equal(n.rates, RATES);
  rimi_work_bound(&n, &with);
  n.rates = 0;
  rimi_work_bound(&n, &without);
  assert_true(with.block > without.block && with.step > without.step);
}

/* A block whose first row comes up to half of its length late follows the one before, for the rows
 * that are missing count as its own, however long it is; after a longer gap it lies apart. */
static void a_block_follows_up_to_half_of_it_late(void **state) {
  (void)state;
  for (uint32_t rows = 2 * BLOCK; rows <= 4 * BLOCK; rows *= 2) {
    for (uint32_t missing = rows / 2 - 2; missing <= rows / 2; missing += 2) {
      recipe r = without_integrals();
      set_word(&r, RIM_CONFIG_BLOCK_ROWS, rows);
      begin(&r);
      for (uint32_t t = 0; t < 30 * rows; ++t)
        (void)step(&b, RUN, t < 25 * rows ? t : t + missing, 0.0);
      const uint32_t first = 24; /* after the gap; the first block of a run is not held */
      assert_int_equal(m->search->held, 29);
      assert_true((search_apart(m->search)[first] != 0) == (missing == rows / 2));
      assert_int_equal(search_apart(m->search)[first + 1], 0);
    }
  }
}

/* One row of each block is missing: too few readings follow on each other to say how much they
 * scatter and repeat, while their means are known. */
static void scatter_needs_readings_in_a_row(void **state) {
  (void)state;
  const recipe r = without_integrals();
  begin(&r);
  take_rows(0, GAP_AT);
  for (uint32_t t = GAP_AT * BLOCK; t < (GAP_AT + 4) * BLOCK; ++t) {
    if (t % BLOCK != 1)
      (void)step(&b, RUN, t, 0.0);
  }
  assert_int_equal(rim_monitor_get_health(m).rows.gaps, 4);
  assert_int_equal(rimi_search_blocks(m->search), GAP_AT + 4 - 1); /* the first is not held */
  for (uint32_t c = 0; c < CHANNELS; ++c)
    assert_true(newest_is_known(c) == (c / O < RIM_CHANNEL_SCATTER));
  take_rows(GAP_AT + 4, GAP_AT + 6);
  for (uint32_t c = 0; c < CHANNELS; ++c)
    assert_true(newest_is_known(c));
}

/* What the command did in missing rows is never learnt by a state that keeps it, and what the flows
 * did not bring meanwhile is not either. The flows themselves forget it, and so does what follows
 * from the command at once. Where healthy runs had long gaps, their noise has it. */
static void states_are_lost_to_missing_rows(void **state) {
  (void)state;
  for (uint32_t layout = NOISE_LAYOUT; layout <= NOISE_LAYOUT_GAPS; ++layout) {
    recipe r = rolled(own);
    put_u32(r.section[RIM_SECTION_NOISE].byte, layout);
    begin(&r);
    for (uint32_t t = 0; t < ENDS * BLOCK; ++t) {
      if (t < GAP_AT * BLOCK || t >= 2 * GAP_AT * BLOCK || t % BLOCK != 1)
        (void)step(&b, RUN, t, 0.0);
    }
    assert_known(true, true, true, layout == NOISE_LAYOUT_GAPS);
  }
}

/* What integrates a reading that jumped over a missing row is not known in that block, nor in the
 * next one, to which the second half of the integral counts. Where nothing jumped it is. */
static void a_sum_is_unknown_after_a_jump(void **state) {
  (void)state;
  uint32_t known = 0, unknown = 0;
  recipe r = without_integrals();
  put_row(&r, TANK, AGREEMENT_INTEGRAL, -1.0, 0, 0.0);
  begin(&r);
  for (uint32_t t = 0; t < 8 * ENDS * BLOCK; ++t) {
    if (t % (5 * BLOCK) == 1 || step(&b, RUN, t, 0.0).blocks < GAP_AT || t % BLOCK != BLOCK - 1)
      continue;
    for (uint32_t o = 0; o < O; ++o) {
      const bool is_known = newest_is_known(RIM_CHANNEL_AGREEMENT * O + o);
      assert_true(is_known == !(o == TANK && rimi_blocks_jumped(m->rows)));
      known += o == TANK && is_known;
      unknown += o == TANK && !is_known;
    }
  }
  print_message("%u and %u\n", known, unknown);
  assert_true(known > 20 && unknown > 20);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_state_is_known_where_noise_lasts),
      cmocka_unit_test(healthy_runs_with_gaps_teach_it),
      cmocka_unit_test(blocks_that_say_nothing_are_no_health),
      cmocka_unit_test(a_short_gap_is_no_new_beginning),
      cmocka_unit_test(commands_are_known_sooner_where_noise_lasts),
      cmocka_unit_test(channels_that_are_not_watched_have_no_partly_known_blocks),
      cmocka_unit_test(scatter_that_commands_explain_is_unknown_after_a_gap),
      cmocka_unit_test(rates_are_in_the_bound),
      cmocka_unit_test(a_block_follows_up_to_half_of_it_late),
      cmocka_unit_test(scatter_needs_readings_in_a_row),
      cmocka_unit_test(states_are_lost_to_missing_rows),
      cmocka_unit_test(a_sum_is_unknown_after_a_jump),
  };
  return cmocka_run_group_tests(tests, set_up_trained, NULL);
}
