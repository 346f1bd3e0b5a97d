/* SPDX-License-Identifier: MIT */
/* Rows of telemetry to blocks: what the models and the search work on.
 *
 * Rows (say 20 Hz) are checked, limited to what was trained, and gathered `block_rows` at a time.
 * A block's numbers are means over its rows; an angle is unwrapped along the run, so that its mean
 * never jumps. A gap of half a block (at least three periods) starts the block over.
 *
 * What the commands were before the first row, and in such a gap, is not known. A run that begins
 * as the healthy ones began (section BASIS, start) is taken to have rested before; in any other,
 * and after a gap, a part of every exponential mean is unknown, and dies away with it. A state that
 * is rolled forward goes on from its reading where a gap was too long for a step. */
#ifndef RIM_SRC_BLOCKS_H
#define RIM_SRC_BLOCKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/basis.h"
#include "rim/status.h"

#define BLOCKS_LIMIT_MARGIN 0.5 /* of the trained width: beyond it a value is out of range */
#define BLOCKS_FAR 1.5          /* widths beyond that from which a reading is not believed at all */
#define BLOCKS_NO_FEATURE 0xffffu
#define BLOCKS_LN_LEAST (-60.0) /* logarithm of a mean square of zero */

/* Bits of RIM_SECTION_COMMANDS, one byte per feature. */
enum { BLOCKS_COMMAND = 1, BLOCKS_ANGLE_RAD = 2, BLOCKS_ANGLE_DEG = 4 };

/* A whole turn of an angle, in its unit; 0 of anything else. */
double rimi_blocks_turn(uint8_t role);
/* An angle within half a turn of 0; anything else as it is. */
double rimi_blocks_wrapped(double x, uint8_t role);

/* The inputs of section LEVEL: a block's context, an angle as its cosine, and after all features
 * the angles' sines. Returns how many there are, for which x has room; with context NULL they are
 * only counted. O(features). */
uint32_t rimi_level_inputs(const uint8_t *role, uint32_t features, const double *context,
                           double *x);

typedef struct blocks_config {
  uint16_t features, outcomes, block_rows;
  bool external;
  bool with_gaps;                 /* so were the healthy runs: their noise has what gaps hide */
  double period_s;                /* 0: rows have no rate */
  const uint8_t *outcome_feature; /* u16[outcomes]; NULL when external */
  const uint8_t *role;            /* u8[features] */
  const uint8_t *range;           /* f32 low[features], high[features] */
  rim_basis basis;
  uint32_t integrands;      /* of section AGREEMENT */
  const uint8_t *integrand; /* u16[integrands][4] */
} blocks_config;

typedef struct blocks_health {
  uint32_t rows, rows_used;
  uint32_t not_finite, time_back, gaps;
  uint32_t out_of_range; /* rows with a value beyond what was trained */
  uint32_t wrong_rate;   /* rows while the rate was not the image's */
} blocks_health;

typedef struct blocks blocks;

size_t rimi_blocks_size(const blocks_config *config);
/* RIM_E_ALIGN, RIM_E_SIZE, RIM_E_CONFIG. */
rim_status rimi_blocks_init(blocks **instance, void *memory, size_t bytes,
                            const blocks_config *config);
void rimi_blocks_reset(blocks *b);
/* Before the first row: rows of the run went before it that were not offered. */
void rimi_blocks_begin_late(blocks *b);
void rimi_blocks_attach(blocks *b, const blocks_config *config);
/* What holds pointers, sizes and counts, for guard.h: aligned to 4, *bytes a multiple of 4. */
const void *rimi_blocks_control(const blocks *b, size_t *bytes);
/* The sum continued by what one row leaves for the next, for guard.h: the upper halves of doubles,
 * as damage in the lower changes nothing that shows. */
uint32_t rimi_blocks_history_sum(const blocks *b, uint32_t sum);

typedef enum blocks_result {
  BLOCKS_BAD = -1, /* not used: not finite, or its time did not increase */
  BLOCKS_NONE = 0,
  BLOCKS_DONE = 1 /* a block ended: read it before the next row */
} blocks_result;

/* Offers a row. outcome, mean, sd [outcomes]: only when external. Cost O(features + outcomes +
 * inputs times), at the end of a block O(terms) more. */
blocks_result rimi_blocks_row(blocks *b, double t_s, const double *context, const double *outcome,
                              const double *mean, const double *sd);

/* The last row: the first feature whose value was beyond what was trained, or BLOCKS_NO_FEATURE. */
uint16_t rimi_blocks_out_of_range(const blocks *b, double *value);
/* Rows come this much faster or slower than those that were trained: their rate is another one. */
#define BLOCKS_RATE_OFF 0.08
bool rimi_blocks_rate_is_wrong(const blocks *b);
double rimi_blocks_period_s(const blocks *b); /* recent mean time between rows */

/* The block that ended. */
const double *rimi_blocks_context(const blocks *b); /* [features]: an angle within half a turn */
const double *
rimi_blocks_outcomes(const blocks *b); /* [outcomes]; external: mean of (z - m) / sd */
const double *
rimi_blocks_predicted(const blocks *b);             /* [outcomes]: mean of m; only when external */
const double *rimi_blocks_sd(const blocks *b);      /* [outcomes]: mean of sd; only when external */
const double *rimi_blocks_scatter(const blocks *b); /* ln of the mean square second difference */
const double *
rimi_blocks_repeats(const blocks *b);             /* share of readings that repeat, or are 0 */
const double *rimi_blocks_terms(const blocks *b); /* [terms], standardised */
const double *rimi_blocks_means(const blocks *b); /* [means], standardised */
const rim_basis *rimi_blocks_basis(const blocks *b);
const uint8_t *rimi_blocks_roles(const blocks *b); /* of the features */
const double *rimi_blocks_early(const blocks *b);  /* [integrands], see section AGREEMENT */
const double *rimi_blocks_late(const blocks *b);   /* [integrands] */
const double *rimi_blocks_first(const blocks *b);  /* [outcomes]: mean of the first two blocks */
bool rimi_blocks_has_first(const blocks *b);
uint16_t rimi_blocks_outcome_feature(const blocks *b,
                                     uint32_t outcome); /* BLOCKS_NO_FEATURE: none */
bool rimi_blocks_knows_start(const blocks *b);          /* the run began as healthy runs begin */
bool rimi_blocks_has_resumed(const blocks *b); /* states went on from readings after a gap */
/* Whether a reading was far out of range in half of the block: a wrong unit, or a wrong sensor. A
 * command never is: a loop may answer a fault by one that no healthy run had. Nor is what another
 * mission may read, within BLOCKS_FAR. */
bool rimi_blocks_is_out(const blocks *b, uint16_t feature);
/* [states]: of what short gaps left unknown of them; all zero: nothing is. */
const double *rimi_blocks_state_variance(const blocks *b);
/* [states], 1 to 0: what is left of each as it began, or went on after a long gap. */
const double *rimi_blocks_state_kept(const blocks *b);
uint32_t rimi_blocks_out_states(const blocks *b); /* bit s: state s began out of range */
bool rimi_blocks_adjoins(const blocks *b);        /* it begins where the one before it ended */
/* A feature jumped over a gap in this block or the one before: what integrates it is not known. */
bool rimi_blocks_jumped(const blocks *b);
bool rimi_blocks_knows_readings(const blocks *b); /* enough of them to see scatter and repeats */
bool rimi_blocks_knows_all(const blocks *b);      /* every term is what the commands made it */
const uint16_t *
rimi_blocks_unknown(const blocks *b); /* [terms]: rimi_behaviour_error; else not valid */
double rimi_blocks_since_start_s(const blocks *b); /* middle of the block */
/* Of the time that the block and the one before it took, how much is of this one: 0.5 unless rows
 * were missing at the end of one of them. */
double rimi_blocks_share(const blocks *b);
/* By how much of their length the run is longer than the healthy runs were: 0 to 1. */
double rimi_blocks_beyond_learnt(const blocks *b);
double rimi_blocks_run_start_s(const blocks *b); /* first row of the run, absolute */
double rimi_blocks_start_s(const blocks *b);     /* its first row, absolute */
uint32_t rimi_blocks_count(const blocks *b);     /* ended since the start */
blocks_health rimi_blocks_get_health(const blocks *b);

#endif
