/* SPDX-License-Identifier: MIT */
/* rim/interval.h - the exact most anomalous interval along one feature (App. A, Alg. 8).
 *
 * Thesis p. 115-116. Over k bins of sufficient statistics all k(k+1)/2 intervals of neighbouring
 * bins are weighed; each interval's sums are the last one's plus one bin (line 10 of Alg. 8), so no
 * table is kept and no sum is a difference. The result is the same as the algorithm's, bit for bit.
 * Ties: the shorter interval, then the one further left. Empty bins at either end are never part of
 * the result (they would tie and be longer).
 *
 * Common to all: `min_n` is the least number of observations an interval must hold (0: any). RIM_OK
 * also when nothing qualifies or every ln_anom is 0: then bins is 0 and all else 0. RIM_E_ARGUMENT:
 * a null pointer or stride 0; RIM_E_RANGE: more than RIM_INTERVAL_MAX_BINS bins. On error nothing
 * is written. Bins must be finite: a NaN is not checked for, but never wins. Cost O(k^2): per
 * interval some additions and two multiplications, a division only for intervals that reach the
 * best so far. Stack below 200 bytes. */
#ifndef RIM_INTERVAL_H
#define RIM_INTERVAL_H

#include <stddef.h>
#include <stdint.h>

#include "batch/stats.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_INTERVAL_MAX_BINS 4096 /* bounds the work of one call to 8.4 million intervals */

typedef struct rim_interval {
  uint32_t first; /* index of its first bin */
  uint32_t bins;  /* number of bins; 0: no interval qualified */
  double n;       /* observations in it */
  double s;       /* sum of the bins' s; 0 from rimi_interval_find_score */
  double w;       /* sum of the bins' w, or the run-level variance of s; 0 from ..._score */
  double ln_anom; /* F = s^2 / 2w (eq. 3.7), or the score */
} rim_interval;

/* Finds the interval with the largest rimi_stats_ln_anom. */
rim_status rimi_interval_find(const rim_stats *bin, size_t bins, double min_n, rim_interval *best);

/* The same on float tables: bin i has n[i * stride], s[i * stride], w[i * stride]. w may equal n
 * when deviations are standardised. Sums are double. */
rim_status rimi_interval_find_f32(const float *n, const float *s, const float *w, size_t stride,
                                  size_t bins, double min_n, rim_interval *best);

/* Variance of a sum of n deviations of one run: a n + b n^2, plus n times sum n_k b_k where each
 * bin brings its own b_k. All zero never qualifies. */
typedef struct rim_interval_run {
  double a;     /* variance of one deviation about the run's offset, >= 0 */
  double b;     /* variance of the run's offset common to all bins, >= 0 */
  double min_n; /* see above */
} rim_interval_run;

/* Finds the interval with the largest F = S^2 / 2 Var, S = sum s, N = sum n,
 * Var = a N + b N^2 + N sum n_k b_k (rimi_stats_ln_anom_run when b_k is NULL). n and s are the
 * number and the plain sum of deviations in a bin; bin i has n[i * stride], s[i * stride], b_k[i *
 * stride]. */
rim_status rimi_interval_find_run(const double *n, const double *s, const double *b_k,
                                  size_t stride, size_t bins, const rim_interval_run *run,
                                  rim_interval *best);
rim_status rimi_interval_find_run_f32(const float *n, const float *s, const float *b_k,
                                      size_t stride, size_t bins, const rim_interval_run *run,
                                      rim_interval *best);

/* Finds the interval with the largest rimi_stats_score_all over several outcomes: bin i has its
 * statistics in bin[i * outcomes .. + outcomes). n is that of the outcome with most. scratch holds
 * `outcomes` statistics and is overwritten. Only scores above 0 qualify. O(k^2 outcomes). */
rim_status rimi_interval_find_score(const rim_stats *bin, size_t bins, size_t outcomes,
                                    double min_n, rim_stats *scratch, rim_interval *best);

#ifdef __cplusplus
}
#endif
#endif
