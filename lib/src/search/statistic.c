/* SPDX-License-Identifier: MIT */
/* The statistic of every hypothesis, and those hypotheses that name no region. */
#include <string.h>

#include "base/bytes.h"
#include "base/cholesky.h"
#include "base/real.h"
#include "search/search_private.h"

#define NEGLIGIBLE 20.0        /* nats: an onset that is less likely by this has no say */
#define FIELD_FROM 0.5         /* of a run: before, its effects are hardly known yet */
#define TWO_TESTS 0.693        /* ln 2: nats of the better of two tests */
#define SHAPE_NATS 1.0         /* that tell a gain from a shift */
#define LEAST_INFORMATION 1e-6 /* A below this part of m'Wm: the run effects explain the shape */

void rimi_search_raw_fields(const rim_search *s, uint32_t slot, double *raw) {
  const double t_s = (double)search_times(s)[slot];
  const rim_noise *noise = s->config.noise;
  raw[0] = 1.0;
  raw[1] = 0.0;
  raw[2] = (1.0 - rimi_exp(-rimi_clamp(t_s / noise->trend_s, 0.0, 40.0))) * noise->trend_s /
           noise->run_s;
  raw[3] = rimi_exp(-rimi_min(t_s / noise->decay_s, 40.0));
  const int8_t *mean = search_means(s, slot);
  for (uint32_t m = 0; m < s->config.means; ++m)
    raw[NOISE_RAW_FIRST + m] = (double)mean[m] * SEARCH_BYTE_STEP;
}

double rimi_search_scale(const rim_search *s, const noise_channel *c, uint32_t channel,
                         uint32_t slot) {
  if (channel >= search_fine(s))
    return 1.0;
  return rimi_noise_weight(c, search_raw_prediction(s, slot, channel),
                           (double)search_activities(s)[slot] * SEARCH_ACTIVITY_STEP,
                           SEARCH_CALMEST +
                               (double)search_disturbances(s)[slot] * SEARCH_DISTURBANCE_STEP);
}

double rimi_search_rho(const rim_search *s, const noise_channel *c, uint32_t slot) {
  return rimi_noise_rho(c, search_activities(s)[slot] > 0);
}

double rimi_search_weight(const rim_search *s, const noise_channel *c, uint32_t channel,
                          uint32_t slot) {
  return search_is_known(s, channel, slot) ? rimi_search_scale(s, c, channel, slot) : 0.0;
}

double rimi_search_inflation(const noise_channel *c, const search_hypothesis *h) {
  const double phi = (double)rimi_le_f32(c->phi, h->family);
  return h->shape == SEARCH_PROPORTIONAL ? rimi_max(phi, (double)rimi_le_f32(c->phi, SEARCH_GAIN))
                                         : phi;
}

static double inflation_of(const rim_search *s, const search_hypothesis *h) {
  const noise_channel c = rimi_noise_channel(s->config.noise, s->channel);
  return rimi_search_inflation(&c, h);
}

double rimi_search_description(search_family family) {
  /* The run's own effects pay least: neither a time nor a place is searched for them. */
  static const double nats[NOISE_FAMILIES] = {4.0, 5.0, 5.0, 1.5, 6.0, 11.0, 8.0, 13.0, 10.0};
  return nats[family];
}

static void set_score(const rim_search *s, search_hypothesis *h) {
  const double nats = h->shape != SEARCH_CONSTANT ? SHAPE_NATS : 0.0;
  h->score = (float)((double)h->ln_ratio / inflation_of(s, h) -
                     rimi_search_description((search_family)h->family) - nats);
}

void rimi_search_judge(const rim_search *s, const search_sums *sums, search_hypothesis *h) {
  const double a = search_unexplained(s->fields, sums->a, sums->g);
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

void rimi_search_effects(const rim_search *s, const noise_channel *c, double *l, double *b) {
  const float *gram = search_gram(s, s->channel);
  const uint32_t k = c->fields;
  const uint32_t packed = k * (k + 1u) / 2u;
  for (uint32_t i = 0; i < packed; ++i)
    l[i] = (double)gram[i];
  for (uint32_t i = 0; i < k; ++i) {
    double *diagonal = l + packed_row(i) + i;
    *diagonal += SEARCH_GRAM_RIDGE * *diagonal + (double)rimi_le_f32(c->inverse_prior, i);
    b[i] = (double)gram[packed + i];
  }
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

/* The raw fields to L^-1 times the channel's: what is left of each field beside those before it, in
 * its own standard deviation. */
static void combine(const rim_search *s, const noise_channel *c, const double *l,
                    search_combination *to) {
  const uint32_t raw = s->config.noise->raw, k = c->fields;
  for (uint32_t r = 0; r < raw; ++r) {
    double column[NOISE_MAX_FIELDS];
    for (uint32_t j = 0; j < k; ++j)
      column[j] = (double)rimi_le_f32(c->combination, (size_t)j * raw + r);
    cholesky_forward(k, l, column);
    for (uint32_t j = 0; j < k; ++j)
      to->of[j][r] = column[j];
  }
}

/* Forward in time: whitened residuals less the run effects in q, whitened fields in g, w in a0.
 * mean[raw]: of the raw fields. */
static void whiten(rim_search *s, const noise_channel *c, const double *l, const double *b,
                   double *mean) {
  const uint32_t k = c->fields, raw_count = s->config.noise->raw;
  search_combination to;
  double effect[NOISE_MAX_FIELDS]; /* b in the units of g: L' b */
  double before[NOISE_MAX_FIELDS] = {0.0};
  double z_before = 0.0, w_before = 0.0;
  combine(s, c, l, &to);
  for (uint32_t j = 0; j < k; ++j) {
    effect[j] = 0.0;
    for (uint32_t i = j; i < k; ++i)
      effect[j] += l[packed_row(i) + j] * b[i];
  }
  for (uint32_t r = 0; r < raw_count; ++r)
    mean[r] = 0.0;
  for (uint32_t i = 0; i < s->held; ++i) {
    const uint32_t slot = search_slot(s, i);
    double w = rimi_search_weight(s, c, s->channel, slot);
    const double z = w > 0.0 ? search_residual(s, s->channel, slot) : 0.0;
    const double rho = rimi_search_rho(s, c, slot);
    const bool alone = !(w_before > 0.0); /* with none before it */
    if (!alone && search_apart(s)[slot] != 0)
      w *= rimi_noise_gap_weight(rho);
    const double own = alone ? w * rimi_sqrt(1.0 - rho * rho) : w, past = alone ? 0.0 : w * rho;
    double raw[NOISE_MAX_RAW];
    rimi_search_raw_fields(s, slot, raw);
    raw[1] = search_raw_prediction(s, slot, s->channel);
    for (uint32_t r = 0; r < raw_count; ++r)
      mean[r] += raw[r];
    double e = own * z - past * z_before;
    float *g = search_g(s, i);
    for (uint32_t j = 0; j < k; ++j) {
      double field = 0.0;
      for (uint32_t r = 0; r < raw_count; ++r)
        field += to.of[j][r] * raw[r];
      const double white = own * field - past * before[j];
      e -= white * effect[j];
      before[j] = field;
      g[j] = (float)white;
    }
    z_before = z;
    w_before = w;
    search_q(s)[i] = (float)e;
    search_a0(s)[i] = (float)w;
  }
  for (uint32_t r = 0; r < raw_count; ++r)
    mean[r] /= (double)s->held;
}

/* Backward: what a block inside a hypothesis adds to d, A and m'WB; a1 is added to A where the next
 * block is inside too. The oldest block of a ring that others have left is there only as what was
 * before the next one: what was new in it followed on a block that nobody knows any more, and is
 * among what taught the run's effects. */
static void fold(rim_search *s, const noise_channel *c) {
  float *q = search_q(s), *a0 = search_a0(s), *a1 = search_a1(s);
  for (uint32_t i = 0; i < s->held; ++i) {
    /* The newest block, and one beside an unknown one, have no next. */
    const bool last = i + 1u == s->held || !(a0[i] > 0.0f) || !(a0[i + 1u] > 0.0f);
    const double rho = last ? 0.0 : rimi_search_rho(s, c, search_slot(s, i + 1u));
    const double kept = rimi_search_rho(s, c, search_slot(s, i));
    const double own = i > 0 && a0[i - 1u] > 0.0f     ? 1.0
                       : i == 0 && s->count > s->held ? 0.0
                                                      : rimi_sqrt(1.0 - kept * kept);
    const double w = (double)a0[i];
    const double next_e = last ? 0.0 : (double)q[i + 1u];
    const double next_w = last ? 0.0 : (double)a0[i + 1u];
    q[i] = (float)(w * own * (double)q[i] - rho * next_w * next_e);
    float *g = search_g(s, i);
    const float *after = search_g(s, last ? i : i + 1u);
    for (uint32_t j = 0; j < c->fields; ++j)
      g[j] = (float)(w * own * (double)g[j] - rho * next_w * (double)after[j]);
    a0[i] = (float)(w * w * own * own + rho * rho * next_w * next_w);
    a1[i] = (float)(-2.0 * rho * next_w * next_w);
  }
}

/* The onset, or the end, of one family whose ratio is largest so far; families differ in scale,
 * times of one family do not. */
typedef struct best_time {
  double square, a; /* d^2 / a */
  search_sums sums;
  uint32_t at; /* index of the ring */
} best_time;

static void judge_time(const rim_search *s, const search_sums *sums, uint32_t i, best_time *best) {
  const double a = search_unexplained(s->fields, sums->a, sums->g);
  const double square = sums->d * sums->d;
  if (!(a > LEAST_INFORMATION * sums->a) || !(square * best->a > best->square * a) ||
      sums->n < (double)SEARCH_LEAST)
    return;
  best->square = square;
  best->a = a;
  best->sums = *sums;
  best->at = i;
}

static void note_time(rim_search *s, search_family family, const best_time *best) {
  if (!(best->square > 0.0))
    return;
  search_hypothesis h = {.family = (uint8_t)family, .onset = s->count - s->held + best->at};
  rimi_search_judge(s, &best->sums, &h);
  rimi_search_note(s, s->channel, &h);
  if (h.score > SEARCH_NONE)
    s->in_time[family] = h;
}

/* Suffix sums give every onset's statistic in one pass (eq. 3.6 and 3.7 for each shape). */
static void scan_time(rim_search *s) {
  const uint32_t k = s->fields;
  const bool is_mean = s->channel < 2u * s->config.outcomes;
  search_sums since = {0}, ramp = {0}, gain = {0};
  best_time best[SEARCH_GAIN + 1] = {{.a = 1.0}, {.a = 1.0}, {.a = 1.0}};
  double tq = 0.0, tg[NOISE_MAX_FIELDS] = {0.0}, square = 0.0, cross = 0.0, p1 = 0.0;
  for (uint32_t i = s->held; i-- > 0;) {
    const double q = (double)search_q(s)[i], a0 = (double)search_a0(s)[i];
    const double a1 = (double)search_a1(s)[i]; /* 0 of the newest block */
    const float *g = search_g(s, i);
    if (!(a0 > 0.0))
      continue; /* beside it a1 is 0 */
    since.n += 1.0;
    since.d += q;
    since.a += a0 + a1;
    search_add_fields(k, since.g, g);
    judge_time(s, &since, i, &best[SEARCH_SINCE]);
    if (!is_mean)
      continue;
    const double p = search_p(s, i);
    const double t = ((double)i - (double)s->held) * SEARCH_RAMP_UNIT, t1 = t + SEARCH_RAMP_UNIT;
    ramp.n = gain.n = since.n;
    gain.d += p * q;
    gain.a += p * p * a0 + p * p1 * a1;
    p1 = p;
    tq += t * q;
    square += a0 * t * t + a1 * t * t1;
    cross += 2.0 * a0 * t + a1 * (t + t1);
    ramp.d = tq - t * since.d;
    ramp.a = square - t * cross + t * t * since.a;
    for (uint32_t j = 0; j < k; ++j) {
      gain.g[j] += p * (double)g[j];
      tg[j] += t * (double)g[j];
      ramp.g[j] = tg[j] - t * since.g[j];
    }
    judge_time(s, &ramp, i, &best[SEARCH_RAMP]);
    judge_time(s, &gain, i, &best[SEARCH_GAIN]);
  }
  for (uint32_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family)
    note_time(s, (search_family)family, &best[family]);
}

/* With x = q / 2, P is exp(-x) times the sum of x^i / i!; where k is odd, of
 * x^(i - 1/2) / Gamma(i + 1/2) and exp(x) erfc(sqrt x), which is at most
 * 2 / (sqrt pi (z + sqrt(z^2 + 4 / pi))), z = sqrt x, and nearly that. */
double rimi_search_surprise(uint32_t k, uint32_t runs, double q) {
  /* T^2 has the tail of a chi-square at (runs - k) ln(1 + q / (runs - 1)): exactly with k = 2. */
  if (runs > 1u)
    q = (double)(runs > k ? runs - k : 1u) * rimi_log(1.0 + q / (double)(runs - 1u));
  const double root_pi = 1.7724538509055160, x = 0.5 * q, z = rimi_sqrt(x);
  const bool is_odd = k % 2u != 0;
  double tail = is_odd ? 2.0 / (root_pi * (z + rimi_sqrt(x + 4.0 / 3.14159265358979324))) : 1.0;
  double term = is_odd ? z / (0.5 * root_pi) : x;
  for (uint32_t i = 1; 2u * i < k; ++i) {
    tail += term;
    term *= x / ((double)i + (is_odd ? 0.5 : 1.0));
  }
  return x - rimi_log(tail);
}

/* A form of a symmetric matrix in packed rows: m' V m. */
static double square_form(uint32_t k, const double *v, const double *m) {
  double sum = 0.0;
  for (uint32_t i = 0; i < k; ++i) {
    for (uint32_t j = 0; j < k; ++j)
      sum += m[i] * m[j] * v[i >= j ? packed_row(i) + j : packed_row(j) + i];
  }
  return sum;
}

/* How much the run's effects surprise, nats. of_all: all of them; of_offset: the square of the
 * offset alone in its own standard deviation, a chi-square of one degree. A sensor that is off from
 * the start shows in that, and among all effects hides behind those that are as usual. */
static double surprise_of_effects(uint32_t runs, double of_all, double of_offset) {
  if (runs == 0u)
    return of_all - SEARCH_VAGUE_NATS;
  return rimi_max(of_all, rimi_search_surprise(1u, runs, of_offset)) - TWO_TESTS;
}

/* The run's effects are themselves impossible: Q = b' (prior - V)^-1 b is a chi-square of k degrees
 * of freedom by chance. The nats are those of its tail: there is nothing that was searched. */
static void judge_field(rim_search *s, const noise_channel *c, const double *l, const double *b,
                        const double *mean_raw) {
  const uint32_t k = c->fields, raw = s->config.noise->raw;
  double v[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], x[NOISE_MAX_FIELDS];
  const uint32_t packed = k * (k + 1u) / 2u;
  memcpy(v, l, packed * sizeof *v);
  cholesky_invert_factor(k, v);
  cholesky_square_inverse(k, v);
  double mean[NOISE_MAX_FIELDS] = {0.0}, shift = 0.0; /* of the fields */
  for (uint32_t j = 0; j < k; ++j) {
    for (uint32_t r = 0; r < raw; ++r)
      mean[j] += (double)rimi_le_f32(c->combination, (size_t)j * raw + r) * mean_raw[r];
  }
  for (uint32_t i = 0; i < k; ++i)
    shift += mean[i] * b[i];
  const double var = square_form(k, v, mean);
  for (uint32_t i = 0; i < packed; ++i)
    v[i] = -v[i];
  for (uint32_t i = 0; i < k; ++i)
    v[packed_row(i) + i] += 1.0 / (double)rimi_le_f32(c->inverse_prior, i);
  const double of_runs = square_form(k, v, mean); /* variance of the offset that is seen */
  const double of_offset = of_runs > 0.0 ? shift * shift / of_runs : 0.0;
  memcpy(x, b, k * sizeof *x);
  if (!cholesky_factor(k, v))
    return;
  cholesky_forward(k, v, x);
  double q = 0.0;
  for (uint32_t i = 0; i < k; ++i)
    q += x[i] * x[i];
  const double degrees = (double)k;
  const double t_s = (double)search_times(s)[search_slot(s, s->held - 1u)];
  const bool is_large = q > degrees || of_offset > 1.0;
  if (!is_large || !rimi_is_finite(q) || s->held < 2u * SEARCH_LEAST ||
      t_s < FIELD_FROM * s->config.noise->run_s)
    return;
  search_hypothesis h = {.family = SEARCH_FIELD, .onset = SEARCH_FROM_START};
  const uint32_t runs = s->config.noise->runs;
  const double of_all = rimi_search_surprise(k, runs, q);
  h.ln_ratio = (float)surprise_of_effects(runs, of_all, of_offset);
  h.shift = (float)shift;
  h.sd = (float)rimi_sqrt(rimi_max(var, 1e-12));
  h.blocks = s->held;
  set_score(s, &h);
  rimi_search_note(s, s->channel, &h);
  /* An offset is explained by a shift, which says since when: here it counts as an effect like any
   * other. */
  h.ln_ratio = (float)of_all;
  s->in_time[SEARCH_FIELD] = h;
}

void rimi_search_refresh(rim_search *s, uint32_t channel) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  double l[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], b[NOISE_MAX_FIELDS];
  double mean_raw[NOISE_MAX_RAW];
  s->channel = (uint16_t)channel;
  s->fields = c.fields;
  s->p_at = search_prediction_of(s, channel);
  s->p_zero = (double)c.p_center / (double)c.s;
  s->p_step = (double)c.p_scale * SEARCH_BYTE_STEP / (double)c.s;
  s->fresh = true;
  s->shape = SEARCH_CONSTANT;
  rimi_search_take_out(s, channel);
  rimi_search_effects(s, &c, l, b);
  whiten(s, &c, l, b, mean_raw);
  fold(s, &c);
  search_state(s, channel)->time.score = SEARCH_NONE;
  memset(s->in_time, 0, sizeof s->in_time);
  scan_time(s);
  if (c.fields > 0)
    judge_field(s, &c, l, b, mean_raw);
}

/* From the work arrays of a constant shift, those of what each block inside adds to a state that
 * keeps SEARCH_KEEPS of it from block to block. With W the inverse covariance and m_i what block i
 * alone adds, q becomes m_i'W(z - effects), a0 m_i'W m_i, and a1 is such that 2 m_h'W m_i is
 * SEARCH_KEEPS^(i - h) a1[i] for every h < i. */
static void take_kept(rim_search *s) {
  const double keeps = SEARCH_KEEPS;
  float *q = search_q(s), *a0 = search_a0(s), *a1 = search_a1(s);
  double d = 0.0, a = 0.0, g[NOISE_MAX_FIELDS] = {0.0};
  for (uint32_t i = s->held; i-- > 0;) {
    const double before = i > 0 ? (double)a1[i - 1u] : 0.0;
    float *field = search_g(s, i);
    const bool known = a0[i] > 0.0f;
    d = (double)q[i] + keeps * d;
    a = (double)a0[i] + keeps * (double)a1[i] + keeps * keeps * a;
    for (uint32_t j = 0; j < s->fields; ++j) {
      g[j] = (double)field[j] + keeps * g[j];
      field[j] = (float)g[j];
    }
    q[i] = (float)d;
    a0[i] = known ? (float)a : 0.0f;
    a1[i] = (float)(2.0 * a + before / keeps);
  }
}

/* From the work arrays of a constant shift. */
static void take_proportional(rim_search *s) {
  float *q = search_q(s), *a0 = search_a0(s), *a1 = search_a1(s);
  double p = s->held > 0 ? search_p(s, 0) : 0.0;
  for (uint32_t i = 0; i < s->held; ++i) {
    const double next = i + 1u < s->held ? search_p(s, i + 1u) : 0.0;
    float *g = search_g(s, i);
    q[i] = (float)(p * (double)q[i]);
    a0[i] = (float)(p * p * (double)a0[i]);
    a1[i] = (float)(p * next * (double)a1[i]);
    for (uint32_t j = 0; j < s->fields; ++j)
      g[j] = (float)(p * (double)g[j]);
    p = next;
  }
}

void rimi_search_take_shape(rim_search *s, search_shape shape) {
  if ((search_shape)s->shape == shape)
    return;
  if (s->shape != SEARCH_CONSTANT)
    rimi_search_refresh(s, s->channel);
  if (shape == SEARCH_PROPORTIONAL)
    take_proportional(s);
  else if (shape == SEARCH_KEPT)
    take_kept(s);
  s->shape = (uint8_t)shape;
}

void rimi_search_scan_end(const rim_search *s, search_hypothesis *h) {
  const uint32_t oldest = s->count - s->held;
  const uint32_t onset = h->onset > oldest ? h->onset : oldest;
  const float *a0 = search_a0(s), *a1 = search_a1(s);
  search_sums sums = {0};
  best_time best = {.square = -1.0, .a = 1.0}; /* less than that of no deviation at all */
  bool inside = false;                         /* the block before */
  for (uint32_t i = onset - oldest; i + 1u < s->held; ++i) {
    const bool known = a0[i] > 0.0f;
    if (known) {
      sums.n += 1.0;
      sums.d += (double)search_q(s)[i];
      sums.a += (double)a0[i] + (inside ? (double)a1[i - 1u] : 0.0);
      search_add_fields(s->fields, sums.g, search_g(s, i));
      judge_time(s, &sums, i, &best);
    }
    inside = known;
  }
  h->score = SEARCH_NONE;
  if (best.square < 0.0)
    return;
  h->onset = onset;
  h->end = oldest + best.at + 1u;
  rimi_search_judge(s, &best.sums, h);
}

void rimi_search_note_onset(search_onsets *onsets, double nats, uint32_t i) {
  const double x = (double)i, above = nats - onsets->nats;
  if (above < -NEGLIGIBLE)
    return;
  const double shrink = above > NEGLIGIBLE ? 0.0 : above > 0.0 ? rimi_exp(-above) : 1.0;
  const double part = above < 0.0 ? rimi_exp(above) : 1.0;
  onsets->weight = onsets->weight * shrink + part;
  onsets->first = onsets->first * shrink + part * x;
  onsets->second = onsets->second * shrink + part * x * x;
  if (above > 0.0) {
    onsets->nats = nats;
    onsets->at = i;
  }
}

double rimi_search_onset_sd(const search_onsets *onsets) {
  const double mean = onsets->weight > 0.0 ? onsets->first / onsets->weight : 0.0;
  const double var = onsets->weight > 0.0 ? onsets->second / onsets->weight - mean * mean : 0.0;
  return rimi_sqrt(rimi_max(var, 1.0 / 12.0)); /* a block is the least that can be told */
}

void rimi_search_scan_onset(const rim_search *s, const search_mask *mask, search_hypothesis *h,
                            double *sd) {
  search_mask everywhen = *mask;
  everywhen.from = 0;
  search_sums sums = {0};
  best_time best = {.a = 1.0};
  search_onsets onsets = {0};
  const double inflation = inflation_of(s, h);
  double later = 0.0;
  for (search_walk w = search_walk_from(s, &everywhen); search_walk_next(&w);) {
    const uint32_t i = w.i;
    const bool counts = w.inside && search_a0(s)[i] > 0.0f;
    const double together = search_together(s, i, later);
    later = search_later(s, i, counts, later);
    if (!counts)
      continue;
    sums.n += 1.0;
    sums.d += (double)search_q(s)[i];
    sums.a += (double)search_a0(s)[i] + together;
    search_add_fields(s->fields, sums.g, search_g(s, i));
    judge_time(s, &sums, i, &best);
    if (sd == NULL)
      continue;
    search_hypothesis now = *h;
    rimi_search_judge(s, &sums, &now);
    if (now.score <= SEARCH_NONE)
      continue;
    rimi_search_note_onset(&onsets, (double)now.ln_ratio / inflation, i);
  }
  if (best.square > 0.0) {
    h->onset = s->count - s->held + best.at;
    rimi_search_judge(s, &best.sums, h);
  }
  if (sd != NULL)
    *sd = rimi_search_onset_sd(&onsets);
}
