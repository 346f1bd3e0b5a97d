/* SPDX-License-Identifier: MIT */
/* batch/stats.h - private: sufficient statistics of a set of observations, and how anomalous they
 * make it.
 *
 * An observation of outcome z in context x is used through dz = z - mu(x), its deviation from the
 * nominal prediction, and the nominal variance var(x). Alternative hypothesis: inside the region
 * the mean is shifted by an unknown constant (eq. 3.2, p. 26). Its logarithmic likelihood ratio
 * ln_anom = F(R) (eq. 3.4 to 3.7, p. 27-28) needs only sums over the region, so statistics of
 * disjoint sets add.
 *
 * All zero is the empty set, for which ln_anom is 0. Units: dz and shift in the outcome's unit, var
 * in its square, ln_anom in nats. Under the nominal model 2 F is chi-squared with one degree of
 * freedom, for a region fixed beforehand. Pointers are not checked. Stack below 200 bytes. */
#ifndef RIM_STATS_H
#define RIM_STATS_H

#include <stddef.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rim_stats {
  double n; /* observations */
  double s; /* sum of dz / var */
  double w; /* sum of 1 / var */
} rim_stats;

/* Adds one observation. RIM_E_DATA: dz not finite, var not finite or not above 0, or a sum that
 * would overflow; nothing is changed then. O(1). */
rim_status rimi_stats_add(rim_stats *stats, double dz, double var);

/* Makes `into` the statistics of the union with a disjoint set. */
void rimi_stats_merge(rim_stats *into, const rim_stats *other);

/* Returns F = s^2 / 2w (eq. 3.7), >= 0; 0 for the empty set. */
double rimi_stats_ln_anom(const rim_stats *stats);

/* Returns F of several outcomes of variance 1 (eq. 3.7 with the unit matrix): the sum over outcomes
 * of sum[o]^2 / 2n, where sum[o] is that of n deviations. 0 for n = 0. O(outcomes). */
double rimi_stats_ln_anom_sums(const double *sum, size_t outcomes, double n);

/* Returns the most likely shift s / w (eq. 3.6); 0 for the empty set. */
double rimi_stats_shift(const rim_stats *stats);

/* Returns F of a sum of deviations that share a component within a run: s = sum of n deviations,
 * each of variance a, plus one common offset of variance b: F = s^2 / 2(a n + b n^2). 0 when the
 * variance is not above 0. With b = 0 and a = var it is eq. 3.7. */
double rimi_stats_ln_anom_run(double s, double n, double a, double b);

#ifdef __cplusplus
}
#endif
#endif
