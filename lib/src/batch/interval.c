/* SPDX-License-Identifier: MIT */
#include "batch/interval.h"

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
