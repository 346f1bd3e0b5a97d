/* SPDX-License-Identifier: MIT */
/* The statistic of every hypothesis, and those hypotheses that name no region. */
#include <string.h>

#include "base/cholesky.h"
#include "base/real.h"
#include "search/search_private.h"

#define LEAST_INFORMATION 1e-6 /* A below this part of m'Wm: the run effects explain the shape */
#define RAMP_UNIT (1.0 / 256.0)

void rimi_search_raw_fields(const rim_search *s, const noise_channel *c, uint32_t slot,
                            uint32_t outcome, double *raw) {
  (void)c;
  const double t_s = (double)search_times(s)[slot];
  const rim_noise *noise = s->config.noise;
  raw[0] = 1.0;
  raw[1] = (double)search_predictions(s, slot)[outcome] * SEARCH_BYTE_STEP;
  raw[2] = (1.0 - rimi_exp(-rimi_clamp(t_s / noise->trend_s, 0.0, 40.0))) * noise->trend_s /
           noise->run_s;
  raw[3] = rimi_exp(-rimi_min(t_s / noise->decay_s, 40.0));
  const int8_t *mean = search_means(s, slot);
  for (uint32_t m = 0; m < s->config.means; ++m)
    raw[NOISE_RAW_FIRST + m] = (double)mean[m] * SEARCH_BYTE_STEP;
}

double rimi_search_weight(const rim_search *s, const noise_channel *c, uint32_t channel,
                          uint32_t slot) {
  if (channel >= search_fine(s))
    return 1.0;
  const uint32_t outcome = channel % s->config.outcomes;
  return rimi_noise_weight(c, (double)search_predictions(s, slot)[outcome] * SEARCH_BYTE_STEP,
                           (double)search_changes(s)[slot] * SEARCH_CHANGE_STEP);
}

void rimi_search_weighted_fields(const rim_search *s, const noise_channel *c, uint32_t slot,
                                 uint32_t outcome, double w, double *fields) {
  const uint32_t raw_count = s->config.noise->raw;
  double raw[NOISE_MAX_RAW];
  rimi_search_raw_fields(s, c, slot, outcome, raw);
  for (uint32_t k = 0; k < c->fields; ++k) {
    double sum = 0.0;
    for (uint32_t r = 0; r < raw_count; ++r)
      sum += (double)rimi_le_f32(c->combination, (size_t)k * raw_count + r) * raw[r];
    fields[k] = w * sum;
  }
}

static double phi(const rim_search *s, uint32_t channel, uint32_t family) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  return (double)rimi_le_f32(c.phi, family);
}

double rimi_search_description(search_family family) {
  static const double nats[NOISE_FAMILIES] = {4.0, 5.0, 5.0, 4.0, 6.0, 11.0, 8.0, 13.0, 7.0};
  return nats[family];
}

static void set_score(const rim_search *s, search_hypothesis *h) {
  h->score = (float)((double)h->ln_ratio / phi(s, s->channel, h->family) -
                     rimi_search_description((search_family)h->family));
}

void rimi_search_judge(const rim_search *s, const search_sums *sums, search_hypothesis *h) {
  double a = sums->a;
  for (uint32_t k = 0; k < s->fields; ++k)
    a -= sums->g[k] * sums->g[k];
  h->blocks = (uint32_t)sums->n;
  if (!(a > LEAST_INFORMATION * sums->a) || !(a > 0.0) || sums->n < (double)SEARCH_LEAST) {
    h->ln_ratio = 0.0f;
    h->shift = h->sd = 0.0f;
    h->score = SEARCH_NONE;
    return;
  }
  h->ln_ratio = (float)(sums->d * sums->d / (2.0 * a));
  h->shift = (float)(sums->d / a);
  h->sd = (float)(1.0 / rimi_sqrt(a));
  set_score(s, h);
}

/* L of G with its prior, and the run effects b. */
static void solve_effects(const rim_search *s, const noise_channel *c, double *l, double *b) {
  const channel_state *state = search_state(s, s->channel);
  const double *gram = search_gram(s, state);
  const uint32_t k = c->fields;
  const uint32_t packed = k * (k + 1u) / 2u;
  memcpy(l, gram, packed * sizeof *l);
  memcpy(b, gram + packed, k * sizeof *b);
  for (uint32_t i = 0; i < k; ++i)
    l[packed_row(i) + i] += (double)rimi_le_f32(c->inverse_prior, i);
  if (!cholesky_factor(k, l)) { /* not with a prior above 0, unless numbers are absurd */
    memset(l, 0, packed * sizeof *l);
    for (uint32_t i = 0; i < k; ++i)
      l[packed_row(i) + i] = 1e15;
    memset(b, 0, k * sizeof *b);
    return;
  }
  cholesky_forward(k, l, b);
  cholesky_backward(k, l, b);
}

/* Whether the block of the ring follows on no other that is evidence. */
static bool is_first(const rim_search *s, uint32_t i) {
  return i == 0 || search_is_excluded(s, search_slot(s, i - 1u));
}

/* Forward in time: whitened residuals less the run effects in q, whitened fields in g, w in a0. */
static void whiten(rim_search *s, const noise_channel *c, const double *l, const double *b) {
  const uint32_t k = c->fields;
  const uint32_t outcome = (uint32_t)s->channel % s->config.outcomes;
  const double rho = (double)c->rho;
  const double lead = rimi_sqrt(1.0 - rho * rho);
  const double s_unit = (double)c->s;
  double before[NOISE_MAX_FIELDS] = {0.0};
  double z_before = 0.0;
  for (uint32_t i = 0; i < s->held; ++i) {
    const uint32_t slot = search_slot(s, i);
    const bool first = is_first(s, i), none = search_is_excluded(s, slot);
    const double w = none ? 0.0 : rimi_search_weight(s, c, s->channel, slot);
    const double z = search_residual(s, s->channel, slot);
    double fields[NOISE_MAX_FIELDS], white[NOISE_MAX_FIELDS];
    rimi_search_weighted_fields(s, c, slot, outcome, w, fields);
    double e = first ? lead * z : z - rho * z_before;
    for (uint32_t j = 0; j < k; ++j) {
      white[j] = first ? lead * fields[j] : fields[j] - rho * before[j];
      e -= white[j] * b[j];
      before[j] = fields[j];
    }
    z_before = z;
    cholesky_forward(k, l, white);
    float *g = search_g(s, i);
    for (uint32_t j = 0; j < k; ++j)
      g[j] = none ? 0.0f : (float)white[j];
    search_q(s)[i] = none ? 0.0f : (float)e;
    search_a0(s)[i] = (float)w;
    const double p = (double)search_predictions(s, slot)[outcome] * SEARCH_BYTE_STEP;
    search_p(s)[i] = (float)(((double)c->p_center + (double)c->p_scale * p) / s_unit);
  }
}

/* Backward: what a block inside a hypothesis adds to d, A and m'WB; a1 is added to A where the next
 * block is inside too. */
static void fold(rim_search *s, const noise_channel *c) {
  const double rho = (double)c->rho;
  const double lead = rimi_sqrt(1.0 - rho * rho);
  float *q = search_q(s), *a0 = search_a0(s), *a1 = search_a1(s);
  for (uint32_t i = 0; i < s->held; ++i) {
    const bool last = i + 1u == s->held || search_is_excluded(s, search_slot(s, i + 1u));
    const double first = is_first(s, i) ? lead : 1.0;
    const double w = (double)a0[i];
    const double next_e = last ? 0.0 : (double)q[i + 1u];
    const double next_w = last ? 0.0 : (double)a0[i + 1u];
    q[i] = (float)(w * (first * (double)q[i] - rho * next_e));
    float *g = search_g(s, i);
    const float *after = search_g(s, last ? i : i + 1u);
    for (uint32_t j = 0; j < c->fields; ++j)
      g[j] = (float)(w * (first * (double)g[j] - (last ? 0.0 : rho * (double)after[j])));
    a0[i] = (float)(w * w * (first * first + (last ? 0.0 : rho * rho)));
    a1[i] = (float)(-2.0 * rho * w * next_w);
  }
}

static void judge_time(rim_search *s, search_family family, const search_sums *sums, uint32_t i) {
  search_hypothesis h = {.family = (uint8_t)family, .onset = s->count - s->held + i};
  rimi_search_judge(s, sums, &h);
  rimi_search_note(s, s->channel, &h);
  if (h.score > SEARCH_NONE && h.ln_ratio > s->in_time[family].ln_ratio)
    s->in_time[family] = h;
}

/* Suffix sums give every onset's statistic in one pass (eq. 3.6 and 3.7 for each shape). */
static void scan_time(rim_search *s) {
  const uint32_t k = s->fields;
  const bool is_mean = s->channel < 2u * s->config.outcomes;
  search_sums since = {0}, ramp = {0}, gain = {0};
  double tq = 0.0, tg[NOISE_MAX_FIELDS] = {0.0}, square = 0.0, cross = 0.0;
  for (uint32_t i = s->held; i-- > 0;) {
    const bool last = i + 1u == s->held;
    const double q = (double)search_q(s)[i], a0 = (double)search_a0(s)[i];
    const double a1 = last ? 0.0 : (double)search_a1(s)[i];
    const double p = (double)search_p(s)[i], p1 = last ? 0.0 : (double)search_p(s)[i + 1u];
    const double t = ((double)i - (double)s->held) * RAMP_UNIT, t1 = t + RAMP_UNIT;
    const float *g = search_g(s, i);
    since.n = ramp.n = gain.n = since.n + 1.0;
    since.d += q;
    since.a += a0 + a1;
    gain.d += p * q;
    gain.a += p * p * a0 + p * p1 * a1;
    tq += t * q;
    square += a0 * t * t + a1 * t * t1;
    cross += 2.0 * a0 * t + a1 * (t + t1);
    ramp.d = tq - t * since.d;
    ramp.a = square - t * cross + t * t * since.a;
    for (uint32_t j = 0; j < k; ++j) {
      since.g[j] += (double)g[j];
      gain.g[j] += p * (double)g[j];
      tg[j] += t * (double)g[j];
      ramp.g[j] = tg[j] - t * since.g[j];
    }
    judge_time(s, SEARCH_SINCE, &since, i);
    if (is_mean) {
      judge_time(s, SEARCH_RAMP, &ramp, i);
      judge_time(s, SEARCH_GAIN, &gain, i);
    }
  }
}

/* The run's effects are themselves impossible: Q = b' (prior - V)^-1 b of k degrees of freedom,
 * against what it is by chance. */
static void judge_field(rim_search *s, const noise_channel *c, const double *l, const double *b) {
  const uint32_t k = c->fields;
  double v[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], x[NOISE_MAX_FIELDS];
  const uint32_t packed = k * (k + 1u) / 2u;
  memcpy(v, l, packed * sizeof *v);
  cholesky_invert_factor(k, v);
  cholesky_square_inverse(k, v);
  double mean[NOISE_MAX_FIELDS] = {0.0}, shift = 0.0, var = 0.0;
  for (uint32_t i = 0; i < s->held; ++i) {
    double fields[NOISE_MAX_FIELDS];
    rimi_search_weighted_fields(s, c, search_slot(s, i), (uint32_t)s->channel % s->config.outcomes,
                                1.0, fields);
    for (uint32_t j = 0; j < k; ++j)
      mean[j] += fields[j] / (double)s->held;
  }
  for (uint32_t i = 0; i < k; ++i) {
    shift += mean[i] * b[i];
    for (uint32_t j = 0; j < k; ++j)
      var += mean[i] * mean[j] * v[i >= j ? packed_row(i) + j : packed_row(j) + i];
  }
  for (uint32_t i = 0; i < packed; ++i)
    v[i] = -v[i];
  for (uint32_t i = 0; i < k; ++i)
    v[packed_row(i) + i] += 1.0 / (double)rimi_le_f32(c->inverse_prior, i);
  memcpy(x, b, k * sizeof *x);
  if (!cholesky_factor(k, v))
    return;
  cholesky_forward(k, v, x);
  double q = 0.0;
  for (uint32_t i = 0; i < k; ++i)
    q += x[i] * x[i];
  const double degrees = (double)k;
  if (!(q > degrees) || !rimi_is_finite(q) || s->held < 2u * SEARCH_LEAST)
    return;
  search_hypothesis h = {.family = SEARCH_FIELD, .onset = SEARCH_FROM_START};
  h.ln_ratio = (float)(0.5 * (q - degrees - degrees * rimi_log(q / degrees)));
  h.shift = (float)shift;
  h.sd = (float)rimi_sqrt(rimi_max(var, 1e-12));
  h.blocks = s->held;
  set_score(s, &h);
  rimi_search_note(s, s->channel, &h);
  s->in_time[SEARCH_FIELD] = h;
}

void rimi_search_refresh(rim_search *s, uint32_t channel) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  double l[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], b[NOISE_MAX_FIELDS];
  s->channel = (uint16_t)channel;
  s->fields = c.fields;
  s->fresh = true;
  if (search_state(s, channel)->excludes)
    search_take_out(s, channel);
  solve_effects(s, &c, l, b);
  whiten(s, &c, l, b);
  fold(s, &c);
  search_state(s, channel)->time.score = SEARCH_NONE;
  memset(s->in_time, 0, sizeof s->in_time);
  scan_time(s);
  if (c.fields > 0)
    judge_field(s, &c, l, b);
}

void search_scan_end(const rim_search *s, search_hypothesis *h) {
  const uint32_t oldest = s->count - s->held;
  search_hypothesis now = *h;
  search_sums sums = {0};
  h->score = SEARCH_NONE;
  now.onset = h->onset > oldest ? h->onset : oldest;
  bool inside = false; /* the block before */
  for (uint32_t i = now.onset - oldest; i + 1u < s->held; ++i) {
    const bool none = search_is_excluded(s, search_slot(s, i));
    if (!none) {
      sums.n += 1.0;
      sums.d += (double)search_q(s)[i];
      sums.a += (double)search_a0(s)[i] + (inside ? (double)search_a1(s)[i - 1u] : 0.0);
      for (uint32_t j = 0; j < s->fields; ++j)
        sums.g[j] += (double)search_g(s, i)[j];
    }
    inside = !none;
    now.end = oldest + i + 1u;
    rimi_search_judge(s, &sums, &now);
    if (now.score > h->score)
      *h = now;
  }
}

void rimi_search_scan_onset(const rim_search *s, const search_mask *mask, search_hypothesis *h,
                            double *sd) {
  search_mask everywhen = *mask;
  everywhen.from = 0;
  search_sums sums = {0};
  search_hypothesis best = *h;
  best.score = SEARCH_NONE;
  double weight = 0.0, first = 0.0, second = 0.0, scale = 0.0;
  const double inflation = phi(s, s->channel, h->family);
  for (uint32_t i = s->held, next_inside = 0; i-- > 0;) {
    if (!search_passes(s, &everywhen, i)) {
      next_inside = 0;
      continue;
    }
    const double p = h->family == SEARCH_GAIN ? (double)search_p(s)[i] : 1.0;
    const double p1 = h->family == SEARCH_GAIN && next_inside ? (double)search_p(s)[i + 1u] : 1.0;
    sums.n += 1.0;
    sums.d += p * (double)search_q(s)[i];
    sums.a += p * p * (double)search_a0(s)[i] +
              (next_inside != 0 ? p * p1 * (double)search_a1(s)[i] : 0.0);
    for (uint32_t j = 0; j < s->fields; ++j)
      sums.g[j] += p * (double)search_g(s, i)[j];
    next_inside = 1;
    search_hypothesis now = *h;
    now.onset = s->count - s->held + i;
    rimi_search_judge(s, &sums, &now);
    if (now.score > best.score)
      best = now;
    if (sd == NULL || now.score <= SEARCH_NONE)
      continue;
    /* The onset's distribution: each onset as likely as its ratio says. */
    const double ln = (double)now.ln_ratio / inflation;
    if (weight <= 0.0 || ln > scale) {
      const double shrink = weight > 0.0 ? rimi_exp(scale - ln) : 0.0;
      weight *= shrink;
      first *= shrink;
      second *= shrink;
      scale = ln;
    }
    const double x = (double)i, part = rimi_exp(ln - scale);
    weight += part;
    first += part * x;
    second += part * x * x;
  }
  if (best.score > SEARCH_NONE)
    *h = best;
  if (sd != NULL) {
    const double mean = weight > 0.0 ? first / weight : 0.0;
    const double var = weight > 0.0 ? second / weight - mean * mean : 0.0;
    *sd = rimi_sqrt(rimi_max(var, 1.0 / 12.0)); /* a block is the least that can be told */
  }
}
