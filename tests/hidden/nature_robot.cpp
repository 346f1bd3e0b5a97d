// SPDX-License-Identifier: MIT
// A robot on a floor of 8 m by 8 m: drives to one waypoint after another, a third of the way
// backwards. Its simulation: first-order response of speed and turn rate to the command, side slip
// that decays and is fed by turning, motor current by effort and speed.
#include <algorithm>
#include <cmath>

#include "nature.hpp"

namespace nature {

namespace {

enum {
  kX,
  kY,
  kHeading,
  kSpeed,
  kSlip,
  kTurn,
  kWheel,
  kSetSpeed,
  kSetTurn,
  kBattery,
  kMotor,
  kOwn
};
enum { kAccel, kYaw, kLateral, kCurrent };

class Robot : public World {
public:
  double tau_speed = 0.5, tau_turn = 0.3, tau_slip = 0.4, slip_gain = 0.3, wheel_m = 0.2;
  double idle_A = 0.4, effort_A = 1.5, speed_A = 0.8;
  bool next_speed = false; // the first channel is the next speed, not the acceleration
  struct Extra {
    double middle, span;
  };
  std::vector<Extra> extras;

  void start(Random &random, std::size_t rows) override;
  void command(Random &random) override;
  Row observe() const override;
  double predict(std::size_t channel, const Row &x) const override;
  void advance(const Row &truth) override;

private:
  Row s_ = Row(kOwn, 0.0);
  double t_s_ = 0.0, goal_x_ = 0.0, goal_y_ = 0.0, goal_speed_ = 0.5, goal_until_s_ = 0.0;
  double dither_speed_ = 0.0, dither_turn_ = 0.0, dither_until_s_ = 0.0;
  double charge_V_ = 25.0, motor_degC_ = 35.0;
  Wave load_, warmth_;
  std::vector<Wave> waves_;

  void new_goal(Random &random);
};

void Robot::new_goal(Random &random) {
  goal_x_ = random.uniform(-3.5, 3.5);
  goal_y_ = random.uniform(-3.5, 3.5);
  goal_speed_ = random.uniform(0.3, 1.3) * (random.uniform() < 0.33 ? -1.0 : 1.0);
  goal_until_s_ = t_s_ + 7.0;
}

void Robot::start(Random &random, std::size_t rows) {
  const double log_s = static_cast<double>(rows) * dt_s;
  std::fill(s_.begin(), s_.end(), 0.0);
  t_s_ = 0.0;
  s_[kX] = random.uniform(-3.0, 3.0);
  s_[kY] = random.uniform(-3.0, 3.0);
  s_[kHeading] = random.uniform(-3.1, 3.1);
  s_[kWheel] = random.uniform(-3.1, 3.1);
  dither_until_s_ = 0.0;
  load_ = Wave::draw(random, random.uniform(23.5, 25.0), 1.2, log_s);
  warmth_ = Wave::draw(random, random.uniform(30.0, 36.0), 6.0, log_s);
  motor_degC_ = warmth_.at(0.0);
  waves_.clear();
  for (const Extra &e : extras)
    waves_.push_back(Wave::draw(random, e.middle, e.span, log_s));
  new_goal(random);
}

void Robot::command(Random &random) {
  const double dx = goal_x_ - s_[kX], dy = goal_y_ - s_[kY];
  if (dx * dx + dy * dy < 0.3 || t_s_ > goal_until_s_)
    new_goal(random);
  if (t_s_ >= dither_until_s_) {
    dither_speed_ = 0.2 * random.normal();
    dither_turn_ = 0.3 * random.normal();
    dither_until_s_ = t_s_ + random.uniform(0.4, 2.5);
  }
  const double back = goal_speed_ < 0.0 ? 3.14159265358979 : 0.0;
  const double error = wrapped(std::atan2(dy, dx) + back - s_[kHeading]);
  const double target = goal_speed_ * std::max(0.3, std::cos(error)) + dither_speed_;
  const double most = 3.0 * dt_s; // the commanded speed changes by 3 m/s^2 at most
  s_[kSetSpeed] += std::clamp(target - s_[kSetSpeed], -most, most);
  s_[kSetTurn] = std::clamp(1.6 * error, -1.4, 1.4) + dither_turn_;
}

Row Robot::observe() const {
  Row x = s_;
  x[kBattery] = load_.at(t_s_);
  x[kMotor] = motor_degC_;
  for (const Wave &w : waves_)
    x.push_back(w.at(t_s_));
  return x;
}

double Robot::predict(std::size_t channel, const Row &x) const {
  const double accel = (x[kSetSpeed] - x[kSpeed]) / tau_speed;
  switch (channel) {
  case kAccel:
    return next_speed ? x[kSpeed] + dt_s * accel : accel;
  case kYaw:
    return (x[kSetTurn] - x[kTurn]) / tau_turn;
  case kLateral:
    return slip_gain * x[kSpeed] * x[kTurn] - x[kSlip] / tau_slip;
  default:
    return idle_A + effort_A * accel + speed_A * x[kSpeed];
  }
}

void Robot::advance(const Row &truth) {
  const double c = std::cos(s_[kHeading]), s = std::sin(s_[kHeading]);
  s_[kX] += dt_s * (c * s_[kSpeed] - s * s_[kSlip]);
  s_[kY] += dt_s * (s * s_[kSpeed] + c * s_[kSlip]);
  s_[kHeading] = wrapped(s_[kHeading] + dt_s * s_[kTurn]);
  s_[kWheel] = wrapped(s_[kWheel] + dt_s * s_[kSpeed] / wheel_m);
  s_[kSpeed] = next_speed ? truth[kAccel] : s_[kSpeed] + dt_s * truth[kAccel];
  s_[kTurn] += dt_s * truth[kYaw];
  s_[kSlip] += dt_s * truth[kLateral];
  t_s_ += dt_s;
  const double heat = warmth_.at(t_s_) + 9.0 * s_[kSpeed] * s_[kSpeed];
  motor_degC_ += dt_s / 6.0 * (heat - motor_degC_);
}

} // namespace

double wrapped(double angle_rad) {
  constexpr double two_pi = 6.283185307179586;
  return angle_rad - two_pi * std::ceil(angle_rad / two_pi - 0.5);
}

double Wave::at(double t_s) const {
  double value = middle + slope * t_s;
  for (std::size_t i = 0; i < amplitude.size(); ++i)
    value += amplitude[i] * std::sin(rate[i] * t_s + phase[i]);
  return value;
}

Wave Wave::draw(Random &random, double middle, double span, double log_s) {
  Wave w;
  w.middle = middle;
  w.slope = random.uniform(-0.2, 0.2) * span / log_s;
  for (std::size_t i = 0; i < w.amplitude.size(); ++i) {
    w.amplitude[i] = span * random.uniform(0.1, 0.25);
    w.rate[i] = 6.283185307179586 * random.uniform(2.0, 7.0) / log_s;
    w.phase[i] = random.uniform(0.0, 6.283185307179586);
  }
  return w;
}

std::unique_ptr<World> draw_robot(Random &random) {
  auto robot = std::make_unique<Robot>();
  Robot &r = *robot;
  r.name = "robot";
  r.dt_s = random.uniform() < 0.5 ? 0.1 : 0.15;
  r.heading = kHeading;
  r.features = {{"s.x_m", false, false, true},         {"s.y_m", false, false, true},
                {"s.heading_rad", false, true, false}, {"s.speed_mps", false, false, true},
                {"s.slip_mps", false, false, false},   {"s.turn_radps", false, false, true},
                {"s.wheel_rad", false, true, false},   {"u.speed_mps", true, false, false},
                {"u.turn_radps", true, false, false},  {"s.battery_V", false, false, false},
                {"s.motor_degC", false, false, true}};
  const std::vector<std::pair<const char *, Robot::Extra>> others = {
      {"x.humidity_pct", {50.0, 20.0}},
      {"x.sun_rad", {0.6, 0.5}},
      {"x.air_kPa", {100.0, 2.0}},
      {"x.signal", {0.0, 1.0}}};
  for (const auto &[name, extra] : others) {
    if (random.uniform() < 0.6) {
      r.features.push_back({name, false, false, false});
      r.extras.push_back(extra);
    }
  }
  r.tau_speed = random.uniform(0.35, 0.8);
  r.tau_turn = random.uniform(0.25, 0.5);
  r.tau_slip = random.uniform(0.3, 0.6);
  r.slip_gain = random.uniform(0.2, 0.5);
  r.wheel_m = random.uniform(0.25, 0.5);
  r.idle_A = random.uniform(0.2, 0.8);
  r.effort_A = random.uniform(0.8, 2.0);
  r.speed_A = random.uniform(0.4, 1.2);
  r.next_speed = random.uniform() < 0.25;
  r.channels = {
      {r.next_speed ? "speed_mps" : "accel_mps2",
       (r.next_speed ? r.dt_s : 1.0) * random.uniform(0.05, 0.2),
       kSpeed,
       kSetSpeed,
       true,
       {kSetTurn, kTurn, kSlip}},
      {"yaw_accel_radps2",
       random.uniform(0.08, 0.3),
       kTurn,
       kSetTurn,
       false,
       {kSetSpeed, kSpeed, kSlip}},
      {"lateral_accel_mps2",
       random.uniform(0.03, 0.1),
       kSlip,
       -1,
       true,
       {kSetSpeed, kSpeed, kSetTurn, kTurn}},
      {"motor_A", random.uniform(0.1, 0.4), -1, kSetSpeed, false, {kSetTurn, kTurn, kSlip}}};
  return robot;
}

} // namespace nature
