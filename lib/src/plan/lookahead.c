/* SPDX-License-Identifier: MIT */
#include "rim/plan/lookahead.h"

#include <string.h>

#include "base/ellipsoid.h"
#include "base/real.h"

#define STEPS 64 /* of each of the two loops of the test for overlap */
#define HALVINGS 8
#define TOLERANCE 1e-6  /* of that test, m */
#define COINCIDENT 1e-9 /* below: both centres are at one place, m^2 */
#define LARGEST 1e308

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
  const rim_lookahead_config *config;
  rim_pose from, to;
} sweep;

bool rim_lookahead_is_physical(const rim_lookahead_config *config, const rim_region *region) {
  if (region->dims == 0 || region->dims > RIM_REGION_MAX_DIMS)
    return false;
  for (size_t d = 0; d < region->dims; ++d) {
    bool found = false;
    for (size_t k = 0; k < 3; ++k)
      found = found || config->axis[k] == region->feature[d];
    if (!found)
      return false;
  }
  return true;
}

static bool make_zone(const rim_lookahead_config *config, const rim_region *region,
                      const rim_plan *plan, zone *z) {
  double shape[RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS];
  if (!rimi_region_shape(region, shape))
    return false;
  memset(z, 0, sizeof *z);
  double size = 1.0 + config->margin_m;
  for (uint32_t v = 0; v < config->vertices; ++v)
    for (size_t k = 0; k < 3; ++k)
      size += rimi_abs(config->vertex[v][k]);
  for (size_t k = 0; k < 3; ++k) {
    z->axis[k] = -1;
    for (size_t d = 0; d < region->dims; ++d)
      if (region->feature[d] == config->axis[k])
        z->axis[k] = (int)d;
    if (z->axis[k] >= 0) {
      z->center[k] = region->center[z->axis[k]];
      continue;
    }
    double low = plan->pose[0].position[k], high = low;
    for (uint32_t i = 1; i < plan->count; ++i) {
      low = rimi_min(low, plan->pose[i].position[k]);
      high = rimi_max(high, plan->pose[i].position[k]);
    }
    z->center[k] = 0.5 * (low + high);
    z->half[k] = 0.5 * (high - low) + size;
  }
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j)
      if (z->axis[i] >= 0 && z->axis[j] >= 0)
        z->shape[i][j] = shape[z->axis[i] * (int)region->dims + z->axis[j]];
  return true;
}

/* Farthest point of the ellipsoid: u + A d / sqrt(d^T A d); of the other axes: their end. */
static void support_zone(const zone *z, const double direction[3], double point[3]) {
  double ad[3], dad = 0.0;
  for (size_t i = 0; i < 3; ++i) {
    ad[i] = 0.0;
    for (size_t j = 0; j < 3; ++j)
      ad[i] += z->shape[i][j] * direction[j];
    dad += direction[i] * ad[i];
  }
  const double scale = dad > 0.0 ? 1.0 / rimi_sqrt(dad) : 0.0;
  for (size_t i = 0; i < 3; ++i) {
    const double end = direction[i] < 0.0 ? -z->half[i] : z->half[i];
    point[i] = z->center[i] + (z->axis[i] >= 0 ? scale * ad[i] : end);
  }
}

/* q v q*, q of length 1. */
static void rotate(const double q[4], const double v[3], double out[3]) {
  const double t[3] = {2.0 * (q[2] * v[2] - q[3] * v[1]), 2.0 * (q[3] * v[0] - q[1] * v[2]),
                       2.0 * (q[1] * v[1] - q[2] * v[0])};
  out[0] = v[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1];
  out[1] = v[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2];
  out[2] = v[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0];
}

static double support_pose(const rim_lookahead_config *config, const rim_pose *pose,
                           const double direction[3], double point[3]) {
  static const double origin[3] = {0.0, 0.0, 0.0};
  double best = -LARGEST;
  for (uint32_t v = 0; v < (config->vertices > 0 ? config->vertices : 1); ++v) {
    double p[3], along = 0.0;
    rotate(pose->orientation, config->vertices > 0 ? config->vertex[v] : origin, p);
    for (size_t k = 0; k < 3; ++k) {
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

static void support_sweep(const sweep *s, const double d[3], double point[3]) {
  double a[3], b[3];
  const double length = rimi_sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const double at_from = support_pose(s->config, &s->from, d, a);
  const bool from = at_from >= support_pose(s->config, &s->to, d, b);
  for (size_t k = 0; k < 3; ++k)
    point[k] = (from ? a[k] : b[k]) + (length > 0.0 ? s->config->margin_m * d[k] / length : 0.0);
}

static void center_sweep(const sweep *s, double point[3]) {
  double sum[3] = {0.0, 0.0, 0.0};
  const uint32_t n = s->config->vertices;
  for (uint32_t v = 0; v < n; ++v)
    for (size_t k = 0; k < 3; ++k)
      sum[k] += s->config->vertex[v][k] / n;
  double a[3], b[3];
  rotate(s->from.orientation, sum, a);
  rotate(s->to.orientation, sum, b);
  for (size_t k = 0; k < 3; ++k)
    point[k] = 0.5 * (a[k] + s->from.position[k] + b[k] + s->to.position[k]);
}

/* ---- do two convex bodies overlap? Minkowski portal refinement (G. Snethen, "XenoCollide", Game
 * Programming Gems 7, 2008): does sweep less zone hold the origin? A portal is a triangle of points
 * of that body through which the ray from a point within it to the origin passes; it is moved
 * outwards until it lies beyond the origin, or a plane separates the two. ---- */

typedef struct vec {
  double v[3];
} vec;

static vec less(vec a, vec b) { return (vec){{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2]}}; }

static double dot(vec a, vec b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }

static vec cross(vec a, vec b) {
  return (vec){{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2],
                a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}

/* Farthest point of sweep less zone. */
static vec support(const sweep *s, const zone *z, vec d) {
  const double back[3] = {-d.v[0], -d.v[1], -d.v[2]};
  vec a = {{0}}, b = {{0}};
  support_sweep(s, d.v, a.v);
  support_zone(z, back, b.v);
  return less(a, b);
}

typedef enum portal_answer { APART, TOGETHER, FOUND } portal_answer;

/* p[0] within the body, p[1..3] the portal. FOUND: the ray from p[0] to the origin passes it. */
static portal_answer find_portal(const sweep *s, const zone *z, vec p[4]) {
  const vec origin = {{0.0, 0.0, 0.0}};
  vec n = less(origin, p[0]);
  p[1] = support(s, z, n);
  if (dot(p[1], n) <= 0.0)
    return APART;
  n = cross(p[1], p[0]);
  if (dot(n, n) <= COINCIDENT * TOLERANCE)
    return TOGETHER; /* the origin lies between the two */
  p[2] = support(s, z, n);
  if (dot(p[2], n) <= 0.0)
    return APART;
  /* It faces the origin: n p[0] = -p[2] (p[1] x p[0]), which is below 0. */
  n = cross(less(p[1], p[0]), less(p[2], p[0]));
  for (int i = 0; i < STEPS; ++i) {
    p[3] = support(s, z, n);
    if (dot(p[3], n) <= 0.0)
      return APART;
    if (dot(cross(p[1], p[3]), p[0]) < 0.0)
      p[2] = p[3];
    else if (dot(cross(p[3], p[2]), p[0]) < 0.0)
      p[1] = p[3];
    else
      return FOUND;
    n = cross(less(p[1], p[0]), less(p[2], p[0]));
  }
  return TOGETHER;
}

static bool overlaps(const sweep *s, const zone *z) {
  vec p[4];
  center_sweep(s, p[0].v);
  for (size_t k = 0; k < 3; ++k)
    p[0].v[k] -= z->center[k];
  if (dot(p[0], p[0]) < COINCIDENT)
    return true;
  const portal_answer found = find_portal(s, z, p);
  if (found != FOUND)
    return found == TOGETHER;
  for (int i = 0; i < STEPS; ++i) {
    vec n = cross(less(p[2], p[1]), less(p[3], p[1]));
    const double length = rimi_sqrt(dot(n, n));
    if (!(length > 0.0))
      return true;
    for (size_t k = 0; k < 3; ++k)
      n.v[k] /= length;
    if (dot(n, p[1]) >= 0.0)
      return true; /* the origin is on this side of the portal */
    const vec beyond = support(s, z, n);
    if (dot(beyond, n) <= 0.0 || dot(less(beyond, p[3]), n) <= TOLERANCE)
      return false; /* the body ends before the origin */
    const vec side = cross(beyond, p[0]);
    if (dot(p[1], side) > 0.0)
      p[dot(p[2], side) > 0.0 ? 1 : 3] = beyond;
    else
      p[dot(p[3], side) > 0.0 ? 2 : 1] = beyond;
  }
  return true;
}

/* Positions linear, orientations along the chord, the shorter way. */
static rim_pose between(const rim_pose *a, const rim_pose *b, double f) {
  rim_pose p;
  double along = 0.0, length2 = 0.0;
  p.after_s = a->after_s + f * (b->after_s - a->after_s);
  for (size_t k = 0; k < 3; ++k)
    p.position[k] = a->position[k] + f * (b->position[k] - a->position[k]);
  for (size_t k = 0; k < 4; ++k)
    along += a->orientation[k] * b->orientation[k];
  for (size_t k = 0; k < 4; ++k) {
    p.orientation[k] =
        (1.0 - f) * a->orientation[k] + f * (along < 0.0 ? -b->orientation[k] : b->orientation[k]);
    length2 += p.orientation[k] * p.orientation[k];
  }
  for (size_t k = 0; k < 4; ++k)
    p.orientation[k] /= rimi_sqrt(length2); /* at least 1/2: less than half a turn apart */
  return p;
}

/* The first moment within a stretch that overlaps somewhere. */
static double first_moment(sweep *s, const zone *z) {
  const rim_pose from = s->from, to = s->to;
  double low = 0.0, high = 1.0;
  s->to = from;
  if (overlaps(s, z))
    return from.after_s;
  for (int i = 0; i < HALVINGS; ++i) {
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

bool rim_lookahead_check(const rim_lookahead_config *config, const rim_region *region,
                         const rim_plan *plan, double from_s, rim_lookahead_result *result) {
  zone z;
  memset(result, 0, sizeof *result);
  if (plan->count == 0 || !rim_lookahead_is_physical(config, region) ||
      !make_zone(config, region, plan, &z))
    return false;
  const uint32_t last = plan->count - 1;
  for (uint32_t i = 0; i <= last; ++i) {
    const rim_pose *next = &plan->pose[i < last ? i + 1 : i];
    if (next->after_s < from_s && i < last)
      continue; /* behind us */
    sweep s = {.config = config, .from = plan->pose[i], .to = *next};
    if (s.from.after_s < from_s && next->after_s > s.from.after_s)
      s.from = between(&plan->pose[i], next,
                       rimi_min((from_s - s.from.after_s) / (next->after_s - s.from.after_s), 1.0));
    if (!overlaps(&s, &z))
      continue;
    result->enters = true;
    result->pose = i;
    result->after_s = first_moment(&s, &z);
    return true;
  }
  return true;
}

bool rim_lookahead_update(rim_lookahead *state, const rim_lookahead_config *config,
                          const rim_monitor *monitor, uint32_t model_id, double row_s, bool replay,
                          bool again, rim_entry *entry) {
  if (state == NULL || config == NULL || monitor == NULL || entry == NULL || state->plan.count == 0)
    return false;
  const rim_alarm *alarm = rim_monitor_standing(monitor, RIM_DETECTOR_RIM);
  rim_lookahead_result found;
  const double from_s = row_s - (double)state->plan.t_us / 1e6;
  const bool enters = alarm != NULL &&
                      rim_lookahead_check(config, &alarm->region, &state->plan, from_s, &found) &&
                      found.enters;
  const bool did = state->told.sequence != 0 && state->told.to_entry_s >= 0.0;
  if (enters == did && !(enters && again))
    return false;
  state->told = (rim_entry){.t_s = row_s,
                            .to_entry_s = RIM_ENTRY_NEVER,
                            .sequence = ++state->sequence,
                            .alarm_sequence =
                                alarm != NULL ? alarm->seq : rim_monitor_alarms(monitor).newest.seq,
                            .plan_sequence = state->plan.sequence,
                            .model_id = model_id,
                            .flags = replay ? RIM_ALARM_FLAG_REPLAY : 0};
  if (enters) {
    state->told.to_entry_s = found.after_s > from_s ? found.after_s - from_s : 0.0;
    state->told.pose = found.pose;
  }
  *entry = state->told;
  return true;
}
