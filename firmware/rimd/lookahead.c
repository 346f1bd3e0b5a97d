/* SPDX-License-Identifier: MIT */
#include "rimd/lookahead.h"

#include <ccd/ccd.h>
#include <math.h>
#include <string.h>

#define ITERATIONS 64u
#define HALVINGS 8
#define TOLERANCE 1e-6 /* of MPR, m */

/* An alarmed region in physical space: axes that it names, and half a length for the others, beyond
 * everything that the plan reaches. */
typedef struct zone {
  int axis[3]; /* of x, y, z: index into the region's features, -1: not named */
  double center[3];
  double shape[3][3]; /* A over the named ones: rows and columns of x, y, z */
  double half[3];
} zone;

/* The footprint on its way between two poses. */
typedef struct sweep {
  const lookahead_config *config;
  rim_pose from, to;
} sweep;

bool lookahead_is_physical(const lookahead_config *config, const rim_region *region) {
  if (region->dims == 0 || region->dims > RIM_REGION_MAX_DIMS)
    return false;
  for (size_t d = 0; d < region->dims; d++) {
    bool found = false;
    for (size_t k = 0; k < 3; k++)
      found = found || config->axis[k] == region->feature[d];
    if (!found)
      return false;
  }
  return true;
}

/* A from A^-1, by Gauss and Jordan; dims <= 3, positive definite, so no pivoting. */
static bool invert(const rim_region *region, double out[3][3]) {
  const size_t n = region->dims;
  double m[3][6];
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) {
      m[i][j] = region->inverse_shape[i * n + j];
      m[i][n + j] = i == j ? 1.0 : 0.0;
    }
  for (size_t i = 0; i < n; i++) {
    if (!(m[i][i] > 0.0) || !isfinite(m[i][i]))
      return false;
    const double inverse = 1.0 / m[i][i];
    for (size_t j = 0; j < 2 * n; j++)
      m[i][j] *= inverse;
    for (size_t k = 0; k < n; k++) {
      const double factor = m[k][i];
      for (size_t j = 0; k != i && j < 2 * n; j++)
        m[k][j] -= factor * m[i][j];
    }
  }
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      out[i][j] = m[i][n + j];
  return true;
}

static bool make_zone(const lookahead_config *config, const rim_region *region,
                      const rim_plan *plan, zone *z) {
  double shape[3][3];
  if (!invert(region, shape))
    return false;
  memset(z, 0, sizeof *z);
  double size = 1.0 + config->margin_m;
  for (uint32_t v = 0; v < config->vertices; v++)
    for (size_t k = 0; k < 3; k++)
      size += fabs(config->vertex[v][k]);
  for (size_t k = 0; k < 3; k++) {
    z->axis[k] = -1;
    for (size_t d = 0; d < region->dims; d++)
      if (region->feature[d] == config->axis[k])
        z->axis[k] = (int)d;
    if (z->axis[k] >= 0) {
      z->center[k] = region->center[z->axis[k]];
      continue;
    }
    double low = plan->pose[0].position[k], high = low;
    for (uint32_t i = 1; i < plan->count; i++) {
      low = fmin(low, plan->pose[i].position[k]);
      high = fmax(high, plan->pose[i].position[k]);
    }
    z->center[k] = 0.5 * (low + high);
    z->half[k] = 0.5 * (high - low) + size;
  }
  for (size_t i = 0; i < 3; i++)
    for (size_t j = 0; j < 3; j++)
      if (z->axis[i] >= 0 && z->axis[j] >= 0)
        z->shape[i][j] = shape[z->axis[i]][z->axis[j]];
  return true;
}

/* Farthest point of the ellipsoid: u + A d / sqrt(d^T A d); of the other axes: their end. */
static void support_zone(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *point) {
  const zone *z = object;
  double ad[3], dad = 0.0;
  for (size_t i = 0; i < 3; i++) {
    ad[i] = 0.0;
    for (size_t j = 0; j < 3; j++)
      ad[i] += z->shape[i][j] * direction->v[j];
    dad += direction->v[i] * ad[i];
  }
  const double scale = dad > 0.0 ? 1.0 / sqrt(dad) : 0.0;
  for (size_t i = 0; i < 3; i++)
    point->v[i] =
        z->center[i] + (z->axis[i] >= 0 ? scale * ad[i] : copysign(z->half[i], direction->v[i]));
}

static void center_zone(const void *object, ccd_vec3_t *point) {
  const zone *z = object;
  for (size_t i = 0; i < 3; i++)
    point->v[i] = z->center[i];
}

/* q v q*, q of length 1. */
static void rotate(const double q[4], const double v[3], double out[3]) {
  const double t[3] = {2.0 * (q[2] * v[2] - q[3] * v[1]), 2.0 * (q[3] * v[0] - q[1] * v[2]),
                       2.0 * (q[1] * v[1] - q[2] * v[0])};
  out[0] = v[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1];
  out[1] = v[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2];
  out[2] = v[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0];
}

static double support_pose(const lookahead_config *config, const rim_pose *pose,
                           const double direction[3], double point[3]) {
  static const double origin[3] = {0.0, 0.0, 0.0};
  double best = -HUGE_VAL;
  for (uint32_t v = 0; v < (config->vertices > 0 ? config->vertices : 1); v++) {
    double p[3], along = 0.0;
    rotate(pose->orientation, config->vertices > 0 ? config->vertex[v] : origin, p);
    for (size_t k = 0; k < 3; k++) {
      p[k] += pose->position[k];
      along += p[k] * direction[k];
    }
    if (along > best) {
      best = along;
      memcpy(point, p, sizeof p);
    }
  }
  return best;
}

static void support_sweep(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *point) {
  const sweep *s = object;
  double a[3], b[3];
  const double *d = direction->v;
  const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const double at_from = support_pose(s->config, &s->from, d, a);
  const bool from = at_from >= support_pose(s->config, &s->to, d, b);
  for (size_t k = 0; k < 3; k++)
    point->v[k] = (from ? a[k] : b[k]) + (length > 0.0 ? s->config->margin_m * d[k] / length : 0.0);
}

static void center_sweep(const void *object, ccd_vec3_t *point) {
  const sweep *s = object;
  double sum[3] = {0.0, 0.0, 0.0};
  const uint32_t n = s->config->vertices;
  for (uint32_t v = 0; v < n; v++)
    for (size_t k = 0; k < 3; k++)
      sum[k] += s->config->vertex[v][k] / n;
  double a[3], b[3];
  rotate(s->from.orientation, sum, a);
  rotate(s->to.orientation, sum, b);
  for (size_t k = 0; k < 3; k++)
    point->v[k] = 0.5 * (a[k] + s->from.position[k] + b[k] + s->to.position[k]);
}

static bool overlaps(const sweep *s, const zone *z) {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = support_sweep;
  ccd.support2 = support_zone;
  ccd.center1 = center_sweep;
  ccd.center2 = center_zone;
  ccd.max_iterations = ITERATIONS;
  ccd.mpr_tolerance = TOLERANCE;
  return ccdMPRIntersect(s, z, &ccd) != 0;
}

/* Positions linear, orientations along the chord, the shorter way. */
static rim_pose between(const rim_pose *a, const rim_pose *b, double f) {
  rim_pose p;
  double dot = 0.0, length2 = 0.0;
  p.after_s = a->after_s + f * (b->after_s - a->after_s);
  for (size_t k = 0; k < 3; k++)
    p.position[k] = a->position[k] + f * (b->position[k] - a->position[k]);
  for (size_t k = 0; k < 4; k++)
    dot += a->orientation[k] * b->orientation[k];
  for (size_t k = 0; k < 4; k++) {
    p.orientation[k] =
        (1.0 - f) * a->orientation[k] + f * (dot < 0.0 ? -b->orientation[k] : b->orientation[k]);
    length2 += p.orientation[k] * p.orientation[k];
  }
  for (size_t k = 0; k < 4; k++)
    p.orientation[k] /= sqrt(length2); /* at least 1/2: less than half a turn apart */
  return p;
}

/* The first moment within a stretch that overlaps somewhere. */
static double first_moment(sweep *s, const zone *z) {
  const rim_pose from = s->from, to = s->to;
  double low = 0.0, high = 1.0;
  s->to = from;
  if (overlaps(s, z))
    return from.after_s;
  for (int i = 0; i < HALVINGS; i++) {
    const double middle = 0.5 * (low + high);
    s->from = between(&from, &to, low);
    s->to = between(&from, &to, middle);
    if (overlaps(s, z))
      high = middle;
    else
      low = middle;
  }
  return from.after_s + low * (to.after_s - from.after_s);
}

bool lookahead_check(const lookahead_config *config, const rim_region *region, const rim_plan *plan,
                     double from_s, lookahead_result *result) {
  zone z;
  memset(result, 0, sizeof *result);
  if (plan->count == 0 || !lookahead_is_physical(config, region) ||
      !make_zone(config, region, plan, &z))
    return false;
  const uint32_t last = plan->count - 1;
  for (uint32_t i = 0; i <= last; i++) {
    const rim_pose *next = &plan->pose[i < last ? i + 1 : i];
    if (next->after_s < from_s && i < last)
      continue; /* behind us */
    sweep s = {.config = config, .from = plan->pose[i], .to = *next};
    if (s.from.after_s < from_s && next->after_s > s.from.after_s)
      s.from = between(&plan->pose[i], next,
                       fmin((from_s - s.from.after_s) / (next->after_s - s.from.after_s), 1.0));
    if (!overlaps(&s, &z))
      continue;
    result->enters = true;
    result->pose = i;
    result->after_s = first_moment(&s, &z);
    return true;
  }
  return true;
}
