// SPDX-License-Identifier: MIT
// The lander: physics against closed forms, nominal landings, readings against their stated errors.
#include "check.hpp"
#include "temporary.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/lander.hpp"
#include "world/lander_guidance.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

using namespace rim::world;

constexpr std::uint64_t kSeed = 20261121;
constexpr std::size_t kRuns = 60;

const LanderParams &params() {
  static const LanderParams p = read_lander_params(rim::data_path("lander.toml"));
  return p;
}

const std::vector<LanderRun> &nominal_runs() {
  static const std::vector<LanderRun> runs = [] {
    std::vector<LanderRun> all;
    for (std::size_t k = 1; k <= kRuns; ++k)
      all.push_back(simulate_lander(params(), {}, kSeed, k));
    return all;
  }();
  return runs;
}

std::size_t column(const char *name) { return sensor_index(name); }

void every_nominal_run_lands_softly(void **) {
  double first = 1e9, last = 0.0;
  for (const LanderRun &run : nominal_runs()) {
    assert_true(run.rows.size() >= 8200 && run.rows.size() <= 8600);
    assert_true(run.ignition_s > 330.0 && run.ignition_s < 360.0);
    first = std::fmin(first, run.ignition_s);
    last = std::fmax(last, run.ignition_s);
    const double *v = run.touchdown_velocity_mps;
    assert_true(v[2] < 0.0 && v[2] > -3.0);
    assert_true(std::hypot(v[0], v[1]) < 0.5);
    const LanderRow &end = run.rows.back();
    assert_true(end.quantity[static_cast<std::size_t>(Quantity::altitude_m)] <= 0.0);
    assert_true(std::hypot(end.sensor[0], end.sensor[1]) < 100.0);
    assert_true(std::fabs(end.sensor[column("roll_rad")]) < 0.1);
    assert_true(std::fabs(end.sensor[column("pitch_rad")]) < 0.1);
    assert_true(run.readings.allFinite());
    for (std::size_t k = 0; k < run.acts.size(); ++k)
      assert_int_equal(run.acts[k], 0);
  }
  // Ignition differs from run to run, as the thesis has it.
  assert_true(last - first > 0.5 && last - first < 10.0);
}

void throttle_stays_in_range_and_moves(void **) {
  for (const LanderRun &run : nominal_runs()) {
    double change = 0.0;
    for (std::size_t k = 1; k < run.rows.size(); ++k) {
      const bool thrusts =
          run.rows[k].quantity[static_cast<std::size_t>(Quantity::thrusting)] > 0.5;
      for (const double u : run.rows[k].throttle) {
        if (thrusts)
          assert_true(u >= params().engine.min_throttle - 1e-9 && u <= 1.0);
        else
          assert_true(u == 0.0);
      }
      change += std::fabs(run.rows[k].throttle[0] - run.rows[k].throttle[2]);
    }
    assert_true(change > 0.0);
  }
}

// Energy of the fall over a point mass is conserved by the integration.
void coast_conserves_energy(void **) {
  const LanderVehicle vehicle = nominal_vehicle(params());
  LanderState s{};
  s[2] = 85000.0;
  s[3] = 60.0;
  s[6] = 1.0;
  s[13] = 1500.0;
  const auto energy = [&] {
    const Eigen::Vector3d r = position_m(s) + Eigen::Vector3d(0, 0, vehicle.radius_m);
    return 0.5 * velocity_mps(s).squaredNorm() - vehicle.mu_m3ps2 / r.norm();
  };
  const double before = energy();
  LanderInput off;
  for (int k = 0; k < 6000; ++k)
    advance(params(), vehicle, off, kLanderStep_s, 1, s);
  assert_true(std::fabs(energy() / before - 1.0) < 1e-12);
  // 300 s of fall from 85 km: v = g t within the change of g
  assert_true(s[5] < -300.0 * 1.47 && s[5] > -300.0 * 1.63);
}

// Spinning freely keeps the angular momentum in the site frame and the norm of the quaternion.
void free_spin_conserves_momentum(void **) {
  const LanderVehicle vehicle = nominal_vehicle(params());
  LanderState s{};
  s[2] = 85000.0;
  s[6] = 1.0;
  s[10] = 0.3;
  s[11] = -0.2;
  s[12] = 0.5;
  s[13] = 1500.0;
  const auto momentum = [&] {
    return Eigen::Vector3d(attitude(s) * vehicle.inertia_kgm2.cwiseProduct(rate_radps(s)));
  };
  const Eigen::Vector3d before = momentum();
  LanderInput off;
  for (int k = 0; k < 400; ++k)
    advance(params(), vehicle, off, kLanderStep_s, 2, s);
  assert_true((momentum() - before).norm() < 1e-5 * before.norm());
  assert_true(std::fabs(attitude(s).norm() - 1.0) < 1e-12);
}

// With constant thrust and no roughness the rocket equation holds.
void burn_obeys_the_rocket_equation(void **) {
  LanderParams p = params();
  LanderVehicle vehicle = nominal_vehicle(p);
  vehicle.mu_m3ps2 = 1e-3; // no gravity to speak of
  LanderState s{};
  s[2] = 1000.0;
  s[6] = 1.0;
  s[13] = 1500.0;
  LanderInput input;
  input.throttle.fill(0.5);
  for (std::size_t i = 0; i < kEngines; ++i)
    s[14 + i] = 0.5;
  for (int k = 0; k < 800; ++k)
    advance(p, vehicle, input, kLanderStep_s, 2, s);
  const double flow_kgps =
      4.0 * 0.5 * p.engine.max_thrust_N / (p.engine.specific_impulse_s * 9.80665);
  assert_true(std::fabs(s[13] - (1500.0 - 40.0 * flow_kgps)) < 1e-6);
  const double expected = p.engine.specific_impulse_s * 9.80665 * std::log(1500.0 / s[13]);
  assert_true(std::fabs(s[5] / expected - 1.0) < 1e-9);
  assert_true(std::fabs(s[10]) < 1e-12 && std::fabs(s[11]) < 1e-12);
}

// More throttle on the side of +y turns the vehicle about +x.
void differential_throttle_turns(void **) {
  const LanderVehicle vehicle = nominal_vehicle(params());
  LanderState s{};
  s[2] = 1000.0;
  s[6] = 1.0;
  s[13] = 1500.0;
  LanderInput input;
  input.throttle = {0.55, 0.55, 0.5, 0.5};
  advance(params(), vehicle, input, 1.0, 20, s);
  assert_true(s[10] > 0.05 && std::fabs(s[11]) < 1e-9 && std::fabs(s[12]) < 1e-9);
  assert_true(roll_pitch_yaw_rad(attitude(s)).x() > 0.0);
}

void a_smaller_step_changes_little(void **) {
  const LanderVehicle vehicle = draw_vehicle(params(), 1, 1);
  LanderState a{};
  a[2] = 10000.0;
  a[5] = -400.0;
  a[6] = 1.0;
  a[13] = 1500.0;
  LanderState b = a;
  LanderInput input;
  input.throttle = {0.8, 0.79, 0.8, 0.81};
  input.hold_radps = params().guidance.burn_hold_radps;
  input.attitude = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
  for (int k = 0; k < 100; ++k) {
    advance(params(), vehicle, input, kLanderStep_s, 2, a);
    advance(params(), vehicle, input, kLanderStep_s, 16, b);
  }
  for (std::size_t i = 0; i < a.size(); ++i)
    assert_true(std::fabs(a[i] - b[i]) < 1e-4 * (1.0 + std::fabs(b[i])));
}

void runs_do_not_depend_on_each_other(void **) {
  const LanderRun again = simulate_lander(params(), {}, kSeed, 7);
  const LanderRun &first = nominal_runs()[6];
  assert_int_equal(again.rows.size(), first.rows.size());
  assert_true((again.readings - first.readings).cwiseAbs().maxCoeff() == 0.0);
  const LanderRun other = simulate_lander(params(), {}, kSeed + 1, 7);
  assert_true(other.readings(0, 0) != first.readings(0, 0));
}

// What each sensor shows less the truth: per run a bias, a scale and a noise level as stated.
void readings_have_the_stated_errors(void **) {
  for (std::size_t c = 0; c < kSensors; ++c) {
    const SensorParams &p = params().sensor[c];
    double bias2 = 0.0, expected2 = 0.0, noise2 = 0.0;
    for (const LanderRun &run : nominal_runs()) {
      double sum = 0.0, square = 0.0, truth = 0.0;
      const std::size_t n = 2000; // the start of the coast, where all but velocities change little
      for (std::size_t k = 0; k < n; ++k) {
        const auto r = static_cast<Eigen::Index>(k);
        const double error = run.readings(r, static_cast<Eigen::Index>(c)) - run.rows[k].sensor[c];
        sum += error;
        square += error * error;
        truth += run.rows[k].sensor[c];
      }
      const double count = static_cast<double>(n);
      const double mean = sum / count;
      truth /= count;
      bias2 += mean * mean;
      noise2 += square / count - mean * mean;
      expected2 += p.bias_sd * p.bias_sd + std::pow(p.scale_sd * truth, 2) +
                   std::pow(p.drift_sd_per_s * 50.0, 2) + p.noise_sd * p.noise_sd / count;
    }
    const double white = p.noise_sd * p.noise_sd * (1.0 + p.noise_level_sd * p.noise_level_sd) +
                         p.resolution * p.resolution / 12.0;
    const double runs = static_cast<double>(kRuns);
    // 60 runs: a variance is known to sqrt(2/60) = 18 %; 5 sd of that, above and below.
    assert_true(bias2 / expected2 < 1.9 && bias2 / expected2 > 0.35);
    assert_true(std::fabs(noise2 / (runs * white) - 1.0) < 0.04);
  }
}

void readings_are_multiples_of_the_resolution(void **) {
  const LanderRun &run = nominal_runs()[0];
  for (std::size_t c = 0; c < kSensors; ++c) {
    const double step = params().sensor[c].resolution;
    for (Eigen::Index k = 0; k < run.readings.rows(); k += 97) {
      const double steps = run.readings(k, static_cast<Eigen::Index>(c)) / step;
      assert_true(std::fabs(steps - std::round(steps)) < 1e-4);
    }
  }
}

// Zeros within normal readings: some rows of the rate read exactly 0 by rounding alone.
void rates_read_zero_now_and_then(void **) {
  const auto c = static_cast<Eigen::Index>(column("rate_y_radps"));
  for (const LanderRun &run : nominal_runs()) {
    int zeros = 0;
    for (Eigen::Index k = 0; k < 6000; ++k)
      zeros += run.readings(k, c) == 0.0 ? 1 : 0;
    assert_true(zeros > 3 && zeros < 120);
  }
}

void assert_refused(const char *text, const char *words) {
  const std::string path = temporary_file(text);
  std::string message;
  try {
    read_lander_params(rim::data_path("lander.toml"), path);
  } catch (const rim::DataError &error) {
    message = error.what();
  }
  if (message.find(path) == std::string::npos || message.find(words) == std::string::npos)
    fail_msg("'%s' gave '%s', wanted '%s'", text, message.c_str(), words);
}

void bad_parameters_are_named(void **) {
  assert_refused("[body\n", "line 1");
  assert_refused("[bodies]\n", "line 1: unknown key 'bodies'");
  assert_refused("[body]\nmu = 3.0\n", "line 2: unknown key 'body.mu'");
  assert_refused("[body]\nmu_m3ps2 = \"x\"\n", "key 'body.mu_m3ps2': must be a number");
  assert_refused("[body]\nradius_m = -1.0\n", "key 'body.radius_m': must be positive");
  assert_refused("[engine]\nmin_throttle = 1.5\n", "must lie between 0 and 1");
  assert_refused("[vehicle]\ndry_mass_sd_kg = nan\n", "must not be negative");
  assert_refused("body = 3\n", "key 'body': must be a table");
  assert_refused("sensor = 3\n", "must be an array of tables");
  assert_refused("[[sensor]]\nbias_sd = 1.0\n", "key 'sensor.columns'");
  assert_refused("[[sensor]]\ncolumns = [\"altitude\"]\n", "no sensor 'altitude'");
  assert_refused("[[sensor]]\ncolumns = [\"mass_kg\", \"mass_kg\"]\n", "given twice");
  assert_refused("[[sensor]]\ncolumns = [\"mass_kg\"]\nresolution = 0\n", "must be positive");
}

void an_incomplete_base_is_refused(void **) {
  const std::string path = temporary_file("[body]\nmu_m3ps2 = 4.9e12\n");
  int caught = 0;
  try {
    read_lander_params(path);
  } catch (const rim::DataError &error) {
    caught = std::strstr(error.what(), "'body.radius_m' is missing") != nullptr;
  }
  assert_int_equal(caught, 1);
}

void an_overlay_changes_what_it_names(void **) {
  const std::string path = temporary_file(
      "[body]\nradius_m = 1.7e6\n[[sensor]]\ncolumns = [\"s.mass_kg\"]\nbias_sd = 9.0\n");
  const LanderParams p = read_lander_params(rim::data_path("lander.toml"), path);
  assert_true(p.body.radius_m == 1.7e6 && p.body.mu_m3ps2 == params().body.mu_m3ps2);
  assert_true(p.sensor[column("mass_kg")].bias_sd == 9.0);
  assert_true(p.sensor[column("mass_kg")].noise_sd == params().sensor[column("mass_kg")].noise_sd);
}

// The record that `rim simulate` leaves reads back to the same parameters.
void the_record_reads_back(void **) {
  const std::string text = lander_params_toml(params());
  const std::string path = temporary_file(text.c_str());
  const LanderParams p = read_lander_params(path);
  assert_string_equal(lander_params_toml(p).c_str(), text.c_str());
}

void impossible_landings_are_refused(void **) {
  int caught = 0;
  LanderParams p = params();
  p.vehicle.propellant_kg = 20.0;
  try {
    simulate_lander(p, {}, 1, 1);
  } catch (const rim::DataError &error) {
    caught += std::strstr(error.what(), "propellant") != nullptr;
  }
  p = params();
  p.approach.velocity_z_mps = 1500.0; // climbs for longer than a log may be
  p.approach.altitude_m = 400000.0;
  p.approach.coast_s = 1.0;
  try {
    simulate_lander(p, {}, 1, 1);
  } catch (const rim::DataError &error) {
    caught += std::strstr(error.what(), "touchdown") != nullptr;
  }
  assert_int_equal(caught, 2);
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_nominal_run_lands_softly),
      cmocka_unit_test(throttle_stays_in_range_and_moves),
      cmocka_unit_test(coast_conserves_energy),
      cmocka_unit_test(free_spin_conserves_momentum),
      cmocka_unit_test(burn_obeys_the_rocket_equation),
      cmocka_unit_test(differential_throttle_turns),
      cmocka_unit_test(a_smaller_step_changes_little),
      cmocka_unit_test(runs_do_not_depend_on_each_other),
      cmocka_unit_test(readings_have_the_stated_errors),
      cmocka_unit_test(readings_are_multiples_of_the_resolution),
      cmocka_unit_test(rates_read_zero_now_and_then),
      cmocka_unit_test(bad_parameters_are_named),
      cmocka_unit_test(an_incomplete_base_is_refused),
      cmocka_unit_test(an_overlay_changes_what_it_names),
      cmocka_unit_test(the_record_reads_back),
      cmocka_unit_test(impossible_landings_are_refused),
  };
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
