// SPDX-License-Identifier: MIT
// What the commands were before a log's first row is learnt where logs are cut out of longer runs,
// and not where the vehicle had settled before its log began. A monitor that is started under way
// knows it. A flight may last longer than all logs.
#include "base/rng.h"
#include "image/image_writer.hpp"
#include "made_vehicle.hpp"
#include "replay/replay.hpp"
#include "temporary.hpp"
#include "train/begin.hpp"
#include "train/choose_models.hpp"
#include "train/healthy_runs.hpp"
#include "train/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <setjmp.h>
extern "C" {
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 8300; // of the first run
constexpr std::size_t kRuns = 12, kRows = 1200;
constexpr double kLag = 300.0, kNoise = 0.01; // rows; of the sensor

// Before its first row: the command as in the first row for ever, the same in every run, or steps
// like those of the run.
enum class Past { settled, alike, cut };

// A temperature that follows a heater slowly.
rim::Log oven(std::uint64_t seed, Past past) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 4);
  rim::Log log;
  log.path = "oven" + std::to_string(seed);
  log.columns = {{"u.heater", "", rim::Role::command}, {"s.oven_degC", "degC", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 2);
  const std::size_t before = past == Past::cut ? 5000 : 0;
  double heater = 0.5, oven = 0.5;
  for (std::size_t t = 0; t < before + kRows; ++t) {
    if (t == 0 ? past != Past::alike : t > 10 && rimi_rng_uniform(&rng) < 0.02)
      heater = rimi_rng_uniform(&rng);
    oven = t == 0 ? heater : oven + (heater - oven) / kLag;
    if (t < before)
      continue;
    log.t_s.push_back(0.5 * static_cast<double>(t - before));
    log.values.row(static_cast<Eigen::Index>(t - before)) << heater,
        oven + kNoise * rimi_rng_normal(&rng);
  }
  return log;
}

std::vector<rim::Log> ovens(Past past) {
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < kRuns; ++i)
    logs.push_back(oven(kSeed + i, past));
  return logs;
}

rim::Basis basis_of(Past past) {
  const std::vector<rim::Log> logs = ovens(past);
  rim::LogSet set(logs);
  return rim::healthy_runs(&set, {}).plan.basis;
}

void the_past_of_cut_runs_is_learnt(void **) {
  print_message("seed %u\n", static_cast<unsigned>(kSeed));
  const rim::Basis basis = basis_of(Past::cut);
  const std::size_t times = basis.share.size();
  assert_true(basis.begin.size() == 2 * basis.inputs.size() * times);
  // Input 0 is the heater: in one row it is what it is; over a run it was half on, whatever it is.
  assert_true(std::abs(basis.begin[0]) < 1e-6 && std::abs(basis.begin[1] - 1.0) < 1e-6);
  const double offset = basis.begin[2 * times - 2], slope = basis.begin[2 * times - 1];
  assert_true(slope > -0.1 && slope < 0.4);
  assert_true(std::abs(offset + 0.5 * slope - 0.5) < 0.1);
}

void a_vehicle_that_had_settled_has_no_other_past(void **) {
  assert_true(basis_of(Past::settled).begin.empty());
}

void runs_that_begin_alike_are_not_asked(void **) {
  for (const Past past : {Past::alike, Past::settled, Past::cut}) {
    const std::vector<rim::Log> logs = ovens(past);
    rim::LogSet set(logs);
    const std::size_t asked = rim::runs_for_begin(rim::survey_of(&set)).size();
    assert_true(asked == (past == Past::alike ? 0 : kRuns));
  }
}

// Runs left out, by the simplest models.
void runs_left_out_are_predicted_better(void **) {
  const std::vector<rim::Log> logs = ovens(Past::cut);
  rim::LogSet set(logs);
  const rim::HealthyRuns healthy = rim::healthy_runs(&set, {});
  const rim::FlightPlan &plan = healthy.plan;
  double error[2] = {0.0, 0.0};
  for (int with = 0; with < 2; ++with) {
    rim::Basis basis = plan.basis;
    if (with == 0)
      basis.begin.clear();
    std::vector<rim::BlockRun> runs;
    for (const rim::Log &log : logs)
      runs.push_back(rim::block_run(log, plan.layout, basis,
                                    {plan.block_rows, plan.period_s, plan.low, plan.high, {}}));
    const rim::RunStore store(runs);
    rim::learn_terms(&basis, store);
    error[with] = rim::screened(rim::Fitter(basis, store, nullptr), basis, 1, {}).front();
  }
  print_message("error %.4f degC with the first row as the past, %.4f with what was learnt\n",
                error[0], error[1]);
  assert_true(error[1] < 0.8 * error[0]);
}

// The runs that tell how a run begins may all be in other parts.
void parts_learn_the_same_past(void **) {
  const std::vector<rim::Log> logs = ovens(Past::cut);
  std::vector<std::string> parts;
  for (std::size_t shard = 1; shard <= 3; ++shard) {
    rim::LogSet set(logs);
    parts.push_back(temporary_folder() / ("begin" + std::to_string(shard)));
    (void)rim::write_part(&set, {}, {shard, 3}, parts.back());
  }
  const rim::Training merged = rim::train(rim::merged_parts(parts), {});
  const rim::Training whole = rim::train(logs, {});
  assert_false(merged.plan.basis.begin.empty());
  assert_true(rim::make_image(merged.plan) == rim::make_image(whole.plan));
}

// A room that is heated from cold. Each of its features may be at first what it is later: only
// together do they tell that the room is warm already.
rim::Log room(std::uint64_t seed, std::size_t first_row = 0) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 5);
  rim::Log log;
  log.path = "room" + std::to_string(seed);
  log.columns = {{"u.heater", "", rim::Role::command},
                 {"s.room_degC", "degC", rim::Role::sensor},
                 {"s.supply_degC", "degC", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows - first_row), 3);
  double set = 20.0 + rimi_rng_normal(&rng), warm = set - 4.0 + 1.2 * rimi_rng_normal(&rng);
  double supply = 33.0 + 3.0 * rimi_rng_normal(&rng);
  for (std::size_t t = 0; t < kRows; ++t) {
    if (rimi_rng_uniform(&rng) < 0.01)
      set = 20.0 + rimi_rng_normal(&rng);
    const double heater = std::clamp(0.45 + 0.1 * (set - warm), 0.0, 1.0);
    supply += (20.0 + 20.0 * heater - supply) / 40.0;
    warm += (10.0 + 0.75 * (supply - 15.0) - warm) / 120.0;
    const double noise[2] = {0.02 * rimi_rng_normal(&rng), 0.05 * rimi_rng_normal(&rng)};
    if (t < first_row)
      continue;
    log.t_s.push_back(0.5 * static_cast<double>(t - first_row));
    log.values.row(static_cast<Eigen::Index>(t - first_row)) << heater, warm + noise[0],
        supply + noise[1];
  }
  return log;
}

void a_monitor_that_is_started_under_way_knows_it(void **) {
  constexpr std::uint64_t first = 8500;
  constexpr std::size_t runs = 30, flights = 10;
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < runs; ++i)
    logs.push_back(room(first + i));
  const rim::Training training = rim::train(logs, {});
  const rim::Basis &basis = training.plan.basis;
  std::size_t tell_alone = 0; // runs of which one feature tells it
  for (const rim::Log &log : logs) {
    bool tells = false;
    for (std::size_t f = 0; f < 3; ++f) {
      const double x =
          log.values(static_cast<Eigen::Index>(kRows / 2), static_cast<Eigen::Index>(f));
      tells |= std::abs(x - basis.start[f]) > BASIS_START_LIMIT * basis.start_sd[f];
    }
    tell_alone += tells ? 1 : 0;
  }
  rim::Replayer replayer(rim::make_image(training.plan), "room");
  std::size_t from_start = 0, under_way = 0, false_alarms = 0, wrong_sensor = 0;
  for (std::uint64_t i = 0; i < flights; ++i) {
    const rim::ReplayedLog whole = replayer.replay(room(first + 100 + i), {});
    const rim::ReplayedLog late = replayer.replay(room(first + 100 + i, kRows / 2), {});
    from_start += whole.health.partly > 0 ? 1 : 0;
    under_way += late.health.partly > 0 ? 1 : 0;
    false_alarms += late.raised > 0 ? 1 : 0;
    rim::Log wrong = room(first + 100 + i);
    wrong.values.col(i % 2 == 0 ? 1 : 2).array() += i % 4 < 2 ? 5.0 : -5.0;
    wrong_sensor += replayer.replay(wrong, {}).health.partly > 0 ? 1 : 0;
  }
  print_message("seed %u: of %zu flights %zu seem to have begun before their first row, of those "
                "that had %zu, of which %zu alarm, of those with a wrong sensor %zu; in %zu of %zu "
                "runs one feature tells it\n",
                static_cast<unsigned>(first), flights, from_start, under_way, false_alarms,
                wrong_sensor, tell_alone, runs);
  assert_true(3 * tell_alone <= runs);
  assert_int_equal(from_start, 0);
  assert_int_equal(wrong_sensor, 0);
  assert_true(under_way + 1 >= flights);
  assert_true(false_alarms <= 1);
}

constexpr double kFirstTenth = 10.0; // blocks

// A command and three outcomes in 100 blocks, of(is_first, feature, common, noise): what there is
// in the first tenth of a run, and later.
template <typename Of> rim::BlockRun blocks_of(std::uint64_t seed, const Of &of) {
  constexpr Eigen::Index blocks = 100;
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 6);
  rim::BlockRun run;
  run.context = rim::Matrix(blocks, 4);
  run.outcome = rim::Matrix::Zero(blocks, 3);
  run.time_s = Eigen::VectorXd::LinSpaced(blocks, 0.0, 99.0);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const double common = rimi_rng_normal(&rng);
    for (Eigen::Index f = 0; f < 4; ++f)
      run.context(b, f) = of(run.time_s[b] <= kFirstTenth, f, common, rimi_rng_normal(&rng));
  }
  run.start = run.context.row(0);
  return run;
}

// +-1 about 0 at first, +-2 about 8 later.
double rises(bool is_first, Eigen::Index, double, double noise) {
  return is_first ? noise : 8.0 + 2.0 * noise;
}

// The second and third outcome go with the command at first, and against it later; each of all by
// itself is the same at first and later.
double turns(bool is_first, Eigen::Index f, double common, double noise) {
  const double with = f == 1 ? 0.0 : (is_first || f == 0 ? 0.95 : -0.95);
  return with * common + std::sqrt(1.0 - with * with) * noise;
}

// Whether flight takes a run that begins so for one that had begun before (begins_late() in
// lib/src/monitor/blocks_unknown.c).
bool is_late(const rim::Basis &basis, const Eigen::VectorXd &x) {
  rim::SectionBytes start, start_sd, later;
  start.f32s(basis.start);
  start_sd.f32s(basis.start_sd);
  later.f32s({basis.late_nats});
  for (const auto *numbers :
       {&basis.later, &basis.later_sd, &basis.start_inverse, &basis.later_inverse})
    later.f32s(*numbers);
  rim_basis view{};
  view.start = start.bytes().data();
  view.start_sd = start_sd.bytes().data();
  view.later = later.bytes().data();
  basis_place place;
  rimi_basis_place(&view, 4, x.data(), &place);
  double nats = 0.0, most = 0.0, alone = 0.0;
  for (std::uint32_t f = 0; f < 4; ++f) {
    nats += rimi_basis_later(&view, 4, &place, f, &alone);
    most = f > 0 ? std::max(most, alone) : most;
  }
  return nats - most >= basis.late_nats;
}

// What 30 runs teach of their first and their later blocks.
rim::Basis learnt_later(const std::vector<rim::BlockRun> &runs) {
  rim::Layout layout;
  layout.feature_names = {"u.a", "s.b", "s.c", "s.d"};
  layout.outcome_names = {"s.b", "s.c", "s.d"};
  layout.outcome_feature = {1, 2, 3};
  layout.command = {1, 0, 0, 0};
  rim::Basis basis;
  basis.start.assign(4, 0.0);
  basis.start_sd.assign(4, 1.0);
  rim::learn_later(&basis, layout, rim::RunStore(runs));
  return basis;
}

template <typename Of> std::vector<rim::BlockRun> thirty(std::uint64_t first, const Of &of) {
  std::vector<rim::BlockRun> runs;
  for (std::uint64_t i = 0; i < 30; ++i)
    runs.push_back(blocks_of(first + i, of));
  return runs;
}

void features_that_go_together_otherwise_tell_it(void **) {
  constexpr std::uint64_t first = 8690;
  const rim::Basis basis = learnt_later(thirty(first, turns));
  std::size_t told = 0, later = 0, too_early = 0;
  for (const rim::BlockRun &run : thirty(first + 100, turns)) {
    too_early += is_late(basis, run.start) ? 1 : 0;
    for (Eigen::Index b = 0; b < run.blocks(); ++b) {
      if (run.time_s[b] <= kFirstTenth)
        continue;
      later++;
      told += is_late(basis, run.context.row(b)) ? 1 : 0;
    }
  }
  print_message("seed %u: of %zu later blocks %zu are told, and %zu of 30 first ones\n",
                static_cast<unsigned>(first), later, told, too_early);
  assert_true(3 * told > later); // those in which the command is not near 0
  assert_true(too_early <= 1);
}

// Where all runs begin clearly as runs begin, what is between that and later blocks is no start,
// but a run that begins with any one sensor wrong is one.
void what_is_less_clear_than_every_start_is_none(void **) {
  constexpr std::uint64_t first = 8650;
  const std::vector<rim::BlockRun> runs = thirty(first, rises);
  const rim::Basis basis = learnt_later(runs);
  print_message("seed %u: %.1f nats\n", static_cast<unsigned>(first), basis.late_nats);
  assert_true(is_late(basis, Eigen::VectorXd::Constant(4, 2.5)));
  for (const rim::BlockRun &run : runs) {
    assert_false(is_late(basis, run.start));
    for (const double wrong : {-20.0, 4.0, 8.0, 30.0}) {
      for (Eigen::Index f = 1; f < 4; ++f) {
        Eigen::VectorXd x = run.start;
        x[f] = wrong;
        assert_false(is_late(basis, x));
      }
    }
  }
}

// Twice as long as all runs that were learnt from: no alarm, and what does not depend on long ago
// is watched to the end.
void a_longer_flight_is_no_fault(void **) {
  constexpr std::uint64_t first = 8400;
  constexpr std::size_t runs = 16, flights = 8;
  MadeVehicle made;
  made.rows /= std::getenv("RIM_LONG") != nullptr ? 1 : 2; // all of them with `make test-long`
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < runs; ++i)
    logs.push_back(made_vehicle(first + i, made));
  rim::TrainOptions coarse;
  coarse.blocking.block_s = std::getenv("RIM_LONG") != nullptr ? 0.0 : 1.0;
  const rim::Training training = rim::train(logs, coarse);
  const double long_s = made.period_s * static_cast<double>(made.rows);
  assert_true(std::abs(training.plan.basis.learnt_s - long_s) < 10.0);
  rim::Replayer replayer(rim::make_image(training.plan), "made");
  MadeVehicle longer = made;
  longer.rows *= 2;
  std::size_t false_alarms = 0, found = 0, partly = 0;
  for (std::uint64_t i = 0; i < flights; ++i) {
    rim::Log flight = made_vehicle(first + 100 + i, longer);
    const rim::ReplayedLog healthy = replayer.replay(flight, {});
    false_alarms += healthy.raised > 0 ? 1 : 0;
    partly += healthy.health.partly;
    // A sensor that is off from 1.5 times the length of a log on.
    const Eigen::Index sick = flight.values.rows() / 4;
    flight.values.col(3).tail(sick).array() += 0.3;
    const rim::ReplayedLog faulty = replayer.replay(flight, {});
    found += faulty.raised > 0 ? 1 : 0;
  }
  print_message("seed %u: %zu of %zu healthy flights alarm, %zu of as many faults are found, %zu "
                "blocks in part\n",
                static_cast<unsigned>(first), false_alarms, flights, found, partly);
  assert_true(false_alarms <= 1);
  assert_int_equal(found, flights);
  assert_true(partly > 0);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(the_past_of_cut_runs_is_learnt),
                              cmocka_unit_test(a_vehicle_that_had_settled_has_no_other_past),
                              cmocka_unit_test(runs_that_begin_alike_are_not_asked),
                              cmocka_unit_test(runs_left_out_are_predicted_better),
                              cmocka_unit_test(parts_learn_the_same_past),
                              cmocka_unit_test(a_monitor_that_is_started_under_way_knows_it),
                              cmocka_unit_test(features_that_go_together_otherwise_tell_it),
                              cmocka_unit_test(what_is_less_clear_than_every_start_is_none),
                              cmocka_unit_test(a_longer_flight_is_no_fault)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
