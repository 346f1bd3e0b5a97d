/* SPDX-License-Identifier: MIT */
/* Since when. A deviation seldom keeps the shape that named it.
 * A leak steps and then grows, a blocked fan warms ever faster, a worn bearing takes more of
 * whatever current flows. One shape alone is then dated where it fits best, which may be far from
 * where the residuals begin to deviate. So an onset may be that of two shapes together (segmented
 * regression), where these explain clearly more. In a region the same is asked of the blocks inside
 * it. */
#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "search/search_private.h"

#define SHAPES 3u     /* of time: 1, t, t^2; of the prediction p: p, p t */
#define PAIR_NATS 5.0 /* that a second shape must explain, by what healthy runs inflate */
#define SQUARE_NATS                                                                                \
  2.0              /* that a drift must explain beyond a step, a growing one beyond a steady one */
#define STILL 0.25 /* of what its own onset explains, that one shape must explain since another */
#define LEAST_SHARE 1e-6 /* of a shape's information, that must be left beside the others */
#define PARTS 2u

typedef enum date_model {
  STEP,
  RAMP,
  GAIN,
  SQUARE,
  STEP_AND_RAMP,
  BEND,
  GAIN_AND_RAMP,
  MODELS
} date_model;

/* Sums over the blocks since an onset, for each shape; t in SEARCH_RAMP_UNIT from the newest. */
typedef struct date_sums {
  double d[SHAPES], a[SHAPES][SHAPES], g[SHAPES][NOISE_MAX_FIELDS];
} date_sums;

typedef struct date_pass {
  double n;
  date_sums time, gain;
  double next_time[SHAPES], next_gain[SHAPES]; /* shapes of the block after, 0 where unknown */
} date_pass;

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

/* False where block i says nothing, or is not inside what is dated. */
static bool add_block(date_pass *pass, const rim_search *s, uint32_t i, bool inside) {
  if (!inside || !(search_a0(s)[i] > 0.0f)) {
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

static double product(const double a[SHAPES], const double b[SHAPES]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The sums of t - t0 and of its square, from those of 1, t and t^2. */
static void since_onset(const date_sums *sums, double t0, uint32_t parts, uint32_t fields,
                        date_sums *out) {
  const double c[PARTS][SHAPES] = {{-t0, 1.0, 0.0}, {t0 * t0, -2.0 * t0, 1.0}};
  for (uint32_t k = 0; k < parts; ++k) {
    out->d[k] = product(c[k], sums->d);
    for (uint32_t j = 0; j < fields; ++j)
      out->g[k][j] = c[k][0] * sums->g[0][j] + c[k][1] * sums->g[1][j] + c[k][2] * sums->g[2][j];
    for (uint32_t l = 0; l <= k; ++l) {
      const double row[SHAPES] = {product(sums->a[0], c[l]), product(sums->a[1], c[l]),
                                  product(sums->a[2], c[l])};
      out->a[k][l] = product(c[k], row);
    }
  }
}

/* The sums of a model's parts, its first part first. A step and a ramp explain the same since any
 * time from which the ramp is counted. */
static const date_sums *parts_of(const rim_search *s, const date_pass *pass, date_model model,
                                 double t0, date_sums *space) {
  if (model == GAIN || model == GAIN_AND_RAMP)
    return &pass->gain;
  if (model == STEP || model == STEP_AND_RAMP)
    return &pass->time;
  since_onset(&pass->time, t0, model == RAMP ? 1 : 2, s->fields, space);
  return space;
}

static double beside_effects(const rim_search *s, const date_sums *sums, uint32_t k, uint32_t l) {
  double a = sums->a[k][l];
  for (uint32_t j = 0; j < s->fields; ++j)
    a -= sums->g[k][j] * sums->g[l][j];
  return a;
}

/* ln likelihood ratio of a model, the run's effects integrated out: d' A^-1 d / 2. */
static double ratio_of(const rim_search *s, const date_pass *pass, date_model model, double t0) {
  date_sums space;
  const date_sums *sums = parts_of(s, pass, model, t0, &space);
  const uint32_t parts = model >= STEP_AND_RAMP ? 2u : 1u, first = model == SQUARE ? 1u : 0u;
  const double d0 = sums->d[first], d1 = sums->d[1], a00 = beside_effects(s, sums, first, first);
  if (pass->n < (double)(SEARCH_LEAST + parts - 1u) ||
      !(a00 > LEAST_SHARE * sums->a[first][first]) || !(a00 > 0.0))
    return 0.0;
  if (parts == 1)
    return d0 * d0 / (2.0 * a00);
  const double a10 = beside_effects(s, sums, 1, 0), a11 = beside_effects(s, sums, 1, 1);
  const double det = a00 * a11 - a10 * a10;
  return det > LEAST_SHARE * a00 * a11
             ? (d0 * d0 * a11 - 2.0 * d0 * d1 * a10 + d1 * d1 * a00) / (2.0 * det)
             : 0.0;
}

static double inflation_of(const rim_search *s) {
  const noise_channel c = rimi_noise_channel(s->config.noise, s->channel);
  return (double)rimi_le_f32(c.phi, SEARCH_SINCE);
}

static date_model model_of(const search_hypothesis *h) {
  return h->family == SEARCH_GAIN ? GAIN : h->family == SEARCH_RAMP ? RAMP : STEP;
}

void rimi_search_sum_in_time(const rim_search *s, const search_hypothesis *h, search_sums *sums) {
  const uint32_t oldest = s->count - s->held;
  const uint32_t from = h->onset != SEARCH_FROM_START && h->onset > oldest ? h->onset - oldest : 0u;
  date_pass pass;
  date_sums space;
  memset(&pass, 0, sizeof pass);
  for (uint32_t i = s->held; i-- > from;)
    (void)add_block(&pass, s, i, true);
  const date_sums *of = parts_of(s, &pass, model_of(h), time_of(s, from), &space);
  *sums = (search_sums){.d = of->d[0], .a = of->a[0][0], .n = pass.n};
  memcpy(sums->g, of->g[0], s->fields * sizeof sums->g[0]);
}

void rimi_search_judge_in_time(const rim_search *s, search_hypothesis *h) {
  search_sums sums;
  rimi_search_sum_in_time(s, h, &sums);
  rimi_search_judge(s, &sums, h);
}

/* Whether the outcome reads high by it; a gain, where the prediction is as usual. */
static bool reads_high(const rim_search *s, const search_hypothesis *h) {
  return (h->family == SEARCH_GAIN ? s->p_zero : 1.0) * (double)h->shift > 0.0;
}

/* Of a step, a ramp and a gain, what explains most since this onset, with the sign of before; of a
 * region what it explains since then. Where none alone says much since there the hypothesis stays
 * as it was: false. */
static bool judge_again(rim_search *s, search_hypothesis *h, uint32_t onset) {
  search_hypothesis best = *h;
  if (search_dims(h) > 0) {
    best.onset = onset;
    rimi_search_evaluate(s, &best);
    if (!(best.shift * h->shift > 0.0f))
      return false;
  } else {
    best.score = SEARCH_NONE;
    for (uint8_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family) {
      search_hypothesis now = {.family = family, .onset = onset};
      rimi_search_judge_in_time(s, &now);
      if (reads_high(s, &now) == reads_high(s, h) &&
          rimi_search_worth(s, s->channel, &now) > rimi_search_worth(s, s->channel, &best))
        best = now;
    }
  }
  if (!(best.score > SEARCH_NONE) || (double)best.ln_ratio < STILL * (double)h->ln_ratio)
    return false;
  *h = best;
  return true;
}

/* Which models may date it: its own, and those that are more. In a region the work arrays have the
 * shape already, so that its own is a step of that shape, for which a ramp may have been taken. */
static bool may_date(date_model model, date_model own, bool in_region) {
  if (model == own || model == STEP_AND_RAMP || model == BEND)
    return true;
  if (model == GAIN_AND_RAMP)
    return !in_region;
  return in_region ? model == RAMP || model == SQUARE : model == SQUARE && own == RAMP;
}

/* The model that dates it. */
static uint32_t choose_model(const search_onsets onsets[MODELS], date_model own) {
  uint32_t best = own;
  for (uint32_t model = 0; model < MODELS; ++model) {
    const double needed = model < STEP_AND_RAMP  ? SQUARE_NATS
                          : best < STEP_AND_RAMP ? PAIR_NATS
                                                 : 0.0;
    if (onsets[model].nats > onsets[best].nats + needed) /* 0 of a model that may not */
      best = model;
  }
  return best;
}

void rimi_search_date(rim_search *s, search_hypothesis *h, double *onset_sd) {
  const bool in_region = search_dims(h) > 0;
  const date_model own = model_of(h);
  const double inflation = inflation_of(s);
  search_onsets onsets[MODELS];
  date_pass pass;
  memset(onsets, 0, sizeof onsets);
  memset(&pass, 0, sizeof pass);
  search_mask mask = rimi_search_mask_of(s, h, -1);
  mask.from = 0;
  for (search_walk w = search_walk_from(s, &mask); search_walk_next(&w);) {
    if (!add_block(&pass, s, w.i, w.inside))
      continue;
    for (uint32_t model = 0; model < MODELS; ++model) {
      if (may_date((date_model)model, own, in_region))
        rimi_search_note_onset(&onsets[model],
                               ratio_of(s, &pass, (date_model)model, time_of(s, w.i)) / inflation,
                               w.i);
    }
  }
  uint32_t dated = choose_model(onsets, own);
  if (dated != own && !judge_again(s, h, s->count - s->held + onsets[dated].at))
    dated = own;
  *onset_sd = rimi_search_onset_sd(&onsets[dated]);
}
