// SPDX-License-Identifier: MIT
// world/freekick.hpp - free kicks with six plans against three defences (thesis appendix B,
// p. 117-124): the state is the ball's place, the action a plan, the reward 1 for a goal, else 0.
//
// A plan (2FKP, B.2) sends four receivers from p_i^s to p_i^f while the kicker passes to the most
// promising. The defence (B.4.1) has a goalie, a robot after the ball, two that block the angle
// from the ball to the goal, and two that mark the most threatening receivers, ranked
//   time      by how soon each could have received a pass and have shot
//   angle     by how wide it sees the goal
//   combined  by the angle while that is narrower than phi_max, above it by time
// Markers are assigned before the kick; they follow their men, late and no faster than they can.
// The chance of a goal is that of the pass (a logistic function of how clear its path is of
// defenders) times that of the shot (of the widest angle of the goal that they leave free). In
// place of the thesis's physics simulation the chance is a formula, so the true expected reward is
// exact.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "world/random.hpp"

namespace rim {

enum class Defence { time, angle, combined };
constexpr std::size_t kDefences = 3;
const char *defence_name(Defence defence);
Defence parse_defence(const std::string &name); // throws UsageError

constexpr std::size_t kFreekickPlans = 6;
constexpr std::size_t kFreekickReceivers = 4;
constexpr std::size_t kFreekickMarkers = 2;

struct FieldPoint {
  double x_m = 0.0, y_m = 0.0;
};

struct FreekickReceiver {
  FieldPoint before, after; // p_i^s and p_i^f
};
using FreekickPlan = std::array<FreekickReceiver, kFreekickReceivers>;

struct FreekickParams { // data/freekick.toml says where each comes from
  double half_length_m, half_width_m, goal_half_m, robot_radius_m;
  double pass_speed_mps, shot_speed_mps, open_angle_rad;
  double ball_min_x_m, ball_max_x_m, ball_min_y_m, ball_max_y_m;
  double robot_accel_mps2, robot_speed_mps, mark_m, latency_s;
  double pass_half_m, pass_scale_m, shot_half_rad, shot_scale_rad, best_chance;
  std::array<FreekickPlan, kFreekickPlans> plans;
};

// Every key must be there; the overlay, where there is one, may hold some. Throws DataError. As a
// file: read back to the same bits.
FreekickParams read_freekick_params(const std::string &path, const std::string &overlay = "");
std::string freekick_params_toml(const FreekickParams &params);

class Freekick {
public:
  Freekick(const FreekickParams &params, Defence defence) : params_(params), defence_(defence) {}

  // The chance of a goal by a plan (0 .. 5) from this place: the true expected reward.
  double chance(const FieldPoint &ball, std::size_t plan) const;
  double best_chance(const FieldPoint &ball) const;
  // The kicking team's own model of its plan: it knows the goalie, the robot after the ball and the
  // blockers, which all defences have (B.4.1), but not whom the defence marks: the mean over all
  // pairs of receivers. The same for every defence.
  double own_estimate(const FieldPoint &ball, std::size_t plan) const;

  // Receivers, the most threatening first, at p_i^s.
  std::array<std::size_t, kFreekickReceivers> ranking(const FieldPoint &ball,
                                                      std::size_t plan) const;
  // Width of the goal seen from a place, nobody in between.
  double goal_angle_rad(const FieldPoint &from) const;
  const FreekickParams &params() const { return params_; }

private:
  using Marked = std::array<std::size_t, kFreekickMarkers>; // receivers

  double threat(const FieldPoint &ball, const FieldPoint &at) const;
  double chance_against(const FieldPoint &ball, std::size_t plan, const Marked &marked) const;
  std::vector<FieldPoint> defenders(const FieldPoint &ball, std::size_t plan, const Marked &marked,
                                    double moving_s) const;
  double pass_chance(const FieldPoint &from, const FieldPoint &to,
                     const std::vector<FieldPoint> &defenders) const;
  double shot_chance(const FieldPoint &from, const std::vector<FieldPoint> &defenders) const;

  FreekickParams params_;
  Defence defence_;
};

// Places of the ball and luck of one run: the same for every policy.
struct FreekickEpisode {
  FieldPoint ball;
  double luck = 0.0;   // a goal where it is below the chance
  double choice = 0.0; // for choosing at random
};
std::vector<FreekickEpisode> freekick_episodes(const FreekickParams &params, std::size_t kicks,
                                               std::uint64_t seed);

} // namespace rim
