// SPDX-License-Identifier: MIT
// A vehicle with a heading that wraps: what curves, and what goes with the heading, is learnt from
// the other readings.
#include "base/rng.h"
#include "replay/replay.hpp"
#include "train/trainer.hpp"

#include <cmath>
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

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(what_curves_is_learnt_beside_an_angle),
                              cmocka_unit_test(its_bias_is_found_and_named)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
