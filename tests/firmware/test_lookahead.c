/* SPDX-License-Identifier: MIT */
/* The look-ahead: entries where geometry says they are, found by a dense search that shares no
 * code. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "rimd/lookahead.h"

#define PI 3.14159265358979323846

static double between(uint32_t *state, double low, double high) {
  *state = *state * 1664525u + 1013904223u;
  return low + (high - low) * (double)(*state >> 8) / 16777216.0;
}

static rim_region sphere(double x, double y, double radius) {
  const uint16_t feature[2] = {4, 7};
  const double lower[2] = {x - radius, y - radius}, upper[2] = {x + radius, y + radius};
  rim_region region;
  assert_int_equal(rimi_region_from_box(&region, 2, feature, lower, upper), RIM_OK);
  return region;
}

static rim_pose pose(double after_s, double x, double y, double yaw) {
  const rim_pose p = {after_s, {x, y, 0.0}, {cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)}};
  return p;
}

static lookahead_config square(double half) {
  lookahead_config c = {.axis = {4, 7, LOOKAHEAD_NO_AXIS}, .vertices = 4};
  for (unsigned v = 0; v < 4; v++) {
    c.vertex[v][0] = (v & 1u) != 0 ? half : -half;
    c.vertex[v][1] = (v & 2u) != 0 ? half : -half;
  }
  return c;
}

static void a_straight_way_enters_when_the_edge_does(void **state) {
  (void)state;
  const lookahead_config c = square(0.5);
  const rim_region region = sphere(10.0, 0.0, 2.0);
  rim_plan plan = {.count = 2};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  plan.pose[1] = pose(20.0, 20.0, 0.0, 0.0); /* 1 m/s: the edge at +0.5 meets x = 8 after 7.5 s */
  lookahead_result r;
  assert_true(lookahead_check(&c, &region, &plan, 0.0, &r));
  assert_true(r.enters && r.pose == 0);
  assert_true(fabs(r.after_s - 7.5) < 20.0 / 256.0 + 1e-3);
  assert_true(r.after_s <= 7.5 + 1e-3); /* never later than it is */
  /* From within: at once. Behind: never. */
  assert_true(lookahead_check(&c, &region, &plan, 9.0, &r) && r.enters && r.after_s == 9.0);
  assert_true(lookahead_check(&c, &region, &plan, 13.0, &r) && !r.enters);
  /* Past it at 2.6 m: the corner of the square passes at 2.1. With a margin of 0.2 it does not. */
  for (unsigned i = 0; i < 2; i++)
    plan.pose[i].position[1] = 2.6;
  assert_true(lookahead_check(&c, &region, &plan, 0.0, &r) && !r.enters);
  lookahead_config wide = c;
  wide.margin_m = 0.2;
  assert_true(lookahead_check(&wide, &region, &plan, 0.0, &r) && r.enters);
}

static void a_turn_sweeps_its_corner(void **state) {
  (void)state;
  lookahead_config c = square(0.1);
  c.vertex[1][0] = c.vertex[3][0] = 5.0; /* a beam of 5 m */
  const rim_region region = sphere(0.0, 4.0, 0.5);
  rim_plan plan = {.count = 3};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  plan.pose[1] = pose(1.0, 0.0, 0.0, PI / 4);
  plan.pose[2] = pose(2.0, 0.0, 0.0, PI / 2);
  lookahead_result r;
  assert_true(lookahead_check(&c, &region, &plan, 0.0, &r));
  assert_true(r.enters && r.pose == 1 && r.after_s > 1.3 && r.after_s < 2.0);
}

static void only_physical_regions_are_looked_at(void **state) {
  (void)state;
  const lookahead_config c = square(0.5);
  rim_region region = sphere(0.0, 0.0, 2.0);
  rim_plan plan = {.count = 1};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  lookahead_result r;
  assert_true(lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  region.feature[1] = 5; /* a speed, say */
  assert_false(lookahead_check(&c, &region, &plan, 0.0, &r));
  region.dims = 0; /* everywhere: it is no place */
  assert_false(lookahead_check(&c, &region, &plan, 0.0, &r));
  region = sphere(0.0, 0.0, 2.0);
  region.inverse_shape[0] = -1.0;
  assert_false(lookahead_check(&c, &region, &plan, 0.0, &r));
  region = sphere(100.0, 0.0, 2.0);
  region.dims = 1; /* a wall: x from 98 to 102, whatever y */
  region.inverse_shape[0] = 0.25;
  plan.count = 2;
  plan.pose[1] = pose(10.0, 200.0, 5000.0, 0.0);
  assert_true(lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  assert_true(fabs(r.after_s - 4.875) < 10.0 / 256.0 + 1e-3);
}

/* Whether the square at a pose overlaps the ellipse: its boundary and the ellipse's, densely. */
static bool dense(const rim_region *region, double x, double y, double yaw, double half) {
  for (int edge = 0; edge < 4; edge++)
    for (int i = 0; i <= 60; i++) {
      const double along = half * (2.0 * i / 60.0 - 1.0);
      const double bx = edge == 0 ? half : edge == 1 ? -half : along;
      const double by = edge == 2 ? half : edge == 3 ? -half : along;
      double context[8] = {0};
      context[4] = x + bx * cos(yaw) - by * sin(yaw);
      context[7] = y + bx * sin(yaw) + by * cos(yaw);
      if (rim_region_contains(region, context))
        return true;
    }
  const double dx = region->center[0] - x, dy = region->center[1] - y;
  return fabs(dx * cos(yaw) + dy * sin(yaw)) < half && fabs(dy * cos(yaw) - dx * sin(yaw)) < half;
}

static void agrees_with_a_dense_search(void **state) {
  (void)state;
  uint32_t random = 99;
  printf("seed %u\n", random);
  unsigned entered = 0, passed = 0;
  for (int n = 0; n < 300; n++) {
    const double half = between(&random, 0.2, 1.5);
    const lookahead_config c = square(half);
    rim_region region = sphere(between(&random, -8, 8), between(&random, -8, 8), 1.0);
    const double a = between(&random, 0.1, 2.0), b = between(&random, 0.1, 2.0);
    region.inverse_shape[0] = a;
    region.inverse_shape[3] = b;
    region.inverse_shape[1] = region.inverse_shape[2] = between(&random, -0.9, 0.9) * sqrt(a * b);
    rim_plan plan = {.count = 20};
    double x = between(&random, -10, 10), y = between(&random, -10, 10);
    const double yaw = between(&random, -3, 3), vx = -x / 8, vy = -y / 8;
    for (uint32_t i = 0; i < plan.count; i++)
      plan.pose[i] = pose(i, x + vx * i, y + vy * i, yaw);
    double first = -1.0; /* translation alone, so the hull is exact */
    for (int k = 0; k <= 19 * 50 && first < 0.0; k++)
      if (dense(&region, x + vx * k / 50.0, y + vy * k / 50.0, yaw, half))
        first = k / 50.0;
    lookahead_result r;
    assert_true(lookahead_check(&c, &region, &plan, 0.0, &r));
    if (first >= 0.0) {
      assert_true(r.enters);
      assert_true(fabs(r.after_s - first) < 0.06);
      entered++;
    } else {
      /* What the dense search sees as a miss may be a graze between its points. */
      passed += r.enters ? 0 : 1;
    }
  }
  assert_true(entered > 60 && passed > 60);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_straight_way_enters_when_the_edge_does),
      cmocka_unit_test(a_turn_sweeps_its_corner),
      cmocka_unit_test(only_physical_regions_are_looked_at),
      cmocka_unit_test(agrees_with_a_dense_search),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
