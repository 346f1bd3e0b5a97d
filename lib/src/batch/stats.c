/* SPDX-License-Identifier: MIT */
#include "batch/stats.h"

#include <stdbool.h>
#include <string.h>

#include "base/cholesky.h"
#include "base/real.h"

static bool is_variance(double var) { return var > 0.0 && rimi_is_finite(var); }

/* Adds to the sums, unless one would no longer be finite. */
static rim_status add_terms(rim_stats *stats, double n, double s, double w) {
  const double new_s = stats->s + s;
  const double new_w = stats->w + w;
  if (!rimi_is_finite(new_s) || !rimi_is_finite(new_w)) {
    return RIM_E_DATA;
  }
  stats->n += n;
  stats->s = new_s;
  stats->w = new_w;
  return RIM_OK;
}

rim_status rimi_stats_add(rim_stats *stats, double dz, double var) {
  if (!is_variance(var)) {
    return RIM_E_DATA;
  }
  const double w = 1.0 / var;
  return add_terms(stats, 1.0, dz * w, w);
}

rim_status rimi_stats_add_weighted(rim_stats *stats, double dz, double var, double weight) {
  if (!is_variance(var) || !rimi_is_finite(dz) || !(weight >= 0.0 && weight <= 1.0)) {
    return RIM_E_DATA;
  }
  const double w = 1.0 / var;
  return add_terms(stats, weight, weight * (dz * w), weight * w);
}

rim_status rimi_stats_add_gain(rim_stats *stats, double dz, double g, double var) {
  if (!is_variance(var) || !rimi_is_finite(dz) || !rimi_is_finite(g)) {
    return RIM_E_DATA;
  }
  const double w = g / var;
  return add_terms(stats, 1.0, w * dz, w * g);
}

void rimi_stats_merge(rim_stats *into, const rim_stats *other) {
  into->n += other->n;
  into->s += other->s;
  into->w += other->w;
}

void rimi_stats_subtract(rim_stats *from, const rim_stats *part) {
  from->n -= part->n;
  from->s -= part->s;
  from->w -= part->w;
  if (!(from->n > 0.0)) {
    *from = (rim_stats){0};
  }
}

double rimi_stats_ln_anom(const rim_stats *stats) {
  return stats->w > 0.0 ? 0.5 * (stats->s * stats->s / stats->w) : 0.0;
}

double rimi_stats_shift(const rim_stats *stats) {
  return stats->w > 0.0 ? stats->s / stats->w : 0.0;
}

double rimi_stats_shift_sd(const rim_stats *stats) {
  return 1.0 / rimi_sqrt(rimi_max(stats->w, 0.0));
}

double rimi_stats_ln_anom_run(double s, double n, double a, double b) {
  const double var = n * (a + b * n);
  return var > 0.0 ? 0.5 * (s * s / var) : 0.0;
}

rim_status rimi_stats_add_all(rim_stats *stats, size_t outcomes, const double *dz,
                              const double *var) {
  for (size_t o = 0; o < outcomes; ++o) {
    rim_stats trial = stats[o];
    if (rimi_stats_add(&trial, dz[o], var[o]) != RIM_OK) {
      return RIM_E_DATA;
    }
  }
  for (size_t o = 0; o < outcomes; ++o) {
    (void)rimi_stats_add(&stats[o], dz[o], var[o]);
  }
  return RIM_OK;
}

void rimi_stats_merge_all(rim_stats *into, const rim_stats *other, size_t outcomes) {
  for (size_t o = 0; o < outcomes; ++o) {
    rimi_stats_merge(&into[o], &other[o]);
  }
}

void rimi_stats_subtract_all(rim_stats *from, const rim_stats *part, size_t outcomes) {
  for (size_t o = 0; o < outcomes; ++o) {
    rimi_stats_subtract(&from[o], &part[o]);
  }
}

double rimi_stats_ln_anom_all(const rim_stats *stats, size_t outcomes) {
  double sum = 0.0;
  for (size_t o = 0; o < outcomes; ++o) {
    sum += rimi_stats_ln_anom(&stats[o]);
  }
  return sum;
}

double rimi_stats_score_all(const rim_stats *stats, size_t outcomes) {
  double sum = 0.0;
  for (size_t o = 0; o < outcomes; ++o) {
    sum += rimi_stats_score(rimi_stats_ln_anom(&stats[o]));
  }
  return sum;
}

double rimi_stats_score(double ln_anom) { return rimi_max(ln_anom - RIM_STATS_SCORE_FLOOR, 0.0); }

rim_status rimi_stats_full_init(rim_stats_full *stats, uint32_t outcomes) {
  if (stats == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (outcomes == 0 || outcomes > RIM_STATS_MAX_OUTCOMES) {
    return RIM_E_RANGE;
  }
  *stats = (rim_stats_full){.outcomes = outcomes};
  return RIM_OK;
}

static bool is_full(const rim_stats_full *stats) {
  return stats != NULL && stats->outcomes >= 1 && stats->outcomes <= RIM_STATS_MAX_OUTCOMES;
}

rim_status rimi_stats_full_precision(uint32_t outcomes, const double *covariance,
                                     double *precision) {
  double a[RIM_STATS_PACKED(RIM_STATS_MAX_OUTCOMES)];
  if (outcomes == 0 || outcomes > RIM_STATS_MAX_OUTCOMES) {
    return RIM_E_RANGE;
  }
  const size_t bytes = sizeof(double) * packed_row(outcomes);
  memcpy(a, covariance, bytes);
  if (!cholesky_factor(outcomes, a)) {
    return RIM_E_SINGULAR;
  }
  cholesky_invert_factor(outcomes, a);
  cholesky_square_inverse(outcomes, a);
  memcpy(precision, a, bytes);
  return RIM_OK;
}

/* y = P x for a packed symmetric P; false where an element is not finite. */
static bool multiply(uint32_t n, const double *p, const double *x, double *y) {
  for (uint32_t i = 0; i < n; ++i) {
    double sum = 0.0;
    for (uint32_t j = 0; j < n; ++j) {
      sum += (j <= i ? p[packed_row(i) + j] : p[packed_row(j) + i]) * x[j];
    }
    y[i] = sum;
    if (!rimi_is_finite(sum)) {
      return false;
    }
  }
  return true;
}

rim_status rimi_stats_full_add_precision(rim_stats_full *stats, const double *dz,
                                         const double *precision) {
  if (!is_full(stats)) {
    return RIM_E_ARGUMENT;
  }
  const uint32_t n = stats->outcomes;
  double s[RIM_STATS_MAX_OUTCOMES];
  if (!multiply(n, precision, dz, s)) {
    return RIM_E_DATA;
  }
  for (uint32_t i = 0; i < packed_row(n); ++i) {
    if (!rimi_is_finite(stats->w[i] + precision[i])) {
      return RIM_E_DATA;
    }
  }
  for (uint32_t i = 0; i < n; ++i) {
    if (!rimi_is_finite(stats->s[i] + s[i])) {
      return RIM_E_DATA;
    }
  }
  stats->n += 1.0;
  for (uint32_t i = 0; i < n; ++i) {
    stats->s[i] += s[i];
  }
  for (uint32_t i = 0; i < packed_row(n); ++i) {
    stats->w[i] += precision[i];
  }
  return RIM_OK;
}

rim_status rimi_stats_full_add(rim_stats_full *stats, const double *dz, const double *covariance) {
  double precision[RIM_STATS_PACKED(RIM_STATS_MAX_OUTCOMES)];
  if (!is_full(stats)) {
    return RIM_E_ARGUMENT;
  }
  const rim_status status = rimi_stats_full_precision(stats->outcomes, covariance, precision);
  return status == RIM_OK ? rimi_stats_full_add_precision(stats, dz, precision) : status;
}

rim_status rimi_stats_full_merge(rim_stats_full *into, const rim_stats_full *other) {
  if (!is_full(into) || !is_full(other) || into->outcomes != other->outcomes) {
    return RIM_E_ARGUMENT;
  }
  into->n += other->n;
  for (uint32_t i = 0; i < into->outcomes; ++i) {
    into->s[i] += other->s[i];
  }
  for (uint32_t i = 0; i < packed_row(into->outcomes); ++i) {
    into->w[i] += other->w[i];
  }
  return RIM_OK;
}

rim_status rimi_stats_full_subtract(rim_stats_full *from, const rim_stats_full *part) {
  if (!is_full(from) || !is_full(part) || from->outcomes != part->outcomes) {
    return RIM_E_ARGUMENT;
  }
  from->n -= part->n;
  for (uint32_t i = 0; i < from->outcomes; ++i) {
    from->s[i] -= part->s[i];
  }
  for (uint32_t i = 0; i < packed_row(from->outcomes); ++i) {
    from->w[i] -= part->w[i];
  }
  if (!(from->n > 0.0)) {
    *from = (rim_stats_full){.outcomes = from->outcomes};
  }
  return RIM_OK;
}

rim_status rimi_stats_full_solve(const rim_stats_full *stats, double *ln_anom, double *shift,
                                 double *shift_covariance) {
  double l[RIM_STATS_PACKED(RIM_STATS_MAX_OUTCOMES)];
  double y[RIM_STATS_MAX_OUTCOMES];
  if (!is_full(stats)) {
    return RIM_E_ARGUMENT;
  }
  const uint32_t n = stats->outcomes;
  memcpy(l, stats->w, sizeof l);
  memcpy(y, stats->s, sizeof y);
  if (!cholesky_factor(n, l)) {
    return RIM_E_SINGULAR;
  }
  cholesky_forward(n, l, y);
  if (ln_anom != NULL) {
    double sum = 0.0; /* with W = L L^T, s^T W^-1 s = |L^-1 s|^2: never below 0 */
    for (uint32_t i = 0; i < n; ++i) {
      sum += y[i] * y[i];
    }
    *ln_anom = 0.5 * sum;
  }
  if (shift != NULL) {
    cholesky_backward(n, l, y);
    memcpy(shift, y, n * sizeof *shift);
  }
  if (shift_covariance != NULL) {
    cholesky_invert_factor(n, l);
    cholesky_square_inverse(n, l);
    memcpy(shift_covariance, l, packed_row(n) * sizeof *shift_covariance);
  }
  return RIM_OK;
}

rim_status rimi_stats_variance_add(rim_stats_variance *stats, double dz, double var) {
  const double q = is_variance(var) ? stats->q + dz * dz / var : -1.0;
  if (!(q >= 0.0) || !rimi_is_finite(q)) {
    return RIM_E_DATA;
  }
  stats->n += 1.0;
  stats->q = q;
  return RIM_OK;
}

void rimi_stats_variance_merge(rim_stats_variance *into, const rim_stats_variance *other) {
  into->n += other->n;
  into->q += other->q;
}

void rimi_stats_variance_subtract(rim_stats_variance *from, const rim_stats_variance *part) {
  from->n -= part->n;
  from->q = rimi_max(from->q - part->q, 0.0);
  if (!(from->n > 0.0)) {
    *from = (rim_stats_variance){0};
  }
}

double rimi_stats_variance_ratio(const rim_stats_variance *stats) {
  return stats->n > 0.0 ? rimi_max(stats->q / stats->n, RIM_STATS_MIN_RATIO) : 1.0;
}

double rimi_stats_variance_ln_anom(const rim_stats_variance *stats) {
  const double v = rimi_stats_variance_ratio(stats);
  return stats->n > 0.0 ? rimi_max(0.5 * stats->n * (v - 1.0 - rimi_log(v)), 0.0) : 0.0;
}

double rimi_stats_variance_ratio_sd(const rim_stats_variance *stats) {
  const double n = rimi_max(stats->n, 0.0);
  return rimi_stats_variance_ratio(stats) * rimi_sqrt(2.0 / n);
}

rim_status rimi_stats_bernoulli_add(rim_stats_bernoulli *stats, int event, double p) {
  if ((event != 0 && event != 1) || !(p > 0.0 && p < 1.0)) {
    return RIM_E_DATA;
  }
  stats->n += 1.0;
  stats->k += (double)event;
  stats->p += p;
  stats->v += p * (1.0 - p);
  return RIM_OK;
}

void rimi_stats_bernoulli_merge(rim_stats_bernoulli *into, const rim_stats_bernoulli *other) {
  into->n += other->n;
  into->k += other->k;
  into->p += other->p;
  into->v += other->v;
}

void rimi_stats_bernoulli_subtract(rim_stats_bernoulli *from, const rim_stats_bernoulli *part) {
  from->n -= part->n;
  from->k -= part->k;
  from->p -= part->p;
  from->v -= part->v;
  if (!(from->n > 0.0)) {
    *from = (rim_stats_bernoulli){0};
  }
}

/* Trials of two nominal probabilities with the mean and, as far as the bounds allow, the variance
 * of those in the set. */
typedef struct two_values {
  double p[2];
  double count[2];
} two_values;

/* False for a set without trials or with a mean probability of 0 or 1. */
static bool split(const rim_stats_bernoulli *stats, two_values *two) {
  const double m = stats->n > 0.0 ? stats->p / stats->n : 0.0;
  if (!(m > 0.0 && m < 1.0)) {
    return false;
  }
  const double least = m / 8.0, most = 1.0 - (1.0 - m) / 8.0;
  const double tau2 = m * (1.0 - m) - stats->v / stats->n;
  *two = (two_values){{m, m}, {stats->n, 0.0}};
  if (!(tau2 > 1e-12 * m * (1.0 - m))) {
    return true; /* one probability: what is left is rounding */
  }
  /* Values m - l and m + tau2 / l with counts in proportion tau2 / l to l: mean m, variance tau2.
   */
  double low = rimi_max(m - rimi_sqrt(tau2), least);
  const double high = rimi_min(m + tau2 / (m - low), most);
  low = rimi_max(m - tau2 / (high - m), least);
  two->p[0] = low;
  two->p[1] = high;
  two->count[1] = stats->n * ((m - low) / (high - low));
  two->count[0] = stats->n - two->count[1];
  return true;
}

/* Newton's method on k = sum of q_i(beta), which rises with beta, within a bracket that every step
 * narrows; where Newton leaves the bracket it is halved. */
static double solve_log_odds(const rim_stats_bernoulli *stats, const two_values *two) {
  if (!(stats->k > 0.0)) {
    return -RIM_STATS_MAX_LOG_ODDS;
  }
  if (!(stats->k < stats->n)) {
    return RIM_STATS_MAX_LOG_ODDS;
  }
  double low = -RIM_STATS_MAX_LOG_ODDS, high = RIM_STATS_MAX_LOG_ODDS;
  const double odds = stats->k * (stats->n - stats->p) / ((stats->n - stats->k) * stats->p);
  double beta = rimi_clamp(rimi_log(odds), low, high); /* exact when all p are equal */
  for (int step = 0; two->count[1] > 0.0 && step < 40; ++step) {
    const double growth = rimi_exp(beta);
    double missing = stats->k, slope = 0.0;
    for (int i = 0; i < 2; ++i) {
      const double weight = two->p[i] * growth;
      const double q = weight / (1.0 - two->p[i] + weight);
      missing -= two->count[i] * q;
      slope += two->count[i] * q * (1.0 - q);
    }
    if (missing > 0.0) {
      low = beta;
    } else {
      high = beta;
    }
    const double newton = beta + missing / slope;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (rimi_abs(next - beta) <= 1e-14 * (1.0 + rimi_abs(beta))) {
      return next;
    }
    beta = next;
  }
  return beta;
}

double rimi_stats_bernoulli_log_odds(const rim_stats_bernoulli *stats) {
  two_values two;
  return split(stats, &two) ? solve_log_odds(stats, &two) : 0.0;
}

double rimi_stats_bernoulli_ln_anom(const rim_stats_bernoulli *stats) {
  two_values two;
  if (!split(stats, &two)) {
    return 0.0;
  }
  double f = 0.0;
  if (!(stats->k > 0.0)) { /* beta to -infinity */
    for (int i = 0; i < 2; ++i) {
      f -= two.count[i] * rimi_log(1.0 - two.p[i]);
    }
  } else if (!(stats->k < stats->n)) { /* beta to infinity */
    for (int i = 0; i < 2; ++i) {
      f -= two.count[i] * rimi_log(two.p[i]);
    }
  } else {
    const double beta = solve_log_odds(stats, &two);
    const double growth = rimi_exp(beta);
    f = beta * stats->k;
    for (int i = 0; i < 2; ++i) {
      f -= two.count[i] * rimi_log(1.0 - two.p[i] + two.p[i] * growth);
    }
  }
  return rimi_max(f, 0.0);
}
