// SPDX-License-Identifier: MIT
#include "world/keepaway.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace rim::world {
namespace {

constexpr std::uint64_t kStartStream = 1, kHoldStream = 2, kKickStream = 3;
constexpr std::uint64_t kPurposes = 8;
constexpr double kSpotMargin_m = 0.4; // of a keeper's place, to the field's edge
constexpr double kTau = 6.283185307179586;
constexpr double kClear_m = 1e-3; // between the kicker and the ball it kicks

double heading_to(const Vec2 &from, const Vec2 &to) {
  const Vec2 way = to - from;
  return std::atan2(way.y(), way.x());
}

double distance_to_segment(const Vec2 &point, const Vec2 &a, const Vec2 &b) {
  const Vec2 along = b - a;
  const double part = std::clamp((point - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + part * along - point).norm();
}

} // namespace

Keepaway::Keepaway(const KeepawayParams &params, std::uint64_t seed, std::uint64_t run)
    : params_(params), seed_(seed), run_(run) {
  if (params.keeper_count() < 2 || params.keeper_count() > 8 || params.taker_count() < 1 ||
      params.taker_count() > kMostTakers)
    throw std::invalid_argument("keepaway: 2 to 8 keepers, 1 to 5 takers");
  const std::size_t robots = params.keeper_count() + params.taker_count();
  state_.robots.resize(robots);
  players_.resize(robots);
  commands_.resize(robots);
  spots_.resize(params.keeper_count());
  marked_.resize(params.taker_count());
  path_m_.resize(static_cast<std::size_t>(params.plan_horizon_s / params.plan_step_s) + 1);
}

// Keepers about points of an ellipse through the field, takers about its middle.
void Keepaway::begin_episode() {
  world::Random random(seed_, run_, kPurposes * episodes_ + kStartStream);
  ++episodes_;
  over_ = false;
  const std::size_t keepers = params_.keeper_count();
  for (std::size_t i = 0; i < state_.robots.size(); ++i) {
    KeepawayRobot &robot = state_.robots[i];
    robot = {};
    Vec2 about = Vec2::Zero();
    if (i < keepers) {
      const double angle = kTau * (static_cast<double>(i) + 0.5) / static_cast<double>(keepers);
      about = {0.35 * params_.field_length_m * std::cos(angle),
               0.35 * params_.field_width_m * std::sin(angle)};
    }
    const double apart = i < keepers ? params_.keeper_start_m : params_.taker_start_m;
    robot.at_m = about + Vec2(random.uniform(-apart, apart), random.uniform(-apart, apart));
    robot.heading_rad = random.uniform(-0.5 * kTau, 0.5 * kTau);
    if (i < keepers)
      spots_[i] = robot.at_m;
  }
  state_.holder = random.below(keepers);
  resolve_contacts(state_.robots, nullptr, params_.sizes, nullptr);
}

// One taker between the holder and the most open keeper, the others before the most open ones; the
// nearest taker takes each mark. Openness: how far the nearest taker is from the line of the pass.
void Keepaway::assign_marks() {
  const Vec2 ball = state_.robots[state_.holder].at_m;
  std::vector<std::pair<double, std::size_t>> open;
  for (std::size_t i = 0; i < params_.keeper_count(); ++i) {
    if (i == state_.holder)
      continue;
    double least = 1e9;
    for (std::size_t t = params_.keeper_count(); t < state_.robots.size(); ++t)
      least =
          std::min(least, distance_to_segment(state_.robots[t].at_m, ball, state_.robots[i].at_m));
    open.emplace_back(-least, i);
  }
  std::sort(open.begin(), open.end());
  if (open.empty()) // there are always two keepers
    throw std::logic_error("keepaway: no keeper to pass to");
  most_open_ = open.front().second;
  std::vector<std::size_t> free(params_.taker_count());
  for (std::size_t t = 0; t < free.size(); ++t)
    free[t] = t;
  for (std::size_t m = 0; !free.empty(); ++m) {
    const std::size_t keeper = m == 0 ? state_.holder : open[(m - 1) % open.size()].second;
    const auto nearest = std::min_element(free.begin(), free.end(), [&](auto a, auto b) {
      const Vec2 at = state_.robots[keeper].at_m;
      return (state_.robots[params_.keeper_count() + a].at_m - at).squaredNorm() <
             (state_.robots[params_.keeper_count() + b].at_m - at).squaredNorm();
    });
    marked_[*nearest] = keeper;
    free.erase(nearest);
  }
}

// Every keeper without the ball runs to the best of a few places: away from takers.
void Keepaway::choose_spots() {
  world::Random random(seed_, run_, kPurposes * passes_ + kHoldStream);
  const Vec2 half(0.5 * params_.field_length_m - kSpotMargin_m,
                  0.5 * params_.field_width_m - kSpotMargin_m);
  for (std::size_t i = 0; i < spots_.size(); ++i) {
    spots_[i] = state_.robots[i].at_m;
    double best = -1.0;
    for (int k = 0; k < static_cast<int>(params_.spots); ++k) {
      const Vec2 spot(random.uniform(-half.x(), half.x()), random.uniform(-half.y(), half.y()));
      double taker = 1e9, keeper = 1e9;
      for (std::size_t j = 0; j < state_.robots.size(); ++j) {
        const Vec2 other = is_keeper(j) && j < i ? spots_[j] : state_.robots[j].at_m;
        if (j != i) {
          double &least = is_keeper(j) ? keeper : taker;
          least = std::min(least, (spot - other).norm());
        }
      }
      if (keeper >= params_.keeper_apart_m && taker > best) {
        best = taker;
        spots_[i] = spot;
      }
    }
  }
  spots_[state_.holder] = state_.robots[state_.holder].at_m;
}

Vec2 Keepaway::mark_of(std::size_t taker) const {
  const Vec2 holder = state_.robots[state_.holder].at_m;
  const bool presses = marked_[taker] == state_.holder;
  const Vec2 keeper = state_.robots[presses ? most_open_ : marked_[taker]].at_m;
  const Vec2 way = (keeper - holder).normalized();
  return presses ? Vec2(holder + params_.mark_passer_m * way)
                 : Vec2(keeper - params_.mark_receiver_m * way);
}

void Keepaway::command_marks() {
  for (std::size_t i = 0; i < state_.robots.size(); ++i)
    commands_[i] = {false, is_keeper(i) ? spots_[i] : mark_of(i - params_.keeper_count()), 0.0};
}

// to_kick_s: until then it lies still.
BallFlight Keepaway::flight(double to_kick_s) {
  BallFlight f;
  const double speed = ball_.velocity_mps.norm();
  f.from = ball_.at_m;
  f.forward = speed > 0.0 ? Vec2(ball_.velocity_mps / speed) : Vec2(1.0, 0.0);
  f.step_s = params_.plan_step_s;
  const double gone = ball_path_m(params_.friction, ball_.slid_from_mps, ball_.sliding_s);
  for (f.count = 0; f.count < path_m_.size(); ++f.count) {
    const double after_s = std::max(0.0, f.step_s * static_cast<double>(f.count) - to_kick_s);
    path_m_[f.count] =
        ball_path_m(params_.friction, ball_.slid_from_mps, ball_.sliding_s + after_s) - gone;
    const Vec2 p = (f.from + path_m_[f.count] * f.forward).cwiseAbs();
    if (p.x() > 0.5 * params_.field_length_m || p.y() > 0.5 * params_.field_width_m)
      break;
  }
  f.path_m = path_m_.data();
  return f;
}

// Of each team the robot that can have the ball first goes for it, once it has begun to react;
// where none can, the nearest to where the ball will be last. The others stop.
void Keepaway::command_chase(double since_kick_s) {
  const BallFlight f = flight(std::max(0.0, -since_kick_s));
  if (f.count == 0)
    return;
  const double reach = params_.sizes.robot_radius_m + params_.sizes.ball_radius_m;
  const Vec2 last = f.at(f.count - 1);
  std::fill(commands_.begin(), commands_.end(), Command{});
  for (const bool keepers : {true, false}) {
    Interception best;
    double nearest = 1e9;
    std::size_t chosen = state_.robots.size();
    for (std::size_t i = 0; i < state_.robots.size(); ++i) {
      if (is_keeper(i) != keepers || (i == state_.holder && since_kick_s < params_.loose_s / 4.0))
        continue;
      const double start = std::max(0.0, players_[i].start_s - since_kick_s);
      const Interception at = intercept(state_.robots[i], players_[i].limits, start, reach, f);
      const double away = (state_.robots[i].at_m - last).norm();
      if (at.time_s < best.time_s ||
          (!std::isfinite(best.time_s) && !std::isfinite(at.time_s) && away < nearest)) {
        best = at;
        nearest = away;
        chosen = i;
      }
    }
    if (chosen == state_.robots.size() || since_kick_s < players_[chosen].start_s)
      continue;
    commands_[chosen] = std::isfinite(best.time_s) ? Command{false, best.at_m, best.time_s}
                                                   : Command{false, last, 0.0};
  }
}

Vec2 Keepaway::wanted_mps(std::size_t robot) const {
  const Command &c = commands_[robot];
  const KeepawayRobot &r = state_.robots[robot];
  if (c.brake)
    return Vec2::Zero();
  return c.by_s > 0.0 ? drive_through(r, c.to, c.by_s, players_[robot].limits)
                      : drive_to(r, c.to, players_[robot].limits);
}

// One step of everything; returns the robot that touched a loose ball, -1: none.
int Keepaway::step(bool loose_ball, double *impact_mps) {
  const Vec2 holder_ball = state_.robots[state_.holder].at_m;
  for (std::size_t i = 0; i < state_.robots.size(); ++i) {
    KeepawayRobot &robot = state_.robots[i];
    const bool holds = !loose_ball && i == state_.holder;
    const Vec2 wanted = holds ? Vec2(Vec2::Zero()) : wanted_mps(i);
    const double heading =
        holds ? robot.heading_rad : heading_to(robot.at_m, loose_ball ? ball_.at_m : holder_ball);
    step_robot(robot, wanted, heading, players_[i].limits, params_.step_s);
    commands_[i].by_s = std::max(0.0, commands_[i].by_s - params_.step_s);
  }
  if (loose_ball)
    ball_.step(params_.friction, params_.step_s);
  const int touched =
      resolve_contacts(state_.robots, loose_ball ? &ball_ : nullptr, params_.sizes, impact_mps);
  state_.time_s += params_.step_s;
  return touched;
}

const KeepawayState &Keepaway::ready() {
  if (over_)
    begin_episode();
  world::Random random(seed_, run_, kPurposes * passes_ + kHoldStream + 4);
  for (std::size_t i = 0; i < players_.size(); ++i)
    players_[i] = {params_.limits, is_keeper(i) ? params_.keeper_start_s : params_.latency_s};
  assign_marks();
  choose_spots();
  const double hold_s = random.uniform(params_.hold_min_s, params_.hold_max_s);
  const auto steps = static_cast<int>(std::lround(hold_s / params_.step_s));
  for (int k = 0; k < steps; ++k) {
    command_marks();
    step(false, nullptr);
  }
  return state_;
}

void Keepaway::set_habits(const PassOption &option, PassResult &result) {
  for (std::size_t t = 0; t < params_.taker_count(); ++t) {
    Player &player = players_[params_.keeper_count() + t];
    for (const TakerHabit &habit : params_.habits) {
      if (!habit.acts(option.context[t]))
        continue;
      player.start_s = habit.start_s;
      player.limits.accel_mps2 *= habit.accel_factor;
      player.limits.speed_mps *= habit.speed_factor;
      result.habit[t] = true;
      break;
    }
  }
}

int Keepaway::control_steps() const {
  return std::max(1, static_cast<int>(std::lround(params_.control_s / params_.step_s)));
}

// The passer turns; takers that watch it may already move to where the ball will pass.
void Keepaway::aim(const PassOption &option) {
  const auto steps = static_cast<int>(std::lround(params_.aim_s / params_.step_s));
  const Vec2 forward(std::cos(option.direction_rad), std::sin(option.direction_rad));
  KeepawayRobot &passer = state_.robots[state_.holder];
  const double front = params_.sizes.robot_front_m + params_.sizes.ball_radius_m + kClear_m;
  for (int k = 0; k < steps; ++k) {
    ball_.at_m = passer.at_m + front * forward;
    ball_.kick(option.speed_mps * forward);
    if (k % control_steps() == 0)
      command_chase(-params_.step_s * (steps - k));
    const double left = std::remainder(option.direction_rad - passer.heading_rad, kTau);
    passer.heading_rad += left / (steps - k);
    step(false, nullptr);
  }
  passer.heading_rad = option.direction_rad;
  ball_.at_m = passer.at_m + front * forward;
}

bool Keepaway::is_out() const {
  const Vec2 p = ball_.at_m.cwiseAbs();
  return p.x() > 0.5 * params_.field_length_m || p.y() > 0.5 * params_.field_width_m;
}

// The front half takes a ball that is not too fast.
bool Keepaway::captures(int robot, double impact_mps) const {
  const KeepawayRobot &r = state_.robots[static_cast<std::size_t>(robot)];
  const double off = std::remainder(heading_to(r.at_m, ball_.at_m) - r.heading_rad, kTau);
  return impact_mps <= params_.capture_mps && std::fabs(off) < 0.25 * kTau;
}

void Keepaway::fly(PassResult &result) {
  const auto most = static_cast<int>(std::lround(params_.loose_s / params_.step_s));
  bool decided = false;
  for (int k = 0; k < most; ++k) {
    if (k % control_steps() == 0)
      command_chase(params_.step_s * k);
    double impact = 0.0;
    const int touched = step(true, &impact);
    if (touched >= 0 && !decided) {
      decided = true;
      result.touched_by = touched;
      result.success = is_keeper(static_cast<std::size_t>(touched));
    }
    if (touched >= 0 && captures(touched, impact)) {
      over_ = !is_keeper(static_cast<std::size_t>(touched));
      if (!over_)
        state_.holder = static_cast<std::size_t>(touched);
      else
        state_.time_s += params_.held_s;
      return;
    }
    if (is_out()) {
      result.out = !decided;
      over_ = true;
      return;
    }
  }
  over_ = true; // nobody got it
}

PassResult Keepaway::pass(const PassOption &option) {
  world::Random random(seed_, run_, kPurposes * passes_ + kKickStream);
  ++passes_;
  PassResult result;
  set_habits(option, result);
  aim(option);
  const double heading = option.direction_rad + params_.kick_heading_sd_rad * random.normal();
  const double speed =
      std::clamp(option.speed_mps * (1.0 + params_.kick_speed_sd * random.normal()), 0.5,
                 params_.kick_max_mps);
  ball_.kick(speed * Vec2(std::cos(heading), std::sin(heading)));
  fly(result);
  return result;
}

} // namespace rim::world
