// SPDX-License-Identifier: MIT
// world/keepaway_motion.hpp - bodies of the keepaway world: ball and robots in the plane, their
// motion and contacts.
//
// The ball slides with one deceleration until it has 5/7 of the speed at which it began to slide,
// and then rolls with another, as in the goalie world. A robot follows a commanded velocity within
// its acceleration. Seen from above a robot is a disc cut off at the front, where it kicks;
// contacts are found by libccd (MPR).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace rim::world {

using Vec2 = Eigen::Vector2d;

struct BallFriction {
  double slide_mps2 = 3.5;
  double roll_mps2 = 0.4;
};

// Path and speed of a ball time_s >= 0 after it began to slide at speed_mps >= 0. O(1).
double ball_path_m(const BallFriction &friction, double speed_mps, double time_s);
double ball_speed_mps(const BallFriction &friction, double speed_mps, double time_s);

struct KeepawayBall {
  Vec2 at_m = Vec2::Zero();
  Vec2 velocity_mps = Vec2::Zero();
  double slid_from_mps = 0.0; // speed at which it last began to slide
  double sliding_s = 0.0;     // since then

  void kick(const Vec2 &velocity);
  void step(const BallFriction &friction, double step_s);
};

struct KeepawayRobot {
  Vec2 at_m = Vec2::Zero();
  Vec2 velocity_mps = Vec2::Zero();
  double heading_rad = 0.0;
  double rate_radps = 0.0;
};

struct MotionLimits {
  double accel_mps2 = 3.0;
  double speed_mps = 2.0;
  double turn_radps = 8.0;
};

// Follows a velocity as far as the limits allow, turns towards a heading.
void step_robot(KeepawayRobot &robot, const Vec2 &wanted_mps, double heading_rad,
                const MotionLimits &limits, double step_s);

// Where it is and how fast when it has braked for time_s.
void coast_to_stop(KeepawayRobot &robot, const MotionLimits &limits, double time_s);

// The velocity to command next, for a robot that is to stop at a place.
Vec2 drive_to(const KeepawayRobot &robot, const Vec2 &to_m, const MotionLimits &limits);
// And for one that is to be there after by_s > 0, however fast: constant acceleration along the
// distance by which it would miss.
Vec2 drive_through(const KeepawayRobot &robot, const Vec2 &to_m, double by_s,
                   const MotionLimits &limits);

struct BodySizes {
  double robot_radius_m = 0.09;
  double robot_front_m = 0.07; // from its middle to the flat front
  double ball_radius_m = 0.0215;
  double robot_mass_kg = 2.5;
  double ball_mass_kg = 0.046;
  double ball_restitution = 0.5;
  double robot_restitution = 0.1;
};

// Depth of overlap and the direction in which the second has to go; depth 0: apart.
struct Overlap {
  double depth_m = 0.0;
  Vec2 away = Vec2::Zero();
};
Overlap overlap_of(const KeepawayRobot &a, const KeepawayRobot &b, const BodySizes &sizes);
Overlap overlap_of(const KeepawayRobot &robot, const KeepawayBall &ball, const BodySizes &sizes);

// Takes bodies apart and exchanges momentum. Returns the robot that the ball touched, the deepest
// of several; -1: none. ball may be nullptr. impact: their speed of approach, may be nullptr.
int resolve_contacts(std::vector<KeepawayRobot> &robots, KeepawayBall *ball, const BodySizes &sizes,
                     double *impact_mps);

} // namespace rim::world
