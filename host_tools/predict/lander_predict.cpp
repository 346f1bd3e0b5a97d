// SPDX-License-Identifier: MIT
#include "predict/lander_predict.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "predict/columns.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/lander.hpp"

namespace rim::world {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStandardGravity_mps2 = 9.80665;
constexpr double kGap_s = 0.25; // longest between rows of a step
constexpr double kMean_s = 1.0; // of the readings that a step begins with
constexpr double kLeastMass = 0.1; // of the dry mass: what is less weighs nothing
const char *const kWho = "world lander";

// Sensors by their place in sensor_names().
enum Sensor : std::size_t {
  kPosition = 0,
  kImu = 3,
  kDoppler = 6,
  kRadar = 9,
  kLaser = 10,
  kAngle = 11,
  kRate = 14,
  kAcceleration = 17,
  kGravity = 18,
  kMass = 19,
  kTank = 20,
  kChamber = 21
};

const std::vector<std::size_t> &predicted() {
  static const std::vector<std::size_t> list = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10,
                                                14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24};
  return list;
}

struct Columns {
  std::array<int, kEngines> throttle;
  std::array<int, kSensors> sensor;
  explicit Columns(const Log &log) {
    for (std::size_t i = 0; i < kEngines; ++i)
      throttle[i] = needed_column(log, "u.throttle_" + std::to_string(i + 1), kWho);
    for (std::size_t i = 0; i < kSensors; ++i)
      sensor[i] = needed_column(log, "s." + sensor_names()[i], kWho);
  }
};

// One row's readings.
struct Row {
  const Log &log;
  const Columns &c;
  Eigen::Index r;
  Row(const Log &l, const Columns &columns, std::size_t row)
      : log(l), c(columns), r(static_cast<Eigen::Index>(row)) {}
  double sensor(std::size_t i) const { return log.values(r, c.sensor[i]); }
  double throttle(std::size_t i) const { return log.values(r, c.throttle[i]); }
  Vector3d vector(std::size_t i) const { return {sensor(i), sensor(i + 1), sensor(i + 2)}; }
  Quaterniond attitude() const {
    return Eigen::AngleAxisd(sensor(kAngle + 2), Vector3d::UnitZ()) *
           Eigen::AngleAxisd(sensor(kAngle + 1), Vector3d::UnitY()) *
           Eigen::AngleAxisd(sensor(kAngle), Vector3d::UnitX());
  }
};

// Row at a moment; the number of rows where there is none.
std::size_t row_at(const Log &log, double t_s) {
  const auto found = std::lower_bound(log.t_s.begin(), log.t_s.end(), t_s - 1e-6);
  const bool there = found != log.t_s.end() && *found <= t_s + 1e-6;
  return there ? static_cast<std::size_t>(found - log.t_s.begin()) : log.t_s.size();
}

// Rate in body axes at the middle of the rows from `first` to `last`: the slope of their attitudes
// by least squares; squares: of the times about their mean, s^2.
Vector3d rate_over(const Log &log, const Columns &c, std::size_t first, std::size_t last,
                   double *squares) {
  const Quaterniond back = Row(log, c, first + (last - first) / 2).attitude().conjugate();
  double mean_s = 0.0;
  for (std::size_t r = first; r <= last; ++r)
    mean_s += log.t_s[r] / static_cast<double>(last - first + 1);
  Vector3d products = Vector3d::Zero();
  *squares = 0.0;
  for (std::size_t r = first; r <= last; ++r) {
    Quaterniond turn = back * Row(log, c, r).attitude();
    if (turn.w() < 0.0)
      turn.coeffs() = -turn.coeffs();
    const double t = log.t_s[r] - mean_s;
    products += 2.0 * t * turn.vec();
    *squares += t * t;
  }
  return products / *squares;
}

// What happens between two rows, apart from the state it begins with.
struct Step {
  double time_s = 0.0;
  Vector3d push_mps = Vector3d::Zero(); // by thrust
  Vector3d push_m = Vector3d::Zero();   // and where it leads
  double burnt_kg = 0.0;
  std::array<double, kEngines> flow{}; // at the end
  double acceleration_mps2 = 0.0;      // along the thrust axis, at the end
};

// The state that a step begins with: means of the readings of the second before it, each carried
// to the row by what the commands and gravity did since. One reading's noise in the prediction
// would otherwise be as large as that of the reading that it is compared with.
struct Start {
  Vector3d position, imu, doppler;
  double mass_kg = 0.0;
  double share = 1.0; // of one reading's standard deviation that is left
};

Step step_between(const LanderParams &p, const Log &log, const Columns &c, std::size_t first,
                  std::size_t last, double mass_kg) {
  Step step;
  for (std::size_t i = 0; i < kEngines; ++i)
    step.flow[i] = Row(log, c, first).throttle(i);
  const double flow_kgps =
      p.engine.max_thrust_N / (p.engine.specific_impulse_s * kStandardGravity_mps2);
  for (std::size_t r = first; r < last; ++r) {
    const Row row(log, c, r);
    const double dt = log.t_s[r + 1] - log.t_s[r];
    const double follow = 1.0 - std::exp(-dt / p.engine.lag_s);
    double share = 0.0; // mean flow of the row, summed over the engines
    for (std::size_t i = 0; i < kEngines; ++i) {
      const double gap = row.throttle(i) - step.flow[i];
      share += row.throttle(i) - gap * follow * p.engine.lag_s / dt;
      step.flow[i] += gap * follow;
    }
    const double force_N = share * p.engine.max_thrust_N;
    const Vector3d kick_mps =
        row.attitude() * Vector3d(0.0, 0.0, force_N * dt / (mass_kg - step.burnt_kg));
    step.push_m += (step.push_mps + 0.5 * kick_mps) * dt;
    step.push_mps += kick_mps;
    step.burnt_kg += share * flow_kgps * dt;
    step.time_s += dt;
  }
  double share = 0.0;
  for (const double flow : step.flow)
    share += flow;
  step.acceleration_mps2 = share * p.engine.max_thrust_N / (mass_kg - step.burnt_kg);
  return step;
}

// A mass that is none: it dropped out, or its unit is another.
bool is_mass(const LanderVehicle &vehicle, double mass_kg) {
  return mass_kg > kLeastMass * vehicle.dry_mass_kg;
}

double first_mass_kg(const LanderVehicle &vehicle, const Log &log, const Columns &c) {
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    const double mass_kg = Row(log, c, r).sensor(kMass);
    if (is_mass(vehicle, mass_kg))
      return mass_kg;
  }
  throw DataError(fmt::format("{}: column 's.{}' is never above {:g} kg, {:g} of the lander's dry "
                              "mass; {} divides by it",
                              log.path, sensor_names()[kMass], kLeastMass * vehicle.dry_mass_kg,
                              kLeastMass, kWho));
}

// The starts of all rows of a log. O(rows).
std::vector<Start> starts_of(const LanderParams &p, const LanderVehicle &vehicle, const Log &log,
                             const Columns &c) {
  const std::size_t n = log.t_s.size();
  std::vector<Start> less(n), out; // readings less what was gained; means of them
  Vector3d faster = Vector3d::Zero(), further = Vector3d::Zero();
  double burnt_kg = 0.0, mass_kg = first_mass_kg(vehicle, log, c);
  Start sum{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), 0.0, 0.0};
  const auto add = [&sum](const Start &x, double sign) {
    sum.position += sign * x.position;
    sum.imu += sign * x.imu;
    sum.doppler += sign * x.doppler;
    sum.mass_kg += sign * x.mass_kg;
    sum.share += sign;
  };
  std::size_t first = 0;
  for (std::size_t r = 0; r < n; ++r) {
    const Row row(log, c, r);
    if (r > 0) {
      const double dt = log.t_s[r] - log.t_s[r - 1];
      const Row before(log, c, r - 1);
      if (is_mass(vehicle, before.sensor(kMass)))
        mass_kg = before.sensor(kMass);
      const Step step = step_between(p, log, c, r - 1, r, mass_kg);
      const Vector3d fall = dt * gravity_mps2(vehicle, before.vector(kPosition));
      further +=
          dt * (0.5 * (before.vector(kImu) + before.vector(kDoppler)) + 0.5 * fall) + step.push_m;
      faster += fall + step.push_mps;
      burnt_kg += step.burnt_kg;
      for (; first < r && (dt > kGap_s || log.t_s[r] - log.t_s[first] > kMean_s); ++first)
        add(less[first], -1.0);
    }
    less[r] = {row.vector(kPosition) - further, row.vector(kImu) - faster,
               row.vector(kDoppler) - faster, row.sensor(kMass) + burnt_kg, 1.0};
    add(less[r], 1.0);
    const double rows = sum.share;
    out.push_back({sum.position / rows + further, sum.imu / rows + faster,
                   sum.doppler / rows + faster, sum.mass_kg / rows - burnt_kg,
                   1.0 / std::sqrt(rows)});
  }
  return out;
}

using Readings = std::array<double, kSensors>;

Readings predict_readings(const LanderParams &p, const LanderVehicle &vehicle, const Start &now,
                          const Vector3d &rate_radps, const Step &step) {
  Readings m{};
  const double dt = step.time_s;
  const Vector3d velocity = 0.5 * (now.imu + now.doppler);
  const Vector3d fall = gravity_mps2(vehicle, now.position + 0.5 * dt * velocity);
  const Vector3d end = now.position + dt * velocity + 0.5 * dt * dt * fall + step.push_m;
  const Vector3d gain = dt * fall + step.push_mps;
  const double mass_kg = now.mass_kg - step.burnt_kg;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto e = static_cast<Eigen::Index>(i);
    m[kPosition + i] = end[e];
    m[kImu + i] = now.doppler[e] + gain[e];
    m[kDoppler + i] = now.imu[e] + gain[e];
    m[kRate + i] = rate_radps[e];
  }
  m[kRadar] = m[kLaser] = altitude_m(vehicle, end);
  m[kAcceleration] = step.acceleration_mps2;
  m[kGravity] = gravity_mps2(vehicle, end).norm();
  m[kMass] = mass_kg;
  const double burnt_kg = vehicle.dry_mass_kg + vehicle.propellant_kg - mass_kg;
  m[kTank] = p.tank.pressure_kPa * p.tank.ullage_m3 /
             (p.tank.ullage_m3 + burnt_kg / p.tank.propellant_density_kgpm3);
  for (std::size_t i = 0; i < kEngines; ++i)
    m[kChamber + i] = p.engine.chamber_pressure_kPa * step.flow[i];
  return m;
}

// Of one reading: its noise and its rounding.
double reading_sd(const SensorParams &s) {
  return std::hypot(s.noise_sd, s.resolution / std::sqrt(12.0));
}

// rate_squares: rate_over's, s^2.
Readings prediction_sd(const LanderParams &p, const Step &step, const Start &now,
                       double rate_squares) {
  Readings own{}, sd{};
  for (std::size_t i = 0; i < kSensors; ++i)
    sd[i] = own[i] = reading_sd(p.sensor[i]);
  const auto start = [&](std::size_t i) { return now.share * own[i]; };
  const double dt = step.time_s;
  // Thrust of four engines of independent flow and impulse, by a mass that is read.
  const double thrust = std::hypot(0.5 * std::hypot(p.engine.flow_sd, p.engine.specific_impulse_sd),
                                   start(kMass) / now.mass_kg);
  const double push = std::hypot(thrust, own[kAngle + 1] / std::sqrt(20.0)) * step.push_mps.norm();
  for (std::size_t i = 0; i < 3; ++i) {
    const double velocity = 0.5 * std::hypot(start(kImu + i), start(kDoppler + i));
    sd[kPosition + i] = std::hypot(own[kPosition + i], start(kPosition + i));
    sd[kPosition + i] = std::hypot(sd[kPosition + i], std::hypot(velocity, push) * dt);
    sd[kImu + i] = std::hypot(std::hypot(own[kImu + i], start(kDoppler + i)), push);
    sd[kDoppler + i] = std::hypot(std::hypot(start(kImu + i), own[kDoppler + i]), push);
    sd[kRate + i] = std::hypot(own[kRate + i], own[kAngle + i] / std::sqrt(rate_squares));
  }
  const double end =
      std::hypot(start(kPosition + 2), 0.5 * std::hypot(start(kImu + 2), start(kDoppler + 2)) * dt);
  sd[kRadar] = std::hypot(sd[kRadar], end);
  sd[kLaser] = std::hypot(sd[kLaser], end);
  sd[kAcceleration] = std::hypot(own[kAcceleration], thrust * step.acceleration_mps2);
  sd[kMass] = std::hypot(own[kMass], start(kMass));
  sd[kTank] = std::hypot(own[kTank], p.tank.pressure_kPa / p.tank.ullage_m3 * start(kMass) /
                                         p.tank.propellant_density_kgpm3);
  for (std::size_t i = 0; i < kEngines; ++i) {
    const double flow = std::hypot(p.engine.flow_sd, p.engine.roughness) * step.flow[i];
    sd[kChamber + i] = std::hypot(own[kChamber + i], p.engine.chamber_pressure_kPa * flow);
  }
  return sd;
}

bool has_no_gap(const Log &log, std::size_t first, std::size_t last) {
  for (std::size_t r = first; r < last; ++r) {
    if (log.t_s[r + 1] - log.t_s[r] > kGap_s)
      return false;
  }
  return true;
}

} // namespace

LanderPredictor::LanderPredictor()
    : params_(read_lander_params(data_path("lander.toml"))), vehicle_(nominal_vehicle(params_)) {}

Log LanderPredictor::predict(const Log &log) const {
  const Columns c(log);
  std::vector<std::string> features, outcomes;
  for (std::size_t i = 0; i < kEngines; ++i)
    features.push_back("u.throttle_" + std::to_string(i + 1));
  features.push_back("x.thrust");
  for (std::size_t i = 0; i <= kMass; ++i) {
    if (i != kGravity)
      features.push_back("s." + sensor_names()[i]);
  }
  for (const std::size_t i : predicted())
    outcomes.push_back(sensor_names()[i]);
  PredictionRows rows(log, features, outcomes);
  const std::size_t none = log.t_s.size();
  const std::vector<Start> starts = starts_of(params_, vehicle_, log, c);
  for (std::size_t r = 0; r < none; ++r) {
    // The attitudes about the end of the step tell the rate there.
    const std::size_t last = row_at(log, log.t_s[r] + kLanderPredictStep_s);
    const std::size_t before = row_at(log, log.t_s[r] + 0.5 * kLanderPredictStep_s);
    const std::size_t after = row_at(log, log.t_s[r] + 1.5 * kLanderPredictStep_s);
    if (last == none || before == none || after == none || !has_no_gap(log, r, after))
      continue;
    const Row now(log, c, r), later(log, c, last);
    double squares = 0.0;
    const Vector3d rate = rate_over(log, c, before, after, &squares);
    const Start &start = starts[r];
    if (!is_mass(vehicle_, start.mass_kg))
      continue;
    const Step step = step_between(params_, log, c, r, last, start.mass_kg);
    const Readings m = predict_readings(params_, vehicle_, start, rate, step);
    const Readings sd = prediction_sd(params_, step, start, squares);
    std::vector<double> values;
    for (std::size_t i = 0; i < kEngines; ++i)
      values.push_back(now.throttle(i));
    values.push_back(0.25 * (values[0] + values[1] + values[2] + values[3]));
    for (std::size_t i = 0; i <= kMass; ++i) {
      if (i != kGravity)
        values.push_back(now.sensor(i));
    }
    for (const std::size_t i : predicted())
      values.insert(values.end(), {later.sensor(i), m[i], sd[i]});
    rows.add(log.t_s[r], log.row[r], values);
  }
  if (rows.rows() == 0)
    throw DataError(log.path +
                    ": world lander: no row has others 0.5, 1 and 1.5 s later without a gap");
  return std::move(rows).finish();
}

bool LanderPredictor::advance(const Log &now, const Matrix &outcome, Log *next) const {
  const auto &list = predicted();
  if (outcome.rows() != next->values.rows() || now.values.rows() != next->values.rows() ||
      outcome.cols() != static_cast<Eigen::Index>(list.size()))
    throw std::logic_error("LanderPredictor::advance: rows do not correspond");
  std::array<int, kSensors> feature{}, mean{};
  for (std::size_t o = 0; o < list.size(); ++o) {
    const std::string &name = sensor_names()[list[o]];
    feature[list[o]] = find_column(*next, "s." + name);
    mean[list[o]] = outcome_columns(*next, name).m;
  }
  for (Eigen::Index r = 0; r < next->values.rows(); ++r) {
    auto row = next->values.row(r);
    Readings change{}; // of the state against what was measured
    for (std::size_t o = 0; o < list.size(); ++o) {
      const std::size_t i = list[o];
      if (feature[i] < 0)
        continue;
      change[i] = outcome(r, static_cast<Eigen::Index>(o)) - row(feature[i]);
      row(feature[i]) += change[i];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double faster = 0.5 * (change[kImu + i] + change[kDoppler + i]);
      row(mean[kPosition + i]) += change[kPosition + i] + kLanderPredictStep_s * faster;
      row(mean[kImu + i]) += change[kDoppler + i];
      row(mean[kDoppler + i]) += change[kImu + i];
    }
    const Vector3d end(row(mean[kPosition]), row(mean[kPosition + 1]), row(mean[kPosition + 2]));
    row(mean[kRadar]) = row(mean[kLaser]) = altitude_m(vehicle_, end);
    const double mass_kg = row(mean[kMass]) + change[kMass];
    row(mean[kAcceleration]) *= row(mean[kMass]) / mass_kg;
    row(mean[kMass]) = mass_kg;
  }
  return true;
}

} // namespace rim::world
