/* SPDX-License-Identifier: MIT */
/* Section BASIS of a flight image: what is computed from the commands of a run, as inputs of the
 * behaviour models and of the noise models.
 *
 * Little endian, 4-byte aligned:
 *   u32 layout (BASIS_LAYOUT), inputs I, time constants T, terms P, means M, S, 0, 0
 *   u16 input[I][2]       a, b: feature a as it is (b = BASIS_PLAIN), its magnitude (b =
 *                         BASIS_MAGNITUDE), the product of the features a and b, or, with
 *                         BASIS_OF_PRODUCT added to b, the product's magnitude
 *   f32 share[T]          of a new row in an exponential mean: 1 - exp(-period / time constant)
 *   u16 term[P][4]        op (basis_op), a, b, 0
 *   f32 center[P], inverse_sd[P]      a term's value is (raw - center) * inverse_sd, clipped
 *   u16 mean[M][2]        filter, 0: the exponential means that the noise models use
 *   f32 center[M], inverse_sd[M]
 *   f32 first[outcomes]   mean first reading of each outcome in healthy runs
 *   f32 first_sd[outcomes]   where S is 1: their standard deviation, > 0. A first reading is
 * limited to BASIS_FIRST_LIMIT of it, or a sensor that is wrong from the start would be believed.
 * Filter i * T + t is the exponential mean of input i with time constant t; its value in a block is
 * the mean over the block's rows. */
#ifndef RIM_SRC_BASIS_H
#define RIM_SRC_BASIS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#define BASIS_LAYOUT 1u
#define BASIS_PLAIN 0xffffu
#define BASIS_MAGNITUDE 0xfffeu
#define BASIS_OF_PRODUCT 0x8000u
#define BASIS_MAX_INPUTS 48u
#define BASIS_MAX_TIMES 12u
#define BASIS_MAX_TERMS 512u
#define BASIS_MAX_MEANS 8u
#define BASIS_CLIP 6.0 /* standard deviations of a term */
#define BASIS_FIRST_LIMIT 4.0
#define BASIS_MEAN_CLIP 4.0 /* of a mean, so that it fits into a byte */

typedef enum basis_op {
  BASIS_MEAN = 0,     /* filter a */
  BASIS_PRODUCT = 1,  /* filter a times filter b */
  BASIS_ABS = 2,      /* magnitude of filter a */
  BASIS_DECAY = 3,    /* (1 - share[b])^rows since the start of the run */
  BASIS_INTEGRAL = 4, /* of input a over the run, seconds times its unit */
  BASIS_INITIAL = 5,  /* first reading of outcome a, less its healthy mean, times 1 - decay b */
  BASIS_TIME = 6,     /* seconds since the start of the run */
  BASIS_ROLLED = 7    /* state a of the rolled model */
} basis_op;

/* A view into the section; all zero: no inputs, no terms. */
typedef struct rim_basis {
  uint32_t inputs, times, terms, means;
  const uint8_t *input, *share, *term, *center, *inverse_sd, *mean, *mean_center, *mean_inverse_sd,
      *first, *first_sd; /* first_sd: NULL where there is none */
} rim_basis;

/* Validate the whole section. RIM_E_TRUNCATED, _SIZE the bytes do not match the counts; RIM_E_RANGE
 * a count or index out of range (features, outcomes: of the image); RIM_E_DATA a number not finite
 * or a scale not above 0. */
rim_status rimi_basis_open(rim_basis *view, const uint8_t *section, size_t bytes, uint32_t features,
                           uint32_t outcomes);

/* Section BEHAVIOUR: every outcome of a block from the terms of BASIS alone. Targets 0..O-1 are the
 * outcomes' block means, O..2O-1 the logarithms of their mean square second differences.
 *   u32 layout (1), terms P, targets 2 O, 0
 *   u32 from_start[2 O]   1: the model predicts the change since the first reading
 *   f32 intercept[2 O], f32 weight[2 O][P] */
typedef struct rim_behaviour {
  uint32_t terms, targets;
  const uint8_t *from_start, *intercept, *weight;
} rim_behaviour;

rim_status rimi_behaviour_open(rim_behaviour *view, const uint8_t *section, size_t bytes,
                               uint32_t terms, uint32_t outcomes);

/* predicted[2 O] in the outcomes' units; term[P] standardised, first[O] the first readings. */
void rimi_behaviour_predict(const rim_behaviour *view, const double *term, const double *first,
                            double *predicted);

/* Section AGREEMENT: what remains of one outcome from what the others say.
 *   u32 layout (2), outcomes O, means M, 0
 *   f32 inverse_sd[O]     of the behaviour residuals
 *   f32 level_inverse_sd[O]   of the outcomes themselves
 *   f32 row[O][AGREEMENT_FIRST + O (2 + M)]: source (agreement_source), intercept, integrand,
 *     0, weights
 * RESIDUALS: weights of the others' residuals of the same block, of the block before, and of the
 *   same block times mean 0, 1, ... Residuals enter in standard deviations, clipped at
 *   AGREEMENT_CLIP; the sum is in the outcome's own standard deviations.
 * LEVEL: the outcome less its prediction by section LEVEL; no weights.
 * INTEGRAL: an outcome that integrates others (position, attitude, charge): its change since the
 *   block before less what the others' values of both blocks, in standard
 *   deviations, say of it, summed over
 *   the run.
 * integrand: whatever the source, the outcome that this one mostly integrates, or -1. */
#define AGREEMENT_CLIP 4.0
#define AGREEMENT_FIRST 4u
#define AGREEMENT_KEEPS 0.9995 /* of the sum per block: it must stay bounded in a long flight */

typedef enum agreement_source {
  AGREEMENT_RESIDUALS = 0,
  AGREEMENT_LEVEL = 1,
  AGREEMENT_INTEGRAL = 2
} agreement_source;

typedef struct rim_agreement {
  uint32_t outcomes, means;
  const uint8_t *inverse_sd, *level_inverse_sd, *row;
} rim_agreement;

rim_status rimi_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                               uint32_t outcomes, uint32_t means);

/* One block; arrays of [outcomes], in the outcomes' units, mean[means] standardised. */
typedef struct agreement_block {
  const double *residual, *mean, *measured;
  const double *level; /* NULL: there is no section LEVEL */
  bool follows;        /* the block before is its neighbour in time */
} agreement_block;

/* Doubles per outcome that are kept from block to block; all 0 before the first. */
#define AGREEMENT_STATE 4u

/* remains[O], in the outcomes' units. Cost O(O^2 (2 + M)). */
void rimi_agreement_evaluate(const rim_agreement *view, const agreement_block *block, double *state,
                             double *remains);

/* Where `outcome` is watched as an integral: its change per block and unit of outcome j, 0 where it
 * does not integrate that one. *mostly: whether j is the one that it mostly integrates. */
double rimi_agreement_gain(const rim_agreement *view, uint32_t outcome, uint32_t j, bool *mostly);

#endif
