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

#include "base/ellipsoid.h"
#include "bits.h"
#include "rim/plan/lookahead.h"

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

static rim_lookahead_config square(double half) {
  rim_lookahead_config c = {.axis = {4, 7, RIM_LOOKAHEAD_NO_AXIS}, .vertices = 4};
  for (unsigned v = 0; v < 4; ++v) {
    c.vertex[v][0] = (v & 1u) != 0 ? half : -half;
    c.vertex[v][1] = (v & 2u) != 0 ? half : -half;
  }
  return c;
}

static void a_straight_way_enters_when_the_edge_does(void **state) {
  (void)state;
  const rim_lookahead_config c = square(0.5);
  const rim_region region = sphere(10.0, 0.0, 2.0);
  rim_plan plan = {.count = 2};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  plan.pose[1] = pose(20.0, 20.0, 0.0, 0.0); /* 1 m/s: the edge at +0.5 meets x = 8 after 7.5 s */
  rim_lookahead_result r;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
  assert_true(r.enters && r.pose == 0);
  assert_true(fabs(r.after_s - 7.5) < 20.0 / 256.0 + 1e-3);
  assert_true(r.after_s <= 7.5 + 1e-3); /* never later than it is */
  /* From within: at once. Behind: never. */
  assert_true(rim_lookahead_check(&c, &region, &plan, 9.0, &r) && r.enters && r.after_s == 9.0);
  assert_true(rim_lookahead_check(&c, &region, &plan, 13.0, &r) && !r.enters);
  /* Past it at 2.6 m: the corner of the square passes at 2.1. With a margin of 0.2 it does not. */
  for (unsigned i = 0; i < 2; ++i)
    plan.pose[i].position[1] = 2.6;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && !r.enters);
  rim_lookahead_config wide = c;
  wide.margin_m = 0.2;
  assert_true(rim_lookahead_check(&wide, &region, &plan, 0.0, &r) && r.enters);
}

static void a_vehicle_without_vertices_is_a_point(void **state) {
  (void)state;
  const rim_lookahead_config c = {.axis = {4, 7, RIM_LOOKAHEAD_NO_AXIS},
                                  .vertex = {{5.0, 5.0, 0.0}}}; /* not one that counts */
  const rim_region region = sphere(10.0, 0.0, 2.0);
  rim_plan plan = {.count = 2};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.3);
  plan.pose[1] = pose(20.0, 20.0, 0.0, 0.3);
  rim_lookahead_result r;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  assert_true(fabs(r.after_s - 8.0) < 20.0 / 256.0 + 1e-3 && r.after_s <= 8.0 + 1e-3);
  for (unsigned i = 0; i < 2; ++i)
    plan.pose[i].position[1] = 2.1;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && !r.enters);
}

/* To touch the region is not to enter it, from whichever side. */
static void what_only_touches_does_not_enter(void **state) {
  (void)state;
  const rim_lookahead_config c = {.axis = {4, 7, RIM_LOOKAHEAD_NO_AXIS}};
  const rim_region region = sphere(10.0, -4.0, 2.0);
  static const double touching[][2] = {{8.0, -4.0}, {12.0, -4.0}, {10.0, -6.0}, {10.0, -2.0}};
  for (size_t i = 0; i < sizeof touching / sizeof *touching; ++i) {
    rim_plan plan = {.count = 1};
    rim_lookahead_result r;
    plan.pose[0] = pose(0.0, touching[i][0], touching[i][1], 0.0);
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && !r.enters);
    for (int k = 0; k < 2; ++k) /* a little nearer */
      plan.pose[0].position[k] += 0.01 * (region.center[k] - plan.pose[0].position[k]);
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  }
}

static void a_turn_sweeps_its_corner(void **state) {
  (void)state;
  rim_lookahead_config c = square(0.1);
  c.vertex[1][0] = c.vertex[3][0] = 5.0; /* a beam of 5 m */
  const rim_region region = sphere(0.0, 4.0, 0.5);
  rim_plan plan = {.count = 3};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  plan.pose[1] = pose(1.0, 0.0, 0.0, PI / 4);
  plan.pose[2] = pose(2.0, 0.0, 0.0, PI / 2);
  rim_lookahead_result r;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
  assert_true(r.enters && r.pose == 1 && r.after_s > 1.3 && r.after_s < 2.0);
  /* Its side meets it at 81.37 degrees, 4 cos 81.37 = 0.1 + 0.5; orientations along the chord are
   * there at 0.806 of the way. */
  assert_true(r.after_s > 1.806 - 0.02 && r.after_s < 1.807);
}

static void only_physical_regions_are_looked_at(void **state) {
  (void)state;
  const rim_lookahead_config c = square(0.5);
  rim_region region = sphere(0.0, 0.0, 2.0);
  rim_plan plan = {.count = 1};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  rim_lookahead_result r;
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  region.feature[1] = 5; /* a speed, say */
  assert_false(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
  region.dims = 0; /* everywhere: it is no place */
  assert_false(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
  region = sphere(0.0, 0.0, 2.0);
  region.inverse_shape[0] = -1.0;
  assert_false(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
  region = sphere(100.0, 0.0, 2.0);
  region.dims = 1; /* a wall: x from 98 to 102, whatever y */
  region.inverse_shape[0] = 0.25;
  plan.count = 2;
  plan.pose[1] = pose(10.0, 200.0, 5000.0, 0.0);
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
  assert_true(fabs(r.after_s - 4.875) < 10.0 / 256.0 + 1e-3);
  plan.count = 3; /* met by the last of several ways, far along it */
  plan.pose[1] = pose(10.0, 0.0, 0.0, 0.0);
  plan.pose[2] = pose(20.0, 110.0, 5000.0, 0.0);
  assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters && r.pose == 1);
  assert_true(r.after_s > 18.0 && r.after_s < 19.0);
}

/* A region over one axis has no limit along the others, however far the vehicle reaches there: a
 * beam whose ends lie 100 m off, along each axis in turn, with a region of another axis. */
static void a_region_has_no_limit_along_other_axes(void **state) {
  (void)state;
  for (size_t along = 0; along < 3; ++along) {
    for (size_t named = 0; named < 3; ++named) {
      rim_lookahead_config c = {.axis = {4, 7, 9}, .vertices = 2};
      const double lower = 1.0, upper = 2.0;
      rim_region region;
      rim_plan plan = {.count = 1};
      rim_lookahead_result r;
      if (named == along)
        continue;
      c.vertex[0][along] = 100.0;
      c.vertex[1][along] = 101.0;
      assert_int_equal(rimi_region_from_box(&region, 1, &c.axis[named], &lower, &upper), RIM_OK);
      plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
      assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && !r.enters);
      plan.pose[0].position[named] = 1.5;
      assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r) && r.enters);
    }
  }
}

/* Bodies whose middles lie on one line, and bodies that only a slanted plane parts. */
static void bodies_in_line(void **state) {
  (void)state;
  const rim_lookahead_config c = square(0.5);
  rim_plan plan = {.count = 1};
  plan.pose[0] = pose(0.0, 0.0, 0.0, 0.0);
  rim_lookahead_result r;
  for (int i = 0; i < 40; ++i) {
    const double at = 0.1 * i, gap = at - 0.5 - 1.0;
    const rim_region region = sphere(at, 0.0, 1.0);
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
    if (fabs(gap) > 0.01)
      assert_int_equal(r.enters, gap < 0.0);
    const rim_region corner = sphere(at, at, 1.0); /* the corner at (.5, .5) is met first */
    assert_true(rim_lookahead_check(&c, &corner, &plan, 0.0, &r));
    if (fabs(sqrt(2.0) * (at - 0.5) - 1.0) > 0.01)
      assert_int_equal(r.enters, sqrt(2.0) * (at - 0.5) < 1.0);
  }
}

/* Whether the square at a pose overlaps the ellipse: its boundary and the ellipse's, densely. */
static bool dense(const rim_region *region, double x, double y, double yaw, double half) {
  for (int edge = 0; edge < 4; ++edge)
    for (int i = 0; i <= 60; ++i) {
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

static void fill_stack(uint8_t byte) {
  volatile uint8_t left_behind[8192];
  for (size_t i = 0; i < sizeof left_behind; ++i)
    left_behind[i] = byte;
}

/* What calls before left on the stack, zeroes or no numbers, is no part of an answer. */
static void answers_do_not_depend_on_the_stack(void **state) {
  (void)state;
  void (*volatile const leave)(uint8_t) = fill_stack; /* called, whatever a compiler sees */
  const rim_lookahead_config c = square(0.5);
  const rim_region region = sphere(10.0, 0.0, 2.0);
  rim_plan plan = {.count = 2};
  for (int i = 0; i < 40; ++i) {
    const double y = 0.05 + 0.1 * i;
    plan.pose[0] = pose(0.0, 0.0, y, 0.0);
    plan.pose[1] = pose(20.0, 20.0, y, 0.0);
    rim_lookahead_result r;
    leave(i % 2 == 0 ? 0x00 : 0xff);
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
    assert_int_equal(r.enters, y < 2.5);
    if (y < 0.5) /* its edge holds the nearest point */
      assert_true(fabs(r.after_s - 7.5) < 20.0 / 256.0 + 1e-3);
  }
}

static void agrees_with_a_dense_search(void **state) {
  (void)state;
  uint32_t random = 99;
  printf("seed %u\n", random);
  unsigned entered = 0, passed = 0;
  for (int n = 0; n < 300; ++n) {
    const double half = between(&random, 0.2, 1.5);
    const rim_lookahead_config c = square(half);
    rim_region region = sphere(between(&random, -8, 8), between(&random, -8, 8), 1.0);
    const double a = between(&random, 0.1, 2.0), b = between(&random, 0.1, 2.0);
    region.inverse_shape[0] = a;
    region.inverse_shape[3] = b;
    region.inverse_shape[1] = region.inverse_shape[2] = between(&random, -0.9, 0.9) * sqrt(a * b);
    rim_plan plan = {.count = 20};
    double x = between(&random, -10, 10), y = between(&random, -10, 10);
    const double yaw = between(&random, -3, 3), vx = -x / 8, vy = -y / 8;
    for (uint32_t i = 0; i < plan.count; ++i)
      plan.pose[i] = pose(i, x + vx * i, y + vy * i, yaw);
    double first = -1.0; /* translation alone, so the hull is exact */
    for (int k = 0; k <= 19 * 50 && first < 0.0; ++k)
      if (dense(&region, x + vx * k / 50.0, y + vy * k / 50.0, yaw, half))
        first = k / 50.0;
    rim_lookahead_result r;
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
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

/* The corners of a body that is turned by q, of length 1. */
static void turned(const rim_lookahead_config *c, const double q[4], double corner[8][3]) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  for (uint32_t v = 0; v < c->vertices; ++v)
    for (int k = 0; k < 3; ++k)
      corner[v][k] = turn[k][0] * c->vertex[v][0] + turn[k][1] * c->vertex[v][1] +
                     turn[k][2] * c->vertex[v][2];
}

/* Whether a point between the corners, drawn at random, lies in the region. */
static bool holds_a_point(const rim_region *region, double corner[8][3], uint32_t corners,
                          uint32_t *random) {
  double context[10] = {0}, weight[8], total = 0.0;
  for (uint32_t v = 0; v < corners; ++v)
    total += weight[v] = -log(between(random, 1e-9, 1.0));
  for (int k = 0; k < 3; ++k)
    for (uint32_t v = 0; v < corners; ++v)
      context[region->feature[k]] += weight[v] / total * corner[v][k];
  return rim_region_contains(region, context);
}

/* Whether a plane, drawn at random, parts the two. The region's axes lie along the features. */
static bool is_parted(const rim_region *region, double corner[8][3], uint32_t corners,
                      uint32_t *random) {
  double d[3], most = -1e9, reach = 0.0, center = 0.0;
  for (int k = 0; k < 3; ++k) {
    d[k] = between(random, -1.0, 1.0);
    reach += d[k] * d[k] / region->inverse_shape[4 * k];
    center += d[k] * region->center[k];
  }
  for (uint32_t v = 0; v < corners; ++v)
    most = fmax(most, d[0] * corner[v][0] + d[1] * corner[v][1] + d[2] * corner[v][2]);
  return most < center - sqrt(reach) - 1e-3;
}

/* Bodies of any shape and attitude in space: where a point of the body lies in the region it
 * enters, and where a plane parts the two it does not. */
static void bodies_in_space(void **state) {
  (void)state;
  uint32_t random = 1234;
  printf("seed %u\n", random);
  unsigned inside = 0, apart = 0;
  for (int n = 0; n < 4000; ++n) {
    rim_lookahead_config c = {.axis = {4, 7, 9}, .vertices = 3 + (uint32_t)n % 6};
    for (uint32_t v = 0; v < c.vertices; ++v)
      for (int k = 0; k < 3; ++k)
        c.vertex[v][k] = between(&random, -1.5, 1.5) * (k == 2 && n % 5 == 0 ? 0.01 : 1.0);
    const uint16_t feature[3] = {4, 7, 9};
    double low[3], high[3], corner[8][3], length = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double at = between(&random, -2.0, 2.0), half = between(&random, 0.1, 1.5);
      low[k] = at - half;
      high[k] = at + half;
    }
    rim_region region;
    assert_int_equal(rimi_region_from_box(&region, 3, feature, low, high), RIM_OK);
    rim_plan plan = {.count = 1};
    double *q = plan.pose[0].orientation;
    for (int k = 0; k < 4; ++k) {
      q[k] = between(&random, -1.0, 1.0);
      length += q[k] * q[k];
    }
    for (int k = 0; k < 4; ++k)
      q[k] /= sqrt(length);
    turned(&c, q, corner);
    bool is_inside = false, is_apart = false;
    for (int i = 0; i < 400 && !is_inside && !is_apart; ++i) {
      is_inside = holds_a_point(&region, corner, c.vertices, &random);
      is_apart = is_parted(&region, corner, c.vertices, &random);
    }
    rim_lookahead_result r;
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
    assert_false(is_inside && !r.enters);
    assert_false(is_apart && r.enters);
    inside += is_inside;
    apart += is_apart;
  }
  assert_true(inside > 500 && apart > 800);
}

/* Ways of several poses past places of one to three axes: whether, where and when they enter. */
static void entries_keep_their_bits(void **state) {
  (void)state;
  static const uint16_t axes[3] = {4, 7, 9};
  uint32_t random = 4321;
  print_message("seed %u\n", random);
  uint64_t digest = BITS_START;
  unsigned entered = 0;
  for (uint32_t n = 0; n < 3000; ++n) {
    rim_lookahead_config c = {.axis = {4, 7, 9}, .vertices = n % 9};
    c.margin_m = n % 3 == 0 ? between(&random, 0.0, 1.0) : 0.0;
    for (uint32_t v = 0; v < c.vertices; ++v)
      for (int k = 0; k < 3; ++k)
        c.vertex[v][k] = between(&random, -1.0, 1.0);
    const uint8_t dims = (uint8_t)(1 + n / 2 % 3);
    uint16_t feature[3];
    double low[3], high[3];
    for (size_t k = 0; k < dims; ++k) {
      feature[k] = axes[(k + n) % 3];
      low[k] = between(&random, -3.0, 2.0);
      high[k] = low[k] + between(&random, 0.1, 3.0);
    }
    rim_region region;
    assert_int_equal(rimi_region_from_box(&region, dims, feature, low, high), RIM_OK);
    if (dims == 2)
      region.inverse_shape[1] = region.inverse_shape[2] =
          between(&random, -0.9, 0.9) * sqrt(region.inverse_shape[0] * region.inverse_shape[3]);
    rim_plan plan = {.count = 1 + n % 5};
    for (uint32_t i = 0; i < plan.count; ++i) {
      rim_pose *p = &plan.pose[i];
      double length = 0.0;
      p->after_s = 2.0 * i;
      for (int k = 0; k < 3; ++k)
        p->position[k] = between(&random, -6.0, 6.0);
      for (int k = 0; k < 4; ++k) {
        p->orientation[k] = between(&random, -1.0, 1.0);
        length += p->orientation[k] * p->orientation[k];
      }
      for (int k = 0; k < 4; ++k)
        p->orientation[k] /= sqrt(length);
    }
    rim_lookahead_result r;
    take_bits(&digest, rim_lookahead_check(&c, &region, &plan, 0.5 * (n % 6), &r));
    take_bits(&digest, (uint64_t)r.pose << 1 | r.enters);
    take_real(&digest, r.after_s);
    entered += r.enters;
  }
  print_message("%u of 3000 enter\n", entered);
  assert_true(entered > 500 && entered < 2500);
  bits_are(digest, UINT64_C(0x41818b0a6a8db58e));
}

/* As many poses and corners as there may be: the last pose, and the last corner, enters. */
static void the_most_poses_and_corners(void **state) {
  (void)state;
  rim_lookahead_config c = square(0.1);
  c.vertices = RIM_LOOKAHEAD_VERTICES;
  for (uint32_t v = 4; v < RIM_LOOKAHEAD_VERTICES; ++v)
    c.vertex[v][0] = v + 1 == RIM_LOOKAHEAD_VERTICES ? 3.0 : 0.0;
  const rim_region region = sphere(10.0, 0.0, 2.0);
  for (int reaches = 0; reaches < 2; ++reaches) {
    rim_plan plan = {.count = RIM_PLAN_MAX_POSES};
    for (uint32_t i = 0; i < RIM_PLAN_MAX_POSES; ++i)
      plan.pose[i] = pose(i, (reaches ? 5.01 : 4.99) * i / (RIM_PLAN_MAX_POSES - 1), 0.0, 0.0);
    rim_lookahead_result r;
    assert_true(rim_lookahead_check(&c, &region, &plan, 0.0, &r));
    assert_int_equal(r.enters, reaches);
    assert_int_equal(r.pose, reaches ? RIM_PLAN_MAX_POSES - 2 : 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_most_poses_and_corners),
      cmocka_unit_test(a_straight_way_enters_when_the_edge_does),
      cmocka_unit_test(a_vehicle_without_vertices_is_a_point),
      cmocka_unit_test(what_only_touches_does_not_enter),
      cmocka_unit_test(a_turn_sweeps_its_corner),
      cmocka_unit_test(only_physical_regions_are_looked_at),
      cmocka_unit_test(answers_do_not_depend_on_the_stack),
      cmocka_unit_test(agrees_with_a_dense_search),
      cmocka_unit_test(bodies_in_space),
      cmocka_unit_test(bodies_in_line),
      cmocka_unit_test(a_region_has_no_limit_along_other_axes),
      cmocka_unit_test(entries_keep_their_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
