/* SPDX-License-Identifier: MIT */
/* Since when: the onset of what names no region. A deviation seldom keeps the shape that named it.
 * A leak steps and then grows, a blocked fan warms ever faster, a worn bearing takes more of
 * whatever current flows. One shape alone is then dated where it fits best, which may be far from
 * where the residuals begin to deviate. So an onset may be that of two shapes together (segmented
 * regression), where these explain clearly more. */
#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "search/search_private.h"

#define SHAPES 3u        /* of time: 1, t, t^2; of the prediction p: p, p t */
#define PAIR_NATS 5.0    /* that a second shape must explain, by what healthy runs inflate */
#define LEAST_SHARE 1e-6 /* of a shape's information, that must be left beside the others */
#define MOST_PARTS 2u

typedef enum date_model { STEP, RAMP, GAIN, STEP_AND_RAMP, BEND, GAIN_AND_RAMP, MODELS } date_model;

/* Sums over the blocks since an onset, for each shape; t in SEARCH_RAMP_UNIT from the newest. */
typedef struct date_sums {
  double d[SHAPES], a[SHAPES][SHAPES], g[SHAPES][NOISE_MAX_FIELDS];
} date_sums;

typedef struct date_pass {
  double n;
  date_sums time, gain;
  double next_time[SHAPES], next_gain[SHAPES]; /* shapes of the block after, 0 where unknown */
} date_pass;

/* The best onset of a model, and the distribution of its onsets: each as likely as its ratio. */
typedef struct date_best {
  double ln, weight, first, second;
  uint32_t at;
} date_best;

static void add_shapes(date_sums *sums, const double *m, const double *next, uint32_t shapes,
                       const rim_search *s, uint32_t i) {
  const double q = (double)search_q(s)[i], a0 = (double)search_a0(s)[i];
  const double a1 = 0.5 * (double)search_a1(s)[i];
  const float *g = search_g(s, i);
  for (uint32_t k = 0; k < shapes; ++k) {
    sums->d[k] += m[k] * q;
    for (uint32_t j = 0; j < s->fields; ++j)
      sums->g[k][j] += m[k] * (double)g[j];
    for (uint32_t l = 0; l <= k; ++l) {
      const double both = m[k] * m[l] * a0 + (m[k] * next[l] + m[l] * next[k]) * a1;
      sums->a[k][l] += both;
      sums->a[l][k] = sums->a[k][l];
    }
  }
}

static double time_of(const rim_search *s, uint32_t i) {
  return ((double)i - (double)s->held) * SEARCH_RAMP_UNIT;
}

/* False where block i says nothing. */
static bool add_block(date_pass *pass, const rim_search *s, uint32_t i) {
  if (!(search_a0(s)[i] > 0.0f)) {
    memset(pass->next_time, 0, sizeof pass->next_time);
    memset(pass->next_gain, 0, sizeof pass->next_gain);
    return false;
  }
  const double t = time_of(s, i), p = search_p(s, i);
  const double time[SHAPES] = {1.0, t, t * t}, gain[SHAPES] = {p, p * t, 0.0};
  pass->n += 1.0;
  add_shapes(&pass->time, time, pass->next_time, SHAPES, s, i);
  add_shapes(&pass->gain, gain, pass->next_gain, 2, s, i);
  memcpy(pass->next_time, time, sizeof time);
  memcpy(pass->next_gain, gain, sizeof gain);
  return true;
}

/* The parts of a model as combinations of the shapes, for an onset at time t0. */
static uint32_t parts_of(date_model model, double t0, double c[MOST_PARTS][SHAPES]) {
  const double step[SHAPES] = {1.0, 0.0, 0.0}, ramp[SHAPES] = {-t0, 1.0, 0.0};
  const double square[SHAPES] = {t0 * t0, -2.0 * t0, 1.0};
  const bool grows = model == RAMP || model == BEND;
  memcpy(c[0], grows ? ramp : step, sizeof step);
  memcpy(c[1], model == BEND ? square : ramp, sizeof square);
  return model >= STEP_AND_RAMP ? 2u : 1u;
}

static double product(const double a[SHAPES], const double b[SHAPES]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ln likelihood ratio of a model, the run's effects integrated out: d' A^-1 d / 2. The sums of its
 * first part go to *first. */
static double ratio_of(const rim_search *s, const date_pass *pass, date_model model, double t0,
                       search_sums *first) {
  const bool is_gain = model == GAIN || model == GAIN_AND_RAMP;
  const date_sums *sums = is_gain ? &pass->gain : &pass->time;
  double c[MOST_PARTS][SHAPES], d[MOST_PARTS] = {0.0, 0.0}, a[3] = {0.0, 0.0, 0.0};
  double g[MOST_PARTS][NOISE_MAX_FIELDS], all = 0.0;
  const uint32_t parts = parts_of(model, t0, c);
  for (uint32_t k = 0; k < parts; ++k) {
    d[k] = product(c[k], sums->d);
    for (uint32_t j = 0; j < s->fields; ++j)
      g[k][j] = c[k][0] * sums->g[0][j] + c[k][1] * sums->g[1][j] + c[k][2] * sums->g[2][j];
    for (uint32_t l = 0; l <= k; ++l) {
      double *both = &a[k + l];
      for (uint32_t m = 0; m < SHAPES; ++m)
        *both += c[k][m] * product(sums->a[m], c[l]);
      all = k == 0 ? *both : all;
      for (uint32_t j = 0; j < s->fields; ++j)
        *both -= g[k][j] * g[l][j];
    }
  }
  first->n = pass->n;
  first->d = d[0];
  first->a = all;
  memcpy(first->g, g[0], s->fields * sizeof g[0][0]);
  if (pass->n < (double)(SEARCH_LEAST + parts - 1u) || !(a[0] > LEAST_SHARE * all) || !(a[0] > 0.0))
    return 0.0;
  if (parts == 1)
    return d[0] * d[0] / (2.0 * a[0]);
  const double det = a[0] * a[2] - a[1] * a[1];
  return det > LEAST_SHARE * a[0] * a[2]
             ? (d[0] * d[0] * a[2] - 2.0 * d[0] * d[1] * a[1] + d[1] * d[1] * a[0]) / (2.0 * det)
             : 0.0;
}

static void note_onset(date_best *best, double ln, double inflation, uint32_t i) {
  const double x = (double)i;
  if (ln > best->ln) {
    const double shrink =
        best->weight > 0.0 ? rimi_exp(rimi_max(best->ln - ln, -600.0) / inflation) : 0.0;
    best->weight *= shrink;
    best->first *= shrink;
    best->second *= shrink;
    best->ln = ln;
    best->at = i;
  }
  const double part = rimi_exp(rimi_max(ln - best->ln, -600.0) / inflation);
  best->weight += part;
  best->first += part * x;
  best->second += part * x * x;
}

static double inflation_of(const rim_search *s) {
  const noise_channel c = rimi_noise_channel(s->config.noise, s->channel);
  return (double)rimi_le_f32(c.phi, SEARCH_SINCE);
}

static date_model model_of(const search_hypothesis *h) {
  return h->family == SEARCH_GAIN ? GAIN : h->family == SEARCH_RAMP ? RAMP : STEP;
}

void rimi_search_judge_in_time(const rim_search *s, search_hypothesis *h) {
  const uint32_t oldest = s->count - s->held;
  const uint32_t from = h->onset != SEARCH_FROM_START && h->onset > oldest ? h->onset - oldest : 0u;
  date_pass pass;
  search_sums sums;
  memset(&pass, 0, sizeof pass);
  for (uint32_t i = s->held; i-- > from;)
    (void)add_block(&pass, s, i);
  (void)ratio_of(s, &pass, model_of(h), time_of(s, from), &sums);
  rimi_search_judge(s, &sums, h);
}

/* Of a step, a ramp and a gain, what explains most since this onset. */
static void judge_again(const rim_search *s, search_hypothesis *h, uint32_t onset) {
  search_hypothesis best = {.score = SEARCH_NONE};
  for (uint8_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family) {
    search_hypothesis now = {.family = family, .onset = onset};
    rimi_search_judge_in_time(s, &now);
    if (rimi_search_worth(s, &now) > rimi_search_worth(s, &best))
      best = now;
  }
  if (best.score > SEARCH_NONE)
    *h = best;
}

void rimi_search_date(const rim_search *s, search_hypothesis *h, double *onset_sd) {
  const date_model own = model_of(h);
  const double inflation = inflation_of(s);
  date_best best[MODELS];
  date_pass pass;
  memset(best, 0, sizeof best);
  memset(&pass, 0, sizeof pass);
  for (uint32_t i = s->held; i-- > 0;) {
    if (!add_block(&pass, s, i))
      continue;
    for (uint32_t model = 0; model < MODELS; ++model) {
      search_sums first;
      if (model == (uint32_t)own || model >= STEP_AND_RAMP)
        note_onset(&best[model], ratio_of(s, &pass, (date_model)model, time_of(s, i), &first),
                   inflation, i);
    }
  }
  const date_best *dated = &best[own];
  for (uint32_t model = STEP_AND_RAMP; model < MODELS; ++model) {
    if (best[model].ln > dated->ln + (dated == &best[own] ? PAIR_NATS * inflation : 0.0))
      dated = &best[model];
  }
  if (dated != &best[own])
    judge_again(s, h, s->count - s->held + dated->at);
  const double mean = dated->weight > 0.0 ? dated->first / dated->weight : 0.0;
  const double var = dated->weight > 0.0 ? dated->second / dated->weight - mean * mean : 0.0;
  *onset_sd = rimi_sqrt(rimi_max(var, 1.0 / 12.0)); /* a block is the least that can be told */
}
