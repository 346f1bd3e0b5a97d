// SPDX-License-Identifier: MIT
// world/collision.hpp - does the body of a robot touch a table top? Intersection of convex bodies
// by libccd.
#pragma once

namespace rim::world {

// Stands on the floor; m.
struct UprightCylinder {
  double x_m = 0.0, y_m = 0.0, radius_m = 0.0, height_m = 0.0;
};

// A level slab: centre, direction of its first half side, half sides, heights of its faces.
struct TableTop {
  double x_m = 0.0, y_m = 0.0, angle_rad = 0.0;
  double half_m = 0.0, half_across_m = 0.0;
  double low_m = 0.0, high_m = 0.0;
};

// Exact to 0.1 mm.
bool touches(const UprightCylinder &body, const TableTop &table);

} // namespace rim::world
