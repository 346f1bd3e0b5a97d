/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "base/real.h"
#include "batch/dmaps.h"

#define STREAMS_A_STEP 16u /* above RIM_DMAPS_MAX_REGIONS */

/* The caller's value function as the search wants it. */
typedef struct asked {
  rim_dmaps_value value_of;
  void *context;
  const rim_ellipsoid *taken;
  uint32_t count;
} asked;

static double ask(const rim_ellipsoid *e, void *context) {
  const asked *a = (const asked *)context;
  return a->value_of(e, a->taken, a->count, a->context);
}

rim_status rimi_dmaps_pool_init(rim_dmaps_pool *pool, const rim_dmaps_pool_config *config) {
  if (pool == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  rim_dmaps_pool_config c = *config;
  if (c.candidates == 0)
    c.candidates = RIM_DMAPS_MAX_REGIONS;
  if (c.radius == 0.0)
    c.radius = 0.1;
  if (c.dims < 1 || c.dims > RIM_CEM_MAX_DIMS || c.candidates > RIM_DMAPS_MAX_REGIONS ||
      c.spare > c.candidates || !(c.radius > 0.0) || !rimi_is_finite(c.radius) ||
      !(c.lambda >= 0.0) || !rimi_is_finite(c.lambda) || !rimi_cem_is_valid(&c.cem, c.dims)) {
    return RIM_E_CONFIG;
  }
  memset(pool, 0, sizeof *pool);
  pool->config = c;
  return RIM_OK;
}

static uint32_t least_of(uint32_t a, uint32_t b) { return a < b ? a : b; }

static void move_up(rim_dmaps_pool *pool, uint32_t from, uint32_t to) {
  const rim_ellipsoid e = pool->candidate[from];
  const double value = pool->value[from];
  for (uint32_t i = from; i > to; --i) {
    pool->candidate[i] = pool->candidate[i - 1];
    pool->value[i] = pool->value[i - 1];
  }
  pool->candidate[to] = e;
  pool->value[to] = value;
}

/* Insertion by descending value of [first, count); the earlier of equals stays first. */
static void sort_pool(rim_dmaps_pool *pool, uint32_t first) {
  for (uint32_t i = first + 1; i < pool->count; ++i) {
    uint32_t to = i;
    while (to > first && pool->value[i] > pool->value[to - 1])
      --to;
    move_up(pool, i, to);
  }
}

rim_status rimi_dmaps_step(rim_dmaps_pool *pool, const double *x, rim_dmaps_value value_of,
                           void *context) {
  if (pool == NULL || x == NULL || value_of == NULL)
    return RIM_E_ARGUMENT;
  const rim_dmaps_pool_config *c = &pool->config;
  for (size_t i = 0; i < c->dims; ++i) {
    if (!rimi_is_finite(x[i]))
      return RIM_E_DATA;
  }
  /* Lines 2-3: every candidate by its own ln anom on all observations there are by now. */
  pool->candidate[pool->count++] = rimi_ellipsoid_ball(c->dims, x, c->radius);
  for (uint32_t i = 0; i < pool->count; ++i)
    pool->value[i] = value_of(&pool->candidate[i], NULL, 0, context);
  sort_pool(pool, 0);
  /* Lines 5-13: the regions found so far are the candidates before `found`. */
  pool->found = 0;
  pool->total = 0.0;
  for (uint32_t i = 0; i < pool->count; ++i) {
    asked a = {value_of, context, pool->candidate, pool->found};
    /* init has tried the configuration and the start is an ellipsoid: this cannot fail */
    (void)rimi_cem_optimise(&c->cem, ask, &a, c->seed, (uint64_t)pool->steps * STREAMS_A_STEP + i,
                            &pool->candidate[i], &pool->value[i]);
    if (!(pool->value[i] >= c->lambda) || pool->found == c->candidates)
      continue;
    pool->total += pool->value[i] - c->lambda;
    move_up(pool, i, pool->found++);
  }
  ++pool->steps;
  sort_pool(pool, pool->found);
  const uint32_t spare = least_of(pool->count - pool->found, c->spare);
  pool->count = least_of(pool->found + spare, c->candidates);
  return RIM_OK;
}
