// SPDX-License-Identifier: MIT
// Runs differ by an offset (the charge of a battery). What a reading follows from within a run is
// learnt all the same, and a fault far smaller than the offsets is found.
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

constexpr std::uint64_t kSeed = 9300; // of the first run
constexpr std::size_t kRows = 1200, kRuns = 14, kFaulty = 600;
constexpr double kOffset = 0.8; // V: how much the charge of a run differs
constexpr double kOhm = 0.12;   // of the battery
constexpr double kAged = 0.02;  // ohm more, from row kFaulty on, of a faulty one
constexpr double kNoise = 0.04; // V
enum { kCurrent, kVoltage, kHull, kBay };

// The current goes with a load that no command says; two temperatures differ from run to run, as
// the charge does, by chance alone.
rim::Log drive(std::uint64_t seed, double ohm_more) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 6);
  rim::Log log;
  log.path = "drive" + std::to_string(seed);
  log.columns = {{"u.lamp", "", rim::Role::command},
                 {"s.current_A", "A", rim::Role::sensor},
                 {"s.battery_V", "V", rim::Role::sensor},
                 {"s.hull_degC", "degC", rim::Role::sensor},
                 {"s.bay_degC", "degC", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 5);
  const auto uniform = [&rng] { return 2.0 * rimi_rng_uniform(&rng) - 1.0; };
  const double charge = kOffset * uniform(), hull = 5.0 * uniform(), bay = 5.0 * uniform();
  double lamp = 0.0, load = 0.0, current = 0.0;
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 40 == 0)
      load = 6.0 + 4.0 * uniform();
    if (t % 90 == 0)
      lamp = rimi_rng_uniform(&rng) < 0.5 ? 0.0 : 1.0;
    current += (load + 0.5 * lamp - current) / 5.0;
    const double ohm = kOhm + (t < kFaulty ? 0.0 : ohm_more);
    log.t_s.push_back(static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << lamp, current + 0.1 * rimi_rng_normal(&rng),
        38.0 + charge - ohm * current + kNoise * rimi_rng_normal(&rng),
        hull + 0.3 * rimi_rng_normal(&rng), bay + 0.3 * rimi_rng_normal(&rng);
  }
  return log;
}

const rim::Training &trained() {
  static const rim::Training training = [] {
    std::vector<rim::Log> logs;
    for (std::size_t i = 0; i < kRuns; ++i)
      logs.push_back(drive(kSeed + i, 0.0));
    return rim::train(logs, {});
  }();
  return training;
}

// What is new in a block is the readings' noise over its rows, not the offsets of the runs.
void a_relation_within_runs_is_learnt(void **) {
  const std::size_t outcomes = trained().outcomes.size();
  const rim::ChannelNoise &n = trained().noise.channels[outcomes + kVoltage];
  const double noise = std::hypot(kNoise, kOhm * 0.1) / std::sqrt(trained().plan.block_rows);
  print_message("seed %u: source %d, noise %.4f V of %.4f, lag-1 correlation %.2f\n",
                static_cast<unsigned>(kSeed), trained().outcomes[kVoltage].source, n.s, noise,
                n.rho);
  assert_true(n.active);
  assert_true(n.s < 1.5 * noise);
  assert_true(n.rho < 0.3);
}

void an_aged_battery_is_found_and_named(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "drive");
  constexpr std::size_t flights = 4;
  std::size_t false_alarms = 0;
  for (std::uint64_t i = 0; i < flights; ++i) {
    false_alarms += replayer.replay(drive(kSeed + 100 + i, 0.0), {}).raised > 0 ? 1 : 0;
    std::vector<rim_alarm> records;
    rim::ReplayOptions options;
    options.record = [&records](const rim_alarm &a) { records.push_back(a); };
    (void)replayer.replay(drive(kSeed + 200 + i, kAged), options);
    assert_true(!records.empty());
    assert_int_equal(records.back().channel[0], kVoltage);
  }
  assert_true(false_alarms <= 1);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(a_relation_within_runs_is_learnt),
                              cmocka_unit_test(an_aged_battery_is_found_and_named)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
