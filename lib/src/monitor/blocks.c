/* SPDX-License-Identifier: MIT */
#include "monitor/blocks_private.h"

#include <string.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "base/usable.h"
#include "image/rolled.h"

#define RATE_ROWS 16.0 /* over which the rate is averaged */
#define RATE_FIRST 8.0 /* the same of a run's first rows: another rate is told before an alarm */
/* Mean time between rows, in periods: from where the rate is wrong, and from where right again. */
#define RATE_SLOW 1.5
#define RATE_SLOW_OVER 1.25
#define RATE_FAST 0.67
#define RATE_FAST_OVER 0.8
#define RATE_OFF_OVER 0.05 /* see BLOCKS_RATE_OFF */
#define RATE_MOST 0.2      /* that one row counts: one that is late says nothing of the rate */
#define SAME_RATE 1e-6   /* of a period: times between rows that are as exact as times are */
#define MOST_TURNS 2e9   /* of an angle in a run */
#define MOST_COUNTED 1e6 /* turns of a reading that still says a direction */
#define MOST_MISSING 1e6 /* rows of a gap over which the filters go on */
#define NEXT_BLOCK 0.25  /* of a block, that its start may be off and still follow the last */
#define STEADY 0.05      /* of its range, by which an input moves in a row without a jump */
#define MOST_FILLED 0.5  /* of a block: the longest gap over which readings are filled in */
#define LEAST_FILLED 4u  /* rows of a block: in a shorter one too much of it would be filled in */
#define LOST_PART 0.5    /* of a block: how much of the commands a gap may hide unnoticed */
#define LEARNT_RUNS 1.1  /* of a healthy run: how far the longest of them may go */

enum { JUMPED_NOW = 1, JUMPED_BEFORE = 2 }; /* in the block, in the one before it */

size_t rimi_blocks_size(const blocks_config *c) {
  const rim_basis *n = &c->basis;
  const size_t outcomes = (blocks_outcome_arrays(c) + blocks_made_arrays(c)) * c->outcomes;
  return ((sizeof(blocks) + 7u) & ~(size_t)7u) +
         8u * (FEATURE_ARRAYS * (size_t)c->features + outcomes + 2u * (size_t)n->inputs * n->times +
               3u * (size_t)n->times + n->inputs + 3u * (size_t)n->states + n->rates + n->terms +
               (n->terms + 3u) / 4u + n->means + ROUND2(c->features) / 2u + ROUND2(n->inputs) / 2u +
               2u * (size_t)c->integrands);
}

rim_status rimi_blocks_init(blocks **instance, void *memory, size_t bytes,
                            const blocks_config *config) {
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  if (config->features == 0 || config->block_rows == 0 || config->role == NULL ||
      config->range == NULL || (!config->external && config->outcome_feature == NULL))
    return RIM_E_CONFIG;
  if (bytes < rimi_blocks_size(config))
    return RIM_E_SIZE;
  blocks *b = memory;
  memset(b, 0, rimi_blocks_size(config));
  b->config = *config;
  rimi_blocks_reset(b);
  *instance = b;
  return RIM_OK;
}

void rimi_blocks_attach(blocks *b, const blocks_config *config) { b->config = *config; }

const void *rimi_blocks_control(const blocks *b, size_t *bytes) {
  *bytes = sizeof *b;
  return b;
}

uint32_t rimi_blocks_history_sum(const blocks *b, uint32_t sum) {
  const double *end = blocks_unknown_sum(b) + b->config.basis.times;
  sum = rimi_upper_sum(sum, array(b), (size_t)(end - array(b)));
  return rimi_word_sum(sum, blocks_turns(b),
                       ROUND2(b->config.features) + ROUND2(b->config.basis.inputs));
}

void rimi_blocks_reset(blocks *b) {
  const blocks_config config = b->config;
  memset(b, 0, rimi_blocks_size(&config));
  b->config = config;
  b->mean_period_s = b->told_period_s = (float)config.period_s;
  b->mean_row = 1.0f;
  b->out_feature = BLOCKS_NO_FEATURE;
}

void rimi_blocks_begin_late(blocks *b) { b->told_late = true; }

static bool row_is_usable(blocks *b, double t_s, const double *context, const double *outcome,
                          const double *mean, const double *sd) {
  const size_t o = b->config.outcomes;
  bool finite = rimi_is_finite(t_s) && all_finite(context, b->config.features);
  if (finite && b->config.external) {
    finite = outcome != NULL && mean != NULL && sd != NULL && all_finite(outcome, o) &&
             all_finite(mean, o) && all_finite(sd, o);
    for (size_t i = 0; finite && i < o; ++i)
      finite = sd[i] > 0.0 && is_usable(sd[i]); /* it is the unit of what an alarm says */
  }
  if (!finite) {
    count(&b->health.not_finite);
    return false;
  }
  if (b->started && !(t_s > b->previous_s)) {
    count(&b->health.time_back);
    return false;
  }
  return true;
}

/* The trained range of an angle is a whole turn: half a turn on either side of it is within. Beyond
 * that it is named, and the same direction is taken: it may have been counted on by whole turns. */
static double limited(blocks *b, size_t f, double x) {
  const double low = (double)rimi_le_f32(b->config.range, f);
  const double high = (double)rimi_le_f32(b->config.range, b->config.features + f);
  const double margin = BLOCKS_LIMIT_MARGIN * (high - low);
  if (x >= low - margin && x <= high + margin)
    return x;
  if (b->out_feature == BLOCKS_NO_FEATURE) {
    b->out_feature = (uint16_t)f;
    b->out_value = x;
  }
  const double whole = blocks_whole_turn(b, f);
  if (whole > 0.0 && rimi_abs(x) < MOST_COUNTED * whole)
    x -= whole * rimi_floor((x - 0.5 * (low + high)) / whole + 0.5);
  return rimi_clamp(x, low - margin, high + margin);
}

static void begin_block(blocks *b) {
  b->rows_in_block = 0;
  b->adjoins = false;
  b->seconds = 0;
  b->unpaired = 0;
  b->jumped = (uint8_t)(b->jumped << 1u);
  memset(SUM(b), 0, 8u * (size_t)b->config.features);
  for (size_t f = 0; f < b->config.features; ++f) {
    if (!(blocks_whole_turn(b, f) > 0.0))
      blocks_turns(b)[f] = 0;
  }
  memset(SQUARES(b), 0, 8u * (b->config.external ? 5u : 2u) * b->config.outcomes);
  memset(blocks_filter_sum(b), 0, 8u * blocks_filters(b));
  memset(blocks_early(b), 0, 16u * (size_t)b->config.integrands);
  memset(blocks_unknown_sum(b), 0, 8u * b->config.basis.times);
}

/* Rows before this one that are missing and count as rows of its block. */
static uint32_t filled(const blocks *b) { return b->fills ? b->missing : 0u; }

/* A gap of more than half of a block begins another one. In a shorter one the readings and commands
 * are taken to lie on a straight line, so that a block is of so much time, not of so many rows. */
static void take_gap(blocks *b, double gap_s) {
  const blocks_config *c = &b->config;
  count(&b->health.gaps);
  b->recent = 0;
  if (gap_s >= rimi_max(MOST_FILLED * (double)c->block_rows, 3.0) * c->period_s) {
    begin_block(b);
    b->bridged = true;
    if (!c->with_gaps && (double)b->missing > LOST_PART * (double)c->block_rows)
      b->lost_rows += (float)b->missing;
  } else if (!c->external && c->block_rows >= LEAST_FILLED &&
             (double)b->missing <= MOST_FILLED * (double)c->block_rows) {
    b->fills = true;
  }
  if (c->block_rows >= LEAST_FILLED)
    b->unpaired = (uint16_t)(b->unpaired + 1u + filled(b));
}

static void take_mean(float *mean, double of_row, double rows) {
  *mean = (float)((double)*mean + (of_row - (double)*mean) / rows);
}

/* Where half of the rows are missing the mean time between the rest is now above its limit and now
 * below: what is examined in between is no run at this rate. Nor is one whose rows, with those that
 * are missing, come somewhat faster or slower than any model knows. */
static void judge_rate(blocks *b) {
  const double row = rimi_clamp((double)b->row_periods, 1.0 - RATE_MOST, 1.0 + RATE_MOST);
  take_mean(&b->mean_row, row, rimi_clamp((double)b->health.rows_used, RATE_FIRST, RATE_ROWS));
  const double off = b->is_off_rate ? RATE_OFF_OVER : BLOCKS_RATE_OFF;
  const double periods = (double)b->mean_period_s / b->config.period_s;
  const double slow = b->is_off_rate ? RATE_SLOW_OVER : RATE_SLOW;
  const double fast = b->is_off_rate ? RATE_FAST_OVER : RATE_FAST;
  b->is_off_rate = periods > slow || periods < fast || rimi_abs((double)b->mean_row - 1.0) > off;
}

/* Whether a time is so much longer, or shorter, than so many rows take that a block lies apart. */
static bool is_late(const blocks *b, double time_s, uint32_t rows) {
  const double period_s = b->config.period_s;
  return !(rimi_abs(time_s - (double)rows * period_s) <
           NEXT_BLOCK * period_s * (double)b->config.block_rows);
}

/* Rows may come somewhat faster or slower than those that were trained. What gathers over a run,
 * and what exponential means forget, follow time, not the count of rows. */
static void take_row_time(blocks *b, double dt) {
  const double rows = 1.0 + (double)b->missing;
  const double periods = rimi_min(dt / b->config.period_s, MOST_MISSING) / rows;
  b->row_periods = rimi_abs(periods - 1.0) < SAME_RATE ? 1.0f : (float)periods;
  /* Of the first row it is known only now how much time it is for. */
  for (size_t i = 0; i < b->config.basis.inputs && b->health.rows_used == 1; ++i)
    blocks_integral(b)[i] *= (double)b->row_periods;
}

/* How long the block is: its rows, each for as much time as is between them. */
static double block_periods(const blocks *b) {
  const double n = (double)b->rows_in_block, time_s = b->previous_s - b->block_start_s;
  if (n < 2.0 || !(b->config.period_s > 0.0))
    return n;
  const double row = time_s / ((n - 1.0) * b->config.period_s);
  return rimi_abs(row - 1.0) < SAME_RATE ? n : n * row;
}

static void take_time(blocks *b, double t_s) {
  const blocks_config *c = &b->config;
  b->row_periods = 1.0f;
  b->bridged = false;
  b->fills = false;
  if (!b->started) {
    b->started = true;
    b->start_s = t_s;
    begin_block(b);
  } else if (c->period_s > 0.0) {
    const double dt = t_s - b->previous_s;
    const double rows = rimi_min(dt / c->period_s - 0.5, MOST_MISSING);
    b->missing = rows >= 1.0 ? (uint32_t)rows : 0u;
    take_row_time(b, dt);
    take_mean(&b->told_period_s, dt, RATE_ROWS);
    take_mean(&b->mean_period_s, rimi_min(dt, 2.0 * c->period_s), RATE_ROWS);
    judge_rate(b);
    if (dt > 1.5 * c->period_s)
      take_gap(b, dt);
  }
  if (b->rows_in_block == 0) {
    b->block_start_s = t_s - (double)filled(b) * c->period_s;
    b->adjoins = b->adjoins && !is_late(b, b->block_start_s - b->previous_s, 1);
  }
  b->previous_s = t_s;
}

/* Sums over a block: of values on a straight line from `before` to `now`, over the rows that are
 * missing between the two; and of each times its row of the block, of which the first is `row`. */
static double between(const blocks *b, double before, double now) {
  return 0.5 * (double)filled(b) * (before + now);
}

static double moment_between(const blocks *b, double row, double before, double now) {
  const double n = (double)filled(b);
  return 0.5 * n * row * (before + now) + n / 6.0 * ((n - 1.0) * before + (2.0 * n - 2.0) * now);
}

/* What a feature moved by, as a part of its range; 0 for one that never did. */
static double moved_by(const blocks *b, size_t f, double from, double to) {
  const double width = blocks_trained_width(b, f);
  return width > 0.0 ? rimi_abs(to - from) / width : 0.0;
}

/* By how much a feature may have been off the straight line over a gap: what it moved by more than
 * it could in so many rows, in standard deviations as those of a feature over its whole range. */
static double jump_of(const blocks *b, double moved) {
  return rimi_max(moved - STEADY * (1.0 + (double)b->missing), 0.0) / RIM_UNIFORM_SD;
}

/* The row's features, limited and unwrapped; where the angle jumps by more than half a turn it went
 * on through its end. The first reading of a block that is far out of range is a glitch, it may be:
 * the one before it stands, or what integrates it would be off ever after. */
static void take_features(blocks *b, const double *context) {
  double *last = LAST(b);
  int32_t *turn = blocks_turns(b);
  b->out_feature = BLOCKS_NO_FEATURE;
  for (size_t f = 0; f < b->config.features; ++f) {
    double x = limited(b, f, context[f]);
    const double whole = blocks_whole_turn(b, f);
    if (whole > 0.0) {
      if (b->health.rows_used > 0) {
        const double jump = rimi_floor((x - last[f]) / whole + 0.5);
        turn[f] = -(int32_t)rimi_clamp(jump, -MOST_TURNS, MOST_TURNS);
      }
      x += whole * (double)turn[f];
    } else if (rimi_abs(context[f] - x) > BLOCKS_FAR * blocks_trained_width(b, f)) {
      if (turn[f] == 0 && b->health.rows_used > 0 && b->config.role[f] == 0)
        x = last[f];
      turn[f] += 1 + (int32_t)filled(b);
    }
    if (b->missing > 0 && jump_of(b, moved_by(b, f, last[f], x)) > 0.0)
      b->jumped |= JUMPED_NOW;
    SUM(b)[f] += b->fills ? between(b, last[f], x) + x : x;
    last[f] = x;
  }
  if (b->out_feature != BLOCKS_NO_FEATURE)
    count(&b->health.out_of_range);
}

static void take_reading(blocks *b, size_t o, double reading) {
  double *one = ONE_AGO(b) + o, *two = TWO_AGO(b) + o;
  /* One that drops out reads 0, among readings that differ. */
  const bool is_zero = !(rimi_abs(reading) > 0.0);
  if (b->recent > 0 && (is_zero || rimi_bits(reading) == rimi_bits(*one)))
    SAME(b)[o] += 1.0;
  if (b->recent >= 2) {
    const double second = reading - 2.0 * *one + *two;
    SQUARES(b)[o] += second * second;
  }
  *two = *one;
  *one = reading;
}

/* How much a reading scatters and repeats is seen in the reading itself. What is believed of one
 * that is out of range stays where the range ends. So far out that nothing is believed, nothing is
 * said of either (rimi_monitor_find_unknown()). */
static double raw_reading(const blocks *b, const double *context, size_t f) {
  const double whole = blocks_whole_turn(b, f);
  if (whole > 0.0)
    return LAST(b)[f];
  const double most = (BLOCKS_LIMIT_MARGIN + BLOCKS_FAR) * blocks_trained_width(b, f);
  const double low = (double)rimi_le_f32(b->config.range, f);
  const double high = (double)rimi_le_f32(b->config.range, b->config.features + f);
  return rimi_clamp(context[f], low - most, high + most);
}

static void take_outcomes(blocks *b, const double *context, const double *outcome,
                          const double *mean, const double *sd) {
  for (size_t o = 0; o < b->config.outcomes; ++o) {
    if (b->config.external) {
      const double z = rimi_clamp((outcome[o] - mean[o]) / sd[o], -1e6, 1e6);
      take_reading(b, o, z);
      O_SUM(b)[o] += z;
      P_SUM(b)[o] += mean[o];
      S_SUM(b)[o] += sd[o];
    } else {
      const size_t f = rimi_le_index(b->config.outcome_feature, o, b->config.features);
      take_reading(b, o, raw_reading(b, context, f));
    }
  }
  if (b->recent >= 2)
    ++b->seconds;
  else
    ++b->recent;
}

double rimi_blocks_turn(uint8_t role) {
  return (role & BLOCKS_ANGLE_RAD) != 0   ? 2.0 * RIM_PI
         : (role & BLOCKS_ANGLE_DEG) != 0 ? 360.0
                                          : 0.0;
}

double rimi_blocks_wrapped(double x, uint8_t role) {
  const double whole = rimi_blocks_turn(role);
  return whole > 0.0 ? x - whole * rimi_floor(x / whole + 0.5) : x;
}

static double in_radians(uint8_t role, double angle) {
  return angle * ((role & BLOCKS_ANGLE_DEG) != 0 ? RIM_PI / 180.0 : 1.0);
}

uint32_t rimi_level_inputs(const uint8_t *role, uint32_t features, const double *context,
                           double *x) {
  uint32_t count = features;
  for (uint32_t f = 0; f < features; ++f) {
    const bool is_angle = (role[f] & (BLOCKS_ANGLE_RAD | BLOCKS_ANGLE_DEG)) != 0;
    if (context != NULL)
      x[f] = is_angle ? rimi_cos(in_radians(role[f], context[f])) : context[f];
    if (is_angle && context != NULL)
      x[count] = rimi_sin(in_radians(role[f], context[f]));
    count += is_angle;
  }
  return count;
}

/* The last reading of an angle, in radians. */
static double radians(const blocks *b, size_t f) {
  return in_radians(b->config.role[f], LAST(b)[f]);
}

static double integrand(const blocks *b, size_t g) {
  const size_t first = rimi_le_index(b->config.integrand, 4 * g + 1, b->config.features);
  const size_t second = rimi_le_index(b->config.integrand, 4 * g + 2, b->config.features);
  const double x = LAST(b)[first];
  switch ((agreement_op)rimi_le_u16(b->config.integrand, 4 * g)) {
  case AGREEMENT_PLAIN:
    break;
  case AGREEMENT_PRODUCT:
    return x * LAST(b)[second];
  case AGREEMENT_COSINE:
    return x * rimi_cos(radians(b, second));
  case AGREEMENT_SINE:
    return x * rimi_sin(radians(b, second));
  }
  return x;
}

/* Of the rows that are missing before this one, what the row before them has to say. */
static void fill_integrands(blocks *b) {
  const double row = (double)b->rows_in_block;
  for (size_t g = 0; g < b->config.integrands; ++g) {
    const double x = integrand(b, g);
    blocks_early(b)[g] += between(b, x, 0.0);
    blocks_late(b)[g] += moment_between(b, row, x, 0.0);
  }
}

static void take_integrands(blocks *b) {
  const double row = (double)b->rows_in_block;
  for (size_t g = 0; g < b->config.integrands; ++g) {
    const double x = integrand(b, g);
    if (b->fills) {
      blocks_early(b)[g] += between(b, 0.0, x);
      blocks_late(b)[g] += moment_between(b, row, 0.0, x);
    }
    blocks_early(b)[g] += x;
    blocks_late(b)[g] += x * (row + (double)filled(b));
  }
}

/* How input p moves: as far as it is off its own recent mean. A direction and a size, for what
 * answers a movement seldom answers in proportion: friction turns round, and rates are limited. */
static double movement(const blocks *b, size_t p, bool is_size, double x) {
  const size_t times = b->config.basis.times;
  const double off = x - blocks_filter(b)[p * times + (times > 1u ? 1u : 0u)];
  const double size = rimi_abs(off);
  return is_size ? size : off < 0.0 ? -rimi_sqrt(size) : rimi_sqrt(size);
}

/* A movement: where the mean of what moves has taken the row already. */
static double input_value(const blocks *b, size_t i) {
  const uint8_t *input = b->config.basis.input;
  const size_t feature = rimi_le_index(input, 2 * i, b->config.features);
  const double x = LAST(b)[feature];
  const uint16_t second = rimi_le_u16(input, 2 * i + 1);
  if (second == BASIS_PLAIN)
    return x;
  if (second == BASIS_MAGNITUDE)
    return rimi_abs(x);
  if (second >= BASIS_LEAST_HARMONIC) {
    const uint32_t below = BASIS_COSINE - second;
    const double angle = (double)(1u + below / 2u) * radians(b, feature);
    return (below & 1u) != 0 ? rimi_sin(angle) : rimi_cos(angle);
  }
  if (rimi_basis_is_movement(second))
    return movement(b, rimi_basis_moves(second), (second & BASIS_OF_SIZE) != 0, x);
  const size_t other = second & ~BASIS_OF_PRODUCT;
  const double product = x * LAST(b)[other < b->config.features ? other : 0u];
  return (second & BASIS_OF_PRODUCT) != 0 ? rimi_abs(product) : product;
}

/* What is left of the exponential mean t's past after this row and those that are missing. */
static double keeps(const blocks *b, size_t t) {
  double keep = 1.0 - (double)rimi_le_f32(b->config.basis.share, t);
  if (rimi_abs((double)b->row_periods - 1.0) > 0.0 && keep > 0.0)
    keep = rimi_exp((double)b->row_periods * rimi_log(keep));
  return blocks_power(keep, keep, b->missing);
}

/* Of a mean that keeps `keep` since the row before, the part that is not known: what is left of the
 * old part, and the share of the gap: of a long one all of it, else as far as an input jumped. */
static void forget(blocks *b, size_t t, double keep, double jump) {
  const double gap = 1.0 - (double)rimi_le_f32(b->config.basis.share, t) - keep;
  blocks_unknown(b)[t] = (b->bridged       ? gap
                          : b->missing > 0 ? rimi_min(jump, 1.0) * gap
                                           : 0.0) +
                         keep * blocks_unknown(b)[t];
  blocks_unknown_sum(b)[t] += (1.0 + (double)filled(b)) * blocks_unknown(b)[t];
}

/* Time since the start, as far as the healthy runs went. Their length is the longest time constant,
 * from which some of them differ. What depends on time alone was not learnt beyond it, and stays as
 * it was there. */
static double learnt_time_s(const blocks *b, double t_s) {
  const rim_basis *n = &b->config.basis;
  if (n->times == 0)
    return t_s;
  const double share = (double)rimi_le_f32(n->share, n->times - 1u);
  return rimi_min(t_s, LEARNT_RUNS * b->config.period_s / share);
}

/* What an exponential mean was before the first row, in which its input is u. */
static double mean_before(const blocks *b, size_t filter, double u) {
  const uint8_t *begin = b->config.basis.begin;
  return begin == NULL ? u
                       : (double)rimi_le_f32(begin, 2 * filter) +
                             (double)rimi_le_f32(begin, 2 * filter + 1) * u;
}

/* How far an exponential mean of what grows by 1 over a gap lags behind it at the gap's end. */
static double lag_of(const blocks *b, size_t t, double keep) {
  const double share = (double)rimi_le_f32(b->config.basis.share, t);
  return (1.0 - share) * (1.0 - keep) / (share * (1.0 + (double)b->missing));
}

/* The means of an input, which over a gap went from `from` on a straight line to `to`, or else is
 * `to` alone. */
static void take_input(blocks *b, size_t i, double from, double to, const double *keep) {
  const rim_basis *n = &b->config.basis;
  const double half = 0.5 * (double)b->missing;
  double *f = blocks_filter(b) + i * n->times, *sum = blocks_filter_sum(b) + i * n->times;
  blocks_integral(b)[i] +=
      (to + half * (from + to)) * ((double)b->row_periods * b->config.period_s);
  for (size_t t = 0; t < n->times; ++t) {
    const double before = b->health.rows_used == 0 ? mean_before(b, i * n->times + t, to) : f[t];
    const double line = b->missing > 0 ? lag_of(b, t, keep[t]) * (from - to) : 0.0;
    f[t] = to + line + (before - from) * keep[t];
    sum[t] += between(b, before, f[t]) + f[t];
  }
}

/* Nobody knows when in a gap the inputs, [inputs] each, went from `from` to `to`. What gathers over
 * a run never learns it. Returns the farthest that a command jumped, for means, which forget. */
static double lose(blocks *b, const double *from, const double *to) {
  const rim_basis *n = &b->config.basis;
  double moved = 0.0;
  for (size_t i = 0; i < n->inputs; ++i) {
    const size_t f = rimi_le_index(n->input, 2 * i, b->config.features);
    if (rimi_le_u16(n->input, 2 * i + 1) != BASIS_PLAIN)
      continue;
    moved = rimi_max(moved, moved_by(b, f, from[i], to[i]));
  }
  const double jump = jump_of(b, moved);
  if (b->bridged || b->config.with_gaps)
    return jump;
  const double rows = moved * (double)b->missing;
  const double lost = (double)b->lost_rows;
  b->lost_rows = (float)rimi_sqrt(lost * lost + rows * rows);
  rimi_rolled_lose(n, from, to, (double)b->missing * b->config.period_s, blocks_state(b),
                   blocks_state_variance(b));
  return jump;
}

/* before[inputs]: of the row before a gap; NULL: there is none. */
static void take_inputs(blocks *b, const double *before) {
  const rim_basis *n = &b->config.basis;
  double keep[BASIS_MAX_TIMES], now[BASIS_MAX_INPUTS];
  for (size_t i = 0; i < n->inputs && before != NULL; ++i)
    now[i] = input_value(b, i);
  const double jump = before != NULL ? lose(b, before, now) : 0.0;
  for (size_t t = 0; t < n->times; ++t) {
    keep[t] = keeps(b, t);
    forget(b, t, keep[t], jump);
  }
  for (size_t i = 0; i < n->inputs; ++i) {
    const double to = input_value(b, i);
    take_input(b, i, before != NULL ? before[i] : to, to, keep);
  }
  const double t_s = b->previous_s - b->start_s;
  const bool was_learnt = t_s < learnt_time_s(b, t_s) + 0.5 * b->config.period_s;
  for (size_t t = 0; t < n->times; ++t)
    blocks_decay(b)[t] = b->health.rows_used == 0 ? 1.0
                         : was_learnt             ? blocks_decay(b)[t] * keep[t]
                                                  : blocks_decay(b)[t];
}

/* An input's integral at the end of the block, or half as much later as the block is longer: the
 * outcome is a mean, which is of its middle. */
static double integral_of(const blocks *b, size_t input) {
  const double longer = block_periods(b) - (double)b->config.block_rows;
  const double mean = blocks_filter_sum(b)[input * b->config.basis.times];
  return blocks_integral(b)[input] - 0.5 * longer * b->config.period_s * mean;
}

static double term_value(const blocks *b, size_t i) {
  const uint8_t *spec = b->config.basis.term;
  const rim_basis *n = &b->config.basis;
  const size_t first = rimi_le_index(spec, 4 * i + 1, blocks_filters(b));
  const size_t second = rimi_le_index(spec, 4 * i + 2, blocks_filters(b));
  const size_t time = rimi_le_index(spec, 4 * i + 2, n->times); /* also where nothing is filtered */
  const size_t outcome = rimi_le_index(spec, 4 * i + 1, b->config.outcomes);
  switch ((basis_op)rimi_le_u16(spec, 4 * i)) {
  case BASIS_MEAN:
    return blocks_filter_sum(b)[first];
  case BASIS_PRODUCT:
    return blocks_filter_sum(b)[first] * blocks_filter_sum(b)[second];
  case BASIS_TRIPLE:
    return blocks_filter_sum(b)[first] * blocks_filter_sum(b)[second] *
           blocks_filter_sum(b)[rimi_le_index(spec, 4 * i + 3, blocks_filters(b))];
  case BASIS_ABS:
    return rimi_abs(blocks_filter_sum(b)[first]);
  case BASIS_SIDE:
    return blocks_filter_sum(b)[first] /
           (rimi_abs(blocks_filter_sum(b)[first]) + (double)rimi_le_f32(spec + 8 * i + 4, 0));
  case BASIS_DECAY:
    return blocks_decay(b)[time];
  case BASIS_INTEGRAL:
    return integral_of(b, first < n->inputs ? first : 0);
  case BASIS_INITIAL:
    return (FIRST(b)[outcome] - (double)rimi_le_f32(n->first, outcome)) *
           (1.0 - blocks_decay(b)[time]);
  case BASIS_TIME:
    return learnt_time_s(b, rimi_blocks_since_start_s(b));
  case BASIS_ROLLED:
    return rimi_rolled_term(n, i, blocks_filter_sum(b), blocks_state(b));
  }
  return 0.0;
}

static void take_first(blocks *b) {
  if (b->count >= FIRST_BLOCKS)
    return;
  for (size_t o = 0; o < b->config.outcomes; ++o) {
    const double before = FIRST(b)[o] * (double)b->count;
    FIRST(b)[o] = (before + OUTCOME(b)[o]) / ((double)b->count + 1.0);
    const rim_basis *n = &b->config.basis;
    if (b->count + 1u < FIRST_BLOCKS || n->first_sd == NULL)
      continue;
    const double mean = (double)rimi_le_f32(n->first, o);
    const double most = BASIS_FIRST_LIMIT * (double)rimi_le_f32(n->first_sd, o);
    FIRST(b)[o] = rimi_clamp(FIRST(b)[o], mean - most, mean + most);
  }
}

/* Of a state, the reading of its outcome in the block that ended last. */
static double reading_of(const blocks *b, size_t s) {
  return OUTCOME(b)[rimi_le_index(b->config.basis.state, s, b->config.outcomes)];
}

static void keep_all(blocks *b) {
  for (size_t s = 0; s < b->config.basis.states; ++s)
    blocks_state_kept(b)[s] = 1.0;
}

/* A run that began before its first row may begin anywhere: its own readings count. before[states]:
 * readings of the block before. */
static void roll(blocks *b, const double *before) {
  const double block_s = b->config.period_s * (double)b->config.block_rows;
  const double middle_s = rimi_blocks_since_start_s(b);
  if (b->count >= FIRST_BLOCKS && middle_s - b->rolled_s > ROLLED_LONGEST * block_s) {
    double moved[BASIS_MAX_STATES] = {0.0};
    for (size_t s = 0; s < b->config.basis.states; ++s)
      moved[s] = reading_of(b, s) - before[s];
    rimi_rolled_resume(&b->config.basis, blocks_filter_sum(b), moved, blocks_state(b),
                       blocks_part(b));
    keep_all(b);
    b->resumed = true;
  } else if (b->count + 1u == FIRST_BLOCKS) {
    const double *reading = b->late ? OUTCOME(b) : FIRST(b);
    for (size_t s = 0; s < b->config.basis.states; ++s)
      blocks_state(b)[s] = reading[rimi_le_index(b->config.basis.state, s, b->config.outcomes)];
    rimi_rolled_begin(&b->config.basis, blocks_filter_sum(b), block_s, blocks_state(b),
                      blocks_part(b));
    keep_all(b);
  } else if (b->count >= FIRST_BLOCKS) {
    const double elapsed_s = middle_s - b->rolled_s;
    rimi_rolled_step(&b->config.basis, blocks_filter_sum(b), rimi_blocks_share(b), elapsed_s,
                     block_s, blocks_state(b), blocks_part(b));
    rimi_rolled_forget(&b->config.basis, blocks_part(b), blocks_state(b), elapsed_s,
                       blocks_state_variance(b), blocks_state_kept(b));
  }
  b->rolled_s = middle_s;
}

static void evaluate_terms(blocks *b) {
  const rim_basis *n = &b->config.basis;
  for (size_t i = 0; i < n->terms; ++i) {
    const double raw = term_value(b, i) - (double)rimi_le_f32(n->center, i);
    blocks_term(b)[i] =
        rimi_clamp(raw * (double)rimi_le_f32(n->inverse_sd, i), -BASIS_CLIP, BASIS_CLIP);
  }
  for (size_t m = 0; m < n->means; ++m) {
    const double raw = blocks_filter_sum(b)[rimi_le_index(n->mean, 2 * m, blocks_filters(b))] -
                       (double)rimi_le_f32(n->mean_center, m);
    blocks_means(b)[m] = rimi_clamp(raw * (double)rimi_le_f32(n->mean_inverse_sd, m),
                                    -BASIS_MEAN_CLIP, BASIS_MEAN_CLIP);
  }
}

static void wrap_angles(blocks *b) {
  for (size_t f = 0; f < b->config.features; ++f)
    SUM(b)[f] = rimi_blocks_wrapped(SUM(b)[f], b->config.role[f]);
}

static void end_block(blocks *b) {
  const double n = (double)b->rows_in_block, pairs = n - (double)b->unpaired;
  double before[BASIS_MAX_STATES] = {0.0};
  b->before_rows = b->count == 0 ? b->rows_in_block : b->last_rows;
  b->last_rows = b->rows_in_block;
  for (size_t s = 0; s < b->config.basis.states; ++s)
    before[s] = reading_of(b, s);
  for (size_t f = 0; f < b->config.features; ++f)
    SUM(b)[f] /= n;
  for (size_t i = 0; i < blocks_filters(b); ++i)
    blocks_filter_sum(b)[i] /= n;
  for (size_t o = 0; o < b->config.outcomes; ++o) {
    if (b->config.external) {
      OUTCOME(b)[o] = O_SUM(b)[o] / n;
      PREDICTED(b)[o] = P_SUM(b)[o] / n;
      SD(b)[o] = S_SUM(b)[o] / n;
    } else {
      OUTCOME(b)[o] = SUM(b)[rimi_le_index(b->config.outcome_feature, o, b->config.features)];
    }
    if (b->count > 0 && !rimi_blocks_knows_readings(b))
      continue; /* as in the block before */
    REPEATS(b)[o] = pairs > 0.0 ? SAME(b)[o] / pairs : 0.0;
    const double square = b->seconds > 0 ? SQUARES(b)[o] / (double)b->seconds : 0.0;
    SCATTER(b)[o] = square > 0.0 ? rimi_max(rimi_log(square), BLOCKS_LN_LEAST) : BLOCKS_LN_LEAST;
  }
  for (size_t g = 0; g < b->config.integrands; ++g) {
    const double mean = blocks_early(b)[g] / n;
    const double moment = (blocks_late(b)[g] / n - 0.5 * (n - 1.0) * mean) / n;
    const double longer = block_periods(b) / (double)b->config.block_rows;
    blocks_early(b)[g] = longer * (mean - 2.0 * moment);
    blocks_late(b)[g] = longer * (mean + 2.0 * moment);
  }
  take_first(b);
  if (b->config.basis.terms + b->config.basis.means > 0) { /* there are models */
    const bool any_out = rimi_blocks_find_out(b);
    roll(b, before);
    evaluate_terms(b);
    rimi_blocks_find_unknown(b, any_out);
  }
  wrap_angles(b);
  ++b->count;
}

blocks_result rimi_blocks_row(blocks *b, double t_s, const double *context, const double *outcome,
                              const double *mean, const double *sd) {
  count(&b->health.rows);
  if (!row_is_usable(b, t_s, context, outcome, mean, sd))
    return BLOCKS_BAD;
  if (b->rows_in_block >= b->config.block_rows) {
    const bool is_whole = !is_late(b, b->previous_s - b->block_start_s, b->rows_in_block - 1u);
    begin_block(b);
    b->adjoins = is_whole; /* unless there is a gap before this row */
  }
  take_time(b, t_s);
  double before[BASIS_MAX_INPUTS];
  const bool has_gap = b->missing > 0;
  for (size_t i = 0; i < b->config.basis.inputs && has_gap; ++i)
    before[i] = input_value(b, i);
  if (has_gap)
    fill_integrands(b);
  take_features(b, context);
  take_outcomes(b, context, outcome, mean, sd);
  take_inputs(b, has_gap && b->config.basis.inputs > 0 ? before : NULL);
  take_integrands(b);
  count(&b->health.rows_used);
  b->rows_in_block = (uint16_t)(b->rows_in_block + 1u + filled(b));
  if (rimi_blocks_rate_is_wrong(b)) {
    count(&b->health.wrong_rate);
    begin_block(b);
    return BLOCKS_NONE;
  }
  if (b->rows_in_block < b->config.block_rows)
    return BLOCKS_NONE;
  end_block(b);
  return BLOCKS_DONE;
}

uint16_t rimi_blocks_out_of_range(const blocks *b, double *value) {
  if (value != NULL)
    *value = b->out_value;
  return b->out_feature;
}
bool rimi_blocks_rate_is_wrong(const blocks *b) { return b->is_off_rate; }
double rimi_blocks_period_s(const blocks *b) { return (double)b->told_period_s; }
const double *rimi_blocks_context(const blocks *b) { return SUM(b); }
const double *rimi_blocks_outcomes(const blocks *b) { return OUTCOME(b); }
const double *rimi_blocks_predicted(const blocks *b) { return PREDICTED(b); }
const double *rimi_blocks_sd(const blocks *b) { return SD(b); }
const double *rimi_blocks_scatter(const blocks *b) { return SCATTER(b); }
const double *rimi_blocks_repeats(const blocks *b) { return REPEATS(b); }
const double *rimi_blocks_terms(const blocks *b) { return blocks_term(b); }
const double *rimi_blocks_means(const blocks *b) { return blocks_means(b); }
const rim_basis *rimi_blocks_basis(const blocks *b) { return &b->config.basis; }
const uint8_t *rimi_blocks_roles(const blocks *b) { return b->config.role; }
const double *rimi_blocks_early(const blocks *b) { return blocks_early(b); }
const double *rimi_blocks_late(const blocks *b) { return blocks_late(b); }
const double *rimi_blocks_first(const blocks *b) { return FIRST(b); }
uint16_t rimi_blocks_outcome_feature(const blocks *b, uint32_t outcome) {
  return b->config.outcome_feature != NULL
             ? rimi_le_index(b->config.outcome_feature, outcome, b->config.features)
             : BLOCKS_NO_FEATURE;
}
bool rimi_blocks_has_first(const blocks *b) { return b->count >= FIRST_BLOCKS; }
bool rimi_blocks_knows_start(const blocks *b) { return !b->late; }
bool rimi_blocks_has_resumed(const blocks *b) { return b->resumed; }
uint32_t rimi_blocks_out_states(const blocks *b) { return b->out_states; }
const double *rimi_blocks_state_variance(const blocks *b) { return blocks_state_variance(b); }
const double *rimi_blocks_state_kept(const blocks *b) { return blocks_state_kept(b); }
double rimi_blocks_share(const blocks *b) {
  return (double)b->last_rows / ((double)b->last_rows + (double)b->before_rows);
}
bool rimi_blocks_jumped(const blocks *b) { return (b->jumped & (JUMPED_NOW | JUMPED_BEFORE)) != 0; }
bool rimi_blocks_adjoins(const blocks *b) { return b->adjoins; }
bool rimi_blocks_knows_readings(const blocks *b) {
  return b->unpaired == 0 || 4u * b->seconds >= 3u * (uint32_t)b->config.block_rows;
}
bool rimi_blocks_knows_all(const blocks *b) { return b->config.basis.terms == 0 || b->knows_all; }
const uint16_t *rimi_blocks_unknown(const blocks *b) { return blocks_unknown_term(b); }
double rimi_blocks_since_start_s(const blocks *b) {
  return 0.5 * (b->block_start_s + b->previous_s) - b->start_s;
}
double rimi_blocks_beyond_learnt(const blocks *b) {
  const double learnt_s = b->config.basis.learnt_s;
  return learnt_s > 0.0 ? rimi_clamp(rimi_blocks_since_start_s(b) / learnt_s - 1.0, 0.0, 1.0) : 0.0;
}
double rimi_blocks_run_start_s(const blocks *b) { return b->start_s; }
double rimi_blocks_start_s(const blocks *b) { return b->block_start_s; }
uint32_t rimi_blocks_count(const blocks *b) { return b->count; }
blocks_health rimi_blocks_get_health(const blocks *b) { return b->health; }
