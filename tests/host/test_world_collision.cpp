// SPDX-License-Identifier: MIT
// A table top against the robot's body: contact against plane geometry, and what it does to a
// drive.
#include "check.hpp"
#include "util/data_path.hpp"
#include "world/cobot.hpp"
#include "world/collision.hpp"
#include "world/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using namespace rim::world;

// Of the plan: distance from the body's axis to the rectangle.
double distance(const UprightCylinder &b, const TableTop &t) {
  const double c = std::cos(t.angle_rad), s = std::sin(t.angle_rad);
  const double dx = b.x_m - t.x_m, dy = b.y_m - t.y_m;
  const double along = std::max(0.0, std::fabs(c * dx + s * dy) - t.half_m);
  const double across = std::max(0.0, std::fabs(-s * dx + c * dy) - t.half_across_m);
  return std::hypot(along, across);
}

void contact_is_as_in_the_plane(void **) {
  Random random(61, 1, 1);
  int touching = 0, apart = 0;
  for (int k = 0; k < 2000; ++k) {
    const UprightCylinder body{random.uniform(-1, 1), random.uniform(-1, 1), 0.3, 1.2};
    const TableTop table{random.uniform(-0.5, 0.5),
                         random.uniform(-0.5, 0.5),
                         random.uniform(-3.2, 3.2),
                         0.4,
                         0.7,
                         0.70,
                         0.74};
    const double off = distance(body, table) - body.radius_m;
    if (std::fabs(off) < 1e-4)
      continue;
    if (touches(body, table) != (off < 0.0))
      fail_msg("case %d: %g m apart", k, off);
    (off < 0.0 ? touching : apart) += 1;
  }
  assert_true(touching > 100 && apart > 100);
}

void a_table_top_above_or_below_is_passed(void **) {
  const UprightCylinder body{0.0, 0.0, 0.3, 1.2};
  const TableTop at_it{0.5, 0.0, 0.0, 0.4, 0.7, 0.70, 0.74};
  TableTop above = at_it, below = at_it;
  above.low_m = 1.25;
  above.high_m = 1.29;
  below.low_m = -0.08;
  below.high_m = -0.04;
  assert_true(touches(body, at_it));
  assert_false(touches(body, above));
  assert_false(touches(body, below));
}

void the_body_stops_and_goes_on(void **) {
  CobotParams params;
  CobotMap map;
  read_cobot(rim::data_path("cobot.toml"), "", &params, &map);
  params.pose_noise_m = 0.0;
  CobotEffect effect;
  effect.kind = CobotEffectKind::collision;
  effect.duration_s = 3.0;
  Cobot cobot(params, map, {effect}, 61, 1);
  CobotRow row = cobot.next();
  while (!row.acts)
    row = cobot.next();
  const double x_m = row.x_m, y_m = row.y_m;
  int rows = 0, slipping = 0;
  while (row.acts) {
    assert_true(std::hypot(row.x_m - x_m, row.y_m - y_m) < 0.01);
    slipping += std::fabs(row.velocity[0]) > 0.1;
    ++rows;
    row = cobot.next();
  }
  assert_true(rows > 55 && rows < 65);
  assert_true(slipping > 0);
  for (int k = 0; k < 100; ++k)
    row = cobot.next();
  assert_true(std::hypot(row.x_m - x_m, row.y_m - y_m) > 0.5);
}

} // namespace

int main() {
  std::printf("seed 61\n");
  const CMUnitTest tests[] = {
      cmocka_unit_test(contact_is_as_in_the_plane),
      cmocka_unit_test(a_table_top_above_or_below_is_passed),
      cmocka_unit_test(the_body_stops_and_goes_on),
  };
  return cmocka_run_group_tests_name("world_collision", tests, nullptr, nullptr);
}
