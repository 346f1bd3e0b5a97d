/* Section BASIS of a flight image: what is computed from the commands of a run, as inputs of the
 * behaviour models and of the noise models.
 *
 * Little endian, 4-byte aligned:
 *   u32 layout (BASIS_LAYOUT), inputs I, time constants T, terms P, means M, 0, 0, 0
 *   u16 input[I][2]       a, b: feature a as it is (b = BASIS_PLAIN), its magnitude (b =
 *                         BASIS_MAGNITUDE), the product of the features a and b, or, with
 *                         BASIS_OF_PRODUCT added to b, the product's magnitude
 *   f32 share[T]          of a new row in an exponential mean: 1 - exp(-period / time constant)
 *   u16 term[P][4]        op (basis_op), a, b, 0
 *   f32 center[P], inverse_sd[P]      a term's value is (raw - center) * inverse_sd, clipped
 *   u16 mean[M][2]        filter, 0: the exponential means that the noise models use
 *   f32 center[M], inverse_sd[M]
 *   f32 first[outcomes]   mean first reading of each outcome in healthy runs
 * Filter i * T + t is the exponential mean of input i with time constant t; its value in a block is
 * the mean over the block's rows. */
#ifndef RIM_SRC_BASIS_H
#define RIM_SRC_BASIS_H

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
#define BASIS_CLIP 6.0      /* standard deviations of a term */
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
      *first;
} rim_basis;

/* Validate the whole section. RIM_E_TRUNCATED, _SIZE the bytes do not match the counts; RIM_E_RANGE
 * a count or index out of range (features, outcomes: of the image); RIM_E_DATA a number not finite
 * or a scale not above 0. */
rim_status rim_basis_open(rim_basis *view, const uint8_t *section, size_t bytes, uint32_t features,
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

rim_status rim_behaviour_open(rim_behaviour *view, const uint8_t *section, size_t bytes,
                              uint32_t terms, uint32_t outcomes);

/* predicted[2 O] in the outcomes' units; term[P] standardised, first[O] the first readings. */
void rim_behaviour_predict(const rim_behaviour *view, const double *term, const double *first,
                           double *predicted);

/* Section AGREEMENT: what remains of one outcome from what remains of the others.
 *   u32 layout (1), outcomes O, means M, 0
 *   f32 inverse_sd[O]     of the behaviour residuals
 *   f32 row[O][2 + O (2 + M)]: source (0: the weights that follow; 1: the outcome's prediction by
 *     section LEVEL), intercept, weights of the residuals of the same block, of the block before,
 *     and of the same block times mean 0, 1, ... Residuals enter in standard deviations, clipped at
 *     AGREEMENT_CLIP; the sum is in the outcome's own standard deviations. */
#define AGREEMENT_CLIP 4.0
typedef struct rim_agreement {
  uint32_t outcomes, means;
  const uint8_t *inverse_sd, *row;
} rim_agreement;

rim_status rim_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                              uint32_t outcomes, uint32_t means);

/* remains[O], in the outcomes' units: residual[o] less what the others' residuals say of it, or,
 * where the outcome's source is LEVEL, measured[o] - level[o]. before[O]: clipped residuals of the
 * block before, replaced by those of this block. mean[M]: standardised. level may be NULL. */
void rim_agreement_evaluate(const rim_agreement *view, const double *residual, const double *mean,
                            const double *measured, const double *level, double *before,
                            double *remains);

#endif
