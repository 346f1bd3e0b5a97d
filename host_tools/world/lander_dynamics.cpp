// SPDX-License-Identifier: MIT
#include "world/lander_dynamics.hpp"

#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <cmath>

#include "world/lander_streams.hpp"

namespace rim::world {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStandardGravity_mps2 = 9.80665; // exact, defines specific impulse

Vector3d attraction(double mu_m3ps2, const Vector3d &from_centre_m) {
  const double r = from_centre_m.norm();
  return -mu_m3ps2 / (r * r * r) * from_centre_m;
}

struct Derivative {
  const LanderParams &params;
  const LanderVehicle &vehicle;
  const LanderInput &input;

  void operator()(const LanderState &s, LanderState &d, double /*t*/) const {
    const Quaterniond q = attitude(s);
    const Vector3d rate = rate_radps(s);
    const double mass_kg = s[13];
    const auto thrust = thrust_N(params, vehicle, s, input);
    Vector3d force = Vector3d::Zero();
    Vector3d torque = hold_torque_Nm(params, vehicle, s, input) + input.disturbance_Nm;
    double burn_kgps = 0.0;
    for (std::size_t i = 0; i < kEngines; ++i) {
      force += thrust[i];
      torque += (vehicle.mount_m[i] - vehicle.cg_m).cross(thrust[i]);
      burn_kgps += params.engine.max_thrust_N * engine_flow(vehicle, s, input, i) /
                   (params.engine.specific_impulse_s * kStandardGravity_mps2);
      d[14 + i] = (input.throttle[i] - s[14 + i]) / params.engine.lag_s;
    }
    const Vector3d acceleration = q * (force / mass_kg) + gravity_mps2(vehicle, position_m(s));
    const Vector3d inertia = vehicle.inertia_kgm2 * (mass_kg / vehicle.inertia_mass_kg);
    const Vector3d momentum = inertia.cwiseProduct(rate);
    const Vector3d spin = (torque - rate.cross(momentum)).cwiseQuotient(inertia);
    const Quaterniond turn = q * Quaterniond(0.0, rate.x(), rate.y(), rate.z());
    for (std::size_t i = 0; i < 3; ++i) {
      const auto e = static_cast<Eigen::Index>(i);
      d[i] = s[3 + i];
      d[3 + i] = acceleration[e];
      d[10 + i] = spin[e];
    }
    d[6] = 0.5 * turn.w();
    d[7] = 0.5 * turn.x();
    d[8] = 0.5 * turn.y();
    d[9] = 0.5 * turn.z();
    d[13] = -burn_kgps;
  }
};

} // namespace

LanderVehicle nominal_vehicle(const LanderParams &p) {
  LanderVehicle v;
  v.mu_m3ps2 = p.body.mu_m3ps2;
  v.radius_m = p.body.radius_m;
  v.mascon_gm_m3ps2 = 0.0;
  v.mascon_m = Vector3d(0.0, 0.0, -p.body.mascon_depth_m);
  v.dry_mass_kg = p.vehicle.dry_mass_kg;
  v.propellant_kg = p.vehicle.propellant_kg;
  v.tank_pressure_kPa = p.tank.pressure_kPa;
  v.inertia_kgm2 =
      Vector3d(p.vehicle.inertia_x_kgm2, p.vehicle.inertia_y_kgm2, p.vehicle.inertia_z_kgm2);
  v.inertia_mass_kg = v.dry_mass_kg + v.propellant_kg;
  v.cg_m = Vector3d::Zero();
  constexpr std::array<double, kEngines> x = {1.0, -1.0, -1.0, 1.0};
  constexpr std::array<double, kEngines> y = {1.0, 1.0, -1.0, -1.0};
  for (std::size_t i = 0; i < kEngines; ++i) {
    v.flow[i] = 1.0;
    v.isp_s[i] = p.engine.specific_impulse_s;
    v.axis[i] = Vector3d::UnitZ();
    v.mount_m[i] = Vector3d(x[i] * p.engine.arm_m, y[i] * p.engine.arm_m, -p.engine.drop_m);
  }
  return v;
}

LanderVehicle draw_vehicle(const LanderParams &p, std::uint64_t seed, std::uint64_t run) {
  LanderVehicle v = nominal_vehicle(p);
  Random body(seed, run, kBodyStream);
  v.mu_m3ps2 *= 1.0 + p.body.mu_relative_sd * body.normal();
  v.mascon_gm_m3ps2 = p.body.mascon_gm_sd_m3ps2 * body.normal();
  v.mascon_m.x() = p.body.mascon_spread_m * body.normal();
  v.mascon_m.y() = p.body.mascon_spread_m * body.normal();
  Random vehicle(seed, run, kVehicleStream);
  v.dry_mass_kg += p.vehicle.dry_mass_sd_kg * vehicle.normal();
  v.propellant_kg += p.vehicle.propellant_sd_kg * vehicle.normal();
  v.tank_pressure_kPa += p.tank.pressure_sd_kPa * vehicle.normal();
  v.cg_m.x() = p.vehicle.cg_offset_sd_m * vehicle.normal();
  v.cg_m.y() = p.vehicle.cg_offset_sd_m * vehicle.normal();
  Random engine(seed, run, kEngineStream);
  const double frame_x = p.engine.frame_misalignment_sd_rad * engine.normal();
  const double frame_y = p.engine.frame_misalignment_sd_rad * engine.normal();
  for (std::size_t i = 0; i < kEngines; ++i) {
    v.flow[i] *= 1.0 + p.engine.flow_sd * engine.normal();
    v.isp_s[i] *= 1.0 + p.engine.specific_impulse_sd * engine.normal();
    const double about_x = frame_x + p.engine.misalignment_sd_rad * engine.normal();
    const double about_y = frame_y + p.engine.misalignment_sd_rad * engine.normal();
    v.axis[i] = Vector3d(about_y, -about_x, 1.0).normalized();
  }
  return v;
}

Vector3d position_m(const LanderState &s) { return {s[0], s[1], s[2]}; }
Vector3d velocity_mps(const LanderState &s) { return {s[3], s[4], s[5]}; }
Quaterniond attitude(const LanderState &s) { return {s[6], s[7], s[8], s[9]}; }
Vector3d rate_radps(const LanderState &s) { return {s[10], s[11], s[12]}; }

Vector3d roll_pitch_yaw_rad(const Quaterniond &q) {
  const double roll = std::atan2(2.0 * (q.w() * q.x() + q.y() * q.z()),
                                 1.0 - 2.0 * (q.x() * q.x() + q.y() * q.y()));
  const double sine = 2.0 * (q.w() * q.y() - q.z() * q.x());
  const double pitch = std::asin(std::fmax(-1.0, std::fmin(1.0, sine)));
  const double yaw = std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()),
                                1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
  return {roll, pitch, yaw};
}

double altitude_m(const LanderVehicle &vehicle, const Vector3d &position) {
  return (position + Vector3d(0.0, 0.0, vehicle.radius_m)).norm() - vehicle.radius_m;
}

Vector3d gravity_mps2(const LanderVehicle &vehicle, const Vector3d &position) {
  return attraction(vehicle.mu_m3ps2, position + Vector3d(0.0, 0.0, vehicle.radius_m)) +
         attraction(vehicle.mascon_gm_m3ps2, position - vehicle.mascon_m);
}

Vector3d hold_torque_Nm(const LanderParams &params, const LanderVehicle &vehicle,
                        const LanderState &s, const LanderInput &input) {
  const Quaterniond error = input.attitude.conjugate() * attitude(s);
  const double sign = error.w() < 0.0 ? -1.0 : 1.0;
  const double n = input.hold_radps;
  const Vector3d inertia = vehicle.inertia_kgm2 * (s[13] / vehicle.inertia_mass_kg);
  return -inertia.cwiseProduct(n * n * 2.0 * sign * error.vec() +
                               2.0 * params.guidance.hold_damping * n *
                                   (rate_radps(s) - input.rate_radps));
}

double engine_flow(const LanderVehicle &vehicle, const LanderState &s, const LanderInput &input,
                   std::size_t i) {
  return s[14 + i] * vehicle.flow[i] * (1.0 + input.roughness[i]) *
         (1.0 - input.fault.flow_loss[i]);
}

std::array<Vector3d, kEngines> thrust_N(const LanderParams &params, const LanderVehicle &vehicle,
                                        const LanderState &s, const LanderInput &input) {
  std::array<Vector3d, kEngines> thrust;
  const Vector3d tilt(input.fault.tilt_rad[1], -input.fault.tilt_rad[0], 0.0);
  for (std::size_t i = 0; i < kEngines; ++i) {
    const double isp =
        vehicle.isp_s[i] / params.engine.specific_impulse_s * (1.0 - input.fault.isp_loss[i]);
    thrust[i] = params.engine.max_thrust_N * engine_flow(vehicle, s, input, i) * isp *
                (vehicle.axis[i] + tilt).normalized();
  }
  return thrust;
}

void advance(const LanderParams &params, const LanderVehicle &vehicle, const LanderInput &input,
             double step_s, int substeps, LanderState &s) {
  boost::numeric::odeint::runge_kutta4<LanderState> stepper;
  const Derivative derivative{params, vehicle, input};
  const double dt = step_s / substeps;
  for (int i = 0; i < substeps; ++i)
    stepper.do_step(derivative, s, 0.0, dt);
  const Quaterniond q = attitude(s).normalized();
  s[6] = q.w();
  s[7] = q.x();
  s[8] = q.y();
  s[9] = q.z();
}

} // namespace rim::world
