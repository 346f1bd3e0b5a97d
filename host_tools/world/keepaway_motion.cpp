// SPDX-License-Identifier: MIT
#include "world/keepaway_motion.hpp"

#include <algorithm>
#include <cmath>

#include <ccd/ccd.h>

namespace rim::world {
namespace {

constexpr double kRollingPart = 5.0 / 7.0; // of its speed, that a solid ball keeps until it rolls
constexpr double kHalfHeight_m = 0.5;      // so tall that no overlap is least along the vertical
constexpr int kRounds = 8;                 // of taking bodies apart, a step
constexpr unsigned long kContactIterations = 60;
constexpr double kContactTolerance_m = 1e-6;

// What libccd sees: a cylinder, cut off at the front where front_m < radius_m, or a ball.
struct Shape {
  Vec2 at, forward;
  double radius_m, front_m;
  bool is_ball;
};

void support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *point) {
  const auto &s = *static_cast<const Shape *>(object);
  const double dz = direction->v[2];
  const Vec2 d(direction->v[0], direction->v[1]);
  if (s.is_ball) {
    const double scale = s.radius_m / std::sqrt(d.squaredNorm() + dz * dz);
    point->v[0] = s.at.x() + scale * d.x();
    point->v[1] = s.at.y() + scale * d.y();
    point->v[2] = scale * dz;
    return;
  }
  const Vec2 left(-s.forward.y(), s.forward.x());
  const double length = d.norm();
  double ahead = length > 0.0 ? s.radius_m * s.forward.dot(d) / length : 0.0;
  double beside = length > 0.0 ? s.radius_m * left.dot(d) / length : 0.0;
  if (ahead > s.front_m) { // the corner on that side
    ahead = s.front_m;
    beside = std::copysign(std::sqrt(s.radius_m * s.radius_m - s.front_m * s.front_m), beside);
  }
  const Vec2 p = s.at + ahead * s.forward + beside * left;
  point->v[0] = p.x();
  point->v[1] = p.y();
  point->v[2] = std::copysign(kHalfHeight_m, dz);
}

void centre(const void *object, ccd_vec3_t *point) {
  const auto &s = *static_cast<const Shape *>(object);
  point->v[0] = s.at.x();
  point->v[1] = s.at.y();
  point->v[2] = 0.0;
}

Overlap overlap(const Shape &a, const Shape &b) {
  const double reach = a.radius_m + b.radius_m;
  if ((b.at - a.at).squaredNorm() >= reach * reach)
    return {};
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = ccd.support2 = support;
  ccd.center1 = ccd.center2 = centre;
  ccd.max_iterations = kContactIterations;
  ccd.mpr_tolerance = kContactTolerance_m;
  ccd_real_t depth = 0.0;
  ccd_vec3_t direction, position;
  if (ccdMPRPenetration(&a, &b, &ccd, &depth, &direction, &position) != 0)
    return {};
  const Vec2 flat(direction.v[0], direction.v[1]);
  const double length = flat.norm();
  if (!(depth > 0.0) || !(length > 0.5)) {
    const Vec2 between = b.at - a.at; // touching, or one inside the other's middle
    return {std::max(0.0, static_cast<double>(depth)),
            between.norm() > 0.0 ? Vec2(between.normalized()) : a.forward};
  }
  return {depth / length, flat / length};
}

Shape shape_of(const KeepawayRobot &robot, const BodySizes &sizes) {
  return {robot.at_m,
          {std::cos(robot.heading_rad), std::sin(robot.heading_rad)},
          sizes.robot_radius_m,
          sizes.robot_front_m,
          false};
}

Shape shape_of(const KeepawayBall &ball, const BodySizes &sizes) {
  return {ball.at_m, {1.0, 0.0}, sizes.ball_radius_m, sizes.ball_radius_m, true};
}

// Equal and opposite impulses along `away`, such that the approach becomes restitution times a
// separation; positions in inverse proportion to mass. Returns the speed of approach, 0: none.
double push(const Overlap &o, Vec2 &at_a, Vec2 &v_a, double mass_a, Vec2 &at_b, Vec2 &v_b,
            double mass_b, double restitution) {
  const double part_a = mass_b / (mass_a + mass_b);
  at_a -= part_a * o.depth_m * o.away;
  at_b += (1.0 - part_a) * o.depth_m * o.away;
  const double approach = (v_a - v_b).dot(o.away);
  if (approach <= 0.0)
    return 0.0;
  v_a -= part_a * (1.0 + restitution) * approach * o.away;
  v_b += (1.0 - part_a) * (1.0 + restitution) * approach * o.away;
  return approach;
}

bool push_robots(std::vector<KeepawayRobot> &robots, const BodySizes &sizes) {
  bool any = false;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      const Overlap o = overlap_of(robots[i], robots[j], sizes);
      if (!(o.depth_m > 0.0))
        continue;
      push(o, robots[i].at_m, robots[i].velocity_mps, sizes.robot_mass_kg, robots[j].at_m,
           robots[j].velocity_mps, sizes.robot_mass_kg, sizes.robot_restitution);
      any = true;
    }
  }
  return any;
}

double turned(double rad) { return std::remainder(rad, 6.283185307179586); }

} // namespace

double ball_path_m(const BallFriction &f, double v, double t) {
  const double rolling = kRollingPart * v, slide_s = (v - rolling) / f.slide_mps2;
  if (t <= slide_s)
    return v * t - 0.5 * f.slide_mps2 * t * t;
  const double roll_s = std::min(t - slide_s, rolling / f.roll_mps2);
  return 0.5 * (v + rolling) * slide_s + rolling * roll_s - 0.5 * f.roll_mps2 * roll_s * roll_s;
}

double ball_speed_mps(const BallFriction &f, double v, double t) {
  const double rolling = kRollingPart * v, slide_s = (v - rolling) / f.slide_mps2;
  if (t <= slide_s)
    return v - f.slide_mps2 * t;
  return std::max(0.0, rolling - f.roll_mps2 * (t - slide_s));
}

void KeepawayBall::kick(const Vec2 &velocity) {
  velocity_mps = velocity;
  slid_from_mps = velocity.norm();
  sliding_s = 0.0;
}

void KeepawayBall::step(const BallFriction &friction, double step_s) {
  const double speed = velocity_mps.norm();
  if (!(speed > 0.0))
    return;
  const Vec2 forward = velocity_mps / speed;
  const double before = ball_path_m(friction, slid_from_mps, sliding_s);
  sliding_s += step_s;
  at_m += (ball_path_m(friction, slid_from_mps, sliding_s) - before) * forward;
  velocity_mps = ball_speed_mps(friction, slid_from_mps, sliding_s) * forward;
}

void step_robot(KeepawayRobot &robot, const Vec2 &wanted_mps, double heading_rad,
                const MotionLimits &limits, double step_s) {
  Vec2 wanted = wanted_mps;
  if (wanted.norm() > limits.speed_mps)
    wanted *= limits.speed_mps / wanted.norm();
  Vec2 change = wanted - robot.velocity_mps;
  const double most = limits.accel_mps2 * step_s;
  if (change.norm() > most)
    change *= most / change.norm();
  robot.at_m += step_s * (robot.velocity_mps + 0.5 * change);
  robot.velocity_mps += change;
  const double turn = limits.turn_radps * step_s;
  const double by = std::clamp(turned(heading_rad - robot.heading_rad), -turn, turn);
  robot.rate_radps = by / step_s;
  robot.heading_rad = turned(robot.heading_rad + by);
}

void coast_to_stop(KeepawayRobot &robot, const MotionLimits &limits, double time_s) {
  const double speed = robot.velocity_mps.norm();
  if (!(speed > 0.0))
    return;
  const double braking = std::min(time_s, speed / limits.accel_mps2);
  const Vec2 forward = robot.velocity_mps / speed;
  robot.at_m += (speed * braking - 0.5 * limits.accel_mps2 * braking * braking) * forward;
  robot.velocity_mps -= limits.accel_mps2 * braking * forward;
}

Vec2 drive_to(const KeepawayRobot &robot, const Vec2 &to_m, const MotionLimits &limits) {
  const Vec2 way = to_m - robot.at_m;
  const double distance = way.norm();
  if (distance < 1e-6)
    return Vec2::Zero();
  // Nine tenths of the deceleration: what is left takes up the control's delay.
  const double speed = std::sqrt(2.0 * 0.9 * limits.accel_mps2 * distance);
  return way * (std::min(speed, limits.speed_mps) / distance);
}

Vec2 drive_through(const KeepawayRobot &robot, const Vec2 &to_m, double by_s,
                   const MotionLimits &limits) {
  Vec2 accel = 2.0 * (to_m - robot.at_m - by_s * robot.velocity_mps) / (by_s * by_s);
  if (accel.norm() > limits.accel_mps2)
    accel *= limits.accel_mps2 / accel.norm();
  return robot.velocity_mps + by_s * accel;
}

Overlap overlap_of(const KeepawayRobot &a, const KeepawayRobot &b, const BodySizes &sizes) {
  return overlap(shape_of(a, sizes), shape_of(b, sizes));
}

Overlap overlap_of(const KeepawayRobot &robot, const KeepawayBall &ball, const BodySizes &sizes) {
  return overlap(shape_of(robot, sizes), shape_of(ball, sizes));
}

int resolve_contacts(std::vector<KeepawayRobot> &robots, KeepawayBall *ball, const BodySizes &sizes,
                     double *impact_mps) {
  int touched = -1;
  double deepest = 0.0, impact = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    bool any = push_robots(robots, sizes);
    for (std::size_t i = 0; ball != nullptr && i < robots.size(); ++i) {
      const Overlap o = overlap_of(robots[i], *ball, sizes);
      if (!(o.depth_m > 0.0))
        continue;
      any = true;
      const double approach =
          push(o, robots[i].at_m, robots[i].velocity_mps, sizes.robot_mass_kg, ball->at_m,
               ball->velocity_mps, sizes.ball_mass_kg, sizes.ball_restitution);
      if (approach > 0.0)
        ball->kick(ball->velocity_mps);
      if (round == 0 && o.depth_m > deepest) {
        deepest = o.depth_m;
        touched = static_cast<int>(i);
        impact = approach;
      }
    }
    if (!any)
      break;
  }
  if (impact_mps != nullptr)
    *impact_mps = impact;
  return touched;
}

} // namespace rim::world
