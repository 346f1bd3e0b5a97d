// SPDX-License-Identifier: MIT
#include "world/lander_guidance.hpp"

#include <algorithm>
#include <cmath>

#include "world/lander_streams.hpp"

namespace rim::world {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kShortestGo_s = 5.0;     // then the profile is flown open loop (E guidance's
                                          // gain on the estimate's noise grows as 1 / go^2)
constexpr double kSettleGain_ps = 0.8;    // vertical velocity loop of the descent
constexpr double kLevelGain_ps = 0.5;     // horizontal
constexpr double kSettleAltitude_m = 8.0; // below it the descent is at touchdown speed
constexpr double kMaxTilt = 0.5;          // horizontal over vertical thrust

Vector3d normal3(Random &random) {
  const double x = random.normal();
  const double y = random.normal();
  const double z = random.normal();
  return {x, y, z};
}

// Attitude without yaw whose z axis is `direction`.
Quaterniond pointing(const Vector3d &direction) {
  const double roll = -std::asin(direction.y());
  const double pitch = std::atan2(direction.x(), direction.z());
  return Quaterniond(Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                     Eigen::AngleAxisd(roll, Vector3d::UnitX()));
}

// The axis and angle that turn `from` into `to`, in the body frame of `from`, for small turns.
Vector3d small_turn_rad(const Quaterniond &from, const Quaterniond &to) {
  const Quaterniond turn = from.conjugate() * to;
  return (turn.w() < 0.0 ? -2.0 : 2.0) * turn.vec();
}

} // namespace

LanderGuidance::LanderGuidance(const LanderParams &params, std::uint64_t seed, std::uint64_t run)
    : params_(params), model_(nominal_vehicle(params)), noise_(seed, run, kNavigationStream) {
  const GuidanceParams &g = params.guidance;
  Random random(seed, run, kGuidanceStream);
  ignition_altitude_m_ = params.approach.altitude_m + g.ignition_altitude_sd_m * random.normal();
  position_bias_m_ = g.position_bias_sd_m * normal3(random);
  velocity_bias_mps_ = g.velocity_bias_sd_mps * normal3(random);
  mass_bias_kg_ = g.mass_bias_sd_kg * random.normal();
  const ApproachParams &a = params.approach;
  const Vector3d position(a.downrange_m, a.crossrange_m, a.altitude_m);
  const Vector3d velocity(a.velocity_x_mps, a.velocity_y_mps, a.velocity_z_mps);
  const Vector3d thrust = brake_acceleration(position, velocity, g.burn_s);
  ignition_pitch_rad_ = std::atan2(thrust.x(), thrust.z());
  direction_ = Vector3d(std::sin(initial_pitch_rad()), 0.0, std::cos(initial_pitch_rad()));
  reference_ = pointing(direction_);
}

double LanderGuidance::pitch_rad(double t_s) const {
  return ignition_pitch_rad_ + params_.approach.pitch_rate_radps * (t_s - params_.approach.coast_s);
}

LanderGuidance::Estimate LanderGuidance::navigate(double step_s, const LanderState &s) {
  const GuidanceParams &g = params_.guidance;
  const double keep = std::exp(-step_s / g.noise_time_s);
  const double fresh = std::sqrt(1.0 - keep * keep);
  position_noise_m_ = keep * position_noise_m_ + fresh * g.position_noise_m * normal3(noise_);
  velocity_noise_mps_ = keep * velocity_noise_mps_ + fresh * g.velocity_noise_mps * normal3(noise_);
  return {position_m(s) + position_bias_m_ + position_noise_m_,
          velocity_mps(s) + velocity_bias_mps_ + velocity_noise_mps_, s[13] + mass_bias_kg_};
}

void LanderGuidance::choose_phase(double t_s, const Estimate &estimate) {
  const double altitude = altitude_m(model_, estimate.position_m);
  if (phase_ == Phase::coast && altitude <= ignition_altitude_m_ &&
      estimate.velocity_mps.z() < 0.0) {
    phase_ = Phase::brake;
    ignition_s_ = t_s;
  }
  const bool is_over =
      t_s - ignition_s_ >= params_.guidance.burn_s || altitude <= params_.guidance.gate_altitude_m;
  if (phase_ == Phase::brake && is_over)
    phase_ = Phase::descend;
}

// Acceleration that the engines must give for the quadratic profile to the gate in go_s.
Vector3d LanderGuidance::brake_acceleration(const Vector3d &position_m,
                                            const Vector3d &velocity_mps, double go_s) const {
  const GuidanceParams &g = params_.guidance;
  const Vector3d gate_m(0.0, 0.0, g.gate_altitude_m);
  const Vector3d gate_mps(0.0, 0.0, g.gate_velocity_z_mps);
  const Vector3d total =
      6.0 / (go_s * go_s) * (gate_m - position_m) - (4.0 * velocity_mps + 2.0 * gate_mps) / go_s;
  return total - gravity_mps2(model_, position_m);
}

// Slope of the total acceleration of that profile.
Vector3d LanderGuidance::brake_jerk(const Vector3d &position_m, const Vector3d &velocity_mps,
                                    double go_s) const {
  const GuidanceParams &g = params_.guidance;
  const Vector3d gate_m(0.0, 0.0, g.gate_altitude_m);
  const Vector3d gate_mps(0.0, 0.0, g.gate_velocity_z_mps);
  return -12.0 / (go_s * go_s * go_s) * (gate_m - position_m) +
         6.0 / (go_s * go_s) * (velocity_mps + gate_mps);
}

Vector3d LanderGuidance::wanted_acceleration(double t_s, const Estimate &estimate) {
  const GuidanceParams &g = params_.guidance;
  if (phase_ == Phase::brake) {
    const double go_s = g.burn_s - (t_s - ignition_s_);
    if (go_s >= kShortestGo_s) {
      last_go_s_ = go_s;
      last_acceleration_mps2_ =
          brake_acceleration(estimate.position_m, estimate.velocity_mps, go_s);
      last_jerk_mps3_ = brake_jerk(estimate.position_m, estimate.velocity_mps, go_s);
    }
    return last_acceleration_mps2_ + (last_go_s_ - go_s) * last_jerk_mps3_;
  }
  const double above_m = altitude_m(model_, estimate.position_m) - kSettleAltitude_m;
  const double slope_ps = (g.touchdown_velocity_z_mps - g.gate_velocity_z_mps) /
                          (g.gate_altitude_m - kSettleAltitude_m);
  const double wanted_mps = std::clamp(g.touchdown_velocity_z_mps - slope_ps * above_m,
                                       g.gate_velocity_z_mps, g.touchdown_velocity_z_mps);
  const Vector3d &v = estimate.velocity_mps;
  return Vector3d(-kLevelGain_ps * v.x(), -kLevelGain_ps * v.y(),
                  kSettleGain_ps * (wanted_mps - v.z())) -
         gravity_mps2(model_, estimate.position_m);
}

void LanderGuidance::steer(const Vector3d &wanted, double step_s, LanderInput &input) {
  const double share = phase_ == Phase::coast ? 1.0 : step_s / params_.guidance.attitude_filter_s;
  Vector3d change = share * (wanted - direction_);
  const double limit = params_.guidance.slew_radps * step_s;
  if (change.norm() > limit)
    change *= limit / change.norm();
  direction_ = (direction_ + change).normalized();
  const Quaterniond next = pointing(direction_);
  input.rate_radps = small_turn_rad(reference_, next) / step_s;
  // The step sees its middle, so that a steady turn leaves no mean error.
  input.attitude = reference_.slerp(0.5, next);
  reference_ = next;
}

// Integrates the torque the attitude hold has to give into the differential throttle.
void LanderGuidance::trim(const LanderVehicle &vehicle, double step_s, const LanderState &s,
                          const LanderInput &input) {
  const Vector3d torque = hold_torque_Nm(params_, vehicle, s, input);
  const double full_Nm =
      static_cast<double>(kEngines) * params_.engine.max_thrust_N * params_.engine.arm_m;
  const double rate = step_s / (params_.guidance.trim_time_s * full_Nm);
  trim_x_ = std::clamp(trim_x_ + rate * torque.x(), -0.1, 0.1);
  trim_y_ = std::clamp(trim_y_ + rate * torque.y(), -0.1, 0.1);
}

void LanderGuidance::command(const LanderVehicle &vehicle, double t_s, double step_s,
                             const LanderState &s, LanderInput &input) {
  const GuidanceParams &g = params_.guidance;
  const Estimate estimate = navigate(step_s, s);
  choose_phase(t_s, estimate);
  if (phase_ == Phase::coast) {
    const double pitch = pitch_rad(t_s + step_s);
    steer(Vector3d(std::sin(pitch), 0.0, std::cos(pitch)), step_s, input);
    input.hold_radps = g.coast_hold_radps;
    input.throttle.fill(0.0);
    return;
  }
  Vector3d wanted = wanted_acceleration(t_s, estimate);
  wanted.z() = std::max(wanted.z(), 0.1);
  const double level = wanted.head<2>().norm();
  if (level > kMaxTilt * wanted.z())
    wanted.head<2>() *= kMaxTilt * wanted.z() / level;
  steer(wanted.normalized(), step_s, input);
  input.hold_radps = g.burn_hold_radps;
  trim(vehicle, step_s, s, input);
  const double full_N = static_cast<double>(kEngines) * params_.engine.max_thrust_N;
  const double spool = params_.engine.min_throttle + (t_s - ignition_s_) / g.spool_s;
  const double base = std::min(estimate.mass_kg * wanted.norm() / full_N, spool);
  for (std::size_t i = 0; i < kEngines; ++i) {
    const Vector3d &mount = model_.mount_m[i];
    const double differential =
        trim_x_ * std::copysign(1.0, mount.y()) - trim_y_ * std::copysign(1.0, mount.x());
    const double throttle = std::clamp(base + differential, params_.engine.min_throttle, 1.0);
    input.throttle[i] = std::round(throttle / g.command_resolution) * g.command_resolution;
  }
}

} // namespace rim::world
