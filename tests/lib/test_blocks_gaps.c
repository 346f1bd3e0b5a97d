/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c after a gap: from which number of missing rows on a block begins anew, and what
 * is not known any more of a command's means and integral. Times are exact: edges are met. And rows
 * that come faster or slower than those that were trained. */
#include <math.h>

#include "monitor/blocks.h"
#include "section_bytes.h"

enum { COMMAND = 0, SENSOR = 1, D = 2, SAID = 10 };
#define PERIOD_S 0.25
#define INVERSE_SD 0.0625 /* of the integral */
#define SHARE 0.25        /* of the slow mean, per row */

typedef struct bench {
  bytes basis, outcome_feature, range;
  _Alignas(8) uint8_t memory[4096];
  blocks *b;
} bench;

/* One command, whose integral is a term: nothing fades. So is its slow exponential mean, where it
 * has a second filter, the first or the second of them: */
typedef enum slow { NONE, FIRST, SECOND } slow;

static void start(bench *s, uint16_t block_rows, bool with_gaps, slow which) {
  static const uint8_t role[D] = {BLOCKS_COMMAND, 0};
  memset(s, 0, sizeof *s);
  bytes *b = &s->basis;
  const uint32_t n = which == NONE ? 1 : 2;
  const uint32_t header[8] = {BASIS_LAYOUT, 1, n, n, 0, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  u16(b, COMMAND);
  u16(b, BASIS_PLAIN);
  for (size_t t = 0; t < n; ++t)
    f32(b, t + 1 == which ? SHARE : 1.0);
  const uint16_t term[2][4] = {{BASIS_INTEGRAL, 0}, {BASIS_MEAN, which == SECOND ? 1 : 0}};
  for (size_t i = 0; i < 4 * n; ++i)
    u16(b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * n; ++i)
    f32(b, i < n ? 0.0 : i == n ? INVERSE_SD : 1.0);
  f32(b, 0.0);
  u16(&s->outcome_feature, SENSOR);
  for (size_t k = 0; k < 2 * D; ++k)
    f32(&s->range, k < D ? -8.0 : 8.0);
  blocks_config config = {.features = D,
                          .outcomes = 1,
                          .block_rows = block_rows,
                          .period_s = PERIOD_S,
                          .outcome_feature = s->outcome_feature.byte,
                          .role = role,
                          .range = s->range.byte,
                          .with_gaps = with_gaps};
  assert_int_equal(rimi_basis_open(&config.basis, b->byte, b->size, D, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&s->b, s->memory, sizeof s->memory, &config), RIM_OK);
}

static blocks_result offer_at(bench *s, double t_s, double command) {
  const double row[D] = {command, 1.0};
  return rimi_blocks_row(s->b, t_s, row, NULL, NULL, NULL);
}
static blocks_result offer(bench *s, uint32_t t) { return offer_at(s, PERIOD_S * t, 2.0); }

/* A block of 16 rows bears six missing ones, which count as rows of it; where the next row comes
 * half a block later, it begins anew. */
static void a_row_half_a_block_late_begins_one(void **state) {
  (void)state;
  enum { ROWS = 16 };
  for (uint32_t missing = 6; missing <= 7; ++missing) {
    bench s;
    start(&s, ROWS, false, NONE);
    const bool anew = missing + 1u >= ROWS / 2u;
    for (uint32_t t = 0; t < 2 + ROWS; ++t) {
      const bool ends = t + 1 == (anew ? 2 + ROWS : ROWS - missing);
      assert_int_equal(offer(&s, t < 2 ? t : t + missing), ends ? BLOCKS_DONE : BLOCKS_NONE);
      if (ends)
        break;
    }
  }
}

/* A command may hide in a gap of half a block and say nothing new; what it did in a longer one is
 * not in its integral any more, as uncertain as anything in the command's range over that time. But
 * where the healthy runs had such gaps, models know integrals as they come. */
static void half_a_block_may_be_missing(void **state) {
  (void)state;
  enum { ROWS = 8 };
  for (uint32_t missing = 4; missing <= 5; ++missing) {
    for (int with_gaps = 0; with_gaps < 2; ++with_gaps) {
      bench s;
      start(&s, ROWS, with_gaps, NONE);
      for (uint32_t t = 0; t < 2 * ROWS; ++t)
        (void)offer(&s, t < ROWS ? t : t + missing);
      assert_int_equal(rimi_blocks_count(s.b), 2);
      assert_int_equal(rimi_blocks_knows_all(s.b), missing == 4 || with_gaps);
      if (rimi_blocks_knows_all(s.b))
        continue;
      const double sd = 16.0 / sqrt(12.0) * missing * PERIOD_S * INVERSE_SD;
      assert_true(fabs(rimi_blocks_unknown(s.b)[0] / BASIS_UNKNOWN_SD - sd) < 0.01 * sd);
    }
  }
}

/* Three missing rows hide nothing of the integral, but a slow mean keeps them: by the share of
 * theirs that is left, until that is forgotten. */
static void forgets_a_gap(slow which) {
  enum { ROWS = 8, MISSING = 3 };
  bench s;
  start(&s, ROWS, false, which);
  double left = 1.0 - SHARE - pow(1.0 - SHARE, MISSING + 1.0), mean = 0.0;
  uint32_t unknown = 0;
  for (uint32_t t = 0; t < 8 * ROWS; ++t) {
    const blocks_result made = offer(&s, t < ROWS ? t : t + MISSING);
    if (t >= ROWS) {
      mean += left / ROWS;
      left *= 1.0 - SHARE;
    }
    if (made != BLOCKS_DONE)
      continue;
    assert_int_equal(rimi_blocks_knows_all(s.b), !(mean > 1e-3));
    if (!rimi_blocks_knows_all(s.b)) {
      assert_int_equal(rimi_blocks_unknown(s.b)[0], 0);
      assert_true(fabs(rimi_blocks_unknown(s.b)[1] / BASIS_UNKNOWN_SD - mean) < 1e-4);
      ++unknown;
    }
    mean = 0.0;
  }
  assert_true(unknown > 1 && rimi_blocks_knows_all(s.b));
}

static void a_slow_mean_forgets_a_gap(void **state) {
  (void)state;
  forgets_a_gap(FIRST);
  forgets_a_gap(SECOND);
}

/* A mean of which a thousandth is not known is as good as known. Where half of it goes with each
 * row, a long gap leaves a half, a quarter... of 1000 rows as much as of one, to the bit. Where
 * ever so little less goes with each, it is more. */
static void a_thousandth_of_a_mean_is_as_good_as_known(void **state) {
  (void)state;
  enum { ROWS = 1000, MISSING = 500, SHARE_AT = 36 };
  for (int more = 0; more < 2; ++more) {
    bench s;
    start(&s, ROWS, false, FIRST);
    put_f32(s.basis.byte + SHARE_AT, more ? 0.5 - 1e-7 : 0.5);
    for (uint32_t t = 0; t < 2 * ROWS; ++t)
      (void)offer(&s, t < ROWS ? t : t + MISSING);
    assert_int_equal(rimi_blocks_count(s.b), 2);
    assert_int_equal(rimi_blocks_knows_all(s.b), more == 0);
  }
}

/* Of a run that began before its first row nobody knows what has gathered, however long it goes
 * on, while what a slow mean was then is forgotten row by row. */
static void stays_unknown(slow which) {
  enum { ROWS = 8 };
  bench s;
  start(&s, ROWS, false, which);
  rimi_blocks_begin_late(s.b);
  uint16_t before = UINT16_MAX;
  for (uint32_t t = 0; t < 12 * ROWS; ++t) {
    if (offer(&s, t) != BLOCKS_DONE)
      continue;
    const uint16_t *unknown = rimi_blocks_unknown(s.b);
    assert_false(rimi_blocks_knows_all(s.b) || rimi_blocks_knows_start(s.b));
    assert_true(unknown[0] >= BASIS_UNKNOWN_SD); /* a standard deviation or more */
    if (t < ROWS)                                /* of the first block itself nothing is said yet */
      continue;
    assert_true(unknown[1] < before || (unknown[1] == 0 && t > 4 * ROWS));
    assert_true(unknown[1] > 0 || t > 2 * ROWS);
    before = unknown[1];
  }
  assert_int_equal(before, 0);
}

static void what_gathered_before_a_late_start_stays_unknown(void **state) {
  (void)state;
  stays_unknown(FIRST);
  stays_unknown(SECOND);
}

/* All that the rest of a block says. */
static void finish(bench *s, uint32_t t, double *said) {
  while (offer(s, t) != BLOCKS_DONE)
    ++t;
  const bool knows = rimi_blocks_knows_all(s->b);
  const double all[SAID] = {rimi_blocks_context(s->b)[COMMAND],
                            rimi_blocks_context(s->b)[SENSOR],
                            rimi_blocks_outcomes(s->b)[0],
                            rimi_blocks_scatter(s->b)[0],
                            rimi_blocks_repeats(s->b)[0],
                            rimi_blocks_first(s->b)[0],
                            rimi_blocks_terms(s->b)[0],
                            rimi_blocks_terms(s->b)[1],
                            knows ? -1.0 : rimi_blocks_unknown(s->b)[0],
                            knows ? -1.0 : rimi_blocks_unknown(s->b)[1]};
  memcpy(said, all, sizeof all);
}

/* In the midst of a block after a gap any number of the run is hit. Where that changes what the
 * block says, the sum of the history has changed, so that nobody believes it. */
static void what_a_block_says_is_all_summed(void **state) {
  (void)state;
  enum { ROWS = 8, MISSING = 3, AT = ROWS + 3 };
  static _Alignas(8) uint8_t before[4096];
  bench s;
  start(&s, ROWS, false, SECOND);
  for (uint32_t t = 0; t < AT; ++t)
    (void)offer(&s, t < ROWS ? t : t + MISSING);
  memcpy(before, s.memory, sizeof before);
  const uint32_t sum = rimi_blocks_history_sum(s.b, 0);
  double healthy[SAID], said[SAID];
  finish(&s, AT + MISSING, healthy);
  assert_true(healthy[SAID - 1] > 0.0);
  size_t begin, changed = 0;
  (void)rimi_blocks_control(s.b, &begin);
  for (size_t at = (begin + 7u) & ~(size_t)7u; at < sizeof before; at += 8) {
    memcpy(s.memory, before, sizeof before);
    s.memory[at + 7] ^= 0x20u; /* of the exponent: 1 becomes next to nothing */
    const bool is_seen = rimi_blocks_history_sum(s.b, 0) != sum;
    finish(&s, AT + MISSING, said);
    if (memcmp(said, healthy, sizeof said) == 0)
      continue;
    assert_true(is_seen);
    ++changed;
  }
  assert_true(changed >= 10); /* sums, means, what is not known of them, an integral */
}

/* What a command gathers, and how fast its mean forgets, are of time. A block of slower rows is
 * longer: its integral is that of half a block after its middle. */
static void slower_and_faster_rows_gather_as_much(void **state) {
  (void)state;
  enum { ROWS = 8, STEP_AT = 20 };
  for (int percent = 93; percent <= 107; percent += 2) {
    bench s;
    start(&s, ROWS, false, SECOND);
    const double dt = 0.01 * percent * PERIOD_S;
    double integral = 0.0, mean = 0.0, commands = 0.0, means = 0.0;
    for (uint32_t t = 0; t < 8 * ROWS; ++t) {
      const double command = t < STEP_AT ? 2.0 : 5.0;
      integral += command * dt;
      mean = t == 0 ? command : command + (mean - command) * pow(1.0 - SHARE, dt / PERIOD_S);
      commands += command / ROWS;
      means += mean / ROWS;
      const blocks_result made = offer_at(&s, dt * t, command);
      assert_int_equal(made, (t + 1) % ROWS == 0 ? BLOCKS_DONE : BLOCKS_NONE);
      if (made != BLOCKS_DONE)
        continue;
      const double then = integral - 0.5 * ROWS * (dt - PERIOD_S) * commands;
      assert_true(fabs(rimi_blocks_terms(s.b)[0] - INVERSE_SD * then) < 1e-6);
      assert_true(fabs(rimi_blocks_terms(s.b)[1] - means) < 1e-6);
      commands = means = 0.0;
    }
  }
}

/* Rows that come much too fast are not examined, and do not count as so much time. */
static void a_burst_gathers_no_more_than_its_time(void **state) {
  (void)state;
  enum { ROWS = 8, BEFORE = 16, BURST = 40 };
  bench s;
  start(&s, ROWS, false, FIRST);
  double t_s = 0.0;
  uint32_t ended = 0;
  for (uint32_t t = 0; t < 160; ++t) {
    t_s += t < BEFORE || t >= BEFORE + BURST ? PERIOD_S : PERIOD_S / 4;
    if (offer_at(&s, t_s, 2.0) != BLOCKS_DONE)
      continue;
    ++ended;
    assert_true(t < BEFORE + ROWS || t > BEFORE + BURST);
    if (t < BEFORE || t > BEFORE + BURST + ROWS)
      assert_true(fabs(rimi_blocks_terms(s.b)[0] - INVERSE_SD * 2.0 * t_s) < 1e-6);
  }
  assert_true(ended > 8 && rimi_blocks_get_health(s.b).wrong_rate > BURST / 2);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_row_half_a_block_late_begins_one),
      cmocka_unit_test(half_a_block_may_be_missing),
      cmocka_unit_test(a_slow_mean_forgets_a_gap),
      cmocka_unit_test(a_thousandth_of_a_mean_is_as_good_as_known),
      cmocka_unit_test(what_gathered_before_a_late_start_stays_unknown),
      cmocka_unit_test(what_a_block_says_is_all_summed),
      cmocka_unit_test(slower_and_faster_rows_gather_as_much),
      cmocka_unit_test(a_burst_gathers_no_more_than_its_time),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
