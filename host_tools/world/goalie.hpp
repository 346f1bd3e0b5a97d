// SPDX-License-Identifier: MIT
// world/goalie.hpp - shooting at a goalie (thesis 5.3, p. 76-83): the state is the ball's place s
// on the centre line, the action the point a of the goal line to aim at, the reward eq. 5.15.
//
// Origin in the middle of the goal line, x into the field, y along the goal line. The ball leaves
// (s, 0) at the greatest speed with a heading of normal error, slides, then rolls. The goalie
// stands in the middle and moves along x = goalie_line_m.
//   nominal     goes to the ball's path with its greatest acceleration, as eq. 5.18, 5.19 assume
//   region      as nominal, but concedes region_gain_m more in a parallelogram of (s, a) (fig. 5.6)
//   obstructed  starts only when the ball is first seen past an obstruction (fig. 5.7)
//   overshoot   always accelerates towards the ball's path, brakes only beyond it (fig. 5.8)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "world/random.hpp"

namespace rim {

enum class GoalieBehaviour { nominal, region, obstructed, overshoot };

// Throws UsageError.
GoalieBehaviour parse_goalie(const std::string &name);
const char *goalie_name(GoalieBehaviour behaviour);

struct GoalieParams { // data/goalie.toml says where each comes from
  double goal_half_m = 0.5;
  double goalie_radius_m = 0.09;
  double ball_radius_m = 0.0215;
  double goalie_line_m = 0.2;
  double shot_speed_mps = 8.0;
  double slide_decel_mps2 = 3.5;
  double roll_decel_mps2 = 0.4;
  double goalie_accel_mps2 = 3.0;
  double latency_s = 0.1;
  double heading_sd_rad = 0.01;
  double ball_min_m = 1.0;
  double ball_max_m = 5.0;
  double region_min_m = 1.8;
  double region_max_m = 4.2;
  double region_at_min_m = 0.25;
  double region_slope = -0.12;
  double region_half_m = 0.15;
  double region_gain_m = 0.4;
  double obstacle_m = 1.5;
  double obstacle_low_m = -0.04;
  double obstacle_high_m = 0.3;
  double step_s = 0.001;
};

// Every key of [goalie] must be there; the overlay, where there is one, may hold some. Throws
// DataError. As a file: read back to the same bits.
GoalieParams read_goalie_params(const std::string &path, const std::string &overlay = "");
std::string goalie_params_toml(const GoalieParams &params);

class Goalie {
public:
  // Throws std::invalid_argument where the ball could start behind the goalie's line.
  Goalie(const GoalieParams &params, GoalieBehaviour behaviour);

  // The robot's own model: eq. 5.17 and 5.20.
  double nominal_mean(double s_m, double a_m) const;
  double nominal_sd(double s_m, double a_m) const;

  // Reward of a shot aimed at a_m that leaves error_rad beside its heading.
  double reward(double s_m, double a_m, double error_rad) const;
  // Its mean over the heading's error, by 64 equally likely errors: the truth to measure against.
  double expected(double s_m, double a_m) const;

  // Seconds until the ball has gone this far; infinite when it stops before.
  double ball_time_s(double distance_m) const;
  bool in_region(double s_m, double a_m) const;
  const GoalieParams &params() const { return params_; }

private:
  double goalie_at(double start_m, double crossing_m, double time_s) const;
  double seen_s(double s_m, double heading_m) const;
  double distance_at(double time_s) const;

  GoalieParams params_;
  GoalieBehaviour behaviour_;
  std::vector<double> errors_; // standard normal quantiles
};

// States and heading errors of one run: the same for every policy that plays it.
struct GoalieEpisode {
  double s_m = 0.0;
  double error_rad = 0.0;
};
std::vector<GoalieEpisode> goalie_episodes(const GoalieParams &params, std::size_t shots,
                                           std::uint64_t seed);

} // namespace rim
