// SPDX-License-Identifier: MIT
// world/lander_guidance.hpp - guidance of the lander: when to ignite, how to thrust, how to point.
//
// It coasts in a slow turn, ignites at an altitude of its own choice, brakes by quadratic (E)
// guidance (Cherry, AIAA 64-638) and descends at constant speed to the ground. It sees its own
// estimate of position, velocity and mass only, never the truth nor the telemetry.
#pragma once

#include "world/lander_dynamics.hpp"

namespace rim::world {

class LanderGuidance {
public:
  LanderGuidance(const LanderParams &params, std::uint64_t seed, std::uint64_t run);

  // Commands for the step that begins at `t_s` in truth `s`: throttle, attitude reference and hold.
  void command(const LanderVehicle &vehicle, double t_s, double step_s, const LanderState &s,
               LanderInput &input);

  bool is_thrusting() const { return phase_ != Phase::coast; }

  // Pitch of the attitude reference at the start of the run.
  double initial_pitch_rad() const { return pitch_rad(0.0); }

private:
  enum class Phase { coast, brake, descend };

  struct Estimate {
    Eigen::Vector3d position_m, velocity_mps;
    double mass_kg;
  };

  double pitch_rad(double t_s) const;
  Estimate navigate(double step_s, const LanderState &s);
  void choose_phase(double t_s, const Estimate &estimate);
  Eigen::Vector3d wanted_acceleration(double t_s, const Estimate &estimate);
  Eigen::Vector3d brake_acceleration(const Eigen::Vector3d &position_m,
                                     const Eigen::Vector3d &velocity_mps, double go_s) const;
  Eigen::Vector3d brake_jerk(const Eigen::Vector3d &position_m, const Eigen::Vector3d &velocity_mps,
                             double go_s) const;
  void steer(const Eigen::Vector3d &direction, double step_s, LanderInput &input);
  void trim(const LanderVehicle &vehicle, double step_s, const LanderState &s,
            const LanderInput &input);

  const LanderParams &params_;
  LanderVehicle model_; // what the guidance believes: nominal
  Phase phase_ = Phase::coast;
  double ignition_altitude_m_ = 0.0;
  double ignition_s_ = 0.0;
  double ignition_pitch_rad_ = 0.0;
  Eigen::Vector3d position_bias_m_, velocity_bias_mps_;
  double mass_bias_kg_ = 0.0;
  double last_go_s_ = 0.0; // the profile as last updated: time to go, acceleration and its slope
  Eigen::Vector3d last_acceleration_mps2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_jerk_mps3_ = Eigen::Vector3d::Zero();
  Random noise_;
  Eigen::Vector3d position_noise_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_noise_mps_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_ = Eigen::Vector3d::UnitZ();
  Eigen::Quaterniond reference_ = Eigen::Quaterniond::Identity();
  double trim_x_ = 0.0, trim_y_ = 0.0; // differential throttle, share of full
};

} // namespace rim::world
