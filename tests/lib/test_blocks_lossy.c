/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c on rows that telemetry loses here and there: a block is of so much time, and
 * says what it would have said with all rows, where these lie on a straight line. */
#include <math.h>

#include "base/rng.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { COMMAND = 0, SENSOR = 1, D = 2, BLOCK = 10, SEED = 20261129 };
#define PERIOD_S 0.5
#define SHARE 0.25
#define INVERSE_SD (1.0 / 64.0)

typedef struct bench {
  bytes basis, outcome_feature, range, integrand;
  _Alignas(8) uint8_t memory[4096];
  blocks *b;
} bench;

/* Terms: a slow mean of the command, and its integral. The sensor is integrated. */
static void start(bench *s) {
  static const uint8_t role[D] = {BLOCKS_COMMAND, 0};
  memset(s, 0, sizeof *s);
  bytes *b = &s->basis;
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, 2, 0, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  u16(b, COMMAND);
  u16(b, BASIS_PLAIN);
  f32(b, SHARE);
  const uint16_t term[2][4] = {{BASIS_MEAN, 0}, {BASIS_INTEGRAL, 0}};
  for (size_t i = 0; i < 8; ++i)
    u16(b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 4; ++i)
    f32(b, i < 2 ? 0.0 : INVERSE_SD);
  f32(b, 0.0);
  u16(&s->outcome_feature, SENSOR);
  const uint16_t integrand[4] = {AGREEMENT_PLAIN, SENSOR, 0, 0};
  for (size_t i = 0; i < 4; ++i)
    u16(&s->integrand, integrand[i]);
  for (size_t k = 0; k < 2 * D; ++k)
    f32(&s->range, k < D ? -100.0 : 100.0);
  blocks_config config = {.features = D,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .period_s = PERIOD_S,
                          .outcome_feature = s->outcome_feature.byte,
                          .role = role,
                          .range = s->range.byte,
                          .integrands = 1,
                          .integrand = s->integrand.byte};
  assert_int_equal(rimi_basis_open(&config.basis, b->byte, b->size, D, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&s->b, s->memory, sizeof s->memory, &config), RIM_OK);
}

static blocks_result offer(bench *s, uint32_t t, double command, double reading) {
  const double row[D] = {command, reading};
  return rimi_blocks_row(s->b, PERIOD_S * t, row, NULL, NULL, NULL);
}

static void assert_close(double value, double expected) {
  if (!(fabs(value - expected) <= 1e-9 * (1.0 + fabs(expected))))
    fail_msg("%.12g instead of %.12g", value, expected);
}

/* Both on a line. */
static double command_at(uint32_t t) { return 3.0 + 0.125 * t; }
static double reading_at(uint32_t t) { return 7.0 - 0.25 * t; }

/* Of both runs the same rows end the blocks; of one of them a fifth of the others are missing. */
static void lost_rows_change_nothing_on_a_line(void **state) {
  (void)state;
  static bench all, lossy;
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 0);
  start(&all);
  start(&lossy);
  uint32_t lost = 0, running = 0, blocks_seen = 0;
  for (uint32_t t = 0; t < 30 * BLOCK; ++t) {
    const bool ends = offer(&all, t, command_at(t), reading_at(t)) == BLOCKS_DONE;
    if (t > 0 && !ends && running < 3 && rimi_rng_uniform(&rng) < 0.2) {
      ++lost;
      ++running;
      continue;
    }
    running = 0;
    assert_int_equal(offer(&lossy, t, command_at(t), reading_at(t)) == BLOCKS_DONE, ends);
    if (!ends)
      continue;
    ++blocks_seen;
    for (uint32_t f = 0; f < D; ++f)
      assert_close(rimi_blocks_context(lossy.b)[f], rimi_blocks_context(all.b)[f]);
    assert_close(rimi_blocks_outcomes(lossy.b)[0], rimi_blocks_outcomes(all.b)[0]);
    assert_close(rimi_blocks_early(lossy.b)[0], rimi_blocks_early(all.b)[0]);
    assert_close(rimi_blocks_late(lossy.b)[0], rimi_blocks_late(all.b)[0]);
    assert_close(rimi_blocks_terms(lossy.b)[1], rimi_blocks_terms(all.b)[1]);
    /* A slow mean bends at first; over a gap it is taken to be straight. */
    assert_true(fabs(rimi_blocks_terms(lossy.b)[0] - rimi_blocks_terms(all.b)[0]) < 0.002);
    assert_true(rimi_blocks_adjoins(lossy.b) == (blocks_seen > 1));
    assert_false(rimi_blocks_jumped(lossy.b));
  }
  assert_true(blocks_seen == 30 && lost > 40);
}

/* So is a block whose rows come more slowly, by as much. */
static void slower_rows_integrate_over_their_time(void **state) {
  (void)state;
  static bench s;
  start(&s);
  uint32_t ended = 0;
  for (uint32_t t = 0; t < 4 * BLOCK; ++t) {
    const double row[D] = {3.0, 4.0};
    if (rimi_blocks_row(s.b, 1.0625 * PERIOD_S * t, row, NULL, NULL, NULL) != BLOCKS_DONE)
      continue;
    ++ended;
    assert_close(rimi_blocks_early(s.b)[0], 1.0625 * 4.0);
    assert_close(rimi_blocks_late(s.b)[0], 1.0625 * 4.0);
  }
  assert_int_equal(ended, 4);
}

/* Where the rows that would end a block are missing it is longer. What is integrated over it, and
 * the command's integral at its middle, are those of its time. */
static void a_longer_block_is_of_more_time(void **state) {
  (void)state;
  for (uint32_t missing = 1; missing <= BLOCK / 2; ++missing) {
    bench s;
    start(&s);
    for (uint32_t t = 0; t < 2 * BLOCK - 1; ++t)
      (void)offer(&s, t, 4.0, 2.0);
    const uint32_t last = 2 * BLOCK - 1 + missing, rows = BLOCK + missing;
    const bool too_long = missing + 1 >= BLOCK / 2;
    assert_int_equal(offer(&s, last, 4.0, 2.0) == BLOCKS_DONE, !too_long);
    if (too_long)
      continue;
    assert_close(rimi_blocks_share(s.b), (double)rows / (rows + BLOCK));
    assert_close(rimi_blocks_since_start_s(s.b), PERIOD_S * (BLOCK + 0.5 * (rows - 1)));
    assert_close(rimi_blocks_early(s.b)[0] + rimi_blocks_late(s.b)[0], 4.0 * rows / BLOCK);
    const double at_end = 4.0 * PERIOD_S * (last + 1), behind = 4.0 * PERIOD_S * 0.5 * missing;
    assert_close(rimi_blocks_terms(s.b)[1], (at_end - behind) * INVERSE_SD);
  }
}

/* A command that jumps over a gap, and a reading that does: nobody knows when they did. */
static void a_jump_over_a_gap_is_told_for_two_blocks(void **state) {
  (void)state;
  for (int of_command = 0; of_command < 2; ++of_command) {
    bench s;
    start(&s);
    for (uint32_t t = 0; t < 6 * BLOCK; ++t) {
      const double after = t > 2 * BLOCK + 4 ? 60.0 : 0.0;
      if (t == 2 * BLOCK + 4 ||
          offer(&s, t, of_command ? after : 0.0, of_command ? 0.0 : after) != BLOCKS_DONE)
        continue;
      const uint32_t block = t / BLOCK;
      assert_int_equal(rimi_blocks_jumped(s.b), block == 2 || block == 3);
    }
    const double moved = 60.0 * PERIOD_S * INVERSE_SD;
    if (of_command)
      assert_true(fabs(rimi_blocks_unknown(s.b)[1] / BASIS_UNKNOWN_SD - 0.29 * moved) <
                  0.01 * moved);
  }
}

/* A reading out of range is limited, but scatters and repeats as it does. */
static void a_reading_out_of_range_repeats_as_it_does(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  for (int sticks = 0; sticks < 2; ++sticks) {
    bench s;
    start(&s);
    double scatter = 0.0;
    for (uint32_t t = 0; t < 4 * BLOCK; ++t) {
      const double noise = rimi_rng_normal(&rng), far = t < 2 * BLOCK ? 0.0 : 350.0;
      const bool done = offer(&s, t, 0.0, far + (sticks && far > 0.0 ? 0.5 : noise)) == BLOCKS_DONE;
      if (done && t < 2 * BLOCK)
        scatter = rimi_blocks_scatter(s.b)[0];
    }
    assert_close(rimi_blocks_outcomes(s.b)[0], 200.0); /* half of the range beyond its end */
    assert_close(rimi_blocks_repeats(s.b)[0], sticks ? 1.0 : 0.0);
    assert_true(sticks || fabs(rimi_blocks_scatter(s.b)[0] - scatter) < 2.0);
    assert_true(!sticks || rimi_blocks_scatter(s.b)[0] == BLOCKS_LN_LEAST);
  }
}

/* A sensor that drops out reads 0 in one row and something else in the next: no two readings are
 * equal, and yet each 0 counts, but for the first reading: nothing was before it. */
static void a_reading_of_zero_counts_as_a_repeat(void **state) {
  (void)state;
  bench s;
  start(&s);
  for (uint32_t t = 0; t < 4 * BLOCK; ++t) {
    const bool is_zero = t == 0 || (t >= 2 * BLOCK && t % 5 == 0);
    const double reading = !is_zero ? 1.0 + 0.01 * t : t % 2 == 0 ? 0.0 : -0.0;
    if (offer(&s, t, 0.0, reading) == BLOCKS_DONE)
      assert_close(rimi_blocks_repeats(s.b)[0], t < 2 * BLOCK ? 0.0 : 0.2);
  }
}

/* Where half of the rows are missing the mean time between them wanders about the limit. Once that
 * is another rate, nothing is examined before it is clearly right again. */
static void a_rate_is_wrong_until_it_is_clearly_right(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 2);
  bench s;
  start(&s);
  uint32_t t = 0, early = 0, late = 0, again = 0;
  for (; t < 4000; ++t) {
    if (rimi_rng_uniform(&rng) < 0.5)
      continue;
    const bool done = offer(&s, t, 0.0, 0.0) == BLOCKS_DONE;
    early += done && t < 200;
    late += done && t >= 200;
    assert_true(!done || !rimi_blocks_rate_is_wrong(s.b));
  }
  print_message("%u and %u blocks\n", early, late);
  assert_true(late < 4000 / BLOCK / 50);
  for (; t < 4200; ++t)
    again += offer(&s, t, 0.0, 0.0) == BLOCKS_DONE;
  assert_true(again > 15 && !rimi_blocks_rate_is_wrong(s.b));
}

/* Rows that all come a tenth late or early are of another rate. A twentieth is none, nor are single
 * rows that are late by most of a period. */
static void a_tenth_slower_or_faster_is_another_rate(void **state) {
  (void)state;
  static const struct {
    double row, late;
    bool is_wrong;
  } cases[] = {{1.1, 0.0, true}, {0.9, 0.0, true}, {1.06, 0.0, false}, {0.95, 0.0, false},
               {1.0, 0.9, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
    static bench s;
    start(&s);
    for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
      const double row[D] = {3.0, 4.0}, late = t % 12 == 11 ? cases[i].late : 0.0;
      (void)rimi_blocks_row(s.b, PERIOD_S * (cases[i].row * t + late), row, NULL, NULL, NULL);
      if (t >= 15) /* by then a tenth is told, before an alarm needs to be */
        assert_int_equal(rimi_blocks_rate_is_wrong(s.b), cases[i].is_wrong);
    }
    assert_int_equal(rimi_blocks_count(s.b) > 30, !cases[i].is_wrong);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(lost_rows_change_nothing_on_a_line),
      cmocka_unit_test(slower_rows_integrate_over_their_time),
      cmocka_unit_test(a_longer_block_is_of_more_time),
      cmocka_unit_test(a_jump_over_a_gap_is_told_for_two_blocks),
      cmocka_unit_test(a_reading_out_of_range_repeats_as_it_does),
      cmocka_unit_test(a_reading_of_zero_counts_as_a_repeat),
      cmocka_unit_test(a_tenth_slower_or_faster_is_another_rate),
      cmocka_unit_test(a_rate_is_wrong_until_it_is_clearly_right),
  };
  print_message("seed %d\n", SEED);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
