// SPDX-License-Identifier: MIT
// The nominal pass model: eq. 3.33 to 3.35, p. 41-42.
#include <algorithm>
#include <cmath>

#include "base/real.h"
#include "world/keepaway.hpp"

namespace rim::world {
namespace {

// Metres by which a point is out of reach at_s after the kick: a robot that keeps its velocity
// until start_s and then accelerates at its limit in any direction reaches a disc about where it
// would have gone without, and never moves faster than its top speed.
double short_by_m(const KeepawayRobot &robot, const MotionLimits &limits, double start_s,
                  double reach_m, const Vec2 &point, double at_s) {
  const double waiting = std::min(at_s, std::max(0.0, start_s)), moving = at_s - start_s;
  const Vec2 start = robot.at_m + waiting * robot.velocity_mps;
  if (moving <= 0.0)
    return (point - start).norm() - reach_m;
  const double gaining = std::min(moving, limits.speed_mps / limits.accel_mps2);
  const double gained =
      0.5 * limits.accel_mps2 * gaining * gaining + limits.speed_mps * (moving - gaining);
  const double by_push = (point - start - gaining * robot.velocity_mps).norm() - gained;
  const double by_speed = (point - start).norm() - limits.speed_mps * moving;
  return std::max(by_push, by_speed) - reach_m;
}

} // namespace

const char *const kKeepawayFeatureNames[kKeepawayFeatures] = {"ahead_m", "beside_m", "v_ahead_mps",
                                                              "v_beside_mps", "ball_speed_mps"};

bool TakerHabit::acts(const PassContext &context) const {
  for (std::size_t k = 0; k < kKeepawayFeatures; ++k) {
    if (!(context[k] >= low[k] && context[k] <= high[k]))
      return false;
  }
  return true;
}

Interception intercept(const KeepawayRobot &robot, const MotionLimits &limits, double start_s,
                       double reach_m, const BallFlight &flight) {
  double before = 0.0;
  for (std::size_t k = 0; k < flight.count; ++k) {
    const double at_s = flight.step_s * static_cast<double>(k);
    const Vec2 point = flight.at(k);
    const double missing = short_by_m(robot, limits, start_s, reach_m, point, at_s);
    if (missing > 0.0) {
      before = missing;
      continue;
    }
    if (k == 0)
      return {at_s, point};
    const double part = before / (before - missing);
    return {at_s - (1.0 - part) * flight.step_s, (1.0 - part) * flight.at(k - 1) + part * point};
  }
  return {};
}

KeepawayModel::KeepawayModel(const KeepawayParams &params) : params_(params) {
  const auto speeds = static_cast<std::size_t>(params.kick_speeds);
  const auto points = static_cast<std::size_t>(params.plan_horizon_s / params.plan_step_s) + 1;
  for (std::size_t i = 0; i < speeds; ++i) {
    const double part =
        speeds == 1 ? 1.0 : static_cast<double>(i) / static_cast<double>(speeds - 1);
    speeds_.push_back(params.kick_min_mps + part * (params.kick_max_mps - params.kick_min_mps));
    std::vector<double> path(points);
    for (std::size_t k = 0; k < points; ++k) {
      path[k] =
          ball_path_m(params.friction, speeds_.back(), params.plan_step_s * static_cast<double>(k));
    }
    path_m_.push_back(path);
  }
}

// False where no keeper receives it.
bool KeepawayModel::evaluate(const KeepawayState &state, std::size_t speed,
                             PassOption &option) const {
  const KeepawayRobot &passer = state.robots[state.holder];
  const double reach = params_.sizes.robot_radius_m + params_.sizes.ball_radius_m;
  BallFlight flight;
  flight.forward = {std::cos(option.direction_rad), std::sin(option.direction_rad)};
  flight.from =
      passer.at_m + (params_.sizes.robot_front_m + params_.sizes.ball_radius_m) * flight.forward;
  flight.path_m = path_m_[speed].data();
  flight.step_s = params_.plan_step_s;
  while (flight.count < path_m_[speed].size()) {
    const Vec2 p = flight.at(flight.count).cwiseAbs();
    if (p.x() > 0.5 * params_.field_length_m || p.y() > 0.5 * params_.field_width_m)
      break;
    ++flight.count;
  }
  option.keepers_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < params_.keeper_count(); ++i) {
    if (i == state.holder)
      continue;
    const Interception at =
        intercept(state.robots[i], params_.limits, params_.keeper_latency_s, reach, flight);
    option.keepers_s = std::min(option.keepers_s, at.time_s);
  }
  if (!std::isfinite(option.keepers_s))
    return false;
  // Who cannot have it within the field: when it leaves, at the earliest.
  const double gone_s = flight.step_s * static_cast<double>(flight.count);
  const Vec2 left(-flight.forward.y(), flight.forward.x());
  option.decisive = 0;
  for (std::size_t i = 0; i < params_.taker_count(); ++i) {
    const KeepawayRobot &taker = state.robots[params_.keeper_count() + i];
    option.takers_s[i] =
        std::min(gone_s, intercept(taker, params_.limits, params_.latency_s, reach, flight).time_s);
    option.expected[i] =
        rimi_normal_cdf((option.takers_s[i] - option.keepers_s) / params_.time_sd_s);
    const Vec2 at = taker.at_m - flight.from;
    option.context[i] = {at.dot(flight.forward), at.dot(left),
                         taker.velocity_mps.dot(flight.forward), taker.velocity_mps.dot(left),
                         option.speed_mps};
    if (option.takers_s[i] < option.takers_s[option.decisive])
      option.decisive = i;
  }
  return true;
}

void KeepawayModel::options(const KeepawayState &now, std::vector<PassOption> &out) const {
  out.clear();
  KeepawayState state = now; // at the kick: robots stop while the passer turns
  for (std::size_t i = 0; i < state.robots.size(); ++i)
    coast_to_stop(state.robots[i], params_.limits, params_.aim_s);
  const auto directions = static_cast<std::size_t>(params_.kick_directions);
  for (std::size_t d = 0; d < directions; ++d) {
    for (std::size_t s = 0; s < speeds_.size(); ++s) {
      PassOption option;
      option.direction_rad =
          6.283185307179586 * static_cast<double>(d) / static_cast<double>(directions);
      option.speed_mps = speeds_[s];
      if (evaluate(state, s, option))
        out.push_back(option);
    }
  }
}

} // namespace rim::world
