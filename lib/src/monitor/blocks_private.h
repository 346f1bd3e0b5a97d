/* SPDX-License-Identifier: MIT */
/* Private to blocks.c and blocks_unknown.c: where things lie in a blocks' memory. */
#ifndef RIM_SRC_BLOCKS_PRIVATE_H
#define RIM_SRC_BLOCKS_PRIVATE_H

#include "base/bytes.h"
#include "base/real.h"
#include "monitor/blocks.h"
#include "rim/image.h"

#define FIRST_BLOCKS 2u /* whose mean is the first reading */
#define ROUND2(n) (((size_t)(n) + 1u) / 2u * 2u)

struct blocks {
  blocks_config config;
  blocks_health health;
  double start_s, previous_s, block_start_s, out_value;
  double rolled_s;        /* middle of the block to which the states were rolled */
  float mean_period_s;    /* recent mean time between rows; of each gap at most two periods */
  float told_period_s;    /* the same, however long the gaps */
  float mean_row;         /* recent mean of row_periods, of each no more than RATE_MOST off 1 */
  float row_periods;      /* from each row to the next in the time since the last row */
  float lost_rows;        /* of which nobody knows what the inputs did, times what they moved */
  uint32_t count;         /* blocks ended */
  uint16_t rows_in_block; /* with those that are filled in */
  uint16_t seconds;       /* second differences of the block */
  uint16_t unpaired;      /* of its rows, those whose last one is missing, and the missing ones */
  uint16_t last_rows;     /* of the block that ended last */
  uint16_t before_rows;   /* of the one before it */
  uint16_t out_feature;
  uint32_t missing;    /* rows that a gap before this one left out */
  uint32_t out_states; /* bit s: state s began at, or was rolled by, a reading out of range */
  uint8_t jumped;      /* bits: a feature did over a gap */
  uint8_t recent;      /* readings before this one without a gap, at most 2 */
  bool started;
  bool late;        /* the run began before its first row */
  bool told_late;   /* by rimi_blocks_begin_late() */
  bool bridged;     /* the gap before this row was too long for its block */
  bool knows_all;   /* of the block that ended: its terms */
  bool is_off_rate; /* judge_rate() */
  bool fills;       /* the gap before this row is filled in */
  bool adjoins;     /* the block begins where the one before it ended */
  bool resumed;     /* states went on from readings after a gap */
};

/* Arrays: first the history, which one row leaves for the next, and then what a block's end makes
 * of it. Those named external are there only when the configuration is. */
enum { FEATURE_ARRAYS = 2, OUTCOME_ARRAYS = 6, EXTERNAL_ARRAYS = 4 };

static inline double *array(const blocks *b) {
  return (double *)(void *)((unsigned char *)(uintptr_t)b + ((sizeof *b + 7u) & ~(size_t)7u));
}
static inline double *feature_array(const blocks *b, size_t which) {
  return array(b) + which * b->config.features;
}
static inline double *outcome_array(const blocks *b, size_t which) {
  return feature_array(b, FEATURE_ARRAYS) + which * b->config.outcomes;
}
#define SUM(b) feature_array(b, 0)     /* of the block, then its mean */
#define LAST(b) feature_array(b, 1)    /* last reading, unwrapped */
#define OUTCOME(b) outcome_array(b, 0) /* of the block that ended */
#define FIRST(b) outcome_array(b, 1)
#define ONE_AGO(b) outcome_array(b, 2)
#define TWO_AGO(b) outcome_array(b, 3)
#define SQUARES(b) outcome_array(b, 4)
#define SAME(b) outcome_array(b, 5)
#define O_SUM(b) outcome_array(b, 6) /* external */
#define P_SUM(b) outcome_array(b, 7) /* external */
#define S_SUM(b) outcome_array(b, 8) /* external */
#define SD(b) outcome_array(b, 9) /* external; between blocks an alarm may tell its shift by it */

static inline size_t blocks_outcome_arrays(const blocks_config *c) {
  return OUTCOME_ARRAYS + (c->external ? EXTERNAL_ARRAYS : 0u);
}
static inline size_t blocks_filters(const blocks *b) {
  return (size_t)b->config.basis.inputs * b->config.basis.times;
}
static inline double *blocks_filter(const blocks *b) {
  return outcome_array(b, blocks_outcome_arrays(&b->config));
}
static inline double *blocks_filter_sum(const blocks *b) {
  return blocks_filter(b) + blocks_filters(b);
}
static inline double *blocks_decay(const blocks *b) {
  return blocks_filter_sum(b) + blocks_filters(b);
}
static inline double *blocks_integral(const blocks *b) {
  return blocks_decay(b) + b->config.basis.times;
}
static inline double *blocks_state(const blocks *b) {
  return blocks_integral(b) + b->config.basis.inputs;
}
/* What missing rows left unknown of each. */
static inline double *blocks_state_variance(const blocks *b) {
  return blocks_state(b) + b->config.basis.states;
}
/* What is left of each as it began, or went on after a gap: 1 to 0. */
static inline double *blocks_state_kept(const blocks *b) {
  return blocks_state_variance(b) + b->config.basis.states;
}
static inline double *blocks_part(const blocks *b) {
  return blocks_state_kept(b) + b->config.basis.states;
}
/* Sums of the integrands and of row times integrand; at the end of a block early and late. */
static inline double *blocks_early(const blocks *b) {
  return blocks_part(b) + b->config.basis.rates;
}
static inline double *blocks_late(const blocks *b) {
  return blocks_early(b) + b->config.integrands;
}
/* Part of every exponential mean that is not known; its sum over the block. */
static inline double *blocks_unknown(const blocks *b) {
  return blocks_late(b) + b->config.integrands;
}
static inline double *blocks_unknown_sum(const blocks *b) {
  return blocks_unknown(b) + b->config.basis.times;
}
/* Per feature: of an angle the whole turns that unwrap it, of any other the rows of the block in
 * which it was far out of range. */
static inline int32_t *blocks_turns(const blocks *b) {
  return (int32_t *)(void *)(blocks_unknown_sum(b) + b->config.basis.times);
}

/* Of each input, the blocks in which it was out of range, and how many blocks ago the last of them
 * was; both saturate. */
static inline uint16_t *blocks_out_blocks(const blocks *b) {
  return (uint16_t *)(void *)(blocks_turns(b) + ROUND2(b->config.features));
}

static inline double *made_array(const blocks *b, size_t which) {
  double *end = (double *)(void *)(blocks_out_blocks(b) + 2u * ROUND2(b->config.basis.inputs));
  return end + which * b->config.outcomes;
}
#define SCATTER(b) made_array(b, 0)
#define REPEATS(b) made_array(b, 1)
#define PREDICTED(b) made_array(b, 2) /* external */

static inline size_t blocks_made_arrays(const blocks_config *c) { return c->external ? 3u : 2u; }
static inline double *blocks_term(const blocks *b) {
  return made_array(b, blocks_made_arrays(&b->config));
}
static inline double *blocks_means(const blocks *b) {
  return blocks_term(b) + b->config.basis.terms;
}
/* Of every term. */
static inline uint16_t *blocks_unknown_term(const blocks *b) {
  return (uint16_t *)(void *)(blocks_means(b) + b->config.basis.means);
}

static inline double blocks_whole_turn(const blocks *b, size_t f) {
  return rimi_blocks_turn(b->config.role[f]);
}

static inline double blocks_trained_width(const blocks *b, size_t f) {
  return (double)rimi_le_f32(b->config.range, b->config.features + f) -
         (double)rimi_le_f32(b->config.range, f);
}

/* What base to the power of n leaves of `power`. 20 turns at most where n is below a million. */
static inline double blocks_power(double power, double base, uint32_t n) {
  for (; n > 0; n >>= 1) {
    if ((n & 1u) != 0)
      power *= base;
    base *= base;
  }
  return power;
}

/* blocks_unknown.c: the block has ended. What of its terms is not known, and where it matters that
 * the run began late. O(features + inputs + rates), where something is not known O(terms). */
bool rimi_blocks_find_out(blocks *b); /* whether a reading is far out of range */
void rimi_blocks_find_unknown(blocks *b, bool any_out);

#endif
