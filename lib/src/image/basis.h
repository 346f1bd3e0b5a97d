/* SPDX-License-Identifier: MIT */
/* Section BASIS of a flight image: what is computed from the commands of a run, as inputs of the
 * behaviour models and of the noise models.
 *
 * Little endian, 4-byte aligned:
 *   u32 layout (BASIS_LAYOUT), inputs I, time constants T, terms P, means M, S, states Z, rates Q
 *   u16 input[I][2]       a, b: feature a as it is (b = BASIS_PLAIN), its magnitude (b =
 *                         BASIS_MAGNITUDE), the cosine or sine of the angle a (BASIS_COSINE,
 *                         BASIS_SINE), those of k times a (2 (k - 1) less, k to BASIS_HARMONICS; of
 *                         what is no angle, a in radians), the product of the features a and b, or,
 *                         with BASIS_OF_PRODUCT added to b, the magnitude of it; or how a moves,
 *                         which as it is is an earlier input, p: by its difference e from its own
 *                         exponential mean with the second time constant, as sign(e) sqrt(|e|) (b =
 *                         BASIS_MOVEMENT + p) or |e| (with BASIS_OF_SIZE added to b)
 *   f32 share[T]          of a new row in an exponential mean: 1 - exp(-period / time constant)
 *   u16 term[P][4]        op (basis_op), a, b, c
 *   f32 center[P], inverse_sd[P]      a term's value is (raw - center) * inverse_sd, clipped
 *   u16 mean[M][2]        filter, 0: the exponential means that the noise models use
 *   f32 center[M], inverse_sd[M]
 *   f32 first[outcomes]   mean first reading of each outcome in healthy runs
 *   f32 first_sd[outcomes]   where S is 1 to 4: their standard deviation, > 0. A first reading is
 * limited to BASIS_FIRST_LIMIT of it, or a sensor that is wrong from the start would be believed.
 *   f32 start[features], start_sd[features]   where S is 2 to 4: what the features are in the first
 * block of healthy runs, and how they differ from run to run (> 0, widened for few runs). A run
 * that begins otherwise is taken to have begun before its first row.
 *   where S is 3 or 4: f32 learnt_s > 0, how far the healthy runs went; f32 begin[I][T][2]: before
 * the first row an exponential mean is taken to be begin[0] + begin[1] times its input. Without: as
 * its input in the first row, and the models are taken to hold for ever.
 *   where S is 4: f32 late_nats, later[features], later_sd[features], start_inverse[features
 * (features + 1) / 2], later_inverse[as many]: what the features are in the later blocks of healthy
 * runs, in mean and standard deviation (> 0), and the inverse matrices of the features'
 * correlations in first and in later blocks (the lower triangle by rows, > 0 on the diagonal; an
 * angle's rows are those of the unit matrix). A run whose first block is likelier by late_nats or
 * more as one of these than as a first one, without the outcome that says most for it
 * (rimi_basis_later()), is taken to have begun before its first row as well. What is the same for
 * every block, half of ln(det later_inverse / det start_inverse), is taken off late_nats.
 *   u16 state[2 ceil(Z / 2)]   the outcome that a state predicts, rolled forward (rolled.h)
 *   f32 limit[Z][2]       lowest and highest value of a state
 *   u16 rate[Q][4]        a state, and three factors of a part of its change per second: a filter's
 *                         mean over the block, BASIS_STATE + s: state s, BASIS_STATE_MAGNITUDE + s:
 *                         its magnitude, or BASIS_PLAIN: 1
 *   f32 weight[Q]
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
#define BASIS_COSINE 0xfffdu
#define BASIS_SINE 0xfffcu
#define BASIS_HARMONICS 5u
#define BASIS_LEAST_HARMONIC (BASIS_SINE - 2u * (BASIS_HARMONICS - 1u))
#define BASIS_OF_PRODUCT 0x8000u
#define BASIS_MOVEMENT 0xff00u /* the least code that is no product */
#define BASIS_OF_SIZE 0x0040u
#define BASIS_STATE 0x8000u
#define BASIS_HINGE 0x4000u
#define BASIS_HINGES 64u
#define BASIS_STATE_MAGNITUDE 0x9000u
#define BASIS_MAX_INPUTS 48u
#define BASIS_MAX_TIMES 12u
#define BASIS_MAX_FEATURES 128u /* of section BASIS with S = 4 */
#define BASIS_MAX_TERMS 640u
#define BASIS_MAX_MEANS 8u
#define BASIS_MAX_STATES 8u /* a power of two */
#define BASIS_MAX_RATES 96u
#define BASIS_CLIP 6.0 /* standard deviations of a term */
#define BASIS_FIRST_LIMIT 4.0
#define BASIS_START_LIMIT 4.0 /* standard deviations of a first block */
#define BASIS_LATER_LIMIT 6.0 /* standard deviations that one feature counts, at most */
#define BASIS_MEAN_CLIP 4.0   /* of a mean, so that it fits into a byte */

typedef enum basis_op {
  BASIS_MEAN = 0,     /* filter a */
  BASIS_PRODUCT = 1,  /* filter a times filter b */
  BASIS_ABS = 2,      /* magnitude of filter a */
  BASIS_DECAY = 3,    /* (1 - share[b])^rows since the start of the run */
  BASIS_INTEGRAL = 4, /* of input a over the run, seconds times its unit */
  BASIS_INITIAL = 5,  /* first reading of outcome a, less its healthy mean, times 1 - decay b */
  BASIS_TIME = 6,     /* seconds since the start of the run */
  BASIS_ROLLED = 7,   /* state a times filter b times state c; BASIS_PLAIN for either: 1. With c =
                         BASIS_HINGE + k: only what of state a lies above k / BASIS_HINGES of the
                         way from its lowest to its highest value */
  BASIS_TRIPLE = 8,   /* filter a times filter b times filter c */
  BASIS_SIDE = 9      /* x / (|x| + h) of filter a: its sign, but smooth about 0. b, c: the low and
                         the high half of h as f32, > 0 */
} basis_op;

static inline bool rimi_basis_is_movement(uint16_t second) {
  return second >= BASIS_MOVEMENT && second < BASIS_MOVEMENT + 2u * BASIS_OF_SIZE;
}

static inline bool rimi_basis_is_product(uint16_t second) { return second < BASIS_MOVEMENT; }

/* The input that moves, of a movement's b. */
static inline uint32_t rimi_basis_moves(uint16_t second) { return second & (BASIS_OF_SIZE - 1u); }

/* A view into the section; all zero: no inputs, no terms. */
typedef struct rim_basis {
  uint32_t inputs, times, terms, means;
  uint16_t states, rates;
  const uint8_t *input, *share, *term, *center, *inverse_sd, *mean, *mean_center, *mean_inverse_sd,
      *first, *first_sd, *start, *start_sd, *begin; /* from first_sd on: NULL without */
  const uint8_t *later;                             /* from late_nats to later_inverse, or NULL */
  const uint8_t *state, *limit, *rate, *weight;
  double learnt_s; /* 0: not known */
} rim_basis;

/* A block's features in standard deviations of first and of later blocks, of each at most
 * BASIS_LATER_LIMIT. */
typedef struct basis_place {
  float start[BASIS_MAX_FEATURES], later[BASIS_MAX_FEATURES];
} basis_place;

/* x: the block's means; at most BASIS_MAX_FEATURES of them. view->later is not NULL. */
void rimi_basis_place(const rim_basis *view, uint32_t features, const double *x,
                      basis_place *place);

/* What feature f adds to the nats by which a block is likelier as a later one of a run than as its
 * first one, both normal (a quadratic discriminant); over all features these sum up to all nats but
 * for what is the same for every block. *alone: how many fewer there are without that feature, the
 * densities integrated over it. O(features). */
double rimi_basis_later(const rim_basis *view, uint32_t features, const basis_place *place,
                        uint32_t f, double *alone);

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

#define BASIS_UNKNOWN_SD 8192.0 /* one standard deviation of a term */

/* error[2 O], in the outcomes' units: standard deviations of the predictions where term i is
 * uncertain by unknown[i] / BASIS_UNKNOWN_SD of its own standard deviations. 1e30 where the first
 * readings are not those of the run (knows_start) and the model needs them. */
void rimi_behaviour_error(const rim_behaviour *view, const uint16_t *unknown, bool knows_start,
                          double *error);

/* Section AGREEMENT: what remains of one outcome from what the others say.
 *   u32 layout (3), outcomes O, means M, integrands G (at most AGREEMENT_INTEGRANDS O)
 *   f32 inverse_sd[O]     of the behaviour residuals
 *   u16 integrand[G][4]   op (agreement_op), features a, b, 0
 *   f32 integrand_inverse_sd[G]
 *   f32 partial[G][2]     change of an integrand's mean per unit of a and of b in healthy runs
 *   f32 row[O][AGREEMENT_FIRST + O (2 + M)]: source (agreement_source), intercept, integrand,
 *     lag (INTEGRAL, INTO: in blocks, -1 to 1), weights
 * RESIDUALS: weights of the others' residuals of the same block, of the block before, and of the
 *   same block times mean 0, 1, ... Residuals enter in standard deviations, clipped at
 *   AGREEMENT_CLIP; the sum is in the outcome's own standard deviations.
 * LEVEL, QUADRATIC: the outcome less its prediction by the section of that name; no weights.
 * FEW: the outcome less the intercept and a weighted sum of a few others, all in their units: what
 *   one sensor says of another holds wherever the vehicle goes. Of an angle the weights are 1 or
 *   -1, and what remains is taken by the shorter way round.
 * INTEGRAL: an outcome that integrates others (position, attitude, charge): its change since the
 *   block before less the intercept and G weights times the integrands over that time, summed over
 *   the run.
 * INTO: an outcome that another one, row[o][1], integrates (a speed, of a position): what the
 *   integral gives more than that other outcome's change, summed over the run. Of two sensors that
 *   read the same, it tells which one is wrong.
 * row[o][2]: whatever the source, the outcome that this one mostly integrates, or -1.
 *
 * The mean of an integral over a block changes by the integrand weighted by a triangle over both
 * blocks. With c_k = (k + .5) / n - .5 for row k of n and q = mean(c_k x_k), that is n periods
 * times (mean - 2 q of this block + mean + 2 q of the block before) / 2: exact, where the means of
 * the two blocks alone are wrong whenever the integrand changes within a block. Where the outcome's
 * reading is later than its integrands' by `lag` blocks (a part of a sampling period is usual), it
 * lacks by lag times n periods what they changed by from block to block. */
#define AGREEMENT_CLIP 4.0
#define AGREEMENT_FIRST 4u
#define AGREEMENT_KEEPS 0.9995  /* of the sum per block: it must stay bounded in a long flight */
#define AGREEMENT_INTEGRANDS 3u /* at most per outcome */
#define AGREEMENT_LAG 1.0       /* blocks, at most */

typedef enum agreement_source {
  AGREEMENT_RESIDUALS = 0,
  AGREEMENT_LEVEL = 1,
  AGREEMENT_INTEGRAL = 2,
  AGREEMENT_FEW = 3,
  AGREEMENT_INTO = 4,
  AGREEMENT_QUADRATIC = 5
} agreement_source;

/* An integrand of the features a and b. */
typedef enum agreement_op {
  AGREEMENT_PLAIN = 0,   /* a */
  AGREEMENT_PRODUCT = 1, /* a b */
  AGREEMENT_COSINE = 2,  /* a cos b */
  AGREEMENT_SINE = 3     /* a sin b */
} agreement_op;

typedef struct rim_agreement {
  uint32_t outcomes, means, integrands;
  const uint8_t *inverse_sd, *integrand, *integrand_inverse_sd, *partial, *row;
} rim_agreement;

/* features: of the image, which integrands may name. */
rim_status rimi_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                               uint32_t features, uint32_t outcomes, uint32_t means);

/* One block; arrays of [outcomes], in the outcomes' units, mean[means] standardised. */
typedef struct agreement_block {
  const double *residual, *mean, *measured, *predicted; /* predicted: by behaviour */
  const double *early, *late; /* [integrands]: mean - 2 q and mean + 2 q, as above */
  const double *level;        /* NULL: there is no section LEVEL */
  const double *quadratic;    /* NULL: there is no section QUADRATIC */
  bool follows;               /* the block before is its neighbour in time */
} agreement_block;

/* Standard deviation of what remains of `outcome`, in its unit, where the residuals are uncertain
 * by error[O] beside their noise: 0 where no residual is used. O(O (2 + M)). */
double rimi_agreement_error(const rim_agreement *view, uint32_t outcome, const double *mean,
                            const double *error);

/* The outcome that alone, and with a weight above 0, says what this one reads (FEW); the number of
 * outcomes: there is none. weight: NULL, or set where there is one. O(O). */
uint32_t rimi_agreement_twin(const rim_agreement *view, uint32_t outcome, double *weight);

/* agreement_source of an outcome. */
uint32_t rimi_agreement_source(const rim_agreement *view, uint32_t outcome);

/* The outcome whose changes a sum over the run is held against: INTEGRAL: the same, INTO: the one
 * that integrates it; the number of outcomes: it is no sum. */
uint32_t rimi_agreement_integral(const rim_agreement *view, uint32_t outcome);

/* Doubles per outcome that are kept from block to block; all 0 before the first. */
#define AGREEMENT_STATE 5u

/* rimi_noise_disturbance() of a block's behaviour residuals, in the outcomes' units; work[O]. */
double rimi_agreement_disturbance(const rim_agreement *view, const double *residual, double *work);

/* remains[O] and what is expected[O], in the outcomes' units: of an integral what was integrated
 * since the start of the run, where only residuals tell what behaviour predicts. A gain's error is
 * a share of it. Cost O(O^2 (2 + M)). */
void rimi_agreement_evaluate(const rim_agreement *view, const agreement_block *block, double *state,
                             double *remains, double *expected);

/* Where `outcome` is watched as an integral: its change per block and unit of outcome j, whose
 * feature is given; of INTO with the sign reversed, since what remains is so. */
typedef struct agreement_gain {
  double sum;         /* 0 where it does not integrate j; the other factors as in healthy runs */
  double of_products; /* the part of the sum that depends on other factors */
  bool mostly;        /* j is the outcome that it mostly integrates */
  bool factor;        /* j is in what it integrates, also as an angle, of which sum is 0 */
} agreement_gain;

agreement_gain rimi_agreement_gain(const rim_agreement *view, uint32_t outcome, uint32_t j,
                                   uint16_t feature);

/* Whether the reading of a feature, that of outcome j (O: of none), is in what `outcome` is held
 * against, or integrates what it is held against. Residuals of other outcomes are not readings.
 * O(integrands). */
bool rimi_agreement_takes(const rim_agreement *view, uint32_t outcome, uint32_t j,
                          uint16_t feature);

#endif
