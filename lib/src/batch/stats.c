/* SPDX-License-Identifier: MIT */
#include "batch/stats.h"

#include "base/real.h"

rim_status rimi_stats_add(rim_stats *stats, double dz, double var) {
  if (!(var > 0.0) || !rimi_is_finite(var))
    return RIM_E_DATA;
  const double w = 1.0 / var;
  const double new_s = stats->s + dz * w;
  const double new_w = stats->w + w;
  if (!rimi_is_finite(new_s) || !rimi_is_finite(new_w))
    return RIM_E_DATA;
  stats->n += 1.0;
  stats->s = new_s;
  stats->w = new_w;
  return RIM_OK;
}

void rimi_stats_merge(rim_stats *into, const rim_stats *other) {
  into->n += other->n;
  into->s += other->s;
  into->w += other->w;
}

double rimi_stats_ln_anom(const rim_stats *stats) {
  return stats->w > 0.0 ? 0.5 * (stats->s * stats->s / stats->w) : 0.0;
}

double rimi_stats_ln_anom_sums(const double *sum, size_t outcomes, double n) {
  double square = 0.0;
  for (size_t o = 0; o < outcomes; ++o)
    square += sum[o] * sum[o];
  return n > 0.0 ? square / (2.0 * n) : 0.0;
}

double rimi_stats_shift(const rim_stats *stats) {
  return stats->w > 0.0 ? stats->s / stats->w : 0.0;
}

double rimi_stats_ln_anom_run(double s, double n, double a, double b) {
  const double var = n * (a + b * n);
  return var > 0.0 ? 0.5 * (s * s / var) : 0.0;
}
