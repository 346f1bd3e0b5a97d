/* SPDX-License-Identifier: MIT */
#include "rim/plan/extent.h"

#include <string.h>

#include "base/real.h"
#include "base/rng.h"
#include "base/usable.h"
#include "search/cem.h"

#define LEAST_VAR 1e-100
#define LARGEST_VAR 1e100
#define LARGEST_LAMBDA 500.0
#define NOT_A_REGION (-1e4) /* value of an ellipsoid that holds too little; far below any other */
#define STUCK 10.0          /* nats by which a chain is left behind */
#define LARGEST_STEP 0.3    /* of a chain, as a fraction of the box */

enum { CANDIDATES = 8, KINDS = 3 };

struct rim_extent {
  rim_extent_config config;
  rim_extent_counters counters;
  uint32_t n;    /* observations held */
  uint32_t next; /* slot the next one takes */
  uint32_t turn; /* slices done; wraps */
};

_Static_assert(sizeof(struct rim_extent) <= RIM_EXTENT_HEADER_BYTES, "header");
/* One region of the set, as rim_extent_region. */
typedef struct held_region {
  rim_ellipsoid ellipsoid;
  double lambda, volume, n, ln_anom, shift, shift_var, confidence;
} held_region;

_Static_assert(sizeof(held_region) <= RIM_EXTENT_REGION_BYTES, "region");
_Static_assert(RIM_EXTENT_HEADER_BYTES % 8 == 0 && RIM_EXTENT_REGION_BYTES % 8 == 0, "alignment");

typedef struct arrays {
  double *u;    /* [points][dims] contexts as fractions of the box */
  double *dz;   /* [points] */
  double *w;    /* [points] 1 / var */
  double *left; /* [points] dz less what the RIMs before the one in hand explain */
  uint8_t *regions;
} arrays;

static arrays arrays_of(const rim_extent *e) {
  const size_t points = e->config.points;
  arrays a;
  a.u = (double *)(void *)((uint8_t *)(uintptr_t)e + RIM_EXTENT_HEADER_BYTES);
  a.dz = a.u + points * e->config.dims;
  a.w = a.dz + points;
  a.left = a.w + points;
  a.regions = (uint8_t *)(a.left + points);
  return a;
}

static held_region *region_of(const rim_extent *e, uint32_t rim, uint32_t lambda) {
  const size_t index = (size_t)rim * e->config.lambdas + lambda;
  return (held_region *)(void *)(arrays_of(e).regions + index * RIM_EXTENT_REGION_BYTES);
}

static bool is_zero(double v) { return v >= 0.0 && v <= 0.0; }

static void fill_defaults(rim_extent_config *c) {
  RIM_OR_DEFAULT(c->lambdas, RIM_EXTENT_DEFAULT_LAMBDAS);
  RIM_OR_DEFAULT(c->rims, 1);
  RIM_OR_DEFAULT(c->samples, 24);
  RIM_OR_DEFAULT(c->iterations, 8);
  RIM_OR_DEFAULT(c->temper, 0.2);
  RIM_OR_DEFAULT(c->min_points, 3.0);
  RIM_OR_DEFAULT(c->threshold, RIM_EXTENT_DEFAULT_THRESHOLD);
  if (is_zero(c->lambda_min) && is_zero(c->lambda_max)) {
    c->lambda_min = -RIM_EXTENT_DEFAULT_LAMBDA;
    c->lambda_max = RIM_EXTENT_DEFAULT_LAMBDA;
  }
  for (size_t d = 0; d < RIM_EXTENT_MAX_DIMS; ++d) {
    RIM_OR_DEFAULT(c->least_axis[d], 0.04);
    RIM_OR_DEFAULT(c->most_axis[d], 0.6);
    if (is_zero(c->lower[d]) && is_zero(c->upper[d]))
      c->upper[d] = 1.0;
  }
}

static bool counts_fit(const rim_extent_config *c) {
  return c->dims >= 1 && c->dims <= RIM_EXTENT_MAX_DIMS && c->points >= 8 &&
         c->points <= RIM_EXTENT_MAX_POINTS && c->lambdas <= RIM_EXTENT_MAX_LAMBDAS &&
         c->rims <= RIM_EXTENT_MAX_RIMS && c->set <= RIM_EXTENT_SAMPLED &&
         c->shape <= RIM_EXTENT_BOX && c->knots <= RIM_EXTENT_MAX_KNOTS && c->knots != 1 &&
         c->samples >= 2 && c->samples <= 64 && c->iterations <= 64;
}

static rim_status check(const rim_extent_config *c) {
  if (!counts_fit(c))
    return RIM_E_CONFIG;
  bool usable = is_usable(c->lambda_min) && is_usable(c->lambda_max) && is_usable(c->temper) &&
                is_usable(c->min_points) && is_usable(c->threshold);
  bool fits = c->lambda_min <= c->lambda_max && c->temper > 0.0 && c->temper <= 1.0 &&
              c->min_points >= 1.0 && c->lambda_min >= -LARGEST_LAMBDA &&
              c->lambda_max <= LARGEST_LAMBDA;
  for (size_t d = 0; d < c->dims; ++d) {
    usable = usable && is_usable(c->lower[d]) && is_usable(c->upper[d]) &&
             is_usable(c->least_axis[d]) && is_usable(c->most_axis[d]);
    fits = fits && c->lower[d] < c->upper[d] && c->least_axis[d] > 0.0 &&
           c->least_axis[d] < c->most_axis[d] && c->most_axis[d] <= 2.0;
  }
  for (size_t k = 0; k < c->knots; ++k) {
    usable = usable && is_usable(c->ln_anom[k]) && is_usable(c->confidence[k]);
    fits = fits && c->confidence[k] >= 0.0 && c->confidence[k] <= 1.0;
    if (k > 0) {
      fits = fits && c->ln_anom[k] > c->ln_anom[k - 1] && c->confidence[k] >= c->confidence[k - 1];
    }
  }
  if (!usable)
    return RIM_E_RANGE;
  return fits ? RIM_OK : RIM_E_CONFIG;
}

rim_status rim_extent_init(rim_extent **extent, void *memory, size_t bytes,
                           const rim_extent_config *config) {
  if (extent == NULL || memory == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  rim_extent_config c = *config;
  fill_defaults(&c);
  const rim_status status = check(&c);
  if (status != RIM_OK)
    return status;
  const size_t needed = RIM_EXTENT_SIZE(c.dims, c.points, c.lambdas, c.rims);
  if (bytes < needed)
    return RIM_E_SIZE;
  memset(memory, 0, needed);
  *extent = memory;
  (*extent)->config = c;
  rim_extent_reset(*extent);
  return RIM_OK;
}

void rim_extent_reset(rim_extent *extent) {
  const rim_extent_config *c = &extent->config;
  memset(&extent->counters, 0, sizeof extent->counters);
  extent->n = extent->next = extent->turn = 0;
  const double steps = c->lambdas > 1 ? (double)(c->lambdas - 1) : 1.0;
  for (uint32_t rim = 0; rim < c->rims; ++rim) {
    for (uint32_t i = 0; i < c->lambdas; ++i) { /* eq. 5.4 */
      held_region *region = region_of(extent, rim, i);
      memset(region, 0, sizeof *region);
      region->lambda = c->lambda_min + (c->lambda_max - c->lambda_min) * ((double)i / steps);
    }
  }
}

uint32_t rim_extent_points(const rim_extent *extent) { return extent->n; }
uint32_t rim_extent_rims(const rim_extent *extent) { return extent->config.rims; }
uint32_t rim_extent_lambdas(const rim_extent *extent) { return extent->config.lambdas; }
rim_extent_config rim_extent_get_config(const rim_extent *extent) { return extent->config; }
rim_extent_counters rim_extent_get_counters(const rim_extent *extent) { return extent->counters; }

double rim_extent_confidence(const rim_extent *extent, double ln_anom) {
  const rim_extent_config *c = &extent->config;
  if (c->knots == 0)
    return 1.0 / (1.0 + rimi_exp(c->threshold - ln_anom));
  if (!(ln_anom > c->ln_anom[0]))
    return c->confidence[0];
  for (size_t k = 1; k < c->knots; ++k) {
    if (ln_anom < c->ln_anom[k]) {
      const double part = (ln_anom - c->ln_anom[k - 1]) / (c->ln_anom[k] - c->ln_anom[k - 1]);
      return c->confidence[k - 1] + part * (c->confidence[k] - c->confidence[k - 1]);
    }
  }
  return c->confidence[c->knots - 1];
}

/* Volume of the unit ball or cube times the product of the diagonal of L. */
static double volume_of(const rim_extent *e, const rim_ellipsoid *ellipsoid) {
  static const double ball[RIM_EXTENT_MAX_DIMS + 1] = {1.0, 2.0, RIM_PI, 4.0 / 3.0 * RIM_PI,
                                                       0.5 * RIM_PI * RIM_PI};
  const bool box = e->config.shape == RIM_EXTENT_BOX;
  double volume = box ? (double)(1u << ellipsoid->dims) : ball[ellipsoid->dims];
  for (size_t d = 0; d < ellipsoid->dims; ++d)
    volume *= ellipsoid->factor[d * (d + 3) / 2];
  return rimi_min(volume, 1.0);
}

typedef struct sums {
  double n, s, w, var;
} sums;

static ellipsoid_test test_of(const rim_extent *e, const rim_ellipsoid *ellipsoid) {
  return rimi_ellipsoid_test(ellipsoid, e->config.shape == RIM_EXTENT_BOX);
}

static sums sums_inside(const rim_extent *e, const rim_ellipsoid *ellipsoid) {
  const arrays a = arrays_of(e);
  const ellipsoid_test m = test_of(e, ellipsoid);
  sums t = {0.0, 0.0, 0.0, 0.0};
  for (uint32_t i = 0; i < e->n; ++i) {
    if (!rimi_ellipsoid_holds(&m, a.u + (size_t)i * e->config.dims))
      continue;
    t.n += 1.0;
    t.s += a.left[i] * a.w[i];
    t.w += a.w[i];
    t.var += 1.0 / a.w[i];
  }
  return t;
}

typedef struct goal {
  const rim_extent *extent;
  double lambda;
} goal;

/* anom+ (eq. 5.3); where an ellipsoid does not qualify, how far it is from it. */
static double anom_plus(const rim_ellipsoid *ellipsoid, void *context) {
  const goal *g = context;
  const rim_extent_config *c = &g->extent->config;
  double outside = 0.0;
  for (size_t d = 0; d < c->dims; ++d) {
    outside += rimi_max(-ellipsoid->center[d], 0.0) + rimi_max(ellipsoid->center[d] - 1.0, 0.0);
  }
  if (outside > 0.0)
    return 2.0 * NOT_A_REGION - rimi_min(outside, 1e6);
  const sums t = sums_inside(g->extent, ellipsoid);
  if (!(t.n >= c->min_points))
    return NOT_A_REGION + t.n;
  return 0.5 * t.s * t.s / t.w + g->lambda * volume_of(g->extent, ellipsoid);
}

/* Fills in what the ellipsoid now holds: eq. 3.6, 3.7, 5.7. */
static void evaluate(const rim_extent *e, held_region *region) {
  const sums t = sums_inside(e, &region->ellipsoid);
  region->volume = volume_of(e, &region->ellipsoid);
  region->n = t.n;
  region->ln_anom = region->shift = region->shift_var = region->confidence = 0.0;
  if (!(t.n >= e->config.min_points))
    return;
  const arrays a = arrays_of(e);
  const ellipsoid_test m = test_of(e, &region->ellipsoid);
  const double shift = t.s / t.w;
  double square = 0.0;
  for (uint32_t i = 0; i < e->n; ++i) {
    if (!rimi_ellipsoid_holds(&m, a.u + (size_t)i * e->config.dims))
      continue;
    square += (a.left[i] - shift) * (a.left[i] - shift);
  }
  region->ln_anom = 0.5 * t.s * t.s / t.w;
  region->shift = shift;
  region->shift_var = (square + t.var / t.n) / (t.n * t.n);
  region->confidence = rim_extent_confidence(e, region->ln_anom);
}

static bool is_region(const held_region *region) { return region->ellipsoid.dims > 0; }

/* A RIM at u, a context as fractions of the box (eq. 5.6, 5.8). */
static rim_extent_local local_at(const rim_extent *e, uint32_t rim, const double *u) {
  rim_extent_local out = {0.0, 0.0, 0.0, 0.0};
  double all = 0.0, inside = 0.0, shift = 0.0, var = 0.0;
  for (uint32_t i = 0; i < e->config.lambdas; ++i) {
    const held_region *region = region_of(e, rim, i);
    if (!(region->ln_anom > 0.0))
      continue;
    out.existence = rimi_max(region->confidence, out.existence);
    const double weight = region->confidence;
    all += weight;
    const ellipsoid_test m = test_of(e, &region->ellipsoid);
    if (!rimi_ellipsoid_holds(&m, u))
      continue;
    inside += weight;
    shift += weight * region->shift;
    var += weight * region->shift_var;
  }
  if (inside > 0.0) {
    out.member = inside / all;
    out.shift = shift / inside;
    out.shift_var = var / inside;
  }
  return out;
}

static rim_extent_mixture mixture_at(const rim_extent *e, uint32_t rims, const double *u,
                                     double mean, double var) {
  rim_extent_mixture out;
  memset(&out, 0, sizeof out);
  out.components = 1 + rims;
  double left = 1.0;
  for (uint32_t rim = 0; rim < rims; ++rim) {
    const rim_extent_local local = local_at(e, rim, u);
    const double weight = left * (local.existence * local.member);
    out.weight[1 + rim] = weight;
    out.mean[1 + rim] = mean + local.shift;
    out.var[1 + rim] = var + local.shift_var;
    left -= weight;
  }
  out.weight[0] = left;
  out.mean[0] = mean;
  out.var[0] = var;
  return out;
}

/* Of a mixture about 0. */
static double correction_of(const rim_extent_mixture *mixture) {
  double sum = 0.0;
  for (uint32_t i = 1; i < mixture->components; ++i)
    sum += mixture->weight[i] * mixture->mean[i];
  return sum;
}

/* What the RIMs before this one leave unexplained. */
static void prepare(const rim_extent *e, uint32_t rim) {
  const arrays a = arrays_of(e);
  for (uint32_t i = 0; i < e->n; ++i) {
    a.left[i] = a.dz[i];
    if (rim > 0) {
      const rim_extent_mixture before =
          mixture_at(e, rim, a.u + (size_t)i * e->config.dims, 0.0, 0.0);
      a.left[i] -= correction_of(&before);
    }
  }
}

/* From one RIM on: those after it see what it leaves. */
static void evaluate_from(const rim_extent *e, uint32_t first) {
  for (uint32_t rim = first; rim < e->config.rims; ++rim) {
    prepare(e, rim);
    for (uint32_t i = 0; i < e->config.lambdas; ++i) {
      held_region *region = region_of(e, rim, i);
      if (is_region(region))
        evaluate(e, region);
    }
  }
}

/* u := x as fractions of the box; false where x is not usable. */
static bool to_unit(const rim_extent_config *c, const double *x, double *u) {
  for (size_t d = 0; d < c->dims; ++d) {
    if (!is_usable(x[d]))
      return false;
    u[d] = (x[d] - c->lower[d]) / (c->upper[d] - c->lower[d]);
    if (!is_usable(u[d]))
      return false;
  }
  return true;
}

rim_status rim_extent_add(rim_extent *extent, const double *x, double dz, double var) {
  if (extent == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  const rim_extent_config *c = &extent->config;
  double u[RIM_EXTENT_MAX_DIMS];
  if (!to_unit(c, x, u) || !is_usable(dz) || !(var >= LEAST_VAR && var <= LARGEST_VAR)) {
    count(&extent->counters.refused);
    return RIM_E_DATA;
  }
  const arrays a = arrays_of(extent);
  const uint32_t slot = extent->next;
  memcpy(a.u + (size_t)slot * c->dims, u, c->dims * sizeof *u);
  a.dz[slot] = dz;
  a.w[slot] = 1.0 / var;
  extent->next = slot + 1 < c->points ? slot + 1 : 0;
  count(&extent->counters.added);
  if (extent->n < c->points) {
    ++extent->n;
  } else {
    count(&extent->counters.replaced);
  }
  evaluate_from(extent, 0);
  return RIM_OK;
}

static double value_of(const held_region *region, double lambda) {
  return region->ln_anom > 0.0 ? region->ln_anom + lambda * region->volume : NOT_A_REGION;
}

/* Takes over what another lambda found, where it is better by this one's measure. */
static void adopt(const rim_extent *e, uint32_t rim, held_region *region) {
  for (uint32_t i = 0; i < e->config.lambdas; ++i) {
    const held_region *other = region_of(e, rim, i);
    if (other == region || !(value_of(other, region->lambda) > value_of(region, region->lambda))) {
      continue;
    }
    const double lambda = region->lambda;
    *region = *other;
    region->lambda = lambda;
  }
}

/* An ellipsoid about the most deviating of a few observations drawn at random. */
static rim_ellipsoid seed_about(const rim_extent *e, rim_rng *rng) {
  const rim_extent_config *c = &e->config;
  const arrays a = arrays_of(e);
  uint32_t best = 0;
  double most = -1.0;
  for (int k = 0; k < CANDIDATES; ++k) {
    const uint32_t i = rimi_rng_below(rng, e->n);
    const double deviance = a.left[i] * a.left[i] * a.w[i];
    if (deviance > most) {
      most = deviance;
      best = i;
    }
  }
  double center[RIM_EXTENT_MAX_DIMS];
  for (size_t d = 0; d < c->dims; ++d) {
    center[d] = rimi_clamp(a.u[(size_t)best * c->dims + d], 0.0, 1.0);
  }
  rim_ellipsoid start = rimi_ellipsoid_ball(c->dims, center, 1.0);
  const double part = 0.05 + 0.45 * rimi_rng_uniform(rng);
  for (size_t d = 0; d < c->dims; ++d)
    start.factor[d * (d + 3) / 2] = c->least_axis[d] + (c->most_axis[d] - c->least_axis[d]) * part;
  return start;
}

/* One step from an ellipsoid, in all of its parameters or in one: of any size from a fiftieth of it
 * to the whole, for what is left to gain may be an edge or the region. */
static rim_ellipsoid stepped(const rim_extent_config *c, const rim_ellipsoid *from, rim_rng *rng) {
  rim_ellipsoid next = *from;
  const double size = rimi_exp(-4.0 * rimi_rng_uniform(rng));
  const bool all = rimi_rng_below(rng, 2) == 0;
  const uint32_t only = rimi_rng_below(rng, RIM_CEM_PARAMETERS((uint32_t)c->dims));
  uint32_t p = 0;
  for (size_t i = 0; i < c->dims; ++i, ++p) {
    if (all || p == only)
      next.center[i] += size * from->factor[i * (i + 3) / 2] * rimi_rng_normal(rng);
  }
  for (size_t i = 0; i < c->dims; ++i) {
    for (size_t j = 0; j <= i; ++j, ++p) {
      if (!all && p != only)
        continue;
      double *entry = &next.factor[i * (i + 1) / 2 + j];
      const double step = size * rimi_rng_normal(rng);
      if (i == j)
        *entry = rimi_clamp(*entry * rimi_exp(rimi_clamp(step, -4.0, 4.0)), c->least_axis[i],
                            c->most_axis[i]);
      else
        *entry += step * from->factor[i * (i + 3) / 2];
    }
  }
  return next;
}

/* Takes over what another chain drawn at random stands on, where this one is stuck. */
static void join(const rim_extent *e, uint32_t rim, held_region *region, rim_rng *rng) {
  const held_region *other = region_of(e, rim, rimi_rng_below(rng, e->config.lambdas));
  const double lambda = region->lambda;
  if (!(value_of(other, lambda) > value_of(region, lambda) + STUCK))
    return;
  *region = *other;
  region->lambda = lambda;
}

/* A step of a chain, as probable as the one back: in one parameter or in all, of any size. */
static rim_ellipsoid proposed(const rim_extent_config *c, const rim_ellipsoid *from, rim_rng *rng) {
  rim_ellipsoid next = *from;
  const uint32_t dims = c->dims, parameters = RIM_CEM_PARAMETERS(dims);
  const double size = LARGEST_STEP * rimi_exp(-5.0 * rimi_rng_uniform(rng));
  const uint32_t only = rimi_rng_below(rng, parameters + 2); /* beyond the last: all */
  for (uint32_t p = 0; p < parameters; ++p) {
    if (p == only || only >= parameters)
      *(p < dims ? &next.center[p] : &next.factor[p - dims]) += size * rimi_rng_normal(rng);
  }
  return next;
}

/* Whether the prior over regions allows it; anom_plus looks at the centre. */
static bool is_possible(const rim_extent_config *c, const rim_ellipsoid *region) {
  for (size_t i = 0, p = 0; i < c->dims; ++i) {
    for (size_t j = 0; j <= i; ++j, ++p) {
      const double entry = region->factor[p];
      if (rimi_abs(entry) > c->most_axis[i] || (i == j && entry < c->least_axis[i]))
        return false;
    }
  }
  return true;
}

/* Goes on from *at by small steps and returns the value where it ends. By volume those are kept
 * where anom+ does not fall: it climbs, and wanders over plateaus; sampled it is Metropolis on
 * temper * anom+. */
static double walk(goal *g, rim_rng *rng, rim_ellipsoid *at) {
  const rim_extent_config *c = &g->extent->config;
  const bool is_sampled = c->set == RIM_EXTENT_SAMPLED;
  double value = anom_plus(at, g);
  for (uint32_t k = (uint32_t)c->samples * c->iterations; k > 0; --k) {
    const rim_ellipsoid next = is_sampled ? proposed(c, at, rng) : stepped(c, at, rng);
    if (is_sampled && !is_possible(c, &next))
      continue;
    const double v = anom_plus(&next, g);
    if (v >= value || (is_sampled && rimi_rng_uniform(rng) < rimi_exp(c->temper * (v - value)))) {
      value = v;
      *at = next;
    }
  }
  return value;
}

/* By search/cem.h from *best, which then keeps the bounds of each dimension. */
static double found_anew(goal *g, rim_ellipsoid *best) {
  const rim_extent_config *c = &g->extent->config;
  rim_cem_config cem = {.samples = c->samples,
                        .iterations = c->iterations,
                        .least_axis = c->least_axis[0],
                        .most_axis = c->most_axis[0]};
  for (size_t d = 1; d < c->dims; ++d) {
    cem.least_axis = rimi_min(cem.least_axis, c->least_axis[d]);
    cem.most_axis = rimi_max(cem.most_axis, c->most_axis[d]);
  }
  double value = 0.0;
  (void)rimi_cem_optimise(&cem, anom_plus, g, c->seed, g->extent->turn, best, &value);
  for (size_t i = 0; i < c->dims; ++i) {
    double *row = &best->factor[i * (i + 1) / 2];
    row[i] = rimi_clamp(row[i], c->least_axis[i], c->most_axis[i]);
    for (size_t j = 0; j < i && c->set == RIM_EXTENT_SAMPLED; ++j) /* else no chain could leave */
      row[j] = rimi_clamp(row[j], -c->most_axis[i], c->most_axis[i]);
  }
  return anom_plus(best, g);
}

static void climb(rim_extent *e, uint32_t rim, uint32_t lambda, uint32_t kind) {
  const rim_extent_config *c = &e->config;
  held_region *region = region_of(e, rim, lambda);
  const bool is_sampled = c->set == RIM_EXTENT_SAMPLED;
  rim_rng rng;
  rimi_rng_seed(&rng, c->seed, UINT64_C(0x100000000) + e->turn);
  if (is_sampled)
    join(e, rim, region, &rng);
  else
    adopt(e, rim, region);
  const bool again = kind > 0 && is_region(region);
  rim_ellipsoid best = again ? region->ellipsoid : seed_about(e, &rng);
  goal g = {e, region->lambda};
  const double value = again ? walk(&g, &rng, &best) : found_anew(&g, &best);
  double least = value_of(region, region->lambda);
  if (is_sampled) /* a step is taken, better or not; a leap only to what is much better */
    least = again ? -LARGEST_VALUE : least + STUCK;
  if (value > least) {
    held_region found = {.ellipsoid = best, .lambda = region->lambda};
    evaluate(e, &found);
    if (found.ln_anom > 0.0)
      *region = found;
  }
}

void rim_extent_search(rim_extent *extent, uint32_t slices) {
  const uint32_t lambdas = extent->config.lambdas;
  const uint32_t sets = lambdas * extent->config.rims;
  for (uint32_t i = 0; i < slices && extent->n > 0; ++i) {
    const uint32_t unit = extent->turn % sets;
    const uint32_t rim = unit / lambdas;
    prepare(extent, rim);
    climb(extent, rim, unit % lambdas, extent->turn / sets % KINDS);
    ++extent->turn;
    if (extent->config.rims > rim + 1)
      evaluate_from(extent, rim + 1);
  }
}

rim_status rim_extent_get_region(const rim_extent *extent, uint32_t rim, uint32_t lambda,
                                 rim_extent_region *region) {
  if (extent == NULL || region == NULL)
    return RIM_E_ARGUMENT;
  if (rim >= extent->config.rims || lambda >= extent->config.lambdas)
    return RIM_E_RANGE;
  const held_region *held = region_of(extent, rim, lambda);
  *region = (rim_extent_region){.dims = held->ellipsoid.dims,
                                .lambda = held->lambda,
                                .volume = held->volume,
                                .n = held->n,
                                .ln_anom = held->ln_anom,
                                .shift = held->shift,
                                .shift_var = held->shift_var,
                                .confidence = held->confidence};
  memcpy(region->center, held->ellipsoid.center, sizeof region->center);
  memcpy(region->factor, held->ellipsoid.factor, sizeof region->factor);
  return RIM_OK;
}

rim_extent_local rim_extent_at(const rim_extent *extent, uint32_t rim, const double *x) {
  double u[RIM_EXTENT_MAX_DIMS];
  if (rim >= extent->config.rims || !to_unit(&extent->config, x, u)) {
    return (rim_extent_local){0.0, 0.0, 0.0, 0.0};
  }
  return local_at(extent, rim, u);
}

rim_extent_mixture rim_extent_reward(const rim_extent *extent, const double *x, double mean,
                                     double var) {
  double u[RIM_EXTENT_MAX_DIMS];
  const uint32_t rims = to_unit(&extent->config, x, u) ? extent->config.rims : 0;
  return mixture_at(extent, rims, u, mean, var);
}

void rim_extent_moments(const rim_extent_mixture *mixture, double *mean, double *var) {
  double m = 0.0, v = 0.0;
  for (uint32_t i = 0; i < mixture->components; ++i)
    m += mixture->weight[i] * mixture->mean[i];
  for (uint32_t i = 0; i < mixture->components; ++i) {
    const double off = mixture->mean[i] - m;
    v += mixture->weight[i] * (off * off + mixture->var[i]);
  }
  if (mean != NULL)
    *mean = m;
  if (var != NULL)
    *var = v;
}

double rim_extent_correction(const rim_extent *extent, const double *x) {
  const rim_extent_mixture mixture = rim_extent_reward(extent, x, 0.0, 0.0);
  return correction_of(&mixture);
}
