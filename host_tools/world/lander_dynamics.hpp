// SPDX-License-Identifier: MIT
// world/lander_dynamics.hpp - the lander as a rigid body with six degrees of freedom over a
// spherical Moon.
//
// Site frame: origin at the landing site, x downrange, y crossrange, z up; taken as inertial (the
// Moon turns by 0.06 deg in a landing). Body frame: z along the nominal thrust. Attitude: body to
// site, as roll, pitch, yaw about x, y, z (R = Rz Ry Rx).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "world/lander_params.hpp"
#include "world/random.hpp"

namespace rim::world {

// position 0-2, velocity 3-5, attitude quaternion w x y z 6-9, rates 10-12, mass 13, delivered
// flow of each engine as a share of full 14-17.
using LanderState = std::array<double, 18>;

// What is the same all through a run, drawn once.
struct LanderVehicle {
  double mu_m3ps2, radius_m;
  double mascon_gm_m3ps2;
  Eigen::Vector3d mascon_m; // its place in the site frame
  double dry_mass_kg, propellant_kg, tank_pressure_kPa;
  Eigen::Vector3d inertia_kgm2; // at the nominal initial mass
  double inertia_mass_kg;
  Eigen::Vector3d cg_m;
  std::array<double, kEngines> flow, isp_s;
  std::array<Eigen::Vector3d, kEngines> axis, mount_m; // thrust direction, place
};

// Shares that effects take away, and the tilt they give the engine frame.
struct LanderFault {
  std::array<double, kEngines> flow_loss{}, isp_loss{};
  std::array<double, 2> tilt_rad{};
};

// What acts during one step, constant in it.
struct LanderInput {
  std::array<double, kEngines> throttle{};
  std::array<double, kEngines> roughness{};                     // relative to 1
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity(); // reference of the attitude hold
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();
  double hold_radps = 0.0;
  Eigen::Vector3d disturbance_Nm = Eigen::Vector3d::Zero();
  LanderFault fault;
};

LanderVehicle nominal_vehicle(const LanderParams &params);
LanderVehicle draw_vehicle(const LanderParams &params, std::uint64_t seed, std::uint64_t run);

Eigen::Vector3d position_m(const LanderState &s);
Eigen::Vector3d velocity_mps(const LanderState &s);
Eigen::Quaterniond attitude(const LanderState &s);
Eigen::Vector3d rate_radps(const LanderState &s);
Eigen::Vector3d roll_pitch_yaw_rad(const Eigen::Quaterniond &q);

double altitude_m(const LanderVehicle &vehicle, const Eigen::Vector3d &position);
Eigen::Vector3d gravity_mps2(const LanderVehicle &vehicle, const Eigen::Vector3d &position);

// Torque of the attitude hold (jets or wheels; no command of the log shows it).
Eigen::Vector3d hold_torque_Nm(const LanderParams &params, const LanderVehicle &vehicle,
                               const LanderState &s, const LanderInput &input);

// Thrust of each engine in the body frame, and its share of full flow with losses and roughness.
std::array<Eigen::Vector3d, kEngines> thrust_N(const LanderParams &params,
                                               const LanderVehicle &vehicle, const LanderState &s,
                                               const LanderInput &input);
double engine_flow(const LanderVehicle &vehicle, const LanderState &s, const LanderInput &input,
                   std::size_t engine);

// Advances by `step_s` in `substeps` Runge-Kutta steps of fourth order; the quaternion is
// normalised afterwards. Cost: 4 derivatives a substep.
void advance(const LanderParams &params, const LanderVehicle &vehicle, const LanderInput &input,
             double step_s, int substeps, LanderState &s);

} // namespace rim::world
