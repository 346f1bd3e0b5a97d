/* SPDX-License-Identifier: MIT */
/* batch/interval.h - the exact most anomalous interval along one feature (App. A, Alg. 8).
 *
 * Thesis p. 115-116. Over k bins of sufficient statistics all k(k+1)/2 intervals of neighbouring
 * bins are weighed; each interval's sums are the last one's plus one bin (line 10 of Alg. 8), so no
 * table is kept and no sum is a difference. The result is the same as the algorithm's, bit for bit.
 * Ties: the shorter interval, then the one further left. Empty bins at either end are never part of
 * the result (they would tie and be longer).
 *
 * `min_n` is the least number of observations an interval must hold (0: any). RIM_OK
 * also when nothing qualifies or every ln_anom is 0: then bins is 0 and all else 0. RIM_E_ARGUMENT:
 * a null pointer; RIM_E_RANGE: more than RIM_INTERVAL_MAX_BINS bins. On error nothing
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
  double s;       /* sum of the bins' s */
  double w;       /* sum of the bins' w */
  double ln_anom; /* F = s^2 / 2w (eq. 3.7) */
} rim_interval;

/* Finds the interval with the largest rimi_stats_ln_anom. */
rim_status rimi_interval_find(const rim_stats *bin, size_t bins, double min_n, rim_interval *best);

#ifdef __cplusplus
}
#endif
#endif
