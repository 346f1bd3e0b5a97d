/* SPDX-License-Identifier: MIT */
/* rim/stats.h - sufficient statistics of a set of observations, and how anomalous they make it.
 *
 * An observation of outcome z in context x is used through dz = z - mu(x), its deviation from the
 * nominal prediction, and the nominal variance var(x). Alternative hypothesis: inside the region
 * the mean is shifted by an unknown constant (eq. 3.2, p. 26). Its logarithmic likelihood ratio
 * ln_anom = F(R) (eq. 3.4 to 3.7, p. 27-28) needs only sums over the region, so statistics of
 * disjoint sets add.
 *
 * Every statistic starts as all zero: the empty set, for which ln_anom is 0. Units: dz and shift in
 * the outcome's unit, var in its square, ln_anom in nats. Under the nominal model 2 F is
 * chi-squared with as many degrees of freedom as outcomes, for a region fixed beforehand.
 *
 * Functions returning rim_status change nothing on error. Every `_add` refuses (RIM_E_DATA) numbers
 * that are not finite and variances not above 0; unless said otherwise pointers must not be NULL
 * and are not checked in functions that return double or void. No function keeps a pointer. Stack
 * below 1.3 kB. */
#ifndef RIM_STATS_H
#define RIM_STATS_H

#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- one Gaussian outcome: a shift of the mean, or a shift proportional to a known quantity ----
 */

/* All sums; all zero is the empty set. */
typedef struct rim_stats {
  double n; /* observations, or the sum of their weights */
  double s; /* sum of dz / var */
  double w; /* sum of 1 / var */
} rim_stats;

/* Adds one observation. RIM_OK; RIM_E_DATA dz not finite, var not finite or not above 0, or a sum
 * that would overflow. O(1). */
rim_status rimi_stats_add(rim_stats *stats, double dz, double var);

/* Adds an observation that belongs to the set with the given weight in [0, 1] (the responsibilities
 * of eq. 3.16). Weight 1 equals rimi_stats_add bit for bit. RIM_E_DATA also for a weight outside. */
rim_status rimi_stats_add_weighted(rim_stats *stats, double dz, double var, double weight);

/* Adds one observation under the alternative 'gain': the shift is g times an unknown constant, g a
 * known quantity of the observation (the sensor's own value, a speed). Sums g dz / var and g^2 /
 * var; the result of the other functions then is the gain and its deviation, in units of dz / g. Do
 * not mix with rimi_stats_add in one set. RIM_E_DATA also for g not finite. */
rim_status rimi_stats_add_gain(rim_stats *stats, double dz, double g, double var);

/* Makes `into` the statistics of the union with a disjoint set. */
void rimi_stats_merge(rim_stats *into, const rim_stats *other);

/* Makes `from` the statistics of what remains without a subset that was merged before; exact up to
 * the rounding of the sums. When no observation remains (n <= 0) all sums are set to exactly 0. */
void rimi_stats_subtract(rim_stats *from, const rim_stats *part);

/* Returns F = s^2 / 2w (eq. 3.7), >= 0; 0 for the empty set. */
double rimi_stats_ln_anom(const rim_stats *stats);

/* Returns the most likely shift s / w (eq. 3.6); 0 for the empty set. */
double rimi_stats_shift(const rim_stats *stats);

/* Returns the standard error 1 / sqrt(w) of the shift; infinity for the empty set. */
double rimi_stats_shift_sd(const rim_stats *stats);

/* Returns F of a sum of deviations that share a component within a run: s = sum of n deviations,
 * each of variance a, plus one common offset of variance b: F = s^2 / 2(a n + b n^2). 0 when the
 * variance is not above 0. With b = 0 and a = var it is eq. 3.7. */
double rimi_stats_ln_anom_run(double s, double n, double a, double b);

/* ---- several outcomes with diagonal covariance: an array of rim_stats, one each ---- */

/* Deviance a healthy outcome contributes by chance and must exceed to count: see rimi_stats_score.
 */
#define RIM_STATS_SCORE_FLOOR 2.0

/* Adds dz[o] with var[o] to stats[o], all or none. Same statuses as rimi_stats_add. O(outcomes). */
rim_status rimi_stats_add_all(rim_stats *stats, size_t outcomes, const double *dz,
                              const double *var);
void rimi_stats_merge_all(rim_stats *into, const rim_stats *other, size_t outcomes);
void rimi_stats_subtract_all(rim_stats *from, const rim_stats *part, size_t outcomes);

/* Returns the sum of F_o: eq. 3.7 with diagonal covariance. */
double rimi_stats_ln_anom_all(const rim_stats *stats, size_t outcomes);

/* Returns the sum over outcomes of max(0, F_o - RIM_STATS_SCORE_FLOOR): a fault in one of many
 * outcomes is not drowned by the healthy ones, which contribute on average 1/2 each to eq. 3.7 and
 * nearly nothing here. Not a likelihood ratio: calibrate its own threshold. */
double rimi_stats_score_all(const rim_stats *stats, size_t outcomes);

/* Returns one outcome's part of it: max(0, ln_anom - RIM_STATS_SCORE_FLOOR). */
double rimi_stats_score(double ln_anom);

/* ---- several outcomes with full covariance ---- */

#define RIM_STATS_MAX_OUTCOMES 8
/* Symmetric matrices are packed by rows of the lower triangle: element (i, j), j <= i, at i(i+1)/2
 * + j. */
#define RIM_STATS_PACKED(outcomes) ((outcomes) * ((outcomes) + 1) / 2)

typedef struct rim_stats_full {
  uint32_t outcomes; /* 1..RIM_STATS_MAX_OUTCOMES; 0: not initialised, every call is refused */
  double n;
  double s[RIM_STATS_MAX_OUTCOMES];                   /* sum of Sigma^-1 dz */
  double w[RIM_STATS_PACKED(RIM_STATS_MAX_OUTCOMES)]; /* sum of Sigma^-1, packed */
} rim_stats_full;

/* Makes the empty set. RIM_E_ARGUMENT NULL; RIM_E_RANGE outcomes not in 1..RIM_STATS_MAX_OUTCOMES.
 */
rim_status rimi_stats_full_init(rim_stats_full *stats, uint32_t outcomes);

/* Writes the inverse of a packed covariance into precision (may be the same array). RIM_E_RANGE
 * outcomes; RIM_E_SINGULAR not positive definite within rounding or not finite. O(outcomes^3). */
rim_status rimi_stats_full_precision(uint32_t outcomes, const double *covariance,
                                     double *precision);

/* Adds dz[outcomes] with a packed precision: for a covariance that is the same for many.
 * O(outcomes^2). RIM_E_ARGUMENT set not initialised; RIM_E_DATA a number not finite. The precision
 * is trusted to be positive definite. */
rim_status rimi_stats_full_add_precision(rim_stats_full *stats, const double *dz,
                                         const double *precision);

/* Adds dz[outcomes] with a packed covariance. Statuses of the two functions above. O(outcomes^3).
 */
rim_status rimi_stats_full_add(rim_stats_full *stats, const double *dz, const double *covariance);

/* As for rim_stats. RIM_E_ARGUMENT: different or no outcomes. */
rim_status rimi_stats_full_merge(rim_stats_full *into, const rim_stats_full *other);
rim_status rimi_stats_full_subtract(rim_stats_full *from, const rim_stats_full *part);

/* Writes F (eq. 3.7), the most likely shift[outcomes] (eq. 3.6) and its packed covariance, the
 * inverse of sum Sigma^-1; any of the three may be NULL. RIM_E_ARGUMENT not initialised;
 * RIM_E_SINGULAR the empty set or a sum that is not positive definite. On error nothing is written.
 * O(outcomes^3). */
rim_status rimi_stats_full_solve(const rim_stats_full *stats, double *ln_anom, double *shift,
                                 double *shift_covariance);

/* ---- a Gaussian outcome whose variance has changed ---- */

typedef struct rim_stats_variance {
  double n; /* observations */
  double q; /* sum of dz^2 / var */
} rim_stats_variance;

/* Ratios are floored here, or a sensor stuck at its prediction would be infinitely anomalous. */
#define RIM_STATS_MIN_RATIO 0x1p-40

/* Adds one observation. RIM_E_DATA as rimi_stats_add. */
rim_status rimi_stats_variance_add(rim_stats_variance *stats, double dz, double var);
void rimi_stats_variance_merge(rim_stats_variance *into, const rim_stats_variance *other);
void rimi_stats_variance_subtract(rim_stats_variance *from, const rim_stats_variance *part);

/* Returns F = n/2 (v - 1 - ln v), v = q / n: the alternative is N(0, v var) with v free. Rises for
 * more and for less noise alike. 0 for the empty set. */
double rimi_stats_variance_ln_anom(const rim_stats_variance *stats);

/* Returns the most likely ratio v = q / n of the variance to the nominal one; 1 for the empty set.
 */
double rimi_stats_variance_ratio(const rim_stats_variance *stats);

/* Returns the standard error v sqrt(2 / n) of that ratio; infinity for the empty set. */
double rimi_stats_variance_ratio_sd(const rim_stats_variance *stats);

/* ---- an outcome that is an event or not (Bernoulli) ---- */

typedef struct rim_stats_bernoulli {
  double n; /* trials */
  double k; /* events among them */
  double p; /* sum of the nominal probabilities: events expected */
  double v; /* sum of p (1 - p) */
} rim_stats_bernoulli;

/* Adds one trial with nominal probability p. RIM_E_DATA: p not in the open interval (0, 1), or
 * event not 0 or 1. */
rim_status rimi_stats_bernoulli_add(rim_stats_bernoulli *stats, int event, double p);
void rimi_stats_bernoulli_merge(rim_stats_bernoulli *into, const rim_stats_bernoulli *other);
void rimi_stats_bernoulli_subtract(rim_stats_bernoulli *from, const rim_stats_bernoulli *part);

/* Returns F of a constant shift of the log odds, logit(p_i) + beta, maximised over beta:
 *   F = max_beta [ beta k - sum_i ln(1 + p_i (e^beta - 1)) ].
 * With one p for all trials it is Kulldorff's k ln(k/np) + (n-k) ln((n-k)/(n(1-p))), exactly. With
 * varying p the sum is taken over two values of p that have the same mean and variance (m -+ tau,
 * kept within [m/8, 1 - (1-m)/8], which can only lower F): exact for two values in equal parts, and
 * for p even over [0.05, 0.95] within 4 % of F + 1/2. 0 for the empty set. At most 40 safeguarded
 * Newton steps. */
double rimi_stats_bernoulli_ln_anom(const rim_stats_bernoulli *stats);

/* Returns the maximising beta, the logarithm of the odds ratio: >0 for more events than expected.
 * Limited to +-RIM_STATS_MAX_LOG_ODDS, which it takes when no trial or every trial was an event. 0
 * if empty. */
#define RIM_STATS_MAX_LOG_ODDS 40.0
double rimi_stats_bernoulli_log_odds(const rim_stats_bernoulli *stats);

#ifdef __cplusplus
}
#endif
#endif
