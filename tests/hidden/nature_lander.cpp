// SPDX-License-Identifier: MIT
// A lander that hops between 1 and 59 km of altitude on its engine, and sideways as it goes. Its
// simulation: thrust by throttle, mass and pitch, gravity that falls with height, attitude as a
// damped spring to the commanded pitch, a radar along the body's axis, a Doppler speed.
#include <algorithm>
#include <cmath>

#include "nature.hpp"

namespace nature {

namespace {

enum {
  kAltitude,
  kClimb,
  kDownrange,
  kPitch,
  kPitchRate,
  kRoll,
  kMass,
  kThrottle,
  kSetPitch,
  kTank,
  kEngine,
  kOwn
};
enum { kVertical, kHorizontal, kAttitude, kRadar, kDoppler };

class Lander : public World {
public:
  double gravity = 3.7, radius_m = 3.4e6, thrust_N = 1.0, stiffness = 0.06, damping = 0.4;
  double mass_kg = 900.0;
  bool roll_from_zero = false; // logged in [0, 2 pi), not (-pi, pi]
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
  double t_s_ = 0.0, burn_kgps_ = 0.0, roll_rate_ = 0.05;
  double dither_throttle_ = 0.0, dither_pitch_ = 0.0, dither_until_s_ = 0.0;
  Wave height_, sideways_, pressure_, warmth_;
  std::vector<Wave> waves_;
};

void Lander::start(Random &random, std::size_t rows) {
  const double log_s = static_cast<double>(rows) * dt_s;
  std::fill(s_.begin(), s_.end(), 0.0);
  t_s_ = 0.0;
  height_ = Wave{};
  height_.middle = 30e3;
  // amplitude * rate^2 stays under .75 of gravity
  height_.amplitude = {random.uniform(22e3, 26e3), random.uniform(0.5e3, 2e3), 0.0};
  height_.rate[0] = std::sqrt(0.6 * gravity / height_.amplitude[0]) * random.uniform(0.85, 1.0);
  height_.rate[1] = std::sqrt(0.15 * gravity / height_.amplitude[1]);
  sideways_ = Wave{};
  for (std::size_t i = 0; i < 3; ++i) {
    height_.phase[i] = random.uniform(0.0, 6.283);
    sideways_.amplitude[i] = random.uniform(40.0, 120.0);
    sideways_.rate[i] = random.uniform(0.5, 2.2) * height_.rate[0];
    sideways_.phase[i] = random.uniform(0.0, 6.283);
  }
  s_[kAltitude] = height_.at(0.0);
  s_[kClimb] = (height_.at(0.5) - height_.at(-0.5));
  s_[kDownrange] = sideways_.at(0.0);
  s_[kMass] = mass_kg * random.uniform(0.97, 1.03);
  burn_kgps_ = 0.5 * mass_kg / log_s; // at full throttle
  s_[kRoll] = random.uniform(-3.1, 3.1);
  roll_rate_ = random.uniform(0.03, 0.12) * (random.uniform() < 0.5 ? -1.0 : 1.0);
  pressure_ = Wave::draw(random, 260.0, 25.0, log_s);
  warmth_ = Wave::draw(random, 300.0, 60.0, log_s);
  dither_until_s_ = 0.0;
  waves_.clear();
  for (const Extra &e : extras)
    waves_.push_back(Wave::draw(random, e.middle, e.span, log_s));
}

void Lander::command(Random &random) {
  if (t_s_ >= dither_until_s_) {
    dither_throttle_ = 0.06 * random.normal();
    dither_pitch_ = 0.05 * random.normal();
    dither_until_s_ = t_s_ + dt_s * random.uniform(4.0, 25.0);
  }
  const double h = 1.0, w = 0.09; // s; rad/s of the altitude loop
  const double climb = (height_.at(t_s_ + h) - height_.at(t_s_ - h)) / (2.0 * h);
  const double feed =
      (height_.at(t_s_ + h) - 2.0 * height_.at(t_s_) + height_.at(t_s_ - h)) / (h * h);
  const double up =
      feed + 1.6 * w * (climb - s_[kClimb]) + w * w * (height_.at(t_s_) - s_[kAltitude]);
  const double side = (sideways_.at(t_s_ + h) - sideways_.at(t_s_ - h)) / (2.0 * h) +
                      0.06 * (sideways_.at(t_s_) - s_[kDownrange]);
  const double lift = std::max(0.2 * gravity, up + gravity);
  s_[kSetPitch] = std::clamp(std::atan2(side, lift), -0.5, 0.5) + dither_pitch_;
  const double full = thrust_N / s_[kMass] * std::cos(s_[kPitch]);
  s_[kThrottle] = std::clamp(lift / full + dither_throttle_, 0.05, 1.0);
}

Row Lander::observe() const {
  Row x = s_;
  x[kTank] = pressure_.at(t_s_) + 0.08 * (s_[kMass] - mass_kg);
  x[kEngine] = s_[kEngine] + warmth_.at(t_s_);
  if (roll_from_zero && x[kRoll] < 0.0)
    x[kRoll] += 6.283185307179586;
  for (const Wave &w : waves_)
    x.push_back(w.at(t_s_));
  return x;
}

double Lander::predict(std::size_t channel, const Row &x) const {
  const double thrust = thrust_N * x[kThrottle] / x[kMass];
  switch (channel) {
  case kVertical:
    return thrust * std::cos(x[kPitch]) - gravity * (1.0 - 2.0 * x[kAltitude] / radius_m);
  case kHorizontal:
    return thrust * std::sin(x[kPitch]);
  case kAttitude:
    return stiffness * (x[kSetPitch] - x[kPitch]) - damping * x[kPitchRate];
  case kRadar:
    return x[kAltitude] / std::cos(x[kPitch]);
  default:
    return x[kClimb] * std::cos(x[kPitch]) + x[kDownrange] * std::sin(x[kPitch]);
  }
}

void Lander::advance(const Row &truth) {
  s_[kAltitude] += dt_s * (s_[kClimb] + 0.5 * dt_s * truth[kVertical]);
  s_[kClimb] += dt_s * truth[kVertical];
  s_[kDownrange] += dt_s * truth[kHorizontal];
  s_[kPitchRate] += dt_s * truth[kAttitude];
  s_[kPitch] += dt_s * s_[kPitchRate];
  s_[kRoll] = wrapped(s_[kRoll] + dt_s * roll_rate_);
  s_[kMass] -= dt_s * burn_kgps_ * s_[kThrottle];
  s_[kEngine] += dt_s / 25.0 * (400.0 * s_[kThrottle] - s_[kEngine]);
  t_s_ += dt_s;
}

} // namespace

std::unique_ptr<World> draw_lander(Random &random) {
  auto lander = std::make_unique<Lander>();
  Lander &l = *lander;
  l.name = "lander";
  l.gravity = random.uniform(5.0, 9.8);
  l.dt_s = std::round(20.0 * random.uniform(1.4, 1.8)) / 20.0;
  l.altitude = kAltitude;
  l.radius_m = random.uniform(3.0e6, 6.4e6);
  l.roll_from_zero = random.uniform() < 0.5;
  l.mass_kg = random.uniform(600.0, 1500.0);
  l.thrust_N = l.mass_kg * l.gravity * random.uniform(2.2, 2.8);
  l.stiffness = random.uniform(0.05, 0.09);
  l.damping = random.uniform(0.3, 0.45);
  l.features = {{"s.altitude_m", false, false, true},        {"s.climb_mps", false, false, true},
                {"s.downrange_mps", false, false, true},     {"s.pitch_rad", false, false, true},
                {"s.pitch_rate_radps", false, false, false}, {"s.roll_rad", false, true, false},
                {"s.mass_kg", false, false, false},          {"u.throttle", true, false, false},
                {"u.pitch_rad", true, false, false},         {"s.tank_kPa", false, false, false},
                {"s.engine_degC", false, false, true}};
  const std::vector<std::pair<const char *, Lander::Extra>> others = {
      {"x.sun_rad", {0.5, 0.6}},
      {"x.battery_V", {28.0, 1.5}},
      {"x.signal", {0.0, 1.0}},
      {"x.skin_degC", {40.0, 30.0}}};
  for (const auto &[name, extra] : others) {
    if (random.uniform() < 0.6) {
      l.features.push_back({name, false, false, false});
      l.extras.push_back(extra);
    }
  }
  l.channels = {
      {"accel_vertical_mps2",
       random.uniform(0.05, 0.25),
       kClimb,
       kThrottle,
       false,
       {kSetPitch, kDownrange, kPitchRate}},
      {"accel_horizontal_mps2",
       random.uniform(0.03, 0.15),
       kDownrange,
       -1,
       false,
       {kThrottle, kClimb, kPitchRate}},
      {"pitch_accel_radps2",
       random.uniform(0.0004, 0.0015),
       kPitchRate,
       kSetPitch,
       false,
       {kThrottle, kClimb, kDownrange}},
      {"radar_range_m",
       random.uniform(8.0, 40.0),
       -1,
       -1,
       false,
       {kClimb, kDownrange, kThrottle, kPitchRate}},
      {"doppler_mps", random.uniform(0.5, 3.0), -1, -1, false, {kThrottle, kPitchRate, kSetPitch}}};
  return lander;
}

} // namespace nature
