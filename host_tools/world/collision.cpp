// SPDX-License-Identifier: MIT
#include "world/collision.hpp"

#include <ccd/ccd.h>
#include <cmath>

namespace rim::world {
namespace {

constexpr double kTolerance_m = 1e-5;
constexpr unsigned long kIterations = 100;

void support_body(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *point) {
  const auto &b = *static_cast<const UprightCylinder *>(object);
  const double dx = ccdVec3X(direction), dy = ccdVec3Y(direction);
  const double length = std::hypot(dx, dy);
  const double r = length > 0.0 ? b.radius_m / length : 0.0;
  ccdVec3Set(point, b.x_m + r * dx, b.y_m + r * dy, ccdVec3Z(direction) > 0.0 ? b.height_m : 0.0);
}

void centre_body(const void *object, ccd_vec3_t *point) {
  const auto &b = *static_cast<const UprightCylinder *>(object);
  ccdVec3Set(point, b.x_m, b.y_m, 0.5 * b.height_m);
}

void support_table(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *point) {
  const auto &t = *static_cast<const TableTop *>(object);
  const double c = std::cos(t.angle_rad), s = std::sin(t.angle_rad);
  const double dx = ccdVec3X(direction), dy = ccdVec3Y(direction);
  const double along = std::copysign(t.half_m, c * dx + s * dy);
  const double across = std::copysign(t.half_across_m, -s * dx + c * dy);
  ccdVec3Set(point, t.x_m + c * along - s * across, t.y_m + s * along + c * across,
             ccdVec3Z(direction) > 0.0 ? t.high_m : t.low_m);
}

void centre_table(const void *object, ccd_vec3_t *point) {
  const auto &t = *static_cast<const TableTop *>(object);
  ccdVec3Set(point, t.x_m, t.y_m, 0.5 * (t.low_m + t.high_m));
}

} // namespace

bool touches(const UprightCylinder &body, const TableTop &table) {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = support_body;
  ccd.support2 = support_table;
  ccd.center1 = centre_body;
  ccd.center2 = centre_table;
  ccd.max_iterations = kIterations;
  ccd.mpr_tolerance = kTolerance_m;
  return ccdMPRIntersect(&body, &table, &ccd) != 0;
}

} // namespace rim::world
