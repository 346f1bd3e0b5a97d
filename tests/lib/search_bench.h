/* SPDX-License-Identifier: MIT */
/* Of test_search.c: a channel's noise as a section, blocks with a planted deviation, and what
 * generalised least squares says of a shape, computed with whole matrices.
 *
 * Predictions, means, activities and residuals are whole multiples of the step in which the ring
 * keeps them. */
#ifndef SEARCH_BENCH_H
#define SEARCH_BENCH_H

#include <math.h>
#include <stdio.h>

#include "base/real.h"
#include "base/rng.h"
#include "bits.h"
#include "search/search.h"
#include "search/search_private.h"
#include "section_bytes.h"

#ifndef BENCH_MEANS
#define BENCH_MEANS 1 /* of the commands; the first moves along a field */
#endif
#ifndef BENCH_FIELDS
#define BENCH_FIELDS 3 /* of the run's effects; what is more than three moves nothing */
#endif
#ifndef BENCH_FEATURES
#define BENCH_FEATURES 3
#endif
enum { FEATURES = BENCH_FEATURES, MEANS = BENCH_MEANS };
enum { OUTCOMES = 2, KINDS = 4, CHANNELS = KINDS * OUTCOMES };
enum { RAW = 4 + MEANS, FIELDS = BENCH_FIELDS, RING = 48, MOST_BLOCKS = 160, TURN = 16 };
#define SEED 4242u
#define BLOCK_S 0.5
#define RUN_S 40.0
#define DECAY_S 5.0
#define TREND_S 30.0
#define ACTIVITY 0.25 /* mean of healthy blocks */

/* What a channel's noise is like, and the blocks of a run. */
typedef struct world {
  uint32_t fields;
  double rho, rho_rise, s, p_center, p_scale;
  /* Per p, per activity, per its square less 1, per disturbance. */
  double ln_sigma, ln_active, ln_active_2, ln_disturbed;
  double common; /* of healthy residuals: what is taken off */
  double prior[FIELDS], combination[FIELDS][RAW];
  float phi;
  uint32_t blocks;
  uint8_t feature[MOST_BLOCKS][FEATURES];
  double p[MOST_BLOCKS], mean[MOST_BLOCKS][MEANS]; /* standardised */
  double r[MOST_BLOCKS];                           /* of channel 0, in the outcome's unit */
  bool unknown[MOST_BLOCKS];                       /* nothing is known of channel 0 */
  bool apart[MOST_BLOCKS];                         /* a gap lies before it */
} world;

static inline double predicted(const world *w, uint32_t i) {
  return w->p_center + w->p_scale * w->p[i];
}
/* As the ring keeps it, of predictions that move alike. */
static inline double activity(const world *w, uint32_t i) {
  const double moved =
      i == 0 ? 0.0
             : fmin(fabs(predicted(w, i) - (double)(float)predicted(w, i - 1)) / w->p_scale, 4.0);
  const bool is_next = i > 0 && !w->apart[i];
  const double exact = is_next ? rimi_log(NOISE_STILL + moved) - ACTIVITY : NOISE_APART;
  return floor(exact / SEARCH_ACTIVITY_STEP + 0.5) * SEARCH_ACTIVITY_STEP;
}

/* Of what was noise in the block before. */
static inline double rho_at(const world *w, uint32_t i) {
  return w->rho + (activity(w, i) > 0.0 ? w->rho_rise : 0.0);
}

/* What the ring keeps exactly: steps of 1 / 40. */
static inline double disturbance(uint32_t i) { return ((double)(13u * i % 41u) - 20.0) / 40.0; }

/* Of what is new in the noise of block i. */
static inline double scale(const world *w, uint32_t i) {
  const double a = activity(w, i);
  return rimi_exp(w->ln_sigma * w->p[i] + w->ln_active * a + w->ln_active_2 * (a * a - 1.0) +
                  w->ln_disturbed * disturbance(i));
}

static inline void fields_of(const world *w, uint32_t i, double *field) {
  const double t_s = BLOCK_S * (double)i;
  const double trend = (1.0 - rimi_exp(-t_s / TREND_S)) * TREND_S / RUN_S;
  const double raw[RAW] = {1.0, w->p[i], trend, rimi_exp(-t_s / DECAY_S), w->mean[i][0]};
  for (uint32_t k = 0; k < w->fields; ++k) {
    field[k] = 0.0;
    for (uint32_t j = 0; j < RAW; ++j)
      field[k] += w->combination[k][j] * raw[j];
  }
}

/* The residual as the ring keeps it. */
static inline double residual_of(const world *w, uint32_t i) {
  const double unit = w->s * SEARCH_Z_STEP;
  return floor(w->r[i] / unit + 0.5) * unit;
}

/* Draws a run of the world's own noise: offsets along the fields, and autocorrelated noise. */
static inline void draw(world *w, uint32_t blocks, uint32_t seed) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, seed);
  double b[FIELDS], noise = 0.0;
  for (uint32_t k = 0; k < w->fields; ++k)
    b[k] = sqrt(w->prior[k]) * rimi_rng_normal(&rng);
  w->blocks = blocks;
  for (uint32_t i = 0; i < blocks; ++i) {
    double field[FIELDS];
    for (uint32_t f = 0; f < FEATURES; ++f)
      w->feature[i][f] = (uint8_t)(256.0 * rimi_rng_uniform(&rng));
    w->p[i] = floor(124.0 * rimi_rng_uniform(&rng) - 62.0) / 31.0;
    w->mean[i][0] = ((double)(7 * i % 125) - 62.0) / 31.0;
    const double fresh = scale(w, i) * rimi_rng_normal(&rng);
    const double rho = rho_at(w, i);
    noise = i == 0 ? fresh / sqrt(1.0 - rho * rho) : rho * noise + fresh;
    fields_of(w, i, field);
    w->r[i] = w->s * noise;
    for (uint32_t k = 0; k < w->fields; ++k)
      w->r[i] += w->s * field[k] * b[k];
  }
}

static inline world make_world(bool effects, double rho, double ln_sigma) {
  world w;
  memset(&w, 0, sizeof w);
  w.fields = effects ? FIELDS : 0;
  w.rho = rho;
  w.s = 0.2;
  w.p_center = 3.0;
  w.p_scale = 1.5;
  w.ln_sigma = ln_sigma;
  w.ln_active = ln_sigma > 0.0 ? 0.125 : 0.0;
  w.ln_active_2 = ln_sigma > 0.0 ? 0.03125 : 0.0;
  w.phi = 1.0f;
  static const double combination[FIELDS][RAW] = {
      {1.0, 0.0, 0.0, 0.0, 0.0}, {0.2, 0.8, 0.0, 0.0, 0.3}, {-0.5, 0.0, 1.0, 0.6, 0.0}};
  memcpy(w.combination, combination, sizeof combination);
  for (uint32_t k = 0; k < FIELDS; ++k)
    w.prior[k] = 0.5 + 0.25 * k;
  return w;
}

/* A run whose own offset is ten of its standard deviations. */
static inline world far_off(uint32_t blocks) {
  world w = make_world(true, 0.0, 0.0);
  w.fields = 1;
  w.prior[0] = 0.01;
  draw(&w, blocks, 77);
  for (uint32_t i = 0; i < blocks; ++i)
    w.r[i] += 1.0 * w.s;
  return w;
}

/* Every combination of run effects, autocorrelation, a scale that depends on the block, and, from
 * WORLD_STEADY on, an autocorrelation that does: what is planted then drowns sooner. */
enum { WORLD_STEADY = 8, WORLD_VARIANTS = 16 };
static inline world world_variant(uint32_t i, uint32_t blocks) {
  world w = make_world((i & 1) != 0, (i & 2) != 0 ? 0.6 : 0.0, (i & 4) != 0 ? 0.31 : 0.0);
  w.ln_disturbed = 1.6 * w.ln_sigma;
  w.rho_rise = (i & 8) != 0 ? 0.3 : 0.0;
  draw(&w, blocks, i);
  return w;
}

/* ---- the search over it ---- */

typedef struct bench {
  world w;
  bytes section;
  rim_noise noise;
  search_config config;
  uint8_t cuts[FEATURES][SEARCH_CUTS];
  _Alignas(8) uint8_t memory[65536];
  rim_search *search;
} bench;

static inline void put_noise(bytes *b, const world *w) {
  b->size = 0;
  const uint32_t header[4] = {NOISE_LAYOUT, CHANNELS, RAW, FIELDS};
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  const double rest[5] = {RUN_S, DECAY_S, TREND_S, 0.0, ACTIVITY};
  for (size_t i = 0; i < 5; ++i)
    f32(b, rest[i]);
  for (size_t c = 0; c < CHANNELS; ++c) {
    const double numbers[NOISE_CHANNEL_WORDS] = {1.0,
                                                 c == 0 ? w->fields : 0.0,
                                                 w->rho,
                                                 w->s,
                                                 w->p_center,
                                                 w->p_scale,
                                                 w->ln_sigma,
                                                 0.0,
                                                 w->ln_active,
                                                 w->ln_active_2,
                                                 w->ln_disturbed,
                                                 w->common,
                                                 w->rho_rise};
    for (size_t i = 0; i < NOISE_CHANNEL_WORDS; ++i)
      f32(b, numbers[i]);
    for (size_t k = 0; k < FIELDS; ++k)
      f32(b, 1.0 / w->prior[k]);
    for (size_t k = 0; k < FIELDS * RAW; ++k)
      f32(b, w->combination[k / RAW][k % RAW]);
    for (size_t f = 0; f < NOISE_FAMILIES; ++f)
      f32(b, (double)w->phi);
  }
  /* Behind the last channel lies what would be one more: nobody may look there. */
  const size_t each = (b->size - 16 - 20) / CHANNELS;
  memcpy(b->byte + b->size, b->byte + 36, each);
}

/* ring: blocks kept. */
static inline void start(bench *b, const world *w, uint16_t ring) {
  b->w = *w;
  put_noise(&b->section, w);
  assert_int_equal(rimi_noise_open(&b->noise, b->section.byte, b->section.size, CHANNELS, MEANS),
                   RIM_OK);
  for (size_t f = 0; f < FEATURES; ++f) {
    for (size_t i = 0; i < SEARCH_CUTS; ++i)
      b->cuts[f][i] = (uint8_t)((i + 1) * 256 / SEARCH_BINS);
  }
  b->config = (search_config){.features = FEATURES,
                              .channels = CHANNELS,
                              .outcomes = OUTCOMES,
                              .means = MEANS,
                              .ring = ring,
                              .cells_per_turn = 6,
                              .noise = &b->noise,
                              .cuts = &b->cuts[0][0]};
  assert_int_equal(rimi_search_init(&b->search, b->memory, sizeof b->memory, &b->config), RIM_OK);
}

static inline search_block block_of(const world *w, uint32_t i, double *outcome, double *residual) {
  static bool unknown[CHANNELS];
  unknown[0] = w->unknown[i];
  for (size_t c = 0; c < CHANNELS; ++c)
    residual[c] = c == 0 ? residual_of(w, i) : 0.0;
  for (size_t c = 0; c < CHANNELS; ++c)
    outcome[c] = predicted(w, i);
  return (search_block){.t_s = BLOCK_S * (double)i,
                        .feature = w->feature[i],
                        .mean = w->mean[i],
                        .predicted = outcome,
                        .residual = residual,
                        .disturbance = disturbance(i),
                        .apart = w->apart[i],
                        .unknown = w->unknown[i] ? unknown : NULL};
}

static inline void feed(bench *b, uint32_t from, uint32_t to, uint32_t units) {
  for (uint32_t i = from; i < to; ++i) {
    double outcome[CHANNELS], residual[CHANNELS];
    const search_block block = block_of(&b->w, i, outcome, residual);
    assert_int_equal(rimi_search_observe(b->search, &block), RIM_OK);
    rimi_search_work(b->search, units);
  }
}

/* All that a hypothesis says. */
static inline void take_hypothesis(uint64_t *digest, const search_hypothesis *h) {
  take_real(digest, (double)h->score);
  if (!(h->score > -1e9f))
    return;
  take_bits(digest, h->family);
  take_bits(digest, (uint64_t)h->onset << 32 | (h->family == SEARCH_DURING ? h->end : 0u));
  take_bits(digest, h->blocks);
  const uint32_t dims = search_dims(h);
  for (uint32_t k = 0; k < dims; ++k)
    take_bits(digest, (uint64_t)h->feature[k] << 16 | (uint64_t)h->first[k] << 8 | h->last[k]);
  take_real(digest, (double)h->shift);
  take_real(digest, (double)h->sd);
  take_real(digest, (double)h->ln_ratio);
}

/* ---- generalised least squares with whole matrices ---- */

typedef struct gls {
  double shift, sd, ln_ratio;
} gls;

/* x <- V^-1 x for several x, by elimination with the largest pivot. */
static inline void solve(uint32_t n, double v[][MOST_BLOCKS], double x[][2]) {
  for (uint32_t i = 0; i < n; ++i) {
    uint32_t pivot = i;
    for (uint32_t j = i + 1; j < n; ++j)
      pivot = fabs(v[j][i]) > fabs(v[pivot][i]) ? j : pivot;
    for (uint32_t k = 0; k < n; ++k) {
      const double swap = v[i][k];
      v[i][k] = v[pivot][k];
      v[pivot][k] = swap;
    }
    for (uint32_t k = 0; k < 2; ++k) {
      const double swap = x[i][k];
      x[i][k] = x[pivot][k];
      x[pivot][k] = swap;
    }
    for (uint32_t j = 0; j < n; ++j) {
      if (j == i)
        continue;
      const double factor = v[j][i] / v[i][i];
      for (uint32_t k = i; k < n; ++k)
        v[j][k] -= factor * v[i][k];
      for (uint32_t k = 0; k < 2; ++k)
        x[j][k] -= factor * x[i][k];
    }
  }
  for (uint32_t i = 0; i < n; ++i)
    for (uint32_t k = 0; k < 2; ++k)
      x[i][k] /= v[i][i];
}

/* Noise before an unknown block says nothing of the noise after it. */
static inline bool are_apart(const world *w, uint32_t i, uint32_t j) {
  for (uint32_t k = i < j ? i : j; k <= (i < j ? j : i); ++k) {
    if (w->unknown[k])
      return true;
  }
  return false;
}

/* Of the noise of block i: it keeps rho of what it was and sigma_i is new, since the first block
 * after an unknown one. After a gap as much more is new as noise differs from rho of other
 * noise. */
static inline double variance(const world *w, uint32_t i) {
  const double fresh = pow(scale(w, i), 2), kept = pow(rho_at(w, i), 2);
  if (i == 0 || are_apart(w, i, i - 1))
    return fresh / (1.0 - kept);
  return kept * variance(w, i - 1) + fresh * (w->apart[i] ? (1.0 + kept) / (1.0 - kept) : 1.0);
}

/* What of the noise of block `older` is in that of a newer one. */
static inline double kept_until(const world *w, uint32_t older, uint32_t newer) {
  double part = 1.0;
  for (uint32_t i = older + 1; i <= newer; ++i)
    part *= rho_at(w, i);
  return part;
}

/* r = shift m + B b + n: the shift of least variance when b and n are both noise,
 * cov r = s^2 (B prior B' + var n_min(i, j) times what is kept of it). */
static inline gls dense(const world *w, const double *shape) {
  static double v[MOST_BLOCKS][MOST_BLOCKS], x[MOST_BLOCKS][2];
  const uint32_t n = w->blocks;
  double before[MOST_BLOCKS];
  for (uint32_t i = 0; i < n; ++i)
    before[i] = variance(w, i);
  for (uint32_t i = 0; i < n; ++i) {
    double of_i[FIELDS], of_j[FIELDS];
    fields_of(w, i, of_i);
    for (uint32_t j = 0; j < n; ++j) {
      fields_of(w, j, of_j);
      const uint32_t older = i < j ? i : j, newer = i < j ? j : i;
      double sum = are_apart(w, i, j) ? 0.0 : before[older] * kept_until(w, older, newer);
      for (uint32_t k = 0; k < w->fields; ++k)
        sum += w->prior[k] * of_i[k] * of_j[k];
      v[i][j] = w->unknown[i] || w->unknown[j] ? (i == j ? 1.0 : 0.0) : w->s * w->s * sum;
    }
    x[i][0] = w->unknown[i] ? 0.0 : shape[i];
    x[i][1] = w->unknown[i] ? 0.0 : residual_of(w, i);
  }
  solve(n, v, x);
  double a = 0.0, d = 0.0;
  for (uint32_t i = 0; i < n; ++i) {
    a += w->unknown[i] ? 0.0 : shape[i] * x[i][0];
    d += w->unknown[i] ? 0.0 : shape[i] * x[i][1];
  }
  return (gls){d / a, 1.0 / sqrt(a), d * d / (2.0 * a)};
}

#endif
