// SPDX-License-Identifier: MIT
// world/lander_params.hpp - parameters of the lander: data/lander.toml, a user's file over it.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace rim::world {

constexpr std::size_t kEngines = 4;
constexpr std::size_t kSensors = 25;

struct BodyParams {
  double mu_m3ps2 = 0, radius_m = 0, mu_relative_sd = 0, mascon_gm_sd_m3ps2 = 0;
  double mascon_depth_m = 0, mascon_spread_m = 0;
};

struct VehicleParams {
  double dry_mass_kg = 0, propellant_kg = 0, dry_mass_sd_kg = 0, propellant_sd_kg = 0;
  double inertia_x_kgm2 = 0, inertia_y_kgm2 = 0, inertia_z_kgm2 = 0, cg_offset_sd_m = 0;
  double disturbance_torque_Nm = 0, disturbance_time_s = 0;
};

struct TankParams {
  double pressure_kPa = 0, ullage_m3 = 0, propellant_density_kgpm3 = 0, pressure_sd_kPa = 0;
};

struct EngineParams {
  double max_thrust_N = 0, specific_impulse_s = 0, chamber_pressure_kPa = 0, min_throttle = 0;
  double lag_s = 0, arm_m = 0, drop_m = 0, roughness = 0, flow_sd = 0, specific_impulse_sd = 0;
  double misalignment_sd_rad = 0, frame_misalignment_sd_rad = 0;
};

struct ApproachParams {
  double coast_s = 0, altitude_m = 0, downrange_m = 0, crossrange_m = 0, velocity_x_mps = 0;
  double velocity_y_mps = 0, velocity_z_mps = 0, position_sd_m = 0, velocity_sd_mps = 0;
  double pitch_rate_radps = 0;
};

struct GuidanceParams {
  double ignition_altitude_sd_m = 0, burn_s = 0, spool_s = 0, gate_altitude_m = 0;
  double gate_velocity_z_mps = 0, touchdown_velocity_z_mps = 0, slew_radps = 0;
  double attitude_filter_s = 0, trim_time_s = 0, coast_hold_radps = 0, burn_hold_radps = 0;
  double hold_damping = 0, command_resolution = 0, position_bias_sd_m = 0;
  double velocity_bias_sd_mps = 0, mass_bias_sd_kg = 0, position_noise_m = 0;
  double velocity_noise_mps = 0, noise_time_s = 0;
};

struct SensorParams {
  double bias_sd = 0, scale_sd = 0, noise_sd = 0, noise_level_sd = 0, drift_sd_per_s = 0;
  double resolution = 0;
};

struct LanderParams {
  BodyParams body;
  VehicleParams vehicle;
  TankParams tank;
  EngineParams engine;
  ApproachParams approach;
  GuidanceParams guidance;
  std::array<SensorParams, kSensors> sensor{}; // in the order of sensor_names()
};

// Names of the sensors, without the prefix "s.", in the order of the log's columns.
const std::array<std::string, kSensors> &sensor_names();

// Index of a sensor ("altitude_radar_m" or "s.altitude_radar_m"); kSensors where there is none.
std::size_t sensor_index(const std::string &name);

// Reads `base` (which must be complete) and lays `overlay` (which may hold any part; empty: none)
// over it. Throws DataError naming file, line and key: unknown or missing key, wrong type, value
// out of range.
LanderParams read_lander_params(const std::string &base, const std::string &overlay = "");

// The same parameters as TOML, readable as --params.
std::string lander_params_toml(const LanderParams &params);

} // namespace rim::world
