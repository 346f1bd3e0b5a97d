/* SPDX-License-Identifier: MIT */
/* What of a block is not known: what commands before the first row or in a gap did, and what
 * readings that are out of range may really have been. */
#include "monitor/blocks_private.h"

#define OUT_SD 5.0          /* of an input that is out of range: how far it may be off */
#define OUT_MOVES 0.01      /* part of a mean that is, from which on it moves a state */
#define ODD_OUTCOMES 2u     /* of a first block that make it none; one may be a sensor's fault */
#define BEFORE_START_SD 2.0 /* of a term whose past lies before the first row */
#define BEYOND_SD 2.0       /* of a term, where a run is longer than any that was learnt */
#define FORGOTTEN 1e-3      /* part of a mean that is as good as known */

bool rimi_blocks_is_out(const blocks *b, uint16_t f) {
  return f < b->config.features && b->config.role[f] == 0 && /* no command, no angle */
         2 * blocks_turns(b)[f] >= (int32_t)b->rows_in_block;
}

/* A product is, if one of its factors is. */
static bool input_is_out(const blocks *b, size_t i) {
  const uint8_t *input = b->config.basis.input;
  const uint16_t second = rimi_le_u16(input, 2 * i + 1);
  return rimi_blocks_is_out(b, rimi_le_u16(input, 2 * i)) ||
         (rimi_basis_is_product(second) &&
          rimi_blocks_is_out(b, (uint16_t)(second & ~BASIS_OF_PRODUCT)));
}

/* Counts what each input's means are made of. Before the first row an input is taken to have been
 * as in it. */
static bool find_out_inputs(blocks *b, bool any_out) {
  bool any = false;
  for (size_t i = 0; i < b->config.basis.inputs; ++i) {
    uint16_t *out = blocks_out_blocks(b) + 2 * i, *ago = out + 1;
    if (any_out && input_is_out(b, i)) {
      *out = b->count == 0 || *out == UINT16_MAX ? UINT16_MAX : (uint16_t)(*out + 1u);
      *ago = 0;
    } else if (*ago < UINT16_MAX) {
      ++*ago;
    }
    any = any || *out > 0;
  }
  return any;
}

/* The part of a mean that is made of readings out of range. */
static double out_part(const blocks *b, size_t filter) {
  const rim_basis *n = &b->config.basis;
  const uint16_t *out = blocks_out_blocks(b) + 2 * (filter / n->times);
  if (out[0] == 0)
    return 0.0;
  const double keep = 1.0 - (double)rimi_le_f32(n->share, filter % n->times);
  const uint32_t rows = b->config.block_rows;
  return blocks_power(1.0 - blocks_power(1.0, keep, rows * out[0]), keep, rows * out[1]);
}

/* The states that begin at a reading out of range, or that it moves. */
static void find_out_states(blocks *b, bool any_out, bool any_input) {
  const rim_basis *n = &b->config.basis;
  for (uint32_t s = 0; s < n->states && any_out && b->count < FIRST_BLOCKS; ++s) {
    const uint32_t o = rimi_le_index(n->state, s, b->config.outcomes);
    if (rimi_blocks_is_out(b, rimi_blocks_outcome_feature(b, o)))
      b->out_states |= UINT32_C(1) << s;
  }
  for (size_t q = 0; q < n->rates && any_input && b->count + 1u >= FIRST_BLOCKS; ++q) {
    for (size_t k = 1; k < 4; ++k) {
      const uint16_t code = rimi_le_u16(n->rate, 4 * q + k);
      if (code < blocks_filters(b) && out_part(b, code) > OUT_MOVES)
        b->out_states |= UINT32_C(1) << rimi_le_index(n->rate, 4 * q, BASIS_MAX_STATES);
    }
  }
}

bool rimi_blocks_find_out(blocks *b) {
  bool any_out = false;
  for (uint32_t f = 0; f < b->config.features && !any_out; ++f)
    any_out = rimi_blocks_is_out(b, (uint16_t)f);
  find_out_states(b, any_out, find_out_inputs(b, any_out));
  return any_out;
}

static bool is_outcome(const blocks *b, size_t feature) {
  for (size_t o = 0; o < b->config.outcomes; ++o) {
    if (rimi_le_u16(b->config.outcome_feature, o) == feature)
      return true;
  }
  return false;
}

/* Whether the features of the run's first block are none that healthy runs begin with: one that is
 * given to the vehicle, or several outcomes; or whether all of them together are rather what they
 * are later. One outcome alone may be a sensor that is wrong, and one that is out of range is. */
static bool begins_late(const blocks *b) {
  const rim_basis *n = &b->config.basis;
  uint32_t odd = 0, out = 0;
  /* By which it is a later block; of the outcome without which it is that least; of one that is out
   * of range. */
  double nats = 0.0, most = 0.0, of_out = 0.0;
  if (n->start == NULL || b->config.external)
    return false;
  basis_place place;
  if (n->later != NULL)
    rimi_basis_place(n, b->config.features, SUM(b), &place);
  for (uint32_t f = 0; f < b->config.features; ++f) {
    const double start[2] = {(double)rimi_le_f32(n->start, f), (double)rimi_le_f32(n->start_sd, f)};
    const double x = SUM(b)[f];
    const bool reads = is_outcome(b, f), is_out = reads && rimi_blocks_is_out(b, (uint16_t)f);
    double alone = 0.0;
    nats += n->later != NULL ? rimi_basis_later(n, b->config.features, &place, f, &alone) : 0.0;
    if (reads && !is_out)
      most = rimi_max(most, alone);
    if (is_out) {
      out++;
      of_out = alone;
    } else if (blocks_whole_turn(b, f) <= 0.0 &&
               rimi_abs(x - start[0]) > BASIS_START_LIMIT * start[1])
      odd += reads ? 1u : ODD_OUTCOMES;
  }
  if (odd >= ODD_OUTCOMES || n->later == NULL || out > 1)
    return odd >= ODD_OUTCOMES; /* of two sensors that are wrong the others say too little */
  return nats - (out == 1 ? of_out : most) >= (double)rimi_le_f32(n->later, 0);
}

/* Standard deviation of an input's integral over the rows that gaps left out: the input may have
 * been anywhere in its range. */
static double lost_of_integral(const blocks *b, size_t input) {
  const size_t f = rimi_le_index(b->config.basis.input, 2 * input, b->config.features);
  return RIM_UNIFORM_SD * blocks_trained_width(b, f) * (double)b->lost_rows * b->config.period_s;
}

/* The part of an exponential mean that is from longer ago than any healthy run went: there, models
 * have only ever seen what was before a run's start. */
static double from_long_ago(const blocks *b, size_t t) {
  const double share = (double)rimi_le_f32(b->config.basis.share, t);
  if (share >= 1.0)
    return 0.0;
  const double rate = rimi_log(1.0 - share) / b->config.period_s; /* < 0, per second */
  const double then = rimi_exp(rate * b->config.basis.learnt_s);
  return rimi_max(then - rimi_exp(rate * rimi_blocks_since_start_s(b)), 0.0);
}

/* Standard deviations of a product that is not known at all. */
static double most_unknown(const blocks *b) { return b->late ? BEFORE_START_SD : 1.0; }

/* What of a mean is not known, of all filters of the block. */
static void find_unknown_means(blocks *b, double beyond) {
  for (size_t t = 0; t < b->config.basis.times; ++t) {
    blocks_unknown_sum(b)[t] *= most_unknown(b) / (double)b->rows_in_block;
    if (beyond > 0.0)
      blocks_unknown_sum(b)[t] += BEYOND_SD * from_long_ago(b, t);
  }
}

static double mean_unknown(const blocks *b, size_t filter) {
  return blocks_unknown_sum(b)[filter % b->config.basis.times]; /* by find_unknown_means() */
}

/* Standard deviation of an error of a term, in the term's own. The commands of a gap are as those
 * of any other time; what a run has done before its first row may be far from what it does now.
 * beyond: by rimi_blocks_beyond_learnt(). */
static double term_unknown(const blocks *b, size_t i, double beyond) {
  const rim_basis *n = &b->config.basis;
  const size_t first = rimi_le_index(n->term, 4 * i + 1, blocks_filters(b));
  const size_t second = rimi_le_index(n->term, 4 * i + 2, blocks_filters(b));
  switch ((basis_op)rimi_le_u16(n->term, 4 * i)) {
  case BASIS_MEAN:
  case BASIS_ABS:
  case BASIS_SIDE:
    return mean_unknown(b, first) + OUT_SD * out_part(b, first);
  case BASIS_PRODUCT:
    return rimi_min(mean_unknown(b, first) + mean_unknown(b, second), most_unknown(b)) +
           OUT_SD * (out_part(b, first) + out_part(b, second));
  case BASIS_TRIPLE: {
    const size_t third = rimi_le_index(n->term, 4 * i + 3, blocks_filters(b));
    return rimi_min(mean_unknown(b, first) + mean_unknown(b, second) + mean_unknown(b, third),
                    most_unknown(b)) +
           OUT_SD * (out_part(b, first) + out_part(b, second) + out_part(b, third));
  }
  case BASIS_DECAY:
    return (b->late ? 1.0 : beyond) * blocks_decay(b)[rimi_le_index(n->term, 4 * i + 2, n->times)] *
           (double)rimi_le_f32(n->inverse_sd, i);
  case BASIS_INTEGRAL:
    if (blocks_out_blocks(b)[2 * (first % n->inputs)] > 0)
      return OUT_SD;
    return b->late ? BEFORE_START_SD
                   : BEYOND_SD * beyond + lost_of_integral(b, first % n->inputs) *
                                              (double)rimi_le_f32(n->inverse_sd, i);
  case BASIS_INITIAL:
    return b->late ? BEFORE_START_SD : 0.0;
  case BASIS_TIME:
    return b->late ? BEFORE_START_SD : BEYOND_SD * beyond;
  case BASIS_ROLLED: /* after a gap it goes on from its reading; its filter: where there is one */
    return rimi_le_u16(n->term, 4 * i + 2) < blocks_filters(b) ? OUT_SD * out_part(b, second) : 0.0;
  }
  return 0.0;
}

void rimi_blocks_find_unknown(blocks *b, bool any_out) {
  const rim_basis *n = &b->config.basis;
  if (b->count == 0 && (b->told_late || begins_late(b))) {
    b->late = true;
    for (size_t t = 0; t < n->times; ++t)
      blocks_unknown(b)[t] = blocks_decay(b)[t];
  }
  const double beyond = rimi_blocks_beyond_learnt(b);
  bool any = b->late || b->resumed || rimi_blocks_jumped(b) || b->out_states != 0 ||
             b->lost_rows > 0.0f || beyond > 0.0 || any_out;
  for (size_t i = 0; i < n->inputs && !any; ++i)
    any = blocks_out_blocks(b)[2 * i] > 0;
  for (size_t t = 0; t < n->times && !any; ++t)
    any = blocks_unknown_sum(b)[t] > FORGOTTEN * (double)b->rows_in_block;
  b->knows_all = !any;
  if (!any)
    return;
  find_unknown_means(b, beyond);
  for (size_t i = 0; i < n->terms; ++i) {
    const double sd = rimi_min(term_unknown(b, i, beyond), BASIS_CLIP);
    blocks_unknown_term(b)[i] = (uint16_t)rimi_floor(BASIS_UNKNOWN_SD * sd + 0.5);
  }
}
