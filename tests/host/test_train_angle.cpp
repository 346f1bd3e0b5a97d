// SPDX-License-Identifier: MIT
// A vehicle with a heading that wraps: what curves, and what goes with the heading, is learnt from
// the other readings. Vanes that turn through north with the wind agree to within whole turns.
#include "base/rng.h"
#include "replay/replay.hpp"
#include "train/trainer.hpp"

#include <cmath>
#include <random>

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 9100; // of the first run
constexpr std::size_t kRows = 900, kRuns = 12;
constexpr double kNoise = 0.01; // of every sensor
constexpr double kWind = 0.3;   // kW: what a head wind adds
enum { kHeading, kFlow, kPressure, kPower };

// A boat whose water jet takes flow times pressure, both of which the sea moves and no command
// does, and more against the wind. bias: what the power reads too high, in the second half.
rim::Log boat(std::uint64_t seed, double bias) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 6);
  rim::Log log;
  log.path = "boat" + std::to_string(seed);
  log.columns = {{"u.rudder", "", rim::Role::command},
                 {"s.heading_rad", "rad", rim::Role::sensor},
                 {"s.flow_Lpm", "L/min", rim::Role::sensor},
                 {"s.pressure_bar", "bar", rim::Role::sensor},
                 {"s.power_kW", "kW", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 5);
  const auto noise = [&rng] { return kNoise * rimi_rng_normal(&rng); };
  const double phase[2] = {6.28 * rimi_rng_uniform(&rng), 6.28 * rimi_rng_uniform(&rng)};
  double rudder = 0.0, heading = 6.28 * rimi_rng_uniform(&rng);
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 60 == 0)
      rudder = 2.0 * rimi_rng_uniform(&rng) - 1.0;
    heading += 0.1 * rudder;
    const double time = static_cast<double>(t);
    const double flow = std::sin(0.031 * time + phase[0]);
    const double pressure = std::sin(0.047 * time + phase[1]);
    log.t_s.push_back(time);
    log.values.row(static_cast<Eigen::Index>(t)) << rudder,
        std::remainder(heading, 2.0 * M_PI) + noise(), flow + noise(), pressure + noise(),
        flow * pressure + kWind * std::sin(heading) + (t < kRows / 2 ? 0.0 : bias) + noise();
  }
  return log;
}

const rim::Training &trained() {
  static const rim::Training training = [] {
    std::vector<rim::Log> logs;
    for (std::size_t i = 0; i < kRuns; ++i)
      logs.push_back(boat(kSeed + i, 0.0));
    return rim::train(logs, {});
  }();
  return training;
}

// By itself the power varies by 0.5 kW, and no straight line explains any of it. Without the
// heading some 0.2 kW would be left.
void what_curves_is_learnt_beside_an_angle(void **) {
  const rim::OutcomeReport &power = trained().outcomes[kPower];
  const double error = power.error * power.agreement;
  print_message("seed %u: the power varies by %.3f kW, the other readings leave %.4f kW\n",
                static_cast<unsigned>(kSeed), power.error, error);
  assert_true(power.source == AGREEMENT_LEVEL || power.source == AGREEMENT_QUADRATIC);
  assert_true(power.error > 0.4);
  assert_true(error < 0.1);
  const int heading = trained().outcomes[kHeading].source;
  assert_true(heading != AGREEMENT_LEVEL && heading != AGREEMENT_QUADRATIC);
}

void its_bias_is_found_and_named(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "boat");
  constexpr std::size_t flights = 4;
  std::size_t false_alarms = 0;
  for (std::uint64_t i = 0; i < flights; ++i) {
    false_alarms += replayer.replay(boat(kSeed + 100 + i, 0.0), {}).raised > 0 ? 1 : 0;
    std::vector<rim_alarm> records;
    rim::ReplayOptions options;
    options.record = [&records](const rim_alarm &a) { records.push_back(a); };
    (void)replayer.replay(boat(kSeed + 200 + i, 0.4), options);
    assert_true(!records.empty());
    assert_int_equal(records.back().channel[0], kPower);
    assert_true(records.back().shift[0] > 0.0);
  }
  assert_true(false_alarms <= 1);
}

// A mast with three vanes, the second mounted 75 degrees off, and a turbine beside it whose vane
// says where the wind comes from as seen from the nacelle. The wind turns by tens of degrees from
// row to row, so that every vane counts whole turns of its own. bias: what vane `wrong` reads too
// much in the second half.
enum { kVane1, kVane2, kVane3, kNacelle, kRelative, kWindSpeed };
rim::Log mast(std::uint64_t seed, double bias, int wrong) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  rim::Log log;
  log.path = "mast" + std::to_string(seed);
  log.columns = {
      {"s.vane1_deg", "deg", rim::Role::sensor},    {"s.vane2_deg", "deg", rim::Role::sensor},
      {"s.vane3_deg", "deg", rim::Role::sensor},    {"s.nacelle_deg", "deg", rim::Role::sensor},
      {"s.relative_deg", "deg", rim::Role::sensor}, {"s.wind_mps", "m/s", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 6);
  const auto wrapped = [](double angle) { return std::remainder(angle, 360.0); };
  double wind = 360.0 * std::generate_canonical<double, 53>(engine), nacelle = wind;
  for (std::size_t t = 0; t < kRows; ++t) {
    wind += 25.0 * normal(engine);
    nacelle += 0.3 * wrapped(wind - nacelle);
    log.t_s.push_back(static_cast<double>(t));
    double reading[] = {wind, wind + 75.0, wind, nacelle, wind - nacelle};
    for (double &angle : reading)
      angle += 3.0 * normal(engine);
    reading[wrong] += t < kRows / 2 ? 0.0 : bias;
    for (int i = 0; i < 5; ++i)
      log.values(static_cast<Eigen::Index>(t), i) = wrapped(reading[i]);
    log.values(static_cast<Eigen::Index>(t), kWindSpeed) = 8.0 + normal(engine);
  }
  return log;
}

void vanes_agree_to_within_whole_turns(void **) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < kRuns; ++i)
    logs.push_back(mast(kSeed + i, 0.0, 0));
  const rim::Training training = rim::train(logs, {});
  for (int vane = kVane1; vane <= kVane3; ++vane) {
    const rim::OutcomeReport &report = training.outcomes[static_cast<std::size_t>(vane)];
    print_message("vane %d: %.1f deg by itself, %.2f deg beside the others\n", vane + 1,
                  report.error, report.error * report.agreement);
    assert_int_equal(report.source, AGREEMENT_FEW);
    assert_true(report.error < 180.0 && report.error * report.agreement < 3.0);
  }
  rim::Replayer replayer(rim::make_image(training.plan), "mast");
  std::size_t false_alarms = 0;
  for (std::uint64_t i = 0; i < 4; ++i) {
    false_alarms += replayer.replay(mast(kSeed + 100 + i, 0.0, 0), {}).raised > 0 ? 1 : 0;
    const int wrong = static_cast<int>(i % 3);
    rim_alarm last{};
    rim::ReplayOptions options;
    options.record = [&last](const rim_alarm &a) { last = a; };
    assert_true(replayer.replay(mast(kSeed + 200 + i, 6.0, wrong), options).raised > 0);
    print_message("vane %d reads 6 deg too much: channel %d, %.1f deg\n", wrong + 1,
                  static_cast<int>(last.channel[0]), static_cast<double>(last.shift[0]));
    assert_int_equal(last.channel[0], wrong);
    assert_true(std::fabs(static_cast<double>(last.shift[0]) - 6.0) < 2.0);
  }
  assert_true(false_alarms <= 1);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(what_curves_is_learnt_beside_an_angle),
                              cmocka_unit_test(its_bias_is_found_and_named),
                              cmocka_unit_test(vanes_agree_to_within_whole_turns)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
