// SPDX-License-Identifier: MIT
// Readings that single precision holds only in part (a clock that counts from 1970, a position on
// the Earth in millimetres), readings that stay as they are over a whole run, and runs of which
// nothing can be said.
#include "base/rng.h"
#include "replay/replay.hpp"
#include "train/train_report.hpp"
#include "train/trainer.hpp"

#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 9500; // of the first run
constexpr std::size_t kRows = 600, kRuns = 14, kFlights = 4;
enum { kFlow, kPressure, kTyre, kFixed };

// A pump; its pressure counts from `offset`. The tyre's pressure is another one in every run, and
// from the middle of this one on `jump` more.
rim::Log run(std::uint64_t seed, double offset, double jump = 0.0, std::size_t rows = kRows) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 7);
  rim::Log log;
  log.path = "pump" + std::to_string(seed);
  log.columns = {{"u.duty", "", rim::Role::command},
                 {"s.flow_lpm", "l/min", rim::Role::sensor},
                 {"s.press_kPa", "kPa", rim::Role::sensor},
                 {"s.tyre_kPa", "kPa", rim::Role::sensor},
                 {"s.fixed_V", "V", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(rows), 5);
  const double tyre = 180.0 + rimi_rng_below(&rng, 60);
  double duty = 0.0, flow = 40.0 * rimi_rng_uniform(&rng);
  for (std::size_t t = 0; t < rows; ++t) {
    if (t % 30 == 0)
      duty = rimi_rng_uniform(&rng);
    flow += (40.0 * duty - flow) / 6.0;
    log.t_s.push_back(0.1 * static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << duty, flow + 0.2 * rimi_rng_normal(&rng),
        offset + 2.0 * flow + 0.5 * rimi_rng_normal(&rng), tyre + (t < kRows / 2 ? 0.0 : jump),
        4.999;
  }
  return log;
}

rim::Training trained(double offset) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < kRuns; ++i)
    logs.push_back(run(kSeed + i, offset));
  return rim::train(logs, {});
}

// An image's number of 3e8 is off by up to 16, and a reading's noise is .5. What healthy runs show
// has that in it: neither they nor those that taught alarm.
void large_values_make_no_false_alarms(void **) {
  constexpr double offset = 3e8;
  const rim::Training training = trained(offset);
  rim::Replayer replayer(rim::make_image(training.plan), "pump");
  std::size_t raised = 0;
  for (std::size_t i = 0; i < kRuns; ++i)
    raised += replayer.replay(run(kSeed + i, offset), {}).raised > 0 ? 1 : 0;
  for (std::size_t i = 0; i < kFlights; ++i)
    raised += replayer.replay(run(kSeed + 100 + i, offset), {}).raised > 0 ? 1 : 0;
  const double seen = training.outcomes[kPressure].detectable;
  print_message("seed %u: %zu runs alarm; pressure is seen from %g kPa off\n",
                static_cast<unsigned>(kSeed), raised, seen);
  assert_true(raised <= 1);
  assert_true(seen < 5.0); /* what changes within a run is seen all the same */
}

void a_reading_that_stays_is_watched(void **) {
  const rim::Training training = trained(0.0);
  const double seen = training.outcomes[kTyre].detectable;
  assert_true(seen > 0.0 && seen < 5.0);
  assert_false(std::isfinite(training.outcomes[kFixed].detectable)); // the same in all runs
  assert_true(rim::outcome_report(training).find("No offset is ever seen in fixed:") !=
              std::string::npos);
  rim::Replayer replayer(rim::make_image(training.plan), "pump");
  for (std::size_t i = 0; i < kFlights; ++i) {
    assert_int_equal(replayer.replay(run(kSeed + 100 + i, 0.0), {}).raised, 0);
    std::vector<rim_alarm> records;
    rim::ReplayOptions options;
    options.record = [&records](const rim_alarm &a) { records.push_back(a); };
    (void)replayer.replay(run(kSeed + 200 + i, 0.0, -2.0 * seen), options);
    assert_true(!records.empty());
    assert_int_equal(records.back().channel[0], kTyre);
    assert_true(records.back().shift[0] < 0.0);
  }
}

// The same pump whose command counts in another unit: `scale` is a power of two, so that nothing is
// rounded.
std::vector<rim::Log> in_unit(double scale, std::uint64_t first, std::size_t count) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < count; ++i) {
    logs.push_back(run(first + i, 0.0));
    logs.back().values.col(0) *= scale;
  }
  return logs;
}

// A hydraulic pressure in pascals has a cube of 1e22. Training must take products as flight does.
void the_unit_of_a_command_changes_nothing(void **) {
  const rim::Training one = rim::train(in_unit(1.0, kSeed, kRuns), {});
  const rim::Training other = rim::train(in_unit(0x1p40, kSeed, kRuns), {});
  for (std::size_t r = 0; r < kRuns; ++r)
    assert_true(std::abs(one.scores[r].score - other.scores[r].score) < 1e-3);
  for (std::size_t o = 0; o < one.outcomes.size(); ++o)
    assert_string_equal(one.outcomes[o].model.c_str(), other.outcomes[o].model.c_str());
}

// Its square is no number of single precision: it is no input then, and healthy runs stay healthy.
void a_command_of_large_numbers_makes_no_false_alarms(void **) {
  constexpr double scale = 0x1p63;
  const rim::Training training = rim::train(in_unit(scale, kSeed, kRuns), {});
  rim::Replayer replayer(rim::make_image(training.plan), "pump");
  std::size_t raised = 0;
  for (const rim::Log &log : in_unit(scale, kSeed + 100, kFlights))
    raised += replayer.replay(log, {}).raised > 0 ? 1 : 0;
  assert_true(raised <= 1);
}

// A motor that warms as slowly as a run lasts.
rim::Log warm(std::uint64_t seed, std::size_t rows) {
  rim::Log log = run(seed, 0.0, 0.0, rows);
  log.columns.resize(2);
  log.columns[1] = {"s.motor_degC", "degC", rim::Role::sensor};
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 8);
  double motor = 20.0;
  for (Eigen::Index t = 0; t < log.values.rows(); ++t) {
    motor += (20.0 + 100.0 * log.values(t, 0) - motor) / kRows;
    log.values(t, 1) = motor + 0.1 * rimi_rng_normal(&rng);
  }
  log.values = log.values.leftCols(2).eval();
  return log;
}

// Of a run five times as long as any that was learnt: what its slow means hold is from longer ago
// than any healthy run went.
void what_says_nothing_of_any_outcome_is_stale(void **) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < kRuns; ++i)
    logs.push_back(warm(kSeed + i, kRows));
  rim::Replayer replayer(rim::make_image(rim::train(logs, {}).plan), "motor");
  const rim::ReplayedLog usual = replayer.replay(warm(kSeed + 100, kRows), {});
  assert_true(!rim::is_stale(usual) && !(usual.blind_s > 0.0));
  const rim::ReplayedLog longer = replayer.replay(warm(kSeed + 101, 5 * kRows), {});
  assert_true(rim::is_stale(longer) && longer.raised == 0);
  assert_true(longer.blind_from_s > 0.1 * kRows && longer.blind_s > 0.3 * longer.duration_s);
  assert_true(rim::replay_text(longer, replayer.names()).find(
                  "STALE: blocks that say nothing of any outcome, first at t = ") !=
              std::string::npos);
}

// A pressure in units so large that its numbers are those of rounding errors: it is said.
void numbers_of_rounding_errors_are_told(void **) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < kRuns; ++i) {
    logs.push_back(run(kSeed + i, 0.0));
    logs.back().values.col(1 + kTyre).setZero(); // of which nothing is said
  }
  assert_true(rim::train(logs, {}).warnings.empty());
  for (rim::Log &log : logs)
    log.values.col(1 + kPressure) *= 1e-14;
  const std::vector<std::string> warnings = rim::train(logs, {}).warnings;
  assert_int_equal(warnings.size(), 1);
  assert_int_equal(warnings[0].rfind("s.press_kPa is nowhere farther from 0 than ", 0), 0);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(large_values_make_no_false_alarms),
                              cmocka_unit_test(a_reading_that_stays_is_watched),
                              cmocka_unit_test(the_unit_of_a_command_changes_nothing),
                              cmocka_unit_test(a_command_of_large_numbers_makes_no_false_alarms),
                              cmocka_unit_test(numbers_of_rounding_errors_are_told),
                              cmocka_unit_test(what_says_nothing_of_any_outcome_is_stale)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
