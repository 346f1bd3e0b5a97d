/* SPDX-License-Identifier: MIT */
#include "batch/select_batch.h"

#include "batch/stats.h"

#include <float.h>
#include <string.h>

#include "base/real.h"
#include "base/rng.h"
#include "base/usable.h"

#define MAX_FEATURES 128
#define MAX_OUTCOMES 128
#define DONE (-DBL_MAX)
#define STREAMS_A_NODE 256u /* above balls + 1 */

/* An explored set of features and its most anomalous region. */
typedef struct node {
  uint16_t feature[RIM_CEM_MAX_DIMS]; /* ascending */
  uint8_t dims;                       /* 0: everything */
  rim_ellipsoid region;
  double ln_anom;
} node;

/* The most anomalous interval of one feature. */
typedef struct interval {
  double ln_anom, low, high;
} interval;

typedef struct search {
  const rim_batch_data *data;
  rim_batch_config config;
  node *nodes;
  double *h;        /* [nodes][features]: of the edge (node, feature) */
  uint64_t *inside; /* [nodes][words]: points of each node's region */
  interval *alone;  /* [features] */
  double *sum;      /* [MAX_OUTCOMES], scratch of whoever sums */
  size_t words;
  uint32_t count;
  uint32_t evaluations;
} search;

/* A set of features under evaluation. */
typedef struct projection {
  search *s;
  const uint16_t *feature;
} projection;

static bool has(const search *s, uint32_t at, uint32_t i) {
  return (s->inside[at * s->words + i / 64u] >> (i % 64u) & 1u) != 0;
}

static bool point_inside(const search *s, const ellipsoid_test *test, const uint16_t *feature,
                         uint32_t i) {
  const double *u = s->data->u + (size_t)i * s->data->features;
  double x[RIM_CEM_MAX_DIMS];
  for (uint32_t k = 0; k < test->ellipsoid->dims; ++k)
    x[k] = u[feature[k]];
  return rimi_ellipsoid_holds(test, x);
}

static void clear_sum(const search *s) { memset(s->sum, 0, 8u * (size_t)s->data->outcomes); }

static void add(const search *s, uint32_t i) {
  const double *r = s->data->r + (size_t)i * s->data->outcomes;
  for (uint32_t o = 0; o < s->data->outcomes; ++o)
    s->sum[o] += r[o];
}

static double value_of(const rim_ellipsoid *e, void *context) {
  const projection *p = (const projection *)context;
  search *s = p->s;
  clear_sum(s);
  uint32_t n = 0;
  ++s->evaluations;
  const ellipsoid_test test = rimi_ellipsoid_test(e, false);
  for (uint32_t i = 0; i < s->data->n; ++i) {
    if (!point_inside(s, &test, p->feature, i))
      continue;
    add(s, i);
    ++n;
  }
  return rimi_stats_ln_anom_sums(s->sum, s->data->outcomes, (double)n);
}

static uint32_t bin_of(const search *s, uint32_t i, uint32_t f) {
  const double position = s->data->u[(size_t)i * s->data->features + f] * (double)s->config.bins;
  if (!(position > 0.0))
    return 0;
  return position < (double)s->config.bins ? (uint32_t)position : s->config.bins - 1u;
}

/* The best interval that begins at bin `first`: its sums grow bin by bin (Alg. 8, line 10). The
 * points are walked once for each first bin, so that no table of bins x outcomes is needed. */
static void intervals_from(const search *s, uint32_t at, uint32_t f, uint32_t first,
                           const uint32_t *count, interval *best) {
  clear_sum(s);
  double n = 0.0;
  for (uint32_t last = first; last < s->config.bins; ++last) {
    if (count[last] == 0)
      continue;
    for (uint32_t i = 0; i < s->data->n; ++i) {
      if (bin_of(s, i, f) == last && has(s, at, i))
        add(s, i);
    }
    n += (double)count[last];
    const double value = rimi_stats_ln_anom_sums(s->sum, s->data->outcomes, n);
    if (value <= best->ln_anom)
      continue;
    best->ln_anom = value;
    best->low = (double)first / (double)s->config.bins;
    best->high = ((double)last + 1.0) / (double)s->config.bins;
  }
}

/* One outcome: prefix sums, O(n + bins^2). */
static void intervals_of_one(const search *s, uint32_t at, uint32_t f, const uint32_t *count,
                             interval *best) {
  double sum[RIM_BATCH_MAX_BINS] = {0.0};
  for (uint32_t i = 0; i < s->data->n; ++i) {
    if (has(s, at, i))
      sum[bin_of(s, i, f)] += s->data->r[i];
  }
  for (uint32_t first = 0; first < s->config.bins; ++first) {
    double total = 0.0;
    double n = 0.0;
    if (count[first] == 0)
      continue;
    for (uint32_t last = first; last < s->config.bins; ++last) {
      total += sum[last];
      n += (double)count[last];
      if (count[last] == 0 || total * total <= best->ln_anom * 2.0 * n)
        continue;
      best->ln_anom = total * total / (2.0 * n);
      best->low = (double)first / (double)s->config.bins;
      best->high = ((double)last + 1.0) / (double)s->config.bins;
    }
  }
}

/* The most anomalous interval of f among the points of a node's region. */
static interval conditional(const search *s, uint32_t at, uint32_t f) {
  uint32_t count[RIM_BATCH_MAX_BINS] = {0};
  for (uint32_t i = 0; i < s->data->n; ++i) {
    if (has(s, at, i))
      ++count[bin_of(s, i, f)];
  }
  interval best = {0.0, 0.0, 1.0};
  if (s->data->outcomes == 1) {
    intervals_of_one(s, at, f, count, &best);
    return best;
  }
  for (uint32_t first = 0; first < s->config.bins; ++first) {
    if (count[first] > 0)
      intervals_from(s, at, f, first, count, &best);
  }
  return best;
}

/* H2: the points of R_F inside R_f. */
static double intersection(const search *s, uint32_t at, uint32_t f) {
  clear_sum(s);
  uint32_t n = 0;
  for (uint32_t i = 0; i < s->data->n; ++i) {
    const double u = s->data->u[(size_t)i * s->data->features + f];
    if (!has(s, at, i) || u < s->alone[f].low || u >= s->alone[f].high)
      continue;
    add(s, i);
    ++n;
  }
  return rimi_stats_ln_anom_sums(s->sum, s->data->outcomes, (double)n);
}

/* ln(e^a + e^b) */
static double ln_sum(double a, double b) {
  return rimi_max(a, b) + rimi_log(1.0 + rimi_exp(-rimi_abs(a - b)));
}

static double heuristic(const search *s, uint32_t at, uint32_t f) {
  const node *from = &s->nodes[at];
  switch (s->config.heuristic) {
  case RIM_HEURISTIC_H1:
    return ln_sum(from->ln_anom, s->alone[f].ln_anom);
  case RIM_HEURISTIC_H2:
    return intersection(s, at, f);
  case RIM_HEURISTIC_H3:
    return conditional(s, at, f).ln_anom;
  default:
    return -((double)from->dims * 1e9 + (double)at * (double)MAX_FEATURES + (double)f);
  }
}

/* Enters a node in the search: its points, and the values of its edges. */
static void open_node(search *s, uint32_t at) {
  const node *from = &s->nodes[at];
  uint64_t *inside = s->inside + at * s->words;
  memset(inside, 0, 8u * s->words);
  const ellipsoid_test test = rimi_ellipsoid_test(&from->region, false);
  for (uint32_t i = 0; i < s->data->n; ++i) {
    const bool in = from->dims == 0 || point_inside(s, &test, from->feature, i);
    if (in)
      inside[i / 64u] |= UINT64_C(1) << (i % 64u);
  }
  for (uint32_t f = 0; f < s->data->features; ++f) {
    bool member = from->dims >= s->config.max_dims;
    for (uint32_t k = 0; k < from->dims; ++k)
      member = member || from->feature[k] == f;
    double *h = &s->h[(size_t)at * s->data->features + f];
    *h = member                                                            ? DONE
         : from->dims == 0 && s->config.heuristic != RIM_HEURISTIC_BREADTH ? s->alone[f].ln_anom
                                                                           : heuristic(s, at, f);
  }
}

/* The node's features and one more, ascending. */
static void join(const node *from, uint16_t f, node *to) {
  memset(to, 0, sizeof *to);
  uint8_t n = 0;
  for (uint32_t k = 0; k < from->dims; ++k) {
    if (from->feature[k] > f && n == k)
      to->feature[n++] = f;
    to->feature[n++] = from->feature[k];
  }
  if (n == from->dims)
    to->feature[n++] = f;
  to->dims = n;
}

static bool is_explored(const search *s, const node *set) {
  for (uint32_t i = 0; i < s->count; ++i) {
    const node *other = &s->nodes[i];
    if (other->dims == set->dims &&
        memcmp(other->feature, set->feature, sizeof set->feature) == 0) {
      return true;
    }
  }
  return false;
}

/* Box of the parent's region and the conditional interval along the new feature, as an ellipsoid.
 */
static rim_ellipsoid start_of(const search *s, uint32_t parent, uint16_t f, const node *set) {
  const node *from = &s->nodes[parent];
  rim_ellipsoid e;
  memset(&e, 0, sizeof e);
  e.dims = set->dims;
  const interval along = conditional(s, parent, f);
  for (uint32_t k = 0, old = 0; k < set->dims; ++k) {
    double *diagonal = &e.factor[k * (k + 1) / 2 + k];
    if (set->feature[k] == f) {
      e.center[k] = 0.5 * (along.low + along.high);
      *diagonal = 0.575 * (along.high - along.low);
      continue;
    }
    e.center[k] = from->region.center[old];
    *diagonal = rimi_ellipsoid_half_side(&from->region, old);
    ++old;
  }
  return e;
}

/* findRIM for two features and more: the best of several starts. */
static rim_status optimise(search *s, node *set, const rim_ellipsoid *start) {
  projection p = {s, set->feature};
  rim_rng rng;
  rimi_rng_seed(&rng, s->config.seed, (uint64_t)s->count * STREAMS_A_NODE);
  set->ln_anom = -1.0;
  for (uint32_t k = 0; k <= s->config.balls; ++k) {
    rim_ellipsoid e = *start;
    if (k > 0) {
      const uint32_t i = rimi_rng_below(&rng, s->data->n);
      double x[RIM_CEM_MAX_DIMS];
      for (uint32_t j = 0; j < set->dims; ++j) {
        x[j] = s->data->u[(size_t)i * s->data->features + set->feature[j]];
      }
      e = rimi_ellipsoid_ball(set->dims, x, 0.2);
    }
    double value = 0.0;
    const rim_status status =
        rimi_cem_optimise(&s->config.cem, value_of, &p, s->config.seed,
                          (uint64_t)s->count * STREAMS_A_NODE + k + 1u, &e, &value);
    if (status != RIM_OK)
      return status;
    if (value <= set->ln_anom)
      continue;
    set->ln_anom = value;
    set->region = e;
  }
  return RIM_OK;
}

static rim_status explore(search *s, uint32_t parent, uint16_t f) {
  node set;
  join(&s->nodes[parent], f, &set);
  if (is_explored(s, &set))
    return RIM_OK;
  if (set.dims == 1) {
    const double middle = 0.5 * (s->alone[f].low + s->alone[f].high);
    set.region = rimi_ellipsoid_ball(1, &middle, 0.5 * (s->alone[f].high - s->alone[f].low));
    set.ln_anom = s->alone[f].ln_anom;
  } else {
    const rim_ellipsoid start = start_of(s, parent, f, &set);
    const rim_status status = optimise(s, &set, &start);
    if (status != RIM_OK)
      return status;
  }
  s->nodes[s->count] = set;
  open_node(s, s->count);
  ++s->count;
  return RIM_OK;
}

/* Lines 3-13 of Alg. 4. Every round takes one edge out: at most nodes * features rounds. */
static rim_status select_features(search *s) {
  node root;
  memset(&root, 0, sizeof root);
  clear_sum(s);
  for (uint32_t i = 0; i < s->data->n; ++i)
    add(s, i);
  root.ln_anom = rimi_stats_ln_anom_sums(s->sum, s->data->outcomes, (double)s->data->n);
  s->nodes[0] = root;
  memset(s->inside, 0xff, 8u * s->words);
  for (uint32_t f = 0; f < s->data->features; ++f)
    s->alone[f] = conditional(s, 0, f);
  open_node(s, 0);
  s->count = 1;
  while (s->count < s->config.nodes) {
    const size_t edges = (size_t)s->count * s->data->features;
    size_t best = 0;
    for (size_t i = 1; i < edges; ++i) {
      if (s->h[i] > s->h[best])
        best = i;
    }
    if (s->h[best] == DONE)
      break;
    s->h[best] = DONE;
    const uint32_t parent = (uint32_t)best / s->data->features;
    const uint32_t f = (uint32_t)best - parent * s->data->features;
    const rim_status status = explore(s, parent, (uint16_t)f);
    if (status != RIM_OK)
      return status;
  }
  return RIM_OK;
}

/* No FS: all features at once, from the middle and from balls. */
static rim_status search_everything(search *s) {
  node set;
  memset(&set, 0, sizeof set);
  set.dims = (uint8_t)s->data->features;
  double middle[RIM_CEM_MAX_DIMS];
  for (uint32_t k = 0; k < set.dims; ++k) {
    set.feature[k] = (uint16_t)k;
    middle[k] = 0.5;
  }
  const rim_ellipsoid start = rimi_ellipsoid_ball(set.dims, middle, 0.5);
  const rim_status status = optimise(s, &set, &start);
  s->nodes[0] = set;
  s->count = 1;
  return status;
}

static void report(search *s, rim_batch_result *result) {
  uint32_t best = 0;
  for (uint32_t i = 1; i < s->count; ++i) {
    if (s->nodes[i].ln_anom > s->nodes[best].ln_anom)
      best = i;
  }
  const node *n = &s->nodes[best];
  memset(result, 0, sizeof *result);
  result->found = n->ln_anom > s->config.threshold;
  result->dims = n->dims;
  memcpy(result->feature, n->feature, sizeof result->feature);
  result->ellipsoid = n->region;
  result->ln_anom = n->ln_anom;
  if (n->dims > 0)
    (void)rimi_ellipsoid_region(&n->region, n->feature, &result->region);
  const ellipsoid_test test = rimi_ellipsoid_test(&n->region, false);
  for (uint32_t i = 0; i < s->data->n; ++i) {
    if (n->dims == 0 || point_inside(s, &test, n->feature, i))
      ++result->inside;
  }
  result->nodes = s->count;
  result->evaluations = s->evaluations;
}

static rim_batch_config filled(const rim_batch_config *config) {
  rim_batch_config c = *config;
  RIM_OR_DEFAULT(c.nodes, 20);
  RIM_OR_DEFAULT(c.max_dims, 2);
  RIM_OR_DEFAULT(c.bins, 32);
  RIM_OR_DEFAULT(c.balls, 2);
  return c;
}

static bool is_valid(const rim_batch_config *c, const rim_batch_data *data) {
  if (data->features < 1 || data->features > MAX_FEATURES || data->outcomes < 1 ||
      data->outcomes > MAX_OUTCOMES || c->nodes > RIM_BATCH_MAX_NODES ||
      c->max_dims > RIM_REGION_MAX_DIMS || c->bins < 4 || c->bins > RIM_BATCH_MAX_BINS ||
      (uint32_t)c->heuristic > (uint32_t)RIM_HEURISTIC_NONE) {
    return false;
  }
  return c->heuristic != RIM_HEURISTIC_NONE || data->features <= RIM_CEM_MAX_DIMS;
}

bool rimi_batch_fits(const rim_batch_data *data, uint32_t nodes) {
  return data->n <= RIM_BATCH_MOST / ((uint32_t)data->features + data->outcomes + nodes + 3u);
}

rim_status rimi_select_batch(const rim_batch_config *config, const rim_batch_data *data, void *work,
                             size_t bytes, rim_batch_result *result) {
  if (config == NULL || data == NULL || work == NULL || result == NULL || data->u == NULL ||
      data->r == NULL) {
    return RIM_E_ARGUMENT;
  }
  if ((uintptr_t)work % 8u != 0)
    return RIM_E_ALIGN;
  search s;
  memset(&s, 0, sizeof s);
  s.config = filled(config);
  s.data = data;
  if (!is_valid(&s.config, data))
    return RIM_E_CONFIG;
  if (data->n == 0)
    return RIM_E_DATA;
  if (!rimi_batch_fits(data, s.config.nodes) ||
      bytes < RIM_BATCH_SIZE(data->n, data->features, s.config.nodes))
    return RIM_E_SIZE;
  s.words = ((size_t)data->n + 63u) / 64u;
  s.nodes = (node *)work;
  s.h = (double *)(void *)((uint8_t *)work + (size_t)s.config.nodes * RIM_BATCH_NODE_BYTES);
  s.inside = (uint64_t *)(void *)(s.h + (size_t)s.config.nodes * data->features);
  s.alone = (interval *)(void *)(s.inside + (size_t)s.config.nodes * s.words);
  s.sum = (double *)(void *)(s.alone + data->features);
  const rim_status status =
      s.config.heuristic == RIM_HEURISTIC_NONE ? search_everything(&s) : select_features(&s);
  if (status == RIM_OK)
    report(&s, result);
  return status;
}

_Static_assert(sizeof(node) <= RIM_BATCH_NODE_BYTES, "a node must fit");
_Static_assert(RIM_BATCH_NODE_BYTES % 8u == 0, "what follows the nodes must be aligned");
