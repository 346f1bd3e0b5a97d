/* SPDX-License-Identifier: MIT */
#include "batch/dmaps.h"

#include <string.h>

#include "base/cholesky.h"
#include "base/ellipsoid.h"
#include "base/real.h"
#include "base/usable.h"
#include "batch/stats.h"

#define MAX_DIMS RIM_REGION_MAX_DIMS
#define MAX_SWEEPS 8u
#define DEFAULT_NODES 20u
#define MOST 128 /* features, outcomes */

/* Owners of an observation besides 1..RIM_DMAPS_MAX_REGIONS. */
enum { FREE = 0, BORDER = 254, SKIPPED = 255 };

/* A region during the search; dims 0 is everywhere. */
typedef struct found {
  rim_ellipsoid e;
  uint16_t feature[MAX_DIMS];
  double ln_anom, price;
  uint32_t count;
} found;

typedef struct finder {
  rim_dmaps_config c;
  const rim_batch_data *data;
  void *batch_work;
  size_t batch_bytes;
  double *u, *r;  /* observations in question: [n][features], [n][outcomes] */
  double *x;      /* [n][dims]: the features of the region being optimised */
  double *sum;    /* [outcomes] */
  double *shift;  /* [MAX_REGIONS + 1][outcomes]: sums of r over each region's observations */
  uint8_t *owner; /* [data->n] */
  found *region;  /* [MAX_REGIONS], one for the candidate, [MAX_REGIONS] saved */
  uint32_t n;     /* observations in question */
  uint32_t count; /* regions */
  uint32_t searches, optimisations, evaluations;
} finder;

/* ---- the observations in question, and the value of an ellipsoid over them ---- */

/* What no region has, and what `a` and `b` have (0: nobody). */
static void gather(finder *f, uint32_t a, uint32_t b) {
  const size_t d = f->data->features;
  const size_t o = f->data->outcomes;
  f->n = 0;
  for (size_t i = 0; i < f->data->n; ++i) {
    if (f->owner[i] != FREE && f->owner[i] != a && f->owner[i] != b)
      continue;
    memcpy(f->u + f->n * d, f->data->u + i * d, d * sizeof(double));
    memcpy(f->r + f->n * o, f->data->r + i * o, o * sizeof(double));
    ++f->n;
  }
}

static void project(finder *f, const found *region) {
  const size_t dims = region->e.dims;
  for (size_t i = 0; i < f->n; ++i) {
    for (size_t k = 0; k < dims; ++k)
      f->x[i * dims + k] = f->u[i * f->data->features + region->feature[k]];
  }
}

/* Sums of the residuals inside into f->sum, their number. */
static uint32_t sum_inside(finder *f, const rim_ellipsoid *e) {
  const size_t outcomes = f->data->outcomes;
  const ellipsoid_test test = rimi_ellipsoid_test(e, false);
  uint32_t n = 0;
  memset(f->sum, 0, outcomes * sizeof(double));
  ++f->evaluations;
  for (size_t i = 0; i < f->n; ++i) {
    if (!rimi_ellipsoid_holds(&test, f->x + i * e->dims))
      continue;
    for (size_t o = 0; o < outcomes; ++o)
      f->sum[o] += f->r[i * outcomes + o];
    ++n;
  }
  return n;
}

static double value_of(const rim_ellipsoid *e, void *context) {
  finder *f = (finder *)context;
  const uint32_t n = sum_inside(f, e);
  return n < f->c.least ? 0.0 : rimi_stats_ln_anom_sums(f->sum, f->data->outcomes, n);
}

/* ---- the price of a region ---- */

static double base_price(const finder *f, const found *region) {
  return f->c.lambda + f->c.lambda_dim * (double)region->e.dims;
}

static double worth(const found *region) { return region->ln_anom - region->price; }

/* Their boxes meet in every feature that both have, and there is one (or one is everywhere). */
static bool touch(const found *a, const found *b) {
  bool shared = a->e.dims == 0 || b->e.dims == 0;
  for (size_t i = 0; i < a->e.dims; ++i) {
    for (size_t j = 0; j < b->e.dims; ++j) {
      if (a->feature[i] != b->feature[j])
        continue;
      shared = true;
      const double reach = rimi_ellipsoid_half_side(&a->e, i) + rimi_ellipsoid_half_side(&b->e, j);
      if (!(rimi_abs(a->e.center[i] - b->e.center[j]) <= reach))
        return false;
    }
  }
  return shared;
}

/* f->sum holds the candidate's sums: the same direction as region k's. */
static bool shifts_alike(const finder *f, uint32_t k) {
  const double *other = f->shift + (size_t)k * f->data->outcomes;
  double dot = 0.0;
  for (size_t o = 0; o < f->data->outcomes; ++o)
    dot += f->sum[o] * other[o];
  return dot > 0.0;
}

/* lambda(R) of a candidate beside the regions but number `self` (0: it is none of them). */
static double price_of(finder *f, const found *candidate, uint32_t self) {
  double most = 0.0;
  for (uint32_t k = 0; k < f->count; ++k) {
    const found *other = &f->region[k];
    if (k + 1 != self && other->ln_anom > candidate->ln_anom && touch(candidate, other) &&
        shifts_alike(f, k)) {
      most = rimi_max(most, other->ln_anom);
    }
  }
  return base_price(f, candidate) + f->c.border * most;
}

/* ---- one region ---- */

/* Climbs over the gathered observations. (Its configuration was looked at before the first.) */
static void climb(finder *f, found *region) {
  project(f, region);
  if (region->e.dims > 0)
    (void)rimi_cem_optimise(&f->c.cem, value_of, f, f->c.search.seed, f->optimisations++,
                            &region->e, &region->ln_anom);
  region->count = sum_inside(f, &region->e);
  region->ln_anom = region->count < f->c.least
                        ? 0.0
                        : rimi_stats_ln_anom_sums(f->sum, f->data->outcomes, region->count);
}

/* FS-RIM over the gathered observations, once for each number of dimensions, so that the simpler
 * region is at hand where more dimensions do not pay (rimi_select_batch returns the most anomalous
 * alone). *best keeps what it has where nothing is worth more. */
static rim_status search(finder *f, found *best) {
  const rim_batch_data data = {f->n, f->data->features, f->data->outcomes, f->u, f->r};
  if (f->n < f->c.least)
    return RIM_OK;
  const uint8_t most = f->c.search.max_dims;
  for (uint8_t dims = 1; dims <= most && dims <= f->data->features; ++dims) {
    rim_batch_config c = f->c.search;
    c.max_dims = dims;
    c.seed += UINT64_C(0x9e3779b97f4a7c15) * ++f->searches; /* 2^64 / golden ratio: far apart */
    if (dims == 1)
      c.nodes = (uint16_t)(c.nodes < 2 ? c.nodes : 2); /* the best single feature is the first */
    rim_batch_result result;
    rim_status status = rimi_select_batch(&c, &data, f->batch_work, f->batch_bytes, &result);
    if (status != RIM_OK)
      return status;
    f->evaluations += result.evaluations;
    found candidate;
    memset(&candidate, 0, sizeof candidate);
    candidate.e = result.ellipsoid;
    for (size_t k = 0; k < result.dims; ++k)
      candidate.feature[k] = result.feature[k];
    if (result.dims == 1) /* an interval's closed ends belong to it */
      candidate.e.factor[0] *= 1.0 + 0x1p-20;
    climb(f, &candidate);
    candidate.price = base_price(f, &candidate);
    if (worth(&candidate) > worth(best))
      *best = candidate;
  }
  return RIM_OK;
}

/* ---- the set ---- */

static void release(finder *f, uint32_t number) {
  for (size_t i = 0; i < f->data->n; ++i)
    f->owner[i] = f->owner[i] == number ? FREE : f->owner[i];
}

/* Whatever is free in a region becomes `owner`'s. */
static void claim(finder *f, const found *region, uint8_t owner) {
  const ellipsoid_test test = rimi_ellipsoid_test(&region->e, false);
  double x[MAX_DIMS];
  for (size_t i = 0; i < f->data->n; ++i) {
    for (size_t k = 0; k < region->e.dims; ++k)
      x[k] = f->data->u[i * f->data->features + region->feature[k]];
    if (f->owner[i] == FREE && rimi_ellipsoid_holds(&test, x))
      f->owner[i] = owner;
  }
}

/* Sums and value of region `number` over what it owns. */
static void account(finder *f, uint32_t number) {
  const size_t outcomes = f->data->outcomes;
  found *region = &f->region[number - 1];
  double *sum = f->shift + (size_t)(number - 1) * outcomes;
  memset(sum, 0, outcomes * sizeof(double));
  region->count = 0;
  for (size_t i = 0; i < f->data->n; ++i) {
    if (f->owner[i] != number)
      continue;
    ++region->count;
    for (size_t o = 0; o < outcomes; ++o)
      sum[o] += f->data->r[i * outcomes + o];
  }
  region->ln_anom =
      region->count < f->c.least ? 0.0 : rimi_stats_ln_anom_sums(sum, outcomes, region->count);
}

/* Adds regions while the rest holds one whose ln anom exceeds its price. */
static rim_status grow(finder *f) {
  found *best = &f->region[RIM_DMAPS_MAX_REGIONS];
  for (uint32_t attempt = 0; attempt < 2u * f->c.regions && f->count < f->c.regions; ++attempt) {
    gather(f, FREE, FREE);
    memset(best, 0, sizeof *best);
    const rim_status status = search(f, best);
    if (status != RIM_OK)
      return status;
    if (!(worth(best) > 0.0))
      return RIM_OK;
    project(f, best);
    (void)sum_inside(f, &best->e);
    best->price = price_of(f, best, 0);
    if (worth(best) < 0.0) { /* the border of another: out of the way of what else there is */
      claim(f, best, BORDER);
      continue;
    }
    claim(f, best, (uint8_t)(f->count + 1));
    f->region[f->count++] = *best;
    account(f, f->count);
  }
  return RIM_OK;
}

static void remove_region(finder *f, uint32_t number) {
  release(f, number);
  for (size_t i = 0; i < f->data->n; ++i) {
    if (f->owner[i] > number && f->owner[i] <= f->count)
      --f->owner[i];
  }
  const size_t outcomes = f->data->outcomes;
  for (uint32_t k = number; k < f->count; ++k) {
    f->region[k - 1] = f->region[k];
    memcpy(f->shift + (k - 1) * outcomes, f->shift + k * outcomes, outcomes * sizeof(double));
  }
  --f->count;
}

/* Descending order by ln anom (Alg. 3, line 3); everybody keeps what he owns. */
static void sort(finder *f) {
  uint8_t number[256]; /* new owner for old */
  for (uint32_t k = 0; k < 256; ++k)
    number[k] = (uint8_t)k;
  found *spare = &f->region[RIM_DMAPS_MAX_REGIONS];
  for (uint32_t i = 1; i < f->count; ++i) {
    for (uint32_t j = i; j > 0 && f->region[j].ln_anom > f->region[j - 1].ln_anom; --j) {
      *spare = f->region[j];
      f->region[j] = f->region[j - 1];
      f->region[j - 1] = *spare;
      for (uint32_t k = 1; k <= f->count; ++k)
        number[k] = (uint8_t)(number[k] == j + 1 ? j : number[k] == j ? j + 1 : number[k]);
    }
  }
  for (size_t i = 0; i < f->data->n; ++i)
    f->owner[i] = number[f->owner[i]];
  for (uint32_t k = 1; k <= f->count; ++k)
    account(f, k);
}

/* Lines 7-13 of Alg. 3: each region again on what the others leave; false where none changed. With
 * `search_again` a fresh search as well, since the first were found before the others were out of
 * the way. */
static rim_status sweep(finder *f, bool search_again, bool *changed) {
  found *best = &f->region[RIM_DMAPS_MAX_REGIONS];
  sort(f);
  for (uint32_t number = 1; number <= f->count;) {
    found *region = &f->region[number - 1];
    gather(f, number, FREE);
    *best = *region;
    climb(f, best);
    best->price = base_price(f, best);
    const rim_status status = search_again && f->count > 1 ? search(f, best) : RIM_OK;
    if (status != RIM_OK)
      return status;
    *changed = *changed || memcmp(&best->e, &region->e, sizeof best->e) != 0;
    release(f, number);
    *region = *best;
    claim(f, region, (uint8_t)number);
    account(f, number);
    memcpy(f->sum, f->shift + (size_t)(number - 1) * f->data->outcomes,
           f->data->outcomes * sizeof(double));
    region->price = price_of(f, region, number);
    if (worth(region) >= 0.0) {
      ++number;
      continue;
    }
    remove_region(f, number);
    *changed = true;
  }
  return RIM_OK;
}

/* Sum over the observations of two regions of one feature less `a0`, or of its product with
 * another less `b0`. */
static double sum_over(const finder *f, uint32_t a, uint32_t b, uint16_t feature, double a0,
                       const uint16_t *other, double b0) {
  double sum = 0.0;
  for (size_t i = 0; i < f->data->n; ++i) {
    const double *x = f->data->u + i * f->data->features;
    if (f->owner[i] == a || f->owner[i] == b)
      sum += (x[feature] - a0) * (other != NULL ? x[*other] - b0 : 1.0);
  }
  return sum;
}

/* The ellipsoid over `like`'s features in which uniform points would have mean and covariance of
 * the observations of both, Sigma = A / (dims + 2); `like` itself where they have no extent. */
static void spanning(const finder *f, uint32_t a, uint32_t b, const found *like, found *both) {
  const uint32_t dims = like->e.dims;
  const double n = (double)(f->region[a - 1].count + f->region[b - 1].count);
  double factor[MAX_DIMS * (MAX_DIMS + 1) / 2] = {0.0};
  *both = *like;
  for (uint32_t k = 0; k < dims; ++k)
    both->e.center[k] = sum_over(f, a, b, like->feature[k], 0.0, NULL, 0.0) / n;
  for (uint32_t k = 0; k < dims; ++k) {
    for (uint32_t j = 0; j <= k; ++j) {
      const double sum = sum_over(f, a, b, like->feature[k], both->e.center[k], &like->feature[j],
                                  both->e.center[j]);
      factor[packed_row(k) + j] = sum * ((double)dims + 2.0) / n;
    }
  }
  if (cholesky_factor(dims, factor))
    memcpy(both->e.factor, factor, sizeof factor);
  else
    *both = *like;
}

/* One region in place of two that touch, where it is worth as much: the simpler hypothesis. */
static bool try_merge(finder *f, uint32_t a, uint32_t b) {
  found *best = &f->region[RIM_DMAPS_MAX_REGIONS];
  found start[2];
  gather(f, a, b);
  memset(best, 0, sizeof *best);
  spanning(f, a, b, &f->region[a - 1], &start[0]);
  spanning(f, a, b, &f->region[b - 1], &start[1]);
  for (size_t k = 0; k < 2; ++k) {
    climb(f, &start[k]);
    start[k].price = base_price(f, &start[k]);
    if (k == 0 || worth(&start[k]) > worth(best))
      *best = start[k];
  }
  if (!(worth(best) >= worth(&f->region[a - 1]) + worth(&f->region[b - 1])))
    return false;
  release(f, a);
  release(f, b);
  f->region[a - 1] = *best;
  claim(f, best, (uint8_t)a);
  account(f, a);
  remove_region(f, b);
  return true;
}

static void merge(finder *f, bool *changed) {
  for (uint32_t a = 1; a <= f->count; ++a) {
    for (uint32_t b = a + 1; b <= f->count;) {
      const bool merged = touch(&f->region[a - 1], &f->region[b - 1]) && try_merge(f, a, b);
      *changed = *changed || merged;
      b += merged ? 0 : 1;
    }
  }
}

static void unmark_border(finder *f) { release(f, BORDER); }

static rim_status find(finder *f) {
  rim_status status = grow(f);
  for (uint32_t s = 0; status == RIM_OK && s < f->c.sweeps && f->count > 0; ++s) {
    bool changed = false;
    unmark_border(f);
    merge(f, &changed);
    status = sweep(f, s == 0, &changed);
    if (status == RIM_OK && changed)
      status = grow(f);
    if (!changed)
      break;
  }
  return status;
}

/* Whose an observation is follows from the regions alone: the first that contains it. Returns what
 * they are worth so. */
static double claim_in_order(finder *f) {
  double value = 0.0;
  for (size_t i = 0; i < f->data->n; ++i)
    f->owner[i] = f->owner[i] == SKIPPED ? SKIPPED : FREE;
  for (uint32_t k = 1; k <= f->count; ++k) {
    claim(f, &f->region[k - 1], (uint8_t)k);
    account(f, k);
    value += f->region[k - 1].ln_anom;
  }
  return value;
}

static bool in_order(const finder *f) {
  for (uint32_t k = 1; k < f->count; ++k) {
    if (f->region[k].ln_anom > f->region[k - 1].ln_anom)
      return false;
  }
  return true;
}

/* Most anomalous first, as long as that is worth more: where two overlap, the first may lose by
 * having the overlap, and they would change places for ever. */
static void order(finder *f) {
  found *saved = f->region + RIM_DMAPS_MAX_REGIONS + 1;
  sort(f);
  double value = claim_in_order(f);
  for (uint32_t k = 0; k < RIM_DMAPS_MAX_REGIONS && !in_order(f); ++k) {
    memcpy(saved, f->region, RIM_DMAPS_MAX_REGIONS * sizeof *saved);
    sort(f);
    const double sorted = claim_in_order(f);
    if (!(sorted > value)) {
      memcpy(f->region, saved, RIM_DMAPS_MAX_REGIONS * sizeof *saved);
      (void)claim_in_order(f);
      return;
    }
    value = sorted;
  }
}

/* The least anomalous region whose ln anom is below its price; 0: none is. */
static uint32_t too_dear(finder *f) {
  for (uint32_t k = f->count; k > 0; --k) {
    found *region = &f->region[k - 1];
    memcpy(f->sum, f->shift + (size_t)(k - 1) * f->data->outcomes,
           f->data->outcomes * sizeof(double));
    region->price = price_of(f, region, k);
    if (worth(region) < 0.0)
      return k;
  }
  return 0;
}

static void settle(finder *f) {
  for (uint32_t removed = 0; removed <= RIM_DMAPS_MAX_REGIONS; ++removed) {
    order(f);
    const uint32_t number = too_dear(f);
    if (number == 0)
      return;
    remove_region(f, number);
  }
}

static rim_status to_region(const found *from, rim_dmaps_region *to) {
  memset(to, 0, sizeof *to);
  to->ln_anom = from->ln_anom;
  to->price = from->price;
  to->count = from->count;
  return from->e.dims == 0 ? RIM_OK : rimi_ellipsoid_region(&from->e, from->feature, &to->region);
}

static rim_status report(finder *f, rim_dmaps_result *result) {
  rim_dmaps_region region[RIM_DMAPS_MAX_REGIONS];
  memset(region, 0, sizeof region);
  double value = 0.0;
  for (uint32_t k = 0; k < f->count; ++k) {
    const rim_status status = to_region(&f->region[k], &region[k]);
    if (status != RIM_OK)
      return status;
    value += worth(&f->region[k]);
  }
  memset(result, 0, sizeof *result);
  memcpy(result->region, region, f->count * sizeof *region);
  result->count = (uint8_t)f->count;
  result->value = value;
  result->searches = f->searches;
  result->evaluations = f->evaluations;
  return RIM_OK;
}

/* ---- set up ---- */

static rim_dmaps_config filled(const rim_dmaps_config *config) {
  rim_dmaps_config c = *config;
  RIM_OR_DEFAULT(c.regions, RIM_DMAPS_MAX_REGIONS);
  RIM_OR_DEFAULT(c.sweeps, 2);
  RIM_OR_DEFAULT(c.least, 8);
  RIM_OR_DEFAULT(c.lambda, 14.0);
  RIM_OR_DEFAULT(c.lambda_dim, 2.0);
  RIM_OR_DEFAULT(c.border, 0.1);
  RIM_OR_DEFAULT(c.search.nodes, DEFAULT_NODES);
  RIM_OR_DEFAULT(c.search.max_dims, 2);
  if (c.search.cem.samples == 0 && c.search.cem.elites == 0 && c.search.cem.iterations == 0) {
    c.search.cem.samples = 16;
    c.search.cem.elites = 4;
    c.search.cem.iterations = 5;
  }
  c.search.threshold = 0.0;
  return c;
}

static bool is_price(double x) { return x >= 0.0 && rimi_is_finite(x); }

static bool is_valid(const rim_dmaps_config *c, const rim_batch_data *data) {
  return data->features >= 1 && data->features <= MOST && data->outcomes >= 1 &&
         data->outcomes <= MOST && c->regions <= RIM_DMAPS_MAX_REGIONS && c->sweeps <= MAX_SWEEPS &&
         c->search.max_dims <= MAX_DIMS && c->search.nodes <= RIM_BATCH_MAX_NODES &&
         c->search.heuristic != RIM_HEURISTIC_NONE && is_price(c->lambda) &&
         is_price(c->lambda_dim) && is_price(c->border) && c->border <= 1.0 &&
         rimi_cem_is_valid(&c->cem, 1) && rimi_cem_is_valid(&c->search.cem, 1);
}

/* Lays the work space out. */
static rim_status begin(finder *f, const rim_dmaps_config *config, const rim_batch_data *data,
                        const uint8_t *skip, void *work, size_t bytes) {
  if (config == NULL || data == NULL || work == NULL || data->u == NULL || data->r == NULL)
    return RIM_E_ARGUMENT;
  if ((uintptr_t)work % 8u != 0)
    return RIM_E_ALIGN;
  memset(f, 0, sizeof *f);
  f->c = filled(config);
  f->data = data;
  if (!is_valid(&f->c, data))
    return RIM_E_CONFIG;
  if (data->n == 0)
    return RIM_E_DATA;
  const size_t n = data->n;
  if (!rimi_batch_fits(data, f->c.search.nodes) ||
      bytes < RIM_DMAPS_SIZE(n, data->features, data->outcomes, f->c.search.nodes))
    return RIM_E_SIZE;
  uint8_t *at = (uint8_t *)work;
  f->batch_work = at;
  f->batch_bytes = RIM_BATCH_SIZE(n, data->features, f->c.search.nodes);
  at += f->batch_bytes;
  f->region = (found *)(void *)at;
  at += 8192u;
  f->u = (double *)(void *)at;
  f->r = f->u + n * data->features;
  f->x = f->r + n * data->outcomes;
  f->sum = f->x + n * MAX_DIMS;
  f->shift = f->sum + data->outcomes;
  f->owner = (uint8_t *)(f->shift + (RIM_DMAPS_MAX_REGIONS + 1u) * (size_t)data->outcomes);
  for (size_t i = 0; i < n; ++i)
    f->owner[i] = skip != NULL && skip[i] != 0 ? SKIPPED : FREE;
  return RIM_OK;
}

_Static_assert(sizeof(found) * (2u * RIM_DMAPS_MAX_REGIONS + 1u) <= 8192u, "the regions must fit");
_Static_assert(sizeof(found) % 8u == 0, "what follows must be aligned");

rim_status rimi_dmaps_find(const rim_dmaps_config *config, const rim_batch_data *data,
                           const uint8_t *skip, void *work, size_t bytes,
                           rim_dmaps_result *result) {
  finder f;
  if (result == NULL)
    return RIM_E_ARGUMENT;
  rim_status status = begin(&f, config, data, skip, work, bytes);
  if (status == RIM_OK)
    status = find(&f);
  if (status != RIM_OK)
    return status;
  settle(&f);
  return report(&f, result);
}

rim_status rimi_dmaps_assign(const rim_dmaps_result *result, const rim_batch_data *data,
                             const uint8_t *skip, uint8_t *assignment) {
  if (result == NULL || data == NULL || data->u == NULL || assignment == NULL)
    return RIM_E_ARGUMENT;
  for (uint32_t k = 0; k < result->count; ++k) {
    if (!rimi_region_names_features(&result->region[k].region.unit, data->features))
      return RIM_E_RANGE;
  }
  for (size_t i = 0; i < data->n; ++i) {
    uint8_t number = 0;
    for (uint8_t k = 0; k < result->count && number == 0; ++k) {
      if (rimi_unit_region_contains(&result->region[k].region, data->u + i * data->features))
        number = (uint8_t)(k + 1);
    }
    assignment[i] = skip != NULL && skip[i] != 0 ? 0 : number;
  }
  return RIM_OK;
}

rim_status rimi_dmaps_shift(const rim_batch_data *data, const uint8_t *assignment, uint8_t number,
                            double *shift) {
  if (data == NULL || data->r == NULL || assignment == NULL || number == 0 || shift == NULL)
    return RIM_E_ARGUMENT;
  double n = 0.0;
  for (size_t o = 0; o < data->outcomes; ++o)
    shift[o] = 0.0;
  for (size_t i = 0; i < data->n; ++i) {
    if (assignment[i] != number)
      continue;
    n += 1.0;
    for (size_t o = 0; o < data->outcomes; ++o)
      shift[o] += data->r[i * data->outcomes + o];
  }
  for (size_t o = 0; o < data->outcomes && n > 0.0; ++o)
    shift[o] /= n;
  return RIM_OK;
}
