/* SPDX-License-Identifier: MIT */
/* rim/plan/extent.h - how far a RIM extends, as a distribution, and what reward that leads to
 * expect (thesis 5.2.1 to 5.2.3, p. 69-72).
 *
 * An extent holds the latest observations (context x, deviation dz = z - mu of the reward from the
 * nominal model, its nominal variance) and represents a RIM by a set of regions instead of one. The
 * weight of each region is P(anom), the confidence that it is anomalous (eq. 5.2). There are two
 * ways to make the set:
 *
 *   by volume  the thesis's: for every lambda of a range the region that maximises anom+ = ln anom
 *              + lambda V (eq. 5.3 to 5.5), V its volume as a fraction of the box of contexts, at
 *              most 1. Small lambda give the most specific, large ones the most general region
 *              consistent with what was seen
 *   sampled    a sample of regions in proportion to their likelihood: anom(R) is the likelihood of
 *              the data with a RIM in R over that without, so Metropolis chains on temper * anom+
 *              sample the posterior over regions (prior: flat over centres and factors). The set by
 *              volume knows the two extremes that the data allow; this one also gives the
 *              probability of what lies between them, which matters near observed edges (fig5.10)
 *
 *   member(x)    = sum P_i 1(x in R_i) / sum P_i                                      (eq. 5.6)
 *   shift(x)     = sum P_i 1(x in R_i) shift_i / sum P_i 1(x in R_i)                   (p. 72)
 *   shift_var(x) = sum P_i 1(x in R_i) var_i / sum P_i 1(x in R_i)                    (eq. 5.8)
 *   var_i        = (sum (dz - shift_i)^2 + v) / n^2                                   (eq. 5.7)
 *
 * v, the mean nominal variance in the region, stands for one further observation: eq. 5.7 as
 * printed is 0/0 for one observation and far too sure for two; with v the first gives the nominal
 * standard error and many give eq. 5.7. shift_i = s / w as in eq. 3.6.
 *
 * Existence: eq. 5.6 is conditional on the RIM's existence, so it also normalises weights that come
 * from noise alone to 1. The weight of the RIM in the mixture is therefore
 * w_1(x) = existence * member(x), where existence is the largest P_i of the set.
 *
 * Several RIMs: the next one is searched for in the deviations that those before it do not explain,
 * and takes its share of what they leave of w_0.
 *
 * The search runs in slices of bounded work (rim_extent_search). Random numbers come from the
 * configured seed and a counter. An extent is one flat block without pointers into itself: a copy
 * of its bytes (aligned to 8) is a second extent in the same state. Functions that return
 * rim_status change nothing on error, except counters. Calls on one extent must not overlap
 * (rim/monitor.h, Threads). Stack below 4 kB. */
#ifndef RIM_EXTENT_H
#define RIM_EXTENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_EXTENT_MAX_DIMS 4
#define RIM_EXTENT_MAX_POINTS 512
#define RIM_EXTENT_MAX_LAMBDAS 16
#define RIM_EXTENT_MAX_RIMS 3
#define RIM_EXTENT_MAX_KNOTS 16
#define RIM_EXTENT_HEADER_BYTES 1024
#define RIM_EXTENT_REGION_BYTES 320

#define RIM_EXTENT_DEFAULT_LAMBDAS 9
#define RIM_EXTENT_DEFAULT_LAMBDA 16.0
#define RIM_EXTENT_DEFAULT_THRESHOLD 7.0

/* Bytes of an extent. 512 observations in 2 dimensions, one RIM, 9 lambdas: 24 kB. */
#define RIM_EXTENT_SIZE(dims, points, lambdas, rims)                                               \
  (RIM_EXTENT_HEADER_BYTES + 8u * (size_t)(points) * ((size_t)(dims) + 3u) +                       \
   RIM_EXTENT_REGION_BYTES * (size_t)(lambdas) * (size_t)(rims))

typedef enum rim_extent_set { RIM_EXTENT_BY_VOLUME = 0, RIM_EXTENT_SAMPLED = 1 } rim_extent_set;

/* Points with |L^-1 (u - centre)| < 1 by the 2-norm or by the largest component: "our algorithms
 * apply to any parametric shape" (3.1, p. 28). L is lower triangular: a box has sides across the
 * first coordinate and is sheared along the others, in 2 dimensions the parallelogram of fig. 5.6.
 */
typedef enum rim_extent_shape { RIM_EXTENT_ELLIPSOID = 0, RIM_EXTENT_BOX = 1 } rim_extent_shape;

/* Zero-initialise, then fill. */
typedef struct rim_extent_config {
  uint8_t dims;    /* of x, 1..RIM_EXTENT_MAX_DIMS */
  uint16_t points; /* observations held, 8..RIM_EXTENT_MAX_POINTS; when full the oldest goes */
  uint8_t lambdas; /* regions of a set, 1..RIM_EXTENT_MAX_LAMBDAS; 0: 9 */
  uint8_t rims;    /* 1..RIM_EXTENT_MAX_RIMS; 0: 1 */
  uint8_t set;     /* rim_extent_set */
  uint8_t shape;   /* rim_extent_shape */
  double lower[RIM_EXTENT_MAX_DIMS]; /* box of contexts; both 0: 0..1. Contexts may lie outside, */
  double upper[RIM_EXTENT_MAX_DIMS]; /* but the centres of regions stay inside */
  double lambda_min; /* nats per unit of V, within +-500; with lambda_max both 0: -16 and 16 */
  double lambda_max;
  double temper; /* sampled: factor of ln anom in (0, 1], because deviations are not quite normal
                    and the region is not quite of that shape; 0: 0.2 */
  /* What is known of a region's size in each dimension: row d of L keeps its diagonal within, as a
   * fraction of the box, and where sampled the rest of the row below the largest. */
  double least_axis[RIM_EXTENT_MAX_DIMS]; /* 0: 0.04 */
  double most_axis[RIM_EXTENT_MAX_DIMS];  /* 0: 0.6 */
  double min_points;                      /* observations a region must hold to count, >= 1; 0: 3 */
  /* P(anom) as a function of ln anom (eq. 5.2): linear between knots that rise in both, constant
   * beyond, to be found by simulating nominal runs (3.4.2, p. 35). Without
   * knots: 1 / (1 + exp(threshold - ln anom)). */
  uint8_t knots;                           /* 0..RIM_EXTENT_MAX_KNOTS; 1 is not allowed */
  double ln_anom[RIM_EXTENT_MAX_KNOTS];    /* strictly rising */
  double confidence[RIM_EXTENT_MAX_KNOTS]; /* rising within [0, 1] */
  double threshold;                        /* ln anom at which P = 1/2; 0: 7 */
  /* Work of one slice: samples * iterations ellipsoids are looked at. */
  uint16_t samples;    /* 2..64; 0: 24 */
  uint16_t iterations; /* 1..64; 0: 8 */
  uint64_t seed;
} rim_extent_config;

/* One region of the set. */
typedef struct rim_extent_region {
  uint8_t dims;                       /* 0: nothing found */
  double center[RIM_EXTENT_MAX_DIMS]; /* u, over (x - lower) / (upper - lower) */
  double factor[RIM_EXTENT_MAX_DIMS * (RIM_EXTENT_MAX_DIMS + 1) / 2]; /* L by rows of its lower
                                         triangle: (i, j) at i (i + 1) / 2 + j; diagonal > 0 */
  double lambda;
  double volume;     /* fraction of the box, at most 1 */
  double n;          /* observations inside */
  double ln_anom;    /* s^2 / 2w (eq. 3.7), 0: nothing found */
  double shift;      /* s / w (eq. 3.6) */
  double shift_var;  /* squared standard error (eq. 5.7) */
  double confidence; /* P(anom), 0 where nothing was found */
} rim_extent_region;

/* What is known of a RIM at a context. */
typedef struct rim_extent_local {
  double existence; /* largest confidence of the set */
  double member; /* eq. 5.6: the probability of lying inside, given existence; 0 where all P are */
  double shift;  /* 0 where member is 0 */
  double shift_var; /* eq. 5.8; 0 where member is 0 */
} rim_extent_local;

/* Reward as a mixture: component 0 is the model without a RIM. The weights sum to 1. */
typedef struct rim_extent_mixture {
  uint32_t components; /* 1 + RIMs */
  double weight[1 + RIM_EXTENT_MAX_RIMS];
  double mean[1 + RIM_EXTENT_MAX_RIMS];
  double var[1 + RIM_EXTENT_MAX_RIMS];
} rim_extent_mixture;

/* Saturating. */
typedef struct rim_extent_counters {
  uint32_t added;
  uint32_t replaced; /* oldest observations that made room */
  uint32_t refused;  /* not finite, or var not within 1e-100..1e100 */
} rim_extent_counters;

typedef struct rim_extent rim_extent;

/* Makes an extent without observations in the caller's memory. RIM_E_ARGUMENT: NULL; RIM_E_ALIGN:
 * memory not aligned to 8; RIM_E_CONFIG: a count out of range, knots that do not rise, lower not
 * below upper, an axis or min_points out of range; RIM_E_RANGE: a number not finite; RIM_E_SIZE:
 * fewer bytes than RIM_EXTENT_SIZE. */
rim_status rim_extent_init(rim_extent **extent, void *memory, size_t bytes,
                           const rim_extent_config *config);

/* Forgets observations, regions and counters. */
void rim_extent_reset(rim_extent *extent);

/* Adds an observation, in place of the oldest when the memory is full: x[dims], dz = reward less
 * the nominal model's expectation, var its nominal variance. Regions are evaluated again, but not
 * moved, so rim_extent_at accounts for all observations. RIM_E_DATA: a number not finite or var not
 * within 1e-100..1e100; counted. O(lambdas * rims * points). */
rim_status rim_extent_add(rim_extent *extent, const double *x, double dz, double var);

/* Runs `slices` bounded searches, in turn for each RIM and lambda. Every third search of a region
 * starts again near a strongly deviating observation, by the cross-entropy method; the other two
 * refine the current region, or another lambda's region where that is better. BY_VOLUME never
 * lowers a region's anom+. SAMPLED runs samples * iterations Metropolis steps; a restart or another
 * lambda's region replaces a chain only if it is 10 nats better, which means that the chain was
 * stuck. 3 * lambdas * rims slices visit every region three times. O(slices * samples * iterations
 * * points * dims^2). */
void rim_extent_search(rim_extent *extent, uint32_t slices);

/* These return the number of observations held, of RIMs searched for, and of lambdas per RIM. */
uint32_t rim_extent_points(const rim_extent *extent);
uint32_t rim_extent_rims(const rim_extent *extent);
uint32_t rim_extent_lambdas(const rim_extent *extent);

/* One region of a RIM's set. RIM_E_ARGUMENT: NULL; RIM_E_RANGE: no such index. O(1). */
rim_status rim_extent_get_region(const rim_extent *extent, uint32_t rim, uint32_t lambda,
                                 rim_extent_region *region);

/* Existence, extent and effect of one RIM at x[dims]. All 0 for a RIM that is not there or x not
 * finite. O(lambdas dims^2). */
rim_extent_local rim_extent_at(const rim_extent *extent, uint32_t rim, const double *x);

/* The reward at x[dims] where the model without a RIM expects `mean` with variance `var` about that
 * expectation (eq. 5.10; with a GP on the residuals pass its mean and variance added: eq. 5.13).
 * Variance of a RIM's component: var + shift_var (eq. 5.14). O(rims lambdas dims^2). */
rim_extent_mixture rim_extent_reward(const rim_extent *extent, const double *x, double mean,
                                     double var);

/* Mean (eq. 5.9) and variance (eq. 5.11, 5.12) of a mixture; either may be NULL. */
void rim_extent_moments(const rim_extent_mixture *mixture, double *mean, double *var);

/* Returns what the corrected model adds to the nominal mean at x: sum of w_j shift_j. */
double rim_extent_correction(const rim_extent *extent, const double *x);

/* Returns P(anom) for a ln anom (eq. 5.2), in [0, 1]. */
double rim_extent_confidence(const rim_extent *extent, double ln_anom);

rim_extent_config rim_extent_get_config(const rim_extent *extent);
rim_extent_counters rim_extent_get_counters(const rim_extent *extent);

#ifdef __cplusplus
}
#endif
#endif
