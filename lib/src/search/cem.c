/* SPDX-License-Identifier: MIT */
#include "search/cem.h"

#include <stddef.h>
#include <string.h>

#include "base/real.h"
#include "base/rng.h"
#include "base/usable.h"

#define MOST_PARAMETERS RIM_CEM_PARAMETERS(RIM_CEM_MAX_DIMS)
#define BLOCKS_A_SAMPLE 16u /* of 4 words; a normal takes 2 words, 27 parameters 14 blocks */
#define LEAST_SPREAD 1e-3

typedef struct distribution {
  double mean[MOST_PARAMETERS]; /* centre; then L, the diagonal as logarithm */
  double sd[MOST_PARAMETERS];
} distribution;

typedef struct elite {
  double value;
  uint32_t sample;
} elite;

static rim_cem_config filled(const rim_cem_config *config) {
  rim_cem_config c = *config;
  RIM_OR_DEFAULT(c.samples, 24);
  RIM_OR_DEFAULT(c.elites, 5);
  RIM_OR_DEFAULT(c.iterations, 10);
  RIM_OR_DEFAULT(c.spread, 0.5);
  RIM_OR_DEFAULT(c.least_axis, 0.02);
  RIM_OR_DEFAULT(c.most_axis, 1.0);
  return c;
}

static bool is_valid(const rim_cem_config *c) {
  return c->samples >= 2 && c->samples <= RIM_CEM_MAX_SAMPLES && c->elites <= RIM_CEM_MAX_ELITES &&
         c->elites <= c->samples && c->smoothing >= 0.0 && c->smoothing < 1.0 && c->spread > 0.0 &&
         rimi_is_finite(c->spread) && c->least_axis > 0.0 && c->most_axis >= c->least_axis &&
         rimi_is_finite(c->most_axis);
}

static bool start_is_valid(const rim_ellipsoid *e) {
  if (e->dims < 1 || e->dims > RIM_CEM_MAX_DIMS)
    return false;
  for (size_t i = 0; i < e->dims; ++i) {
    if (!rimi_is_finite(e->center[i]) || !(e->factor[i * (i + 1) / 2 + i] > 0.0))
      return false;
  }
  return true;
}

static distribution start_from(const rim_cem_config *c, const rim_ellipsoid *e) {
  distribution d;
  double least = e->factor[0];
  for (size_t i = 1; i < e->dims; ++i)
    least = rimi_min(least, e->factor[i * (i + 1) / 2 + i]);
  size_t p = 0;
  for (size_t i = 0; i < e->dims; ++i, ++p) {
    d.mean[p] = e->center[i];
    d.sd[p] = c->spread * least;
  }
  for (size_t i = 0; i < e->dims; ++i) {
    for (size_t j = 0; j <= i; ++j, ++p) {
      const double entry = e->factor[i * (i + 1) / 2 + j];
      d.mean[p] = i == j ? rimi_log(entry) : entry;
      d.sd[p] = i == j ? c->spread : c->spread * least;
    }
  }
  return d; /* cppcheck-suppress uninitvar ; dims is at least 1 */
}

static void draw(const rim_cem_config *c, const distribution *d, rim_rng *rng, uint32_t sample,
                 rim_ellipsoid *e) {
  rimi_rng_seek(rng, (uint64_t)sample * BLOCKS_A_SAMPLE);
  size_t p = 0;
  for (size_t i = 0; i < e->dims; ++i, ++p) {
    e->center[i] = d->mean[p] + d->sd[p] * rimi_rng_normal(rng);
  }
  for (size_t i = 0; i < e->dims; ++i) {
    for (size_t j = 0; j <= i; ++j, ++p) {
      const double x = d->mean[p] + d->sd[p] * rimi_rng_normal(rng);
      e->factor[i * (i + 1) / 2 + j] =
          i == j ? rimi_clamp(rimi_exp(rimi_clamp(x, -50.0, 50.0)), c->least_axis, c->most_axis)
                 : x;
    }
  }
}

/* Keeps the best, in descending order; equal values in the order of drawing. */
static void keep_elite(elite *list, uint32_t *count, uint32_t most, double value, uint32_t sample) {
  uint32_t at = *count;
  while (at > 0 && list[at - 1].value < value)
    --at;
  if (at >= most)
    return;
  if (*count < most)
    ++*count;
  for (uint32_t i = *count - 1; i > at; --i)
    list[i] = list[i - 1];
  list[at].value = value;
  list[at].sample = sample;
}

/* Towards mean and spread of the elites, drawn again in the same order. */
static void refit(const rim_cem_config *c, distribution *d, rim_rng *rng, const elite *list,
                  uint32_t count, uint32_t parameters) {
  distribution moved = *d;
  for (uint32_t p = 0; p < parameters; ++p) {
    moved.mean[p] = 0.0; /* holds sums until the loop below */
    moved.sd[p] = 0.0;
  }
  for (uint32_t k = 0; k < count; ++k) {
    rimi_rng_seek(rng, (uint64_t)list[k].sample * BLOCKS_A_SAMPLE);
    for (uint32_t p = 0; p < parameters; ++p) {
      const double from_mean = d->sd[p] * rimi_rng_normal(rng);
      moved.mean[p] += from_mean;
      moved.sd[p] += from_mean * from_mean;
    }
  }
  const double n = (double)count;
  for (uint32_t p = 0; p < parameters; ++p) {
    const double mean = moved.mean[p] / n;
    const double sd = rimi_sqrt(rimi_max(moved.sd[p] / n - mean * mean, 0.0));
    d->mean[p] += (1.0 - c->smoothing) * mean;
    d->sd[p] = rimi_max(c->smoothing * d->sd[p] + (1.0 - c->smoothing) * sd, LEAST_SPREAD);
  }
}

bool rimi_cem_is_valid(const rim_cem_config *config, uint8_t dims) {
  if (config == NULL || dims < 1 || dims > RIM_CEM_MAX_DIMS)
    return false;
  const rim_cem_config c = filled(config);
  return is_valid(&c);
}

rim_status rimi_cem_optimise(const rim_cem_config *config, rim_cem_value value_of, void *context,
                             uint64_t seed, uint64_t stream, rim_ellipsoid *best, double *value) {
  if (config == NULL || value_of == NULL || best == NULL || value == NULL)
    return RIM_E_ARGUMENT;
  const rim_cem_config c = filled(config);
  if (!is_valid(&c) || !start_is_valid(best))
    return RIM_E_CONFIG;
  const uint32_t parameters = RIM_CEM_PARAMETERS((uint32_t)best->dims);
  distribution d = start_from(&c, best);
  rim_rng rng;
  rimi_rng_seed(&rng, seed, stream);
  rim_ellipsoid e = *best;
  double best_value = value_of(best, context);
  for (uint32_t t = 0; t < c.iterations; ++t) {
    elite list[RIM_CEM_MAX_ELITES];
    uint32_t count = 0;
    for (uint32_t i = 0; i < c.samples; ++i) {
      const uint32_t sample = t * c.samples + i;
      draw(&c, &d, &rng, sample, &e);
      const double v = value_of(&e, context);
      keep_elite(list, &count, c.elites, v, sample);
      if (v > best_value) {
        best_value = v;
        *best = e;
      }
    }
    refit(&c, &d, &rng, list, count, parameters);
  }
  *value = best_value;
  return RIM_OK;
}
