// SPDX-License-Identifier: MIT
#include "world/lander.hpp"

#include <algorithm>
#include <cmath>

#include "util/error.hpp"
#include "world/lander_guidance.hpp"
#include "world/lander_streams.hpp"

namespace rim::world {
namespace {

using Eigen::Vector3d;

constexpr int kCoastSubsteps = 1;
constexpr int kBurnSubsteps = 2;

Vector3d normal3(Random &random) {
  const double x = random.normal();
  const double y = random.normal();
  const double z = random.normal();
  return {x, y, z};
}

// The nominal ignition state taken back through the coast, then dispersed.
LanderState initial_state(const LanderParams &p, const LanderVehicle &vehicle, double pitch_rad,
                          std::uint64_t seed, std::uint64_t run) {
  const ApproachParams &a = p.approach;
  LanderState s{};
  s[0] = a.downrange_m;
  s[1] = a.crossrange_m;
  s[2] = a.altitude_m;
  s[3] = a.velocity_x_mps;
  s[4] = a.velocity_y_mps;
  s[5] = a.velocity_z_mps;
  s[6] = 1.0;
  s[13] = p.vehicle.dry_mass_kg + p.vehicle.propellant_kg;
  const int steps = static_cast<int>(std::lround(a.coast_s / kLanderStep_s));
  LanderInput off;
  advance(p, nominal_vehicle(p), off, -a.coast_s, steps, s);
  Random random(seed, run, kInitialStream);
  const Vector3d position = a.position_sd_m * normal3(random);
  const Vector3d velocity = a.velocity_sd_mps * normal3(random);
  for (std::size_t i = 0; i < 3; ++i) {
    s[i] += position[static_cast<Eigen::Index>(i)];
    s[3 + i] += velocity[static_cast<Eigen::Index>(i)];
  }
  s[6] = std::cos(pitch_rad / 2.0);
  s[8] = std::sin(pitch_rad / 2.0);
  s[11] = a.pitch_rate_radps;
  s[13] = vehicle.dry_mass_kg + vehicle.propellant_kg;
  return s;
}

double tank_pressure_kPa(const LanderParams &p, const LanderVehicle &vehicle, double mass_kg) {
  // Isothermal blowdown; the load of the run sets the gas volume at the start.
  const double burnt_kg = vehicle.dry_mass_kg + vehicle.propellant_kg - mass_kg;
  const double start_m3 = p.tank.ullage_m3 - (vehicle.propellant_kg - p.vehicle.propellant_kg) /
                                                 p.tank.propellant_density_kgpm3;
  return vehicle.tank_pressure_kPa * p.tank.ullage_m3 /
         (start_m3 + burnt_kg / p.tank.propellant_density_kgpm3);
}

Quantities quantities(const LanderVehicle &vehicle, double t_s, const LanderState &s,
                      bool is_thrusting) {
  Quantities q;
  q[static_cast<std::size_t>(Quantity::time_s)] = t_s;
  q[static_cast<std::size_t>(Quantity::altitude_m)] = altitude_m(vehicle, position_m(s));
  q[static_cast<std::size_t>(Quantity::speed_mps)] = velocity_mps(s).norm();
  q[static_cast<std::size_t>(Quantity::velocity_x_mps)] = s[3];
  q[static_cast<std::size_t>(Quantity::velocity_y_mps)] = s[4];
  q[static_cast<std::size_t>(Quantity::velocity_z_mps)] = s[5];
  q[static_cast<std::size_t>(Quantity::downrange_m)] = s[0];
  q[static_cast<std::size_t>(Quantity::thrust)] = (s[14] + s[15] + s[16] + s[17]) / 4.0;
  q[static_cast<std::size_t>(Quantity::thrusting)] = is_thrusting ? 1.0 : 0.0;
  return q;
}

std::array<double, kSensors> perfect_sensors(const LanderParams &p, const LanderVehicle &vehicle,
                                             const LanderState &s, const LanderInput &input) {
  const Vector3d position = position_m(s);
  const double altitude = altitude_m(vehicle, position);
  const Vector3d angle = roll_pitch_yaw_rad(attitude(s));
  Vector3d force = Vector3d::Zero();
  for (const Vector3d &thrust : thrust_N(p, vehicle, s, input))
    force += thrust;
  std::array<double, kSensors> out = {s[0],
                                      s[1],
                                      s[2],
                                      s[3],
                                      s[4],
                                      s[5],
                                      s[3],
                                      s[4],
                                      s[5],
                                      altitude,
                                      altitude,
                                      angle.x(),
                                      angle.y(),
                                      angle.z(),
                                      s[10],
                                      s[11],
                                      s[12],
                                      force.z() / s[13],
                                      gravity_mps2(vehicle, position).norm(),
                                      s[13],
                                      tank_pressure_kPa(p, vehicle, s[13]),
                                      0.0,
                                      0.0,
                                      0.0,
                                      0.0};
  for (std::size_t i = 0; i < kEngines; ++i) {
    out[21 + i] = p.engine.chamber_pressure_kPa * engine_flow(vehicle, s, input, i);
  }
  return out;
}

// What the open terms do to the physics. Returns whether any acts: losses of engines need thrust.
bool apply_physics(const std::vector<Effect> &effects, const Quantities &truth,
                   LanderFault &fault) {
  bool acts = false;
  fault = {};
  const bool is_thrusting = truth[static_cast<std::size_t>(Quantity::thrusting)] > 0.5;
  for (const Effect &effect : effects) {
    for (const EffectTerm &term : effect.terms) {
      if (!term.is_physics() || !term.is_open(truth))
        continue;
      acts = acts || is_thrusting;
      for (std::size_t i = 0; i < kEngines; ++i) {
        if (term.engine != kEngines && term.engine != i)
          continue;
        if (term.kind == EffectKind::thrust_loss)
          fault.flow_loss[i] += term.size();
        if (term.kind == EffectKind::isp_loss)
          fault.isp_loss[i] += term.size();
      }
      if (term.kind == EffectKind::misalignment)
        fault.tilt_rad[term.axis] += term.size();
    }
  }
  return acts;
}

void check_state(const LanderVehicle &vehicle, double t_s, const LanderState &s) {
  const bool is_finite = std::all_of(s.begin(), s.end(), [](double v) { return std::isfinite(v); });
  if (is_finite && s[13] > vehicle.dry_mass_kg)
    return;
  throw DataError("lander: " + std::string(is_finite ? "the propellant is gone" : "it tumbles") +
                  " at t = " + std::to_string(t_s) + " s; check the parameters and effects");
}

struct Process {
  Random random;
  Vector3d disturbance_Nm = Vector3d::Zero();

  void step(const LanderParams &p, LanderInput &input) {
    const double keep = std::exp(-kLanderStep_s / p.vehicle.disturbance_time_s);
    const double fresh = p.vehicle.disturbance_torque_Nm * std::sqrt(1.0 - keep * keep);
    disturbance_Nm = keep * disturbance_Nm + fresh * normal3(random);
    input.disturbance_Nm = disturbance_Nm;
    for (double &roughness : input.roughness)
      roughness = p.engine.roughness * random.normal();
  }
};

} // namespace

LanderRun simulate_lander(const LanderParams &params, const std::vector<Effect> &effects,
                          std::uint64_t seed, std::uint64_t run) {
  const LanderVehicle vehicle = draw_vehicle(params, seed, run);
  LanderGuidance guidance(params, seed, run);
  LanderState s = initial_state(params, vehicle, guidance.initial_pitch_rad(), seed, run);
  Process process{Random(seed, run, kProcessStream)};
  LanderInput input;
  LanderRun result;
  result.rows.reserve(8800);
  bool was_thrusting = false;
  for (std::size_t k = 0; k < kMaxLanderRows; ++k) {
    LanderRow row;
    row.t_s = static_cast<double>(k) / 20.0;
    guidance.command(vehicle, row.t_s, kLanderStep_s, s, input);
    process.step(params, input);
    if (guidance.is_thrusting() && !was_thrusting)
      result.ignition_s = row.t_s;
    was_thrusting = guidance.is_thrusting();
    row.quantity = quantities(vehicle, row.t_s, s, was_thrusting);
    row.acts = apply_physics(effects, row.quantity, input.fault);
    row.throttle = input.throttle;
    row.sensor = perfect_sensors(params, vehicle, s, input);
    result.rows.push_back(row);
    if (row.quantity[static_cast<std::size_t>(Quantity::altitude_m)] <= 0.0) {
      for (std::size_t i = 0; i < 3; ++i)
        result.touchdown_velocity_mps[i] = s[3 + i];
      read_lander_sensors(params, effects, seed, run, result);
      return result;
    }
    check_state(vehicle, row.t_s, s);
    advance(params, vehicle, input, kLanderStep_s, was_thrusting ? kBurnSubsteps : kCoastSubsteps,
            s);
  }
  throw DataError("lander: no touchdown within " + std::to_string(kMaxLanderRows) +
                  " rows; check the parameters");
}

std::vector<std::string> lander_columns() {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= kEngines; ++i)
    names.push_back("u.throttle_" + std::to_string(i));
  for (const std::string &name : sensor_names())
    names.push_back("s." + name);
  return names;
}

} // namespace rim::world
