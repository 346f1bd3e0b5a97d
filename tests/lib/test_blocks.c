/* SPDX-License-Identifier: MIT */
/* blocks: rows of telemetry to blocks. What a block says is held to a straightforward computation
 * over its rows; gaps, times, rates, values out of range, angles that wrap, and the first readings.
 */
#include <math.h>
#include <stdio.h>

#include "base/real.h"
#include "base/rng.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { D = 4, O = 2, BLOCK = 5, INPUTS = 5, TIMES = 2, FILTERS = INPUTS * TIMES };
enum { COMMAND = 0, SENSOR = 1, OTHER = 2, HEADING = 3 };
#define PERIOD_S 0.1
#define SEED 31u

static const double share[TIMES] = {1.0, 0.25};

/* op, a, b, c: every kind of term, filters 2 i + t. The side's half width is 1.75 (0x3fe00000). */
static const uint16_t terms[][4] = {
    {BASIS_MEAN, 1, 0},         {BASIS_MEAN, 4, 0},   {BASIS_PRODUCT, 1, 3},
    {BASIS_ABS, 1, 0},          {BASIS_DECAY, 0, 1},  {BASIS_INTEGRAL, 0, 0},
    {BASIS_INITIAL, 1, 1},      {BASIS_TIME, 0, 0},   {BASIS_MEAN, 7, 0},
    {BASIS_MEAN, 8, 0},         {BASIS_DECAY, 0, 0},  {BASIS_TRIPLE, 1, 3, 5},
    {BASIS_SIDE, 1, 0, 0x3fe0}, {BASIS_INITIAL, 1, 0}};
enum { TERMS = sizeof terms / sizeof *terms, MEANS = 2 };
static const uint16_t mean_filter[MEANS] = {0, 9};

#define CENTER 0.125
#define INVERSE_SD 0.25
#define FIRST_MEAN 0.5

typedef struct bench {
  bytes section, outcome_feature, range;
  uint8_t role[D];
  blocks_config config;
  _Alignas(8) uint8_t memory[4096];
  blocks *b;
} bench;

static void put_basis(bytes *b) {
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, TERMS, MEANS, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  const unsigned input[INPUTS][2] = {{COMMAND, BASIS_PLAIN},
                                     {COMMAND, BASIS_MAGNITUDE},
                                     {COMMAND, OTHER},
                                     {COMMAND, OTHER | BASIS_OF_PRODUCT},
                                     {HEADING, BASIS_PLAIN}};
  for (size_t i = 0; i < 2 * INPUTS; ++i)
    u16(b, input[i / 2][i % 2]);
  for (size_t t = 0; t < TIMES; ++t)
    f32(b, share[t]);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(b, terms[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(b, i < TERMS ? CENTER : INVERSE_SD);
  for (size_t i = 0; i < 2 * MEANS; ++i)
    u16(b, i % 2 == 0 ? mean_filter[i / 2] : 0);
  for (size_t i = 0; i < 2 * MEANS; ++i)
    f32(b, i < MEANS ? CENTER : INVERSE_SD);
  for (size_t o = 0; o < O; ++o)
    f32(b, FIRST_MEAN);
}

static void make(bench *b) {
  memset(b, 0, sizeof *b);
  put_basis(&b->section);
  u16(&b->outcome_feature, SENSOR);
  u16(&b->outcome_feature, HEADING);
  const double range[2 * D] = {-1, -10, -4, -4, 1, 10, 4, 4};
  for (size_t i = 0; i < 2 * D; ++i)
    f32(&b->range, range[i]);
  b->role[COMMAND] = BLOCKS_COMMAND;
  b->role[HEADING] = BLOCKS_ANGLE_RAD;
  b->config = (blocks_config){.features = D,
                              .outcomes = O,
                              .block_rows = BLOCK,
                              .period_s = PERIOD_S,
                              .outcome_feature = b->outcome_feature.byte,
                              .role = b->role,
                              .range = b->range.byte};
  assert_int_equal(rimi_basis_open(&b->config.basis, b->section.byte, b->section.size, D, O),
                   RIM_OK);
}

static void start(bench *b) {
  make(b);
  assert_int_equal(rimi_blocks_init(&b->b, b->memory, sizeof b->memory, &b->config), RIM_OK);
}

static void make_row(uint32_t t, double *x) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, t);
  x[COMMAND] = 2.0 * rimi_rng_uniform(&rng) - 1.0;
  x[SENSOR] = 3.0 * x[COMMAND] + rimi_rng_normal(&rng);
  x[OTHER] = 4.0 * rimi_rng_uniform(&rng) - 2.0;
  x[HEADING] = 0.1 * t - 6.0 * rimi_floor(0.1 * t / 6.0) - 2.96; /* to 3, and back: not a turn */
}

static blocks_result row(bench *b, double t_s, const double *x) {
  return rimi_blocks_row(b->b, t_s, x, NULL, NULL, NULL);
}
static blocks_result step(bench *b, uint32_t t) {
  double x[D];
  make_row(t, x);
  return row(b, 7.0 + PERIOD_S * t, x);
}

static double standard(double raw, double clip) {
  return fmax(-clip, fmin(clip, (raw - CENTER) * INVERSE_SD));
}

/* All rows of a run kept, and every number of a block computed from its definition. */
typedef struct run {
  double x[400][D]; /* the heading unwrapped */
  double filter[400][FILTERS], integral[400][INPUTS];
  double first[O];
} run;

static void definition(run *r, uint32_t rows) {
  const double turn = 2.0 * RIM_PI;
  for (uint32_t t = 0; t < rows; ++t) {
    make_row(t, r->x[t]);
    while (t > 0 && r->x[t][HEADING] - r->x[t - 1][HEADING] > 0.5 * turn)
      r->x[t][HEADING] -= turn;
    while (t > 0 && r->x[t][HEADING] - r->x[t - 1][HEADING] < -0.5 * turn)
      r->x[t][HEADING] += turn;
    const double c = r->x[t][COMMAND], o = r->x[t][OTHER];
    const double input[INPUTS] = {c, fabs(c), c * o, fabs(c * o), r->x[t][HEADING]};
    for (uint32_t i = 0; i < INPUTS; ++i) {
      r->integral[t][i] = (t > 0 ? r->integral[t - 1][i] : 0.0) + PERIOD_S * input[i];
      for (uint32_t k = 0; k < TIMES; ++k) {
        const uint32_t f = TIMES * i + k;
        r->filter[t][f] =
            t == 0 ? input[i] : (1.0 - share[k]) * r->filter[t - 1][f] + share[k] * input[i];
      }
    }
  }
  for (uint32_t o = 0; o < O; ++o) {
    r->first[o] = 0.0;
    for (uint32_t t = 0; t < 2 * BLOCK; ++t)
      r->first[o] += r->x[t][o == 0 ? SENSOR : HEADING] / (2.0 * BLOCK);
  }
}

static double mean_filter_of(const run *r, uint32_t end, uint32_t filter) {
  double sum = 0.0;
  for (uint32_t t = end - BLOCK; t < end; ++t)
    sum += r->filter[t][filter];
  return sum / BLOCK;
}

/* What depends on time alone stays as it was after 1.1 times the longest time constant. */
#define LEARNT_ROWS (1.1 / share[TIMES - 1])

static double decay_of(uint32_t end, uint16_t time) {
  return pow(1.0 - share[time], fmin((double)(end - 1), floor(LEARNT_ROWS)));
}

static double term_of(const run *r, uint32_t end, const uint16_t *term) {
  switch (term[0]) {
  case BASIS_MEAN:
    return mean_filter_of(r, end, term[1]);
  case BASIS_PRODUCT:
    return mean_filter_of(r, end, term[1]) * mean_filter_of(r, end, term[2]);
  case BASIS_TRIPLE:
    return mean_filter_of(r, end, term[1]) * mean_filter_of(r, end, term[2]) *
           mean_filter_of(r, end, term[3]);
  case BASIS_ABS:
    return fabs(mean_filter_of(r, end, term[1]));
  case BASIS_SIDE: {
    const double x = mean_filter_of(r, end, term[1]);
    return x < 0.0 ? x / (1.75 - x) : x / (1.75 + x);
  }
  case BASIS_DECAY:
    return decay_of(end, term[2]);
  case BASIS_INTEGRAL:
    return r->integral[end - 1][term[1]];
  case BASIS_INITIAL:
    return (r->first[term[1]] - FIRST_MEAN) * (1.0 - decay_of(end, term[2]));
  case BASIS_TIME:
    return PERIOD_S * fmin((double)end - 0.5 * (BLOCK + 1), LEARNT_ROWS);
  default:
    return 0.0;
  }
}

static void assert_close(double value, double expected) {
  if (!(fabs(value - expected) <= 1e-9 * (1.0 + fabs(expected))))
    fail_msg("%.12g instead of %.12g", value, expected);
}

static double within_half_a_turn(double x) { return remainder(x, 2.0 * RIM_PI); }

static void check_block(const bench *b, const run *r, uint32_t end) {
  for (uint32_t f = 0; f < D; ++f) {
    double sum = 0.0;
    for (uint32_t t = end - BLOCK; t < end; ++t)
      sum += r->x[t][f];
    assert_close(rimi_blocks_context(b->b)[f],
                 f == HEADING ? within_half_a_turn(sum / BLOCK) : sum / BLOCK);
  }
  for (uint32_t o = 0; o < O; ++o) {
    const uint32_t f = o == 0 ? SENSOR : HEADING;
    double sum = 0.0, squares = 0.0;
    uint32_t n = 0;
    for (uint32_t t = end - BLOCK; t < end; ++t) {
      sum += r->x[t][f];
      if (t >= 2) {
        const double second = r->x[t][f] - 2.0 * r->x[t - 1][f] + r->x[t - 2][f];
        squares += second * second;
        ++n;
      }
    }
    assert_close(rimi_blocks_outcomes(b->b)[o], sum / BLOCK);
    if (squares > 1e-20)
      assert_close(rimi_blocks_scatter(b->b)[o], log(squares / n));
    assert_true(rimi_blocks_repeats(b->b)[o] == 0.0);
  }
  for (uint32_t i = 0; i < TERMS; ++i) {
    if (terms[i][0] != BASIS_INITIAL || end >= 2 * BLOCK)
      assert_close(rimi_blocks_terms(b->b)[i], standard(term_of(r, end, terms[i]), BASIS_CLIP));
  }
  for (uint32_t m = 0; m < MEANS; ++m)
    assert_close(rimi_blocks_means(b->b)[m],
                 standard(mean_filter_of(r, end, mean_filter[m]), BASIS_MEAN_CLIP));
}

static void blocks_are_as_defined(void **state) {
  (void)state;
  static run r;
  bench b;
  start(&b);
  definition(&r, 400);
  for (uint32_t t = 0; t < 400; ++t) {
    assert_int_equal(rimi_blocks_has_first(b.b), t >= 2 * BLOCK);
    const blocks_result result = step(&b, t);
    assert_int_equal(result, (t + 1) % BLOCK == 0 ? BLOCKS_DONE : BLOCKS_NONE);
    if (result == BLOCKS_NONE)
      continue;
    check_block(&b, &r, t + 1);
    assert_int_equal(rimi_blocks_count(b.b), (t + 1) / BLOCK);
  }
  for (uint32_t o = 0; o < O; ++o)
    assert_close(rimi_blocks_first(b.b)[o], r.first[o]);
  assert_close(rimi_blocks_run_start_s(b.b), 7.0);
  assert_close(rimi_blocks_start_s(b.b), 7.0 + PERIOD_S * (400 - BLOCK));
  const blocks_health h = rimi_blocks_get_health(b.b);
  assert_true(h.rows == 400 && h.rows_used == 400);
  assert_true(h.not_finite + h.time_back + h.gaps + h.out_of_range + h.wrong_rate == 0);
}

/* The sums of a block begin anew with each, whatever the number of time constants. */
static void one_time_constant_is_enough(void **state) {
  (void)state;
  bench b;
  bytes s = {.size = 0};
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, 1, 0, 0, 0, 0};
  make(&b);
  for (size_t i = 0; i < 8; ++i)
    u32(&s, header[i]);
  u16(&s, COMMAND);
  u16(&s, BASIS_PLAIN);
  f32(&s, share[1]);
  for (size_t i = 0; i < 4; ++i) /* its only term */
    u16(&s, i == 0 ? BASIS_MEAN : 0);
  f32(&s, CENTER);
  f32(&s, INVERSE_SD);
  for (size_t o = 0; o < O; ++o)
    f32(&s, FIRST_MEAN);
  assert_int_equal(rimi_basis_open(&b.config.basis, s.byte, s.size, D, O), RIM_OK);
  assert_int_equal(rimi_blocks_init(&b.b, b.memory, sizeof b.memory, &b.config), RIM_OK);
  double filter = 0.0, sum = 0.0, x[D];
  for (uint32_t t = 0; t < 8 * BLOCK; ++t) {
    make_row(t, x);
    filter = t == 0 ? x[COMMAND] : (1.0 - share[1]) * filter + share[1] * x[COMMAND];
    sum += filter;
    assert_int_equal(step(&b, t) == BLOCKS_DONE, (t + 1) % BLOCK == 0);
    if ((t + 1) % BLOCK == 0) {
      assert_close(rimi_blocks_terms(b.b)[0], standard(sum / BLOCK, BASIS_CLIP));
      sum = 0.0;
    }
  }
}

/* A heading that goes round and round: its mean never jumps, whatever turns the reading leaves out.
 */
static void an_angle_that_wraps_is_one(void **state) {
  (void)state;
  for (int degrees = 0; degrees < 2; ++degrees) {
    bench b;
    make(&b);
    const double turn = degrees ? 360.0 : 2.0 * RIM_PI;
    b.role[HEADING] = degrees ? BLOCKS_ANGLE_DEG : BLOCKS_ANGLE_RAD;
    put_f32(b.range.byte + 4 * HEADING, -0.5 * turn);
    put_f32(b.range.byte + 4 * (D + HEADING), 0.5 * turn);
    assert_int_equal(rimi_blocks_init(&b.b, b.memory, sizeof b.memory, &b.config), RIM_OK);
    for (uint32_t t = 0; t < 300; ++t) {
      const double angle = (t < 150 ? t : 300.0 - t) * 0.07 * turn; /* ten turns, and back */
      const double x[D] = {0.0, 0.0, 0.0, remainder(angle, turn)};
      if (row(&b, PERIOD_S * t, x) != BLOCKS_DONE)
        continue;
      double sum = 0.0;
      for (uint32_t k = t + 1 - BLOCK; k <= t; ++k)
        sum += (k < 150 ? k : 300.0 - k) * 0.07 * turn / BLOCK;
      assert_close(rimi_blocks_outcomes(b.b)[1], sum);
      assert_close(remainder(rimi_blocks_context(b.b)[HEADING] - sum, turn), 0.0);
      assert_true(fabs(rimi_blocks_context(b.b)[HEADING]) <= 0.5 * turn * (1.0 + 1e-12));
      if (t >= 2 && (t < 145 || t > 160)) /* no second difference of a whole turn */
        assert_true(rimi_blocks_scatter(b.b)[1] < -40.0);
    }
  }
}

static void repeated_readings_are_counted(void **state) {
  (void)state;
  bench b;
  start(&b);
  for (uint32_t t = 0; t < 6 * BLOCK; ++t) {
    double x[D];
    make_row(t, x);
    if (t >= BLOCK)
      x[SENSOR] = t % 5 < 3 ? 1.5 : 2.5; /* three the same, two the same */
    if (t >= 3 * BLOCK)
      x[SENSOR] = 1.5;
    if (row(&b, PERIOD_S * t, x) != BLOCKS_DONE)
      continue;
    const double expected = t < BLOCK       ? 0.0
                            : t < 3 * BLOCK ? 3.0 / BLOCK
                            : t < 4 * BLOCK ? 4.0 / BLOCK
                                            : 1.0;
    assert_close(rimi_blocks_repeats(b.b)[0], expected);
    if (t >= 4 * BLOCK)
      assert_true(rimi_blocks_scatter(b.b)[0] == BLOCKS_LN_LEAST);
  }
}

/* ---- gaps ---- */

/* A short gap is counted and filled in, and the block goes on; a long one begins it anew; neither
 * leaves a second difference, or a repetition, across it. Of a block of which most readings do not
 * follow on each other, scatter is as in the block before. */
static void gaps_are_counted_and_not_bridged(void **state) {
  (void)state;
  for (uint32_t missing = 1; missing < 12; ++missing) {
    bench b;
    start(&b);
    uint32_t t = 0, used = 2 * BLOCK + 2;
    while (t < used)
      (void)step(&b, t++);
    const double scatter = rimi_blocks_scatter(b.b)[0];
    const bool anew = missing + 1 >= 3; /* at least three periods, and half of five */
    double sum = 0.0;
    for (uint32_t k = 0; k < BLOCK; ++k) { /* of the block's time */
      double x[D], after[D];
      const uint32_t at = anew ? t + missing + k : 2 * BLOCK + k;
      make_row(anew || at != t ? at : t - 1, x);
      make_row(anew || at != t ? at : t + 1, after);
      sum += 0.5 * (x[SENSOR] + after[SENSOR]);
    }
    t += missing;
    const uint32_t rows = anew ? BLOCK : BLOCK - 2 - missing;
    for (uint32_t k = 0; k < rows; ++k, ++t, ++used)
      assert_int_equal(step(&b, t), k + 1 == rows ? BLOCKS_DONE : BLOCKS_NONE);
    assert_close(rimi_blocks_outcomes(b.b)[0], sum / BLOCK);
    assert_true(!rimi_blocks_knows_readings(b.b) && rimi_blocks_scatter(b.b)[0] == scatter);
    const blocks_health h = rimi_blocks_get_health(b.b);
    assert_true(h.gaps == 1 && h.rows_used == used && h.wrong_rate == 0);
  }
}

static void make_with_start(bench *b, const double *start) {
  make(b);
  put_u32(b->section.byte + 20, 2);
  for (size_t o = 0; o < O; ++o)
    f32(&b->section, 1.0);
  for (size_t f = 0; f < 2 * D; ++f)
    f32(&b->section, f < D ? start[f] : 0.25);
  assert_int_equal(rimi_basis_open(&b->config.basis, b->section.byte, b->section.size, D, O),
                   RIM_OK);
  assert_int_equal(rimi_blocks_init(&b->b, b->memory, sizeof b->memory, &b->config), RIM_OK);
}

static void first_block_means(double *mean) {
  for (uint32_t f = 0; f < D; ++f)
    mean[f] = 0.0;
  for (uint32_t t = 0; t < BLOCK; ++t) {
    double x[D];
    make_row(t, x);
    for (uint32_t f = 0; f < D; ++f)
      mean[f] += x[f] / BLOCK;
  }
}

/* A command, or a feature that is no outcome, 1.1 from where healthy runs begin (limit 1.0), or two
 * outcomes, are no start of a run; .9, one outcome, or an angle anywhere, are one. */
static void a_start_is_that_of_healthy_runs_or_none(void **state) {
  (void)state;
  for (uint32_t f = 0; f < D; ++f) {
    for (uint32_t k = 0; k < 4; ++k) {
      double start[D];
      bench b;
      first_block_means(start);
      start[f] += (k & 1u ? 1.0 : -1.0) * (k & 2u ? 0.9 : 1.1);
      make_with_start(&b, start);
      for (uint32_t t = 0; t < 3 * BLOCK; ++t)
        (void)step(&b, t);
      const bool is_start = (k & 2u) != 0 || f == SENSOR || f == HEADING;
      assert_int_equal(rimi_blocks_knows_start(b.b), is_start);
      assert_int_equal(rimi_blocks_knows_all(b.b), is_start);
      rimi_blocks_reset(b.b);
      assert_true(rimi_blocks_knows_start(b.b));
      rimi_blocks_begin_late(b.b); /* whatever the first block looks like */
      for (uint32_t t = 0; t < 3 * BLOCK; ++t)
        (void)step(&b, t);
      assert_false(rimi_blocks_knows_start(b.b));
    }
  }
}

static void assert_unknown(const bench *b, uint32_t term, double expected) {
  assert_true(fabs((double)rimi_blocks_unknown(b->b)[term] - BASIS_UNKNOWN_SD * expected) <= 0.51);
}

/* Part of the mean with share .25 that a missing row makes unknown, if the command jumped. */
static double unknown_after_a_jump(uint32_t t) {
  double before[D], after[D], sum = 0.0;
  make_row(t - 1, before);
  make_row(t + 1, after);
  const double moved = fabs(after[COMMAND] - before[COMMAND]) / 2.0;
  const double part = fmin(fmax(moved - 0.1, 0.0) / 0.29, 1.0) * 0.75 * 0.25;
  for (uint32_t k = 0; k < BLOCK; ++k) /* the missing row as the one after it */
    sum += part * pow(0.75, k > 0 ? k - 1.0 : 0.0);
  return sum / BLOCK;
}

static void a_jump_over_a_missing_row_is_unknown(void **state) {
  (void)state;
  uint32_t jumps = 0;
  for (uint32_t at = 2 * BLOCK; at < 20 * BLOCK; at += BLOCK) {
    bench b;
    start(&b);
    for (uint32_t t = 0; t < at + BLOCK; ++t)
      (void)(t != at && step(&b, t));
    assert_unknown(&b, 0, unknown_after_a_jump(at));
    jumps += unknown_after_a_jump(at) > 0.01;
  }
  assert_true(jumps > 4 && jumps < 18);
}
/* After a late start it is what is left of the first row, after a gap that ends a block the share
 * of its rows; each row takes its own off it. */
static void the_past_is_unknown_and_dies_away(void **state) {
  (void)state;
  double start[D];
  bench b;
  first_block_means(start);
  start[OTHER] += 5.0;
  make_with_start(&b, start);
  for (uint32_t t = 0; t < 2 * BLOCK; ++t)
    (void)step(&b, t);
  double part = 0.0;
  for (uint32_t t = BLOCK; t < 2 * BLOCK; ++t)
    part += pow(0.75, (double)t) / BLOCK;
  assert_unknown(&b, 0, 2.0 * part);        /* filter 1 */
  assert_unknown(&b, 2, 2.0 * 2.0 * part);  /* filters 1 and 3 */
  assert_unknown(&b, 11, 2.0 * 3.0 * part); /* filters 1, 3 and 5 */
  assert_unknown(&b, 12, 2.0 * part);
  assert_unknown(&b, 4, decay_of(2 * BLOCK, 1) * INVERSE_SD);
  for (uint32_t i = 5; i < 8; ++i) /* integral, initial, time */
    assert_unknown(&b, i, 2.0);
  assert_unknown(&b, 9, 0.0); /* filter 8: the row itself */
  for (uint32_t missing = 1; missing < 40; missing += 6) {
    first_block_means(start);
    make_with_start(&b, start);
    for (uint32_t t = 0; t < 2 * BLOCK; ++t)
      (void)step(&b, t);
    assert_true(rimi_blocks_knows_all(b.b));
    for (uint32_t t = 0; t < BLOCK; ++t)
      (void)step(&b, 2 * BLOCK + missing + t);
    assert_false(rimi_blocks_knows_all(b.b));
    if (missing < 2) /* a block goes on over it */
      continue;
    part = 0.0;
    for (uint32_t t = 1; t <= BLOCK; ++t)
      part += (1.0 - pow(0.75, (double)missing)) * pow(0.75, (double)t) / BLOCK;
    assert_unknown(&b, 0, part);
    assert_unknown(&b, 5, fmin(6.0, 0.29 * 2.0 * missing * PERIOD_S * INVERSE_SD));
    assert_unknown(&b, 7, 0.0);
  }
}

static void a_reading_after_a_gap_repeats_nothing(void **state) {
  (void)state;
  bench b;
  start(&b);
  double x[D] = {0.0, 1.5, 0.0, 0.0};
  for (uint32_t t = 0; t < BLOCK; ++t)
    (void)row(&b, PERIOD_S * t, x);
  assert_close(rimi_blocks_repeats(b.b)[0], 4.0 / BLOCK);
  for (uint32_t t = 0; t < BLOCK; ++t)
    (void)row(&b, 10.0 + PERIOD_S * t, x);
  assert_close(rimi_blocks_repeats(b.b)[0], 4.0 / BLOCK);
  for (uint32_t t = BLOCK; t < 2 * BLOCK; ++t)
    (void)row(&b, 10.0 + PERIOD_S * t, x);
  assert_close(rimi_blocks_repeats(b.b)[0], 1.0);
}

/* ---- what is not a row ---- */

static void bad_rows_are_counted_and_leave_no_trace(void **state) {
  (void)state;
  const double nan = rimi_from_bits(UINT64_C(0x7ff8000000000000));
  const double infinity = rimi_from_bits(UINT64_C(0xfff0000000000000));
  bench clean, dirty;
  start(&clean);
  start(&dirty);
  uint32_t not_finite = 0, back = 0;
  for (uint32_t t = 0; t < 100; ++t) {
    const double t_s = 7.0 + PERIOD_S * t;
    for (uint32_t f = 0; f < D; ++f) {
      double x[D];
      make_row(t, x);
      x[f] = t % 2 ? nan : infinity;
      assert_int_equal(row(&dirty, t_s - 0.01, x), BLOCKS_BAD);
      ++not_finite;
    }
    double x[D];
    make_row(t, x);
    assert_int_equal(row(&dirty, t % 2 ? nan : infinity, x), BLOCKS_BAD);
    ++not_finite;
    if (t > 0) {
      assert_int_equal(row(&dirty, 7.0 + PERIOD_S * (t - 1), x), BLOCKS_BAD); /* again */
      assert_int_equal(row(&dirty, t_s - 1e300, x), BLOCKS_BAD);
      back += 2;
    }
    const blocks_result result = step(&clean, t);
    assert_int_equal(step(&dirty, t), result);
    for (uint32_t i = 0; result == BLOCKS_DONE && i < TERMS; ++i)
      assert_true(rimi_blocks_terms(clean.b)[i] == rimi_blocks_terms(dirty.b)[i]);
    for (uint32_t o = 0; result == BLOCKS_DONE && o < O; ++o)
      assert_true(rimi_blocks_scatter(clean.b)[o] == rimi_blocks_scatter(dirty.b)[o]);
  }
  const blocks_health h = rimi_blocks_get_health(dirty.b);
  assert_true(h.not_finite == not_finite && h.time_back == back && h.rows_used == 100);
  assert_true(h.rows == 100 + not_finite + back && h.gaps == 0 && h.out_of_range == 0);
}

/* ---- rates ---- */

static void a_wrong_rate_is_told_and_not_examined(void **state) {
  (void)state;
  static const struct {
    double factor; /* of the time between rows */
    bool wrong;
  } rates[] = {{0.1, true},   {0.5, true}, {0.75, true}, {0.94, false},
               {1.06, false}, {1.3, true}, {1.7, true},  {10.0, true}};
  for (size_t i = 0; i < sizeof rates / sizeof *rates; ++i) {
    bench b;
    start(&b);
    uint32_t done = 0, late = 0;
    for (uint32_t t = 0; t < 200; ++t) {
      double x[D];
      make_row(t, x);
      const bool ended = row(&b, 7.0 + rates[i].factor * PERIOD_S * t, x) == BLOCKS_DONE;
      done += ended;
      late += ended && t >= 60;
    }
    const blocks_health h = rimi_blocks_get_health(b.b);
    assert_int_equal(rimi_blocks_rate_is_wrong(b.b), rates[i].wrong);
    assert_int_equal(h.wrong_rate > 100, rates[i].wrong);
    assert_int_equal(late == 0, rates[i].wrong);
    assert_true(!rates[i].wrong || done <= 8);
    assert_true(rates[i].wrong || done == 200 / BLOCK);
    if (rates[i].factor < 2.0)
      assert_true(fabs(rimi_blocks_period_s(b.b) - rates[i].factor * PERIOD_S) < 0.01 * PERIOD_S);
    uint32_t again = 0; /* and right again */
    for (uint32_t t = 0; t < 100; ++t)
      again += step(&b, 30000 + t) == BLOCKS_DONE;
    assert_false(rimi_blocks_rate_is_wrong(b.b));
    assert_true(again >= 10);
  }
}

/* Jitter, and a row in five lost, are no other rate. */
static void jitter_and_loss_are_no_other_rate(void **state) {
  (void)state;
  bench b;
  start(&b);
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 100000);
  uint32_t done = 0;
  for (uint32_t t = 0; t < 2000; ++t) {
    double x[D];
    make_row(t, x);
    if (rimi_rng_uniform(&rng) < 0.2)
      continue;
    done += row(&b, PERIOD_S * (t + 0.3 * rimi_rng_uniform(&rng)), x) == BLOCKS_DONE;
    assert_false(rimi_blocks_rate_is_wrong(b.b));
  }
  assert_true(done > 250);
  assert_true(rimi_blocks_get_health(b.b).gaps > 200);
}

static void rows_without_a_rate_have_none(void **state) {
  (void)state;
  bench b;
  make(&b);
  b.config.period_s = 0.0;
  assert_int_equal(rimi_blocks_init(&b.b, b.memory, sizeof b.memory, &b.config), RIM_OK);
  uint32_t done = 0;
  for (uint32_t t = 0; t < 100; ++t) {
    double x[D];
    make_row(t, x);
    done += row(&b, 1.5 * t * t, x) == BLOCKS_DONE;
    assert_true(row(&b, 1.5 * t * t, x) == BLOCKS_BAD);
  }
  assert_int_equal(done, 100 / BLOCK);
  assert_true(rimi_blocks_get_health(b.b).gaps == 0 && !rimi_blocks_rate_is_wrong(b.b));
}

/* ---- values out of range ---- */

static void values_out_of_range_are_named_and_limited(void **state) {
  (void)state;
  static const double value[] = {20.0, 20.5, -20.0, -20.5, 1e30, 1e300, -1e300};
  for (size_t i = 0; i < sizeof value / sizeof *value; ++i) {
    bench b;
    start(&b);
    const bool out = fabs(value[i]) > 20.0; /* trained -10..10, and half of that on either side */
    for (uint32_t t = 0; t < 2 * BLOCK; ++t) {
      double x[D], named = 0.0;
      make_row(t, x);
      if (t == BLOCK + 2)
        x[SENSOR] = value[i];
      const blocks_result result = row(&b, PERIOD_S * t, x);
      assert_int_equal(rimi_blocks_out_of_range(b.b, &named),
                       out && t == BLOCK + 2 ? SENSOR : BLOCKS_NO_FEATURE);
      if (out && t == BLOCK + 2)
        assert_true(named == value[i]);
      if (result != BLOCKS_DONE)
        continue;
      assert_true(fabs(rimi_blocks_outcomes(b.b)[0]) <= 20.0);
      for (uint32_t k = 0; k < TERMS; ++k)
        assert_true(fabs(rimi_blocks_terms(b.b)[k]) <= BASIS_CLIP);
    }
    assert_int_equal(rimi_blocks_get_health(b.b).out_of_range, out);
    assert_int_equal(rimi_blocks_out_of_range(b.b, NULL), BLOCKS_NO_FEATURE);
  }
}

/* Trained as -pi to pi: a log that counts from 0 to two pi says the same. */
static void an_angle_may_be_counted_from_zero(void **state) {
  (void)state;
  bench signed_angle, positive;
  make(&signed_angle);
  put_f32(signed_angle.range.byte + 4 * HEADING, -RIM_PI);
  put_f32(signed_angle.range.byte + 4 * (D + HEADING), RIM_PI);
  positive = signed_angle;
  bench *both[2] = {&signed_angle, &positive};
  for (size_t k = 0; k < 2; ++k) {
    both[k]->config.range = both[k]->range.byte;
    assert_int_equal(
        rimi_blocks_init(&both[k]->b, both[k]->memory, sizeof both[k]->memory, &both[k]->config),
        RIM_OK);
    for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
      const double angle = remainder(0.3 * t, 2.0 * RIM_PI);
      const double x[D] = {0.0, 0.0, 0.0, k == 1 && angle < 0.0 ? angle + 2.0 * RIM_PI : angle};
      (void)row(both[k], PERIOD_S * t, x);
      assert_int_equal(rimi_blocks_out_of_range(both[k]->b, NULL), BLOCKS_NO_FEATURE);
    }
  }
  assert_close(rimi_blocks_outcomes(positive.b)[1], rimi_blocks_outcomes(signed_angle.b)[1]);
  assert_close(rimi_blocks_context(positive.b)[HEADING],
               rimi_blocks_context(signed_angle.b)[HEADING]);
  const double far[D] = {0.0, 0.0, 0.0, 6.5}; /* more than a turn */
  (void)row(&positive, PERIOD_S * 40 * BLOCK, far);
  assert_int_equal(rimi_blocks_out_of_range(positive.b, NULL), HEADING);
}

/* ---- the caller's own predictions ---- */

static void own_predictions_are_standardised(void **state) {
  (void)state;
  bench b;
  make(&b);
  b.config.external = true;
  b.config.outcome_feature = NULL;
  assert_int_equal(rimi_blocks_init(&b.b, b.memory, sizeof b.memory, &b.config), RIM_OK);
  const double x[D] = {0.0};
  double sum[O] = {0.0}, means[O] = {0.0}, sds[O] = {0.0};
  for (uint32_t t = 0; t < BLOCK; ++t) {
    const double outcome[O] = {1.0 + t, 1e300}, mean[O] = {0.5 * t, -1e10};
    const double sd[O] = {2.0 + 0.1 * t, 1e-3};
    for (uint32_t o = 0; o < O; ++o) {
      sum[o] += o == 0 ? (outcome[o] - mean[o]) / sd[o] / BLOCK : 1e6 / BLOCK;
      means[o] += mean[o] / BLOCK;
      sds[o] += sd[o] / BLOCK;
    }
    assert_int_equal(rimi_blocks_row(b.b, PERIOD_S * t, x, outcome, mean, sd),
                     t + 1 == BLOCK ? BLOCKS_DONE : BLOCKS_NONE);
  }
  for (uint32_t o = 0; o < O; ++o) {
    assert_close(rimi_blocks_outcomes(b.b)[o], sum[o]);
    assert_close(rimi_blocks_predicted(b.b)[o], means[o]);
    assert_close(rimi_blocks_sd(b.b)[o], sds[o]);
  }
  const double one[O] = {1.0, 1.0}, zero[O] = {1.0, 0.0}, negative[O] = {-1.0, 1.0};
  const double nan[O] = {1.0, rimi_from_bits(UINT64_C(0x7ff8000000000000))};
  const double huge[O] = {1.0, 1.1e150}, *const bad_sd[] = {zero, negative, nan, huge};
  for (size_t i = 0; i < sizeof bad_sd / sizeof *bad_sd; ++i)
    assert_int_equal(rimi_blocks_row(b.b, 9.0, x, one, one, bad_sd[i]), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_row(b.b, 9.0, x, nan, one, one), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_row(b.b, 9.0, x, one, nan, one), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_row(b.b, 9.0, x, NULL, one, one), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_row(b.b, 9.0, x, one, NULL, one), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_row(b.b, 9.0, x, one, one, NULL), BLOCKS_BAD);
  assert_int_equal(rimi_blocks_get_health(b.b).not_finite, 9);
}

/* ---- memory ---- */

static void memory_is_checked_and_not_left(void **state) {
  (void)state;
  bench b;
  start(&b);
  const size_t need = rimi_blocks_size(&b.config);
  blocks *other = NULL;
  assert_int_equal(rimi_blocks_init(&other, b.memory, need - 1, &b.config), RIM_E_SIZE);
  assert_int_equal(rimi_blocks_init(&other, b.memory + 4, need, &b.config), RIM_E_ALIGN);
  blocks_config bad = b.config;
  bad.features = 0;
  assert_int_equal(rimi_blocks_init(&other, b.memory, need, &bad), RIM_E_CONFIG);
  bad = b.config;
  bad.block_rows = 0;
  assert_int_equal(rimi_blocks_init(&other, b.memory, need, &bad), RIM_E_CONFIG);
  bad = b.config;
  bad.outcome_feature = NULL;
  assert_int_equal(rimi_blocks_init(&other, b.memory, need, &bad), RIM_E_CONFIG);
  assert_null(other);
  assert_true(need + 64 < sizeof b.memory);
  memset(b.memory, 0x5a, sizeof b.memory);
  assert_int_equal(rimi_blocks_init(&b.b, b.memory, need, &b.config), RIM_OK);
  for (uint32_t t = 0; t < 100; ++t)
    (void)step(&b, t);
  for (size_t i = need; i < sizeof b.memory; ++i)
    assert_int_equal(b.memory[i], 0x5a);
}

static void a_copy_and_a_reset_go_on_as_they_should(void **state) {
  (void)state;
  bench whole, copy;
  start(&whole);
  start(&copy);
  for (uint32_t t = 0; t < 33; ++t)
    (void)step(&whole, t);
  memcpy(copy.memory, whole.memory, sizeof copy.memory);
  rimi_blocks_attach(copy.b, &copy.config);
  for (uint32_t t = 33; t < 80; ++t)
    assert_int_equal(step(&whole, t), step(&copy, t));
  for (uint32_t i = 0; i < TERMS; ++i)
    assert_true(rimi_blocks_terms(whole.b)[i] == rimi_blocks_terms(copy.b)[i]);
  rimi_blocks_reset(whole.b);
  rimi_blocks_attach(copy.b, &copy.config);
  assert_int_equal(rimi_blocks_count(whole.b), 0);
  assert_int_equal(rimi_blocks_get_health(whole.b).rows, 0);
  static run r;
  definition(&r, 100);
  for (uint32_t t = 0; t < 100; ++t) {
    if (step(&whole, t) == BLOCKS_DONE)
      check_block(&whole, &r, t + 1);
  }
  assert_int_equal(rimi_blocks_count(whole.b), 100 / BLOCK);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(blocks_are_as_defined),
      cmocka_unit_test(one_time_constant_is_enough),
      cmocka_unit_test(an_angle_that_wraps_is_one),
      cmocka_unit_test(repeated_readings_are_counted),
      cmocka_unit_test(gaps_are_counted_and_not_bridged),
      cmocka_unit_test(a_start_is_that_of_healthy_runs_or_none),
      cmocka_unit_test(a_jump_over_a_missing_row_is_unknown),
      cmocka_unit_test(the_past_is_unknown_and_dies_away),
      cmocka_unit_test(a_reading_after_a_gap_repeats_nothing),
      cmocka_unit_test(bad_rows_are_counted_and_leave_no_trace),
      cmocka_unit_test(a_wrong_rate_is_told_and_not_examined),
      cmocka_unit_test(jitter_and_loss_are_no_other_rate),
      cmocka_unit_test(rows_without_a_rate_have_none),
      cmocka_unit_test(values_out_of_range_are_named_and_limited),
      cmocka_unit_test(an_angle_may_be_counted_from_zero),
      cmocka_unit_test(own_predictions_are_standardised),
      cmocka_unit_test(memory_is_checked_and_not_left),
      cmocka_unit_test(a_copy_and_a_reset_go_on_as_they_should),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
