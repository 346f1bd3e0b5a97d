// SPDX-License-Identifier: MIT
#include "world/goalie.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/real.h"
#include "util/error.hpp"
#include "util/toml_table.hpp"

namespace rim {
namespace {

constexpr std::uint64_t kStateStream = 1;
constexpr std::uint64_t kHeadingStream = 2;
constexpr std::size_t kErrors = 64;
// A ball that rolls without slipping keeps 5/7 of the speed at which it began to slide.
constexpr double kRollingPart = 5.0 / 7.0;

const char *const kNames[] = {"nominal", "region", "obstructed", "overshoot"};

std::vector<NumberKey> keys_of(GoalieParams &p) {
  return {{"goal_half_m", &p.goal_half_m, Range::positive},
          {"goalie_radius_m", &p.goalie_radius_m, Range::positive},
          {"ball_radius_m", &p.ball_radius_m, Range::positive},
          {"goalie_line_m", &p.goalie_line_m, Range::positive},
          {"shot_speed_mps", &p.shot_speed_mps, Range::positive},
          {"slide_decel_mps2", &p.slide_decel_mps2, Range::positive},
          {"roll_decel_mps2", &p.roll_decel_mps2, Range::positive},
          {"goalie_accel_mps2", &p.goalie_accel_mps2, Range::positive},
          {"latency_s", &p.latency_s, Range::not_negative},
          {"heading_sd_rad", &p.heading_sd_rad, Range::positive},
          {"ball_min_m", &p.ball_min_m, Range::positive},
          {"ball_max_m", &p.ball_max_m, Range::positive},
          {"region_min_m", &p.region_min_m, Range::any},
          {"region_max_m", &p.region_max_m, Range::any},
          {"region_at_min_m", &p.region_at_min_m, Range::any},
          {"region_slope", &p.region_slope, Range::any},
          {"region_half_m", &p.region_half_m, Range::not_negative},
          {"region_gain_m", &p.region_gain_m, Range::any},
          {"obstacle_m", &p.obstacle_m, Range::positive},
          {"obstacle_low_m", &p.obstacle_low_m, Range::any},
          {"obstacle_high_m", &p.obstacle_high_m, Range::any},
          {"step_s", &p.step_s, Range::positive}};
}

} // namespace

GoalieBehaviour parse_goalie(const std::string &name) {
  for (int i = 0; i < 4; ++i) {
    if (name == kNames[i])
      return static_cast<GoalieBehaviour>(i);
  }
  throw UsageError("goalie '" + name + "': expected nominal, region, obstructed or overshoot");
}

const char *goalie_name(GoalieBehaviour behaviour) { return kNames[static_cast<int>(behaviour)]; }

static void read_file(const std::string &path, GoalieParams &params, bool complete) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"goalie"});
  const toml::node *table = root.get("goalie");
  if (table == nullptr || !table->is_table())
    throw DataError(path + ": table '[goalie]' is missing");
  read_numbers(path, *table->as_table(), "goalie", keys_of(params), complete);
  if (params.ball_max_m < params.ball_min_m || params.ball_min_m <= params.goalie_line_m)
    throw DataError(path + ": key 'goalie.ball_min_m': must lie between goalie_line_m and "
                           "ball_max_m");
  if (params.obstacle_low_m > params.obstacle_high_m)
    throw DataError(path + ": key 'goalie.obstacle_low_m': must not exceed obstacle_high_m");
}

GoalieParams read_goalie_params(const std::string &path, const std::string &overlay) {
  return read_overlaid<GoalieParams>(path, overlay, read_file);
}

std::string goalie_params_toml(const GoalieParams &params) {
  GoalieParams copy = params;
  return table_toml("[goalie]", keys_of(copy));
}

Goalie::Goalie(const GoalieParams &params, GoalieBehaviour behaviour)
    : params_(params), behaviour_(behaviour) {
  if (params.ball_min_m <= params.goalie_line_m)
    throw std::invalid_argument("goalie: the ball must start before the goalie's line");
  for (std::size_t i = 0; i < kErrors; ++i)
    errors_.push_back(rimi_normal_quantile((static_cast<double>(i) + 0.5) / kErrors));
}

double Goalie::ball_time_s(double distance_m) const {
  const double v0 = params_.shot_speed_mps, v1 = kRollingPart * v0;
  const double slide_s = (v0 - v1) / params_.slide_decel_mps2;
  const double slide_m = 0.5 * (v0 + v1) * slide_s;
  if (distance_m <= slide_m) {
    return (v0 - std::sqrt(v0 * v0 - 2.0 * params_.slide_decel_mps2 * distance_m)) /
           params_.slide_decel_mps2;
  }
  const double left = v1 * v1 - 2.0 * params_.roll_decel_mps2 * (distance_m - slide_m);
  if (left < 0.0)
    return std::numeric_limits<double>::infinity();
  return slide_s + (v1 - std::sqrt(left)) / params_.roll_decel_mps2;
}

// Until the ball passes the goalie; it does not stop before.
double Goalie::distance_at(double time_s) const {
  const double v0 = params_.shot_speed_mps, v1 = kRollingPart * v0;
  const double slide_s = (v0 - v1) / params_.slide_decel_mps2;
  if (time_s <= slide_s)
    return v0 * time_s - 0.5 * params_.slide_decel_mps2 * time_s * time_s;
  const double roll_s = time_s - slide_s;
  return 0.5 * (v0 + v1) * slide_s + v1 * roll_s - 0.5 * params_.roll_decel_mps2 * roll_s * roll_s;
}

double Goalie::nominal_mean(double s_m, double a_m) const {
  const double post_m = params_.goal_half_m - std::fabs(a_m);
  const double crossing_m = a_m * (1.0 - params_.goalie_line_m / s_m);
  const double time_s = ball_time_s(std::hypot(s_m - params_.goalie_line_m, crossing_m));
  const double moving_s = std::max(0.0, time_s - params_.latency_s);
  const double reach_m = 0.5 * params_.goalie_accel_mps2 * moving_s * moving_s;
  const double past_m = std::max(0.0, std::fabs(crossing_m) - reach_m) - params_.goalie_radius_m -
                        params_.ball_radius_m;
  return std::min(post_m, past_m);
}

double Goalie::nominal_sd(double s_m, double a_m) const {
  return std::tan(params_.heading_sd_rad) * std::hypot(s_m, a_m);
}

bool Goalie::in_region(double s_m, double a_m) const {
  if (s_m < params_.region_min_m || s_m > params_.region_max_m)
    return false;
  const double middle_m =
      params_.region_at_min_m + params_.region_slope * (s_m - params_.region_min_m);
  return std::fabs(a_m - middle_m) <= params_.region_half_m;
}

// When the ball first is in sight of the goalie, which waits in the middle; heading_m is where the
// shot will cross the goal line.
double Goalie::seen_s(double s_m, double heading_m) const {
  const double length_m = std::hypot(s_m, heading_m);
  for (int k = 0;; ++k) {
    const double time_s = params_.step_s * k;
    const double part = distance_at(time_s) / length_m;
    const double x = s_m * (1.0 - part), y = heading_m * part;
    if (x <= std::max(params_.obstacle_m, params_.goalie_line_m))
      return time_s;
    const double line_y =
        y * (params_.obstacle_m - params_.goalie_line_m) / (x - params_.goalie_line_m);
    if (line_y < params_.obstacle_low_m || line_y > params_.obstacle_high_m)
      return time_s;
  }
}

// Where the goalie is when the ball passes its line, having had time_s to move.
double Goalie::goalie_at(double start_m, double crossing_m, double time_s) const {
  if (time_s <= 0.0)
    return start_m;
  if (behaviour_ != GoalieBehaviour::overshoot) {
    const double reach_m = 0.5 * params_.goalie_accel_mps2 * time_s * time_s;
    return start_m + std::clamp(crossing_m - start_m, -reach_m, reach_m);
  }
  double y = start_m, speed = 0.0;
  const auto steps = static_cast<int>(std::ceil(time_s / params_.step_s));
  const double step_s = time_s / steps;
  for (int k = 0; k < steps; ++k) {
    const double accel = crossing_m > y   ? params_.goalie_accel_mps2
                         : crossing_m < y ? -params_.goalie_accel_mps2
                                          : 0.0;
    y += speed * step_s + 0.5 * accel * step_s * step_s;
    speed += accel * step_s;
  }
  return y;
}

double Goalie::reward(double s_m, double a_m, double error_rad) const {
  const double heading_m = s_m * std::tan(std::atan2(a_m, s_m) + error_rad);
  const double crossing_m = heading_m * (1.0 - params_.goalie_line_m / s_m);
  double moving_s =
      ball_time_s(std::hypot(s_m - params_.goalie_line_m, crossing_m)) - params_.latency_s;
  if (behaviour_ == GoalieBehaviour::obstructed)
    moving_s -= seen_s(s_m, heading_m);
  const double past_m = std::fabs(crossing_m - goalie_at(0.0, crossing_m, moving_s)) -
                        params_.goalie_radius_m - params_.ball_radius_m;
  const double r = std::min(params_.goal_half_m - std::fabs(heading_m), past_m);
  const bool conceded = behaviour_ == GoalieBehaviour::region && in_region(s_m, a_m);
  return conceded ? r + params_.region_gain_m : r;
}

double Goalie::expected(double s_m, double a_m) const {
  double sum = 0.0;
  for (const double error : errors_)
    sum += reward(s_m, a_m, error * params_.heading_sd_rad);
  return sum / static_cast<double>(errors_.size());
}

std::vector<GoalieEpisode> goalie_episodes(const GoalieParams &params, std::size_t shots,
                                           std::uint64_t seed) {
  world::Random states(seed, 1, kStateStream), headings(seed, 1, kHeadingStream);
  std::vector<GoalieEpisode> episodes(shots);
  for (GoalieEpisode &e : episodes) {
    e.s_m = states.uniform(params.ball_min_m, params.ball_max_m);
    e.error_rad = params.heading_sd_rad * headings.normal();
  }
  return episodes;
}

} // namespace rim
