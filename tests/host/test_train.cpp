// SPDX-License-Identifier: MIT
// Training and its report: what is promised, that it is kept, what is refused.
#include <algorithm>
#include <cstdio>

#include "check.hpp"
#include "replay/replay.hpp"
#include "train/train_report.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"

#include "made_vehicle.hpp"
#include "toy_log.hpp"

namespace {

std::vector<rim::Log> healthy_logs(std::uint64_t first, std::size_t count) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < count; ++i)
    logs.push_back(toy_log(first + i));
  return logs;
}

// Blocks of so many seconds, some 60 in a run instead of 240: for a quarter of the time, where it
// does not matter how much is learnt.
rim::TrainOptions coarse(double block_s) {
  rim::TrainOptions options;
  options.blocking.block_s = block_s;
  return options;
}

// Nineteen runs, the least for 5 %; trained once.
const rim::Training &trained() {
  static const rim::Training training = rim::train(healthy_logs(1, 19), rim::TrainOptions{});
  return training;
}

void promise_is_what_ranks_allow(void **) {
  const struct {
    std::size_t runs;
    double wished;
    std::uint32_t rank;
    double rate;
  } table[] = {{8, 0.05, 8, 1.0 / 9},    {18, 0.05, 18, 1.0 / 19},  {19, 0.05, 19, 1.0 / 20},
               {50, 0.05, 49, 2.0 / 51}, {99, 0.05, 95, 5.0 / 100}, {3, 0.9, 1, 3.0 / 4}};
  for (const auto &line : table) {
    const rim::Promise promise = rim::promise_for(line.runs, line.wished);
    assert_int_equal(promise.rank, line.rank);
    assert_true(std::fabs(promise.rate - line.rate) < 1e-12);
    // Never more than what n + 1 exchangeable runs allow.
    assert_true(promise.rate >= 1.0 / static_cast<double>(line.runs + 1) - 1e-12);
  }
}

void equal_logs_equal_images(void **) {
  const auto image_of = [](std::uint64_t first) {
    return rim::make_image(rim::train(healthy_logs(first, 19), coarse(0.5)).plan);
  };
  const auto image = image_of(1);
  assert_true(image_of(1) == image);
  assert_false(image_of(2) == image);
}

// 60 fresh runs at a promised 5 %: more than 9 alarms have a chance below 1 in 1000.
void promise_is_kept_and_faults_are_found(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "toy");
  unsigned false_alarms = 0, found = 0;
  for (std::uint64_t seed = 1000; seed < 1060; ++seed)
    false_alarms += replayer.replay(toy_log(seed), {}).raised > 0 ? 1 : 0;
  for (std::uint64_t seed = 2000; seed < 2020; ++seed)
    found += replayer.replay(toy_log(seed, 600, 0.5), {}).raised > 0 ? 1 : 0;
  print_message("seeds 1000.. and 2000..: %u of 60 false, %u of 20 found\n", false_alarms, found);
  assert_true(false_alarms <= 9);
  assert_true(found >= 18);
}

void report_says_what_was_done(void **) {
  const std::vector<rim::OutcomeReport> &outcomes = trained().outcomes;
  assert_int_equal(outcomes.size(), 3);
  const std::string errors = rim::outcome_report(trained());
  assert_true(has(errors, "position a"));
  assert_true(has(errors, "filtered commands"));
  // Nothing knows a block's mean of readings better than their noise, 0.03 m and 0.02 m/s.
  const double readings = std::sqrt(static_cast<double>(trained().plan.block_rows));
  assert_true(outcomes[0].error > 0.9 * 0.03 / readings);
  assert_true(outcomes[2].error > 0.9 * 0.02 / readings && outcomes[2].error < 0.1);
  for (const rim::OutcomeReport &o : outcomes)
    assert_true(o.r2 > 0.98);
  for (const rim::OutcomeReport &o : outcomes)
    assert_true(o.detectable > 0.0 && o.detectable < 1.0 && o.noise > 0.0);
  assert_int_equal(trained().scores.size(), 19);
  assert_true(trained().warnings.empty());
  const std::string promise = rim::promise_report(trained(), 0.05);
  assert_true(has(promise, "at most 5.0 %"));
  assert_true(promise.find("no rate below") == std::string::npos);
  assert_true(has(rim::promise_report(trained(), 0.01), "with 19 runs no rate below 5.0 %"));
  assert_true(has(rim::promise_report(trained(), 0.01), "99 runs are the least for 1 %"));
  // Which runs set the alarm: the highest first, by name, with what deviates most in it.
  double largest = -1e30;
  std::size_t at = 0;
  std::vector<double> scores;
  for (std::size_t r = 0; r < trained().scores.size(); ++r) {
    scores.push_back(trained().scores[r].score);
    if (trained().scores[r].score > largest) {
      largest = trained().scores[r].score;
      at = r;
    }
  }
  assert_int_equal(trained().paths.size(), 19);
  char highest[80];
  std::snprintf(highest, sizeof highest, "highest: %.1f in %s (", largest,
                trained().paths[at].c_str());
  assert_true(has(promise, highest));
  std::nth_element(scores.begin(), scores.begin() + 9, scores.end());
  std::snprintf(highest, sizeof highest, "; half of the runs reach at most %.1f\n", scores[9]);
  assert_true(has(promise, highest));
  // A run beyond what counts says so, and no other does.
  rim::Training odd = trained();
  const double counted = static_cast<double>(odd.plan.thresholds.maxima.back());
  odd.scores[at].score = counted + 5.0;
  std::snprintf(highest, sizeof highest, ", counts as %.1f)", counted);
  assert_true(has(rim::promise_report(odd, 0.05), highest));
  assert_true(has(rim::promise_report(odd, 0.05), "the highest run counts as much as"));
  odd.scores[at].score = counted;
  assert_true(rim::promise_report(odd, 0.05).find("counts as") == std::string::npos);
  const auto image = rim::make_image(trained().plan);
  assert_true(has(rim::image_report(image), std::to_string(image.size())));
  assert_true(has(rim::choice_report(trained()),
                  "A block is " + std::to_string(trained().plan.block_rows) + " rows"));
}

// A reading that never changed in the healthy runs: whatever else it reads is out of range.
void what_is_constant_can_be_trained(void **) {
  std::vector<rim::Log> logs = made_vehicles(1, 5);
  for (rim::Log &log : logs) {
    log.columns = {log.columns[2]};
    log.values = rim::Matrix::Constant(log.values.rows(), 1, -1.0);
  }
  const rim::Training training = rim::train(logs, rim::TrainOptions{});
  assert_int_equal(training.plan.region.size(), 1);
  rim::Replayer replayer(rim::make_image(training.plan), "constant");
  const rim::ReplayedLog healthy = replayer.replay(logs[0], {});
  assert_int_equal(healthy.raised, 0);
  assert_int_equal(healthy.health.rows.out_of_range, 0);
  logs[0].values.bottomRows(100).setConstant(1.0);
  assert_int_equal(replayer.replay(logs[0], {}).health.rows.out_of_range, 100);
}

// u.a, s.lag, and columns that say little for their magnitude: a latitude, what never changed, one
// of two modes, and a counter that began long before.
rim::Log driven_somewhere(std::uint64_t seed, double pressure = 1013.7) {
  MadeVehicle made;
  made.rows = 800;
  rim::Log log = made_vehicle(seed, made);
  log.columns = {log.columns[0],
                 log.columns[2],
                 {"x.lat_deg", "deg", rim::Role::context},
                 {"x.pressure_hPa", "hPa", rim::Role::context},
                 {"x.mode", "", rim::Role::context},
                 {"x.ticks", "", rim::Role::context}};
  const rim::Matrix all = log.values;
  log.values.resize(all.rows(), 6);
  for (Eigen::Index i = 0; i < all.rows(); ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(all.rows() - 1);
    log.values.row(i) << all(i, 0), all(i, 2), 52.122 + 0.003 * part, pressure,
        i % 700 < 350 ? 4100.0 : 4101.0, 1e7 + std::floor(50.0 * part);
  }
  return log;
}

// The width follows from the spread: by the magnitude a latitude's range was 0.1 degree, 11 km, and
// another field was no news. What never changed may differ by the rounding of its readings.
void ranges_follow_the_spread(void **) {
  std::vector<rim::Log> logs;
  for (std::uint64_t seed = 11; seed <= 22; ++seed) // of fewer all is learnt again without each
    logs.push_back(driven_somewhere(seed));
  const rim::Training training = rim::train(logs, coarse(1.3));
  const auto width = [&training](std::size_t f) {
    return static_cast<double>(training.plan.high[f] - training.plan.low[f]);
  };
  assert_true(width(2) > 0.003 && width(2) < 2.1 * 0.003);
  assert_true(width(3) > 2.0 && width(3) < 2.1); /* always 1013.7 */
  assert_true(width(4) > 1.0 && width(4) < 2.1);
  assert_true(width(5) > 50.0 && width(5) < 2.1 * 50.0);
  rim::Replayer replayer(rim::make_image(training.plan), "somewhere");
  const auto rows_out = [&replayer](const rim::Log &log) {
    return replayer.replay(log, {}).health.rows.out_of_range;
  };
  assert_int_equal(rows_out(driven_somewhere(6)), 0);
  const double single = static_cast<double>(1013.7F);
  assert_true(std::abs(single - 1013.7) > 0.0);
  for (const double read : {single, 2.0 * single - 1013.7, 2.0 * 1013.7 - single})
    assert_int_equal(rows_out(driven_somewhere(6, read)), 0);
  // One column at a time, beyond by more than half of what was seen; and by less.
  const struct {
    Eigen::Index column;
    double by;
    bool is_out;
  } cases[] = {{2, 0.005, true}, {2, 0.001, false}, {3, 5.0, true},   {4, 2.0, true},
               {5, 80.0, true},  {5, 20.0, false},  {2, -0.005, true}};
  for (const auto &one : cases) {
    rim::Log log = driven_somewhere(6);
    log.values.col(one.column).array() += one.by;
    assert_int_equal(rows_out(log) > 0, one.is_out);
  }
}

// An alarm is updated twelve times in a run, but no more often than every ten seconds.
void short_runs_are_updated_more_often(void **) {
  const double short_s = toy_log(1).t_s.back(), twelfth_s = trained().plan.inhibit_s;
  assert_true(twelfth_s < 10.0 && std::abs(12.0 * twelfth_s - short_s) < 0.05 * short_s);
  std::vector<rim::Log> logs = made_vehicles(1, 3);
  assert_true(logs[0].t_s.back() > 130.0);
  for (rim::Log &log : logs) {
    log.columns = {log.columns[2]};
    log.values = log.values.col(2).eval();
  }
  const double of_long_s = rim::train(logs, rim::TrainOptions{}).plan.inhibit_s;
  assert_true(of_long_s > 9.99 && of_long_s < 10.01);
}

// An outcome that neither the commands nor the other sensors explain cannot be watched: it is said.
void what_cannot_be_modelled_is_said(void **) {
  MadeVehicle brief;
  brief.rows = 1200;
  std::vector<rim::Log> logs =
      made_vehicles(1, 12, brief); // of fewer all is learnt again without each
  for (rim::Log &log : logs) {     // u.a, u.b, s.lag and what obeys nothing
    log.columns = {log.columns[0], log.columns[1], log.columns[2], log.columns[6]};
    const rim::Matrix all = log.values;
    log.values.resize(all.rows(), 4);
    log.values << all.leftCols(3), all.col(6);
  }
  const rim::Training made = rim::train(logs, coarse(2.0));
  const std::string text = rim::outcome_report(made);
  assert_true(has(text, "Neither the commands nor the other sensors explain nothing."));
  assert_true(made.outcomes[1].r2 < 0.05 && made.outcomes[0].r2 > 0.95);
}

// A run that is not like the others is named with the outcome; the same run twice is named too.
void odd_runs_are_named(void **) {
  MadeVehicle made;
  made.rows = 1200;
  std::vector<rim::Log> logs = made_vehicles(1, 12, made);
  logs[5].values.col(2).tail(400).array() += 1.0; // s.lag
  const rim::Training odd = rim::train(logs, coarse(2.0));
  assert_int_equal(odd.warnings.size(), 1);
  assert_true(has(odd.warnings[0], "made6 is unlike the other runs"));
  assert_true(has(odd.warnings[0], "'s.lag_m' deviates most"));
  std::size_t most = 0;
  for (std::size_t r = 0; r < odd.scores.size(); ++r)
    most = odd.scores[r].score > odd.scores[most].score ? r : most;
  assert_int_equal(most, 5);
  made.rows = 400;
  logs = made_vehicles(1, 11, made);
  logs.push_back(logs[2]);
  logs.back().path = "copy";
  const rim::Training twice = rim::train(logs, coarse(2.0));
  assert_false(twice.warnings.empty());
  assert_true(has(twice.warnings[0], "copy holds the same rows as made3"));
}

// Logs with their own predictions: noise, effects of the run and thresholds alone are learnt. Runs
// with offsets of their own, which thresholds from one log alone would alarm at, do not alarm.
void own_predictions_are_taken_as_they_are(void **) {
  const auto own = [](std::uint64_t seed, double late) {
    rim::Log log = toy_external(seed, 400, 0.0);
    rim_rng rng;
    rimi_rng_seed(&rng, seed, 79);
    log.values.col(1).array() += 0.5 * rimi_rng_normal(&rng); // 1 sd from run to run
    log.values.col(1).tail(200).array() += late;
    return log;
  };
  std::vector<rim::Log> logs;
  for (std::uint64_t seed = 1; seed <= 19; ++seed)
    logs.push_back(own(seed, 0.0));
  const rim::Training training = rim::train(logs, rim::TrainOptions{});
  assert_true(training.plan.layout.external && training.plan.behaviour.empty());
  // Residuals are in the stated sd: an offset of 1 from run to run.
  assert_true(training.noise.channels[0].effect_sd > 0.6 &&
              training.noise.channels[0].effect_sd < 1.6);
  rim::Replayer replayer(rim::make_image(training.plan), "own");
  unsigned false_alarms = 0, found = 0;
  for (std::uint64_t seed = 100; seed < 120; ++seed) {
    false_alarms += replayer.replay(own(seed, 0.0), {}).raised > 0 ? 1 : 0;
    found += replayer.replay(own(seed, 0.75), {}).raised > 0 ? 1 : 0;
  }
  print_message("seeds 100..: %u of 20 false, %u of 20 found\n", false_alarms, found);
  assert_true(false_alarms <= 4); // of 20 at 5 %: more have a chance of 0.3 %
  assert_true(found >= 18);
}

// An alarm of such an image ends by itself.
void images_ask_for_clearing(void **) {
  const rim::Monitor monitor(rim::make_image(trained().plan), "toy");
  assert_int_equal(rim_monitor_config(monitor.get(), RIM_CONFIG_CLEAR), 30);
}

void refuses(void **) {
  const rim::TrainOptions options;
  assert_true(has(refusal([&] { rim::train(healthy_logs(1, 2), options); }), "at least 3 logs"));
  std::vector<rim::Log> logs = healthy_logs(1, 4);
  logs[2].columns[3].name = "s.velocity_mps";
  assert_true(has(refusal([&] { rim::train(logs, options); }), "toy3: column 's.velocity_mps'"));
  logs = healthy_logs(1, 3);
  logs.push_back(toy_log(9, 25));
  assert_true(has(refusal([&] { rim::train(logs, options); }), "toy9: "));
  assert_true(has(refusal([&] { rim::train(logs, options); }), "a run needs at least 16"));
  logs = healthy_logs(1, 4);
  for (double &t : logs[1].t_s)
    t *= 2.0;
  assert_true(has(refusal([&] { rim::train(logs, options); }),
                  "toy2: its rows come at 10 Hz, those of the other runs at 20 Hz"));
}

// Two hours do not fit into the image's period, and half of a microsecond rounds to none.
void refuses_periods_that_no_image_holds(void **) {
  for (const double period_s : {7200.0, 1e-7}) {
    std::vector<rim::Log> logs = healthy_logs(1, 3);
    for (rim::Log &log : logs) {
      for (double &t : log.t_s)
        t *= period_s / 0.05;
    }
    assert_true(has(refusal([&] { rim::train(logs, {}); }), "count the time in another unit"));
  }
}

void refuses_more_columns_than_the_monitor_takes(void **) {
  std::vector<rim::Log> logs = healthy_logs(1, 3);
  for (rim::Log &log : logs) {
    const Eigen::Index own = log.values.cols();
    log.values.conservativeResize(Eigen::NoChange, 129);
    for (Eigen::Index c = own; c < log.values.cols(); ++c) {
      log.columns.push_back({"u.c" + std::to_string(c), "", rim::Role::command});
      log.values.col(c) = log.values.col(0) * static_cast<double>(c);
    }
  }
  assert_true(has(refusal([&] { rim::train(logs, {}); }),
                  "toy1: has 129 columns x. u. s., and the monitor takes at most 128"));
}

void refuses_numbers_that_no_image_holds(void **) {
  std::vector<rim::Log> logs = healthy_logs(1, 3);
  logs[1].values(7, 2) = -1e39;
  assert_true(
      has(refusal([&] { rim::train(logs, {}); }), "toy2: column 's.position_b_m' reaches 1e+39"));
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(promise_is_what_ranks_allow),
      cmocka_unit_test(equal_logs_equal_images),
      cmocka_unit_test(promise_is_kept_and_faults_are_found),
      cmocka_unit_test(report_says_what_was_done),
      cmocka_unit_test(what_is_constant_can_be_trained),
      cmocka_unit_test(ranges_follow_the_spread),
      cmocka_unit_test(short_runs_are_updated_more_often),
      cmocka_unit_test(what_cannot_be_modelled_is_said),
      cmocka_unit_test(odd_runs_are_named),
      cmocka_unit_test(own_predictions_are_taken_as_they_are),
      cmocka_unit_test(images_ask_for_clearing),
      cmocka_unit_test(refuses),
      cmocka_unit_test(refuses_periods_that_no_image_holds),
      cmocka_unit_test(refuses_more_columns_than_the_monitor_takes),
      cmocka_unit_test(refuses_numbers_that_no_image_holds),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
