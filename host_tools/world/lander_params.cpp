// SPDX-License-Identifier: MIT
#include "world/lander_params.hpp"

#include <set>

#include "util/error.hpp"
#include "util/toml_table.hpp"

namespace rim::world {
namespace {

constexpr Range kPositive = Range::positive;
constexpr Range kSpread = Range::not_negative;

std::vector<NumberKey> keys_of(BodyParams &p) {
  return {{"mu_m3ps2", &p.mu_m3ps2, kPositive},
          {"radius_m", &p.radius_m, kPositive},
          {"mu_relative_sd", &p.mu_relative_sd, kSpread},
          {"mascon_gm_sd_m3ps2", &p.mascon_gm_sd_m3ps2, kSpread},
          {"mascon_depth_m", &p.mascon_depth_m, kPositive},
          {"mascon_spread_m", &p.mascon_spread_m, kSpread}};
}

std::vector<NumberKey> keys_of(VehicleParams &p) {
  return {{"dry_mass_kg", &p.dry_mass_kg, kPositive},
          {"propellant_kg", &p.propellant_kg, kPositive},
          {"dry_mass_sd_kg", &p.dry_mass_sd_kg, kSpread},
          {"propellant_sd_kg", &p.propellant_sd_kg, kSpread},
          {"inertia_x_kgm2", &p.inertia_x_kgm2, kPositive},
          {"inertia_y_kgm2", &p.inertia_y_kgm2, kPositive},
          {"inertia_z_kgm2", &p.inertia_z_kgm2, kPositive},
          {"cg_offset_sd_m", &p.cg_offset_sd_m, kSpread},
          {"disturbance_torque_Nm", &p.disturbance_torque_Nm, kSpread},
          {"disturbance_time_s", &p.disturbance_time_s, kPositive}};
}

std::vector<NumberKey> keys_of(TankParams &p) {
  return {{"pressure_kPa", &p.pressure_kPa, kPositive},
          {"ullage_m3", &p.ullage_m3, kPositive},
          {"propellant_density_kgpm3", &p.propellant_density_kgpm3, kPositive},
          {"pressure_sd_kPa", &p.pressure_sd_kPa, kSpread}};
}

std::vector<NumberKey> keys_of(EngineParams &p) {
  return {{"max_thrust_N", &p.max_thrust_N, kPositive},
          {"specific_impulse_s", &p.specific_impulse_s, kPositive},
          {"chamber_pressure_kPa", &p.chamber_pressure_kPa, kPositive},
          {"min_throttle", &p.min_throttle, Range::fraction},
          {"lag_s", &p.lag_s, kPositive},
          {"arm_m", &p.arm_m, kPositive},
          {"drop_m", &p.drop_m, kSpread},
          {"roughness", &p.roughness, kSpread},
          {"flow_sd", &p.flow_sd, kSpread},
          {"specific_impulse_sd", &p.specific_impulse_sd, kSpread},
          {"misalignment_sd_rad", &p.misalignment_sd_rad, kSpread},
          {"frame_misalignment_sd_rad", &p.frame_misalignment_sd_rad, kSpread}};
}

std::vector<NumberKey> keys_of(ApproachParams &p) {
  return {{"coast_s", &p.coast_s, kPositive},
          {"altitude_m", &p.altitude_m, kPositive},
          {"downrange_m", &p.downrange_m, Range::any},
          {"crossrange_m", &p.crossrange_m, Range::any},
          {"velocity_x_mps", &p.velocity_x_mps, Range::any},
          {"velocity_y_mps", &p.velocity_y_mps, Range::any},
          {"velocity_z_mps", &p.velocity_z_mps, Range::any},
          {"position_sd_m", &p.position_sd_m, kSpread},
          {"velocity_sd_mps", &p.velocity_sd_mps, kSpread},
          {"pitch_rate_radps", &p.pitch_rate_radps, Range::any}};
}

std::vector<NumberKey> keys_of(GuidanceParams &p) {
  return {{"ignition_altitude_sd_m", &p.ignition_altitude_sd_m, kSpread},
          {"burn_s", &p.burn_s, kPositive},
          {"spool_s", &p.spool_s, kPositive},
          {"gate_altitude_m", &p.gate_altitude_m, kPositive},
          {"gate_velocity_z_mps", &p.gate_velocity_z_mps, Range::any},
          {"touchdown_velocity_z_mps", &p.touchdown_velocity_z_mps, Range::any},
          {"slew_radps", &p.slew_radps, kPositive},
          {"attitude_filter_s", &p.attitude_filter_s, kPositive},
          {"trim_time_s", &p.trim_time_s, kPositive},
          {"coast_hold_radps", &p.coast_hold_radps, kPositive},
          {"burn_hold_radps", &p.burn_hold_radps, kPositive},
          {"hold_damping", &p.hold_damping, kPositive},
          {"command_resolution", &p.command_resolution, kPositive},
          {"position_bias_sd_m", &p.position_bias_sd_m, kSpread},
          {"velocity_bias_sd_mps", &p.velocity_bias_sd_mps, kSpread},
          {"mass_bias_sd_kg", &p.mass_bias_sd_kg, kSpread},
          {"position_noise_m", &p.position_noise_m, kSpread},
          {"velocity_noise_mps", &p.velocity_noise_mps, kSpread},
          {"noise_time_s", &p.noise_time_s, kPositive}};
}

std::vector<NumberKey> keys_of(SensorParams &p) {
  return {{"bias_sd", &p.bias_sd, kSpread},
          {"scale_sd", &p.scale_sd, kSpread},
          {"noise_sd", &p.noise_sd, kSpread},
          {"noise_level_sd", &p.noise_level_sd, kSpread},
          {"drift_sd_per_s", &p.drift_sd_per_s, kSpread},
          {"resolution", &p.resolution, kPositive}};
}

template <class Section>
void read_section(const std::string &path, const toml::table &root, const char *name,
                  Section &section, bool complete) {
  const toml::node *node = root.get(name);
  if (node == nullptr) {
    if (complete)
      throw DataError(path + ": table '[" + std::string(name) + "]' is missing");
    return;
  }
  if (!node->is_table())
    fail(path, *node, "key '" + std::string(name) + "': must be a table");
  read_numbers(path, *node->as_table(), name, keys_of(section), complete);
}

void read_sensor(const std::string &path, const toml::node &node, LanderParams &params,
                 std::set<std::size_t> &seen, bool complete) {
  if (!node.is_table())
    fail(path, node, "key 'sensor': must be an array of tables");
  const toml::table &table = *node.as_table();
  const toml::array *columns = table["columns"].as_array();
  if (columns == nullptr || columns->empty()) {
    fail(path, table, "key 'sensor.columns': must be a list of column names");
  }
  for (const toml::node &column : *columns) {
    const std::string name = read_string(path, column, "sensor.columns");
    const std::size_t index = sensor_index(name);
    if (index == kSensors)
      fail(path, column, "key 'sensor.columns': no sensor '" + name + "'");
    if (!seen.insert(index).second) {
      fail(path, column, "key 'sensor.columns': '" + name + "' is given twice");
    }
    read_numbers(path, table, "sensor", keys_of(params.sensor[index]), complete, {"columns"});
  }
}

void read_sensors(const std::string &path, const toml::table &root, LanderParams &params,
                  bool complete) {
  std::set<std::size_t> seen;
  if (const toml::node *node = root.get("sensor")) {
    if (!node->is_array())
      fail(path, *node, "key 'sensor': must be an array of tables");
    for (const toml::node &entry : *node->as_array()) {
      read_sensor(path, entry, params, seen, complete);
    }
  }
  if (!complete)
    return;
  for (std::size_t i = 0; i < kSensors; ++i) {
    if (seen.count(i) == 0) {
      throw DataError(path + ": no [[sensor]] lists the column '" + sensor_names()[i] + "'");
    }
  }
}

void read_file(const std::string &path, LanderParams &params, bool complete) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false,
               {"body", "vehicle", "tank", "engine", "approach", "guidance", "sensor"});
  read_section(path, root, "body", params.body, complete);
  read_section(path, root, "vehicle", params.vehicle, complete);
  read_section(path, root, "tank", params.tank, complete);
  read_section(path, root, "engine", params.engine, complete);
  read_section(path, root, "approach", params.approach, complete);
  read_section(path, root, "guidance", params.guidance, complete);
  read_sensors(path, root, params, complete);
}

} // namespace

const std::array<std::string, kSensors> &sensor_names() {
  static const std::array<std::string, kSensors> names = {"position_x_m",
                                                          "position_y_m",
                                                          "position_z_m",
                                                          "velocity_imu_x_mps",
                                                          "velocity_imu_y_mps",
                                                          "velocity_imu_z_mps",
                                                          "velocity_doppler_x_mps",
                                                          "velocity_doppler_y_mps",
                                                          "velocity_doppler_z_mps",
                                                          "altitude_radar_m",
                                                          "altitude_laser_m",
                                                          "roll_rad",
                                                          "pitch_rad",
                                                          "yaw_rad",
                                                          "rate_x_radps",
                                                          "rate_y_radps",
                                                          "rate_z_radps",
                                                          "acceleration_mps2",
                                                          "gravity_mps2",
                                                          "mass_kg",
                                                          "tank_pressure_kPa",
                                                          "chamber_pressure_1_kPa",
                                                          "chamber_pressure_2_kPa",
                                                          "chamber_pressure_3_kPa",
                                                          "chamber_pressure_4_kPa"};
  return names;
}

std::size_t sensor_index(const std::string &name) {
  const std::string bare = name.rfind("s.", 0) == 0 ? name.substr(2) : name;
  for (std::size_t i = 0; i < kSensors; ++i) {
    if (sensor_names()[i] == bare)
      return i;
  }
  return kSensors;
}

std::string lander_params_toml(const LanderParams &params) {
  LanderParams p = params;
  std::string text =
      table_toml("[body]", keys_of(p.body)) + table_toml("\n[vehicle]", keys_of(p.vehicle)) +
      table_toml("\n[tank]", keys_of(p.tank)) + table_toml("\n[engine]", keys_of(p.engine)) +
      table_toml("\n[approach]", keys_of(p.approach)) +
      table_toml("\n[guidance]", keys_of(p.guidance));
  for (std::size_t i = 0; i < kSensors; ++i) {
    text +=
        table_toml("\n[[sensor]]\ncolumns = [\"" + sensor_names()[i] + "\"]", keys_of(p.sensor[i]));
  }
  return text;
}

LanderParams read_lander_params(const std::string &base, const std::string &overlay) {
  return read_overlaid<LanderParams>(base, overlay, read_file);
}

} // namespace rim::world
