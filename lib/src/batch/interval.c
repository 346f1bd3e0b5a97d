/* SPDX-License-Identifier: MIT */
#include "batch/interval.h"

#include <string.h>

/* Division is kept for intervals that reach the best up to this factor: the three roundings of the
 * multiplied-out comparison are together below 2^-51, so none that reaches it is missed. */
#define SCREEN (1.0 - 0x1p-50)

/* Replaces the best by an interval of anomaly f where that is larger, or equal over fewer bins.
 * Offers come with `first` rising, so of equal ones the leftmost stays. */
static void consider(rim_interval *best, const rim_interval *offer) {
  if (offer->ln_anom > best->ln_anom ||
      (offer->ln_anom == best->ln_anom && offer->bins < best->bins)) {
    *best = *offer;
  }
}

/* Weighs the interval that starts at offer->first and has offer's sums; w <= 0 or NaN never wins.
 */
static inline void weigh(rim_interval *best, rim_interval *offer, uint32_t bins, double min_n) {
  const double square = offer->s * offer->s;
  if (!(offer->w > 0.0) || offer->n < min_n ||
      !(square >= best->ln_anom * offer->w * (2.0 * SCREEN))) {
    return;
  }
  offer->bins = bins;
  offer->ln_anom = 0.5 * (square / offer->w);
  consider(best, offer);
}

rim_status rimi_interval_find(const rim_stats *bin, size_t bins, double min_n, rim_interval *best) {
  if (bin == NULL || best == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (bins > RIM_INTERVAL_MAX_BINS) {
    return RIM_E_RANGE;
  }
  rim_interval found = {0};
  for (uint32_t first = 0; first < bins; ++first) {
    rim_interval sum = {.first = first};
    for (uint32_t i = first; i < bins; ++i) {
      sum.n += bin[i].n;
      sum.s += bin[i].s;
      sum.w += bin[i].w;
      weigh(&found, &sum, i - first + 1, min_n);
    }
  }
  *best = found;
  return RIM_OK;
}

rim_status rimi_interval_find_f32(const float *n, const float *s, const float *w, size_t stride,
                                  size_t bins, double min_n, rim_interval *best) {
  if (n == NULL || s == NULL || w == NULL || stride == 0 || best == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (bins > RIM_INTERVAL_MAX_BINS) {
    return RIM_E_RANGE;
  }
  rim_interval found = {0};
  for (uint32_t first = 0; first < bins; ++first) {
    rim_interval sum = {.first = first};
    for (uint32_t i = first; i < bins; ++i) {
      sum.n += (double)n[i * stride];
      sum.s += (double)s[i * stride];
      sum.w += (double)w[i * stride];
      weigh(&found, &sum, i - first + 1, min_n);
    }
  }
  *best = found;
  return RIM_OK;
}

/* The variance of a run-level sum: n, and the sum of n_k b_k. */
static inline double run_variance(const rim_interval_run *run, double n, double own) {
  return n * (run->a + run->b * n + own);
}

rim_status rimi_interval_find_run(const double *n, const double *s, const double *b_k,
                                  size_t stride, size_t bins, const rim_interval_run *run,
                                  rim_interval *best) {
  if (n == NULL || s == NULL || stride == 0 || run == NULL || best == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (bins > RIM_INTERVAL_MAX_BINS) {
    return RIM_E_RANGE;
  }
  rim_interval found = {0};
  for (uint32_t first = 0; first < bins; ++first) {
    rim_interval sum = {.first = first};
    double own = 0.0;
    for (uint32_t i = first; i < bins; ++i) {
      sum.n += n[i * stride];
      sum.s += s[i * stride];
      own += b_k != NULL ? n[i * stride] * b_k[i * stride] : 0.0;
      sum.w = run_variance(run, sum.n, own);
      weigh(&found, &sum, i - first + 1, run->min_n);
    }
  }
  *best = found;
  return RIM_OK;
}

rim_status rimi_interval_find_run_f32(const float *n, const float *s, const float *b_k,
                                      size_t stride, size_t bins, const rim_interval_run *run,
                                      rim_interval *best) {
  if (n == NULL || s == NULL || stride == 0 || run == NULL || best == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (bins > RIM_INTERVAL_MAX_BINS) {
    return RIM_E_RANGE;
  }
  rim_interval found = {0};
  for (uint32_t first = 0; first < bins; ++first) {
    rim_interval sum = {.first = first};
    double own = 0.0;
    for (uint32_t i = first; i < bins; ++i) {
      sum.n += (double)n[i * stride];
      sum.s += (double)s[i * stride];
      own += b_k != NULL ? (double)n[i * stride] * (double)b_k[i * stride] : 0.0;
      sum.w = run_variance(run, sum.n, own);
      weigh(&found, &sum, i - first + 1, run->min_n);
    }
  }
  *best = found;
  return RIM_OK;
}

rim_status rimi_interval_find_score(const rim_stats *bin, size_t bins, size_t outcomes,
                                    double min_n, rim_stats *scratch, rim_interval *best) {
  if (bin == NULL || outcomes == 0 || scratch == NULL || best == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (bins > RIM_INTERVAL_MAX_BINS) {
    return RIM_E_RANGE;
  }
  rim_interval found = {0};
  for (uint32_t first = 0; first < bins; ++first) {
    memset(scratch, 0, outcomes * sizeof *scratch);
    for (uint32_t i = first; i < bins; ++i) {
      rim_interval sum = {.first = first, .bins = i - first + 1};
      rimi_stats_merge_all(scratch, bin + (size_t)i * outcomes, outcomes);
      for (size_t o = 0; o < outcomes; ++o) {
        sum.n = scratch[o].n > sum.n ? scratch[o].n : sum.n;
      }
      sum.ln_anom = rimi_stats_score_all(scratch, outcomes);
      if (sum.n >= min_n) {
        consider(&found, &sum);
      }
    }
  }
  *best = found;
  return RIM_OK;
}
