// SPDX-License-Identifier: MIT
// Learning motion interference: the labels of C.3.1, what is counted, what is refused, what is
// found.

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "check.hpp"
#include "thesis/experiment/control_mrclam.hpp"
#include "thesis/experiment/fig_C5.hpp"
#include "thesis/poisson.hpp"
#include "train/interference.hpp"
#include "util/error.hpp"

using namespace rim;

namespace {

constexpr std::uint64_t kSeed = 907;

// Stands, drives at 0.6 from 1 s, is held from 4 to 5 s, stops at 7 s; no noise.
InterferenceRun plain_run() {
  InterferenceRun run;
  run.name = "plain";
  double v = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double t_s = 0.05 * i, u = t_s < 1.0 || t_s >= 7.0 ? 0.0 : 0.6;
    const double target = t_s >= 4.0 && t_s < 5.0 ? 0.1 : u;
    v += std::fmax(-0.06, std::fmin(0.05, target - v));
    run.t_s.push_back(t_s);
    run.command_mps.push_back(u);
    run.speed_mps.push_back(v);
  }
  run.intervals = {{4.0, 4.99, "hold"}};
  return run;
}

bool is_refused(const std::function<void()> &work, const std::string &reason) {
  try {
    work();
  } catch (const DataError &error) {
    return std::string(error.what()).find(reason) != std::string::npos;
  }
  return false;
}

void labels_follow_the_rules(void **) {
  const InterferenceRun run = plain_run();
  const std::vector<int> label = label_motion(run, 0.028);
  assert_int_equal(label[10], RIM_MOTION_STOP);
  assert_int_equal(label[22], RIM_MOTION_ACCEL);
  assert_int_equal(label[50], RIM_MOTION_CONSTANT);
  assert_int_equal(label[80], RIM_MOTION_MI);
  assert_int_equal(label[99], RIM_MOTION_MI);
  assert_int_equal(label[102], RIM_MOTION_CONSTANT); // off, but the command had been constant
  assert_int_equal(label[143], RIM_MOTION_DECEL);
  assert_int_equal(label[190], RIM_MOTION_STOP);
}

void training_learns_the_vehicle(void **) {
  const std::vector<InterferenceRun> runs = interference_world(kSeed);
  assert_int_equal(runs.size(), 31);
  const InterferenceTrainer trainer(runs, {});
  const InterferenceTraining t = trainer.train(runs.size());
  assert_true(t.unseen.empty());
  assert_true(std::fabs(t.model.accel_mps2 - 1.0) < 0.1);
  assert_true(std::fabs(t.model.decel_mps2 - 1.2) < 0.12);
  assert_true(t.model.latency_s > 0.03 && t.model.latency_s < 0.15);
  for (int i = 0; i < RIM_MOTION_MI; ++i)
    assert_true(t.model.transition[i][RIM_MOTION_MI] == t.p_mi);
  assert_true(t.model.mean[RIM_MOTION_MI][0] > 0.1); // slower than commanded
  std::size_t hits = 0, wrong = 0;
  for (const InterferenceRun &run : runs) {
    const InterferenceOutcome o = detect(t.model, run);
    hits += o.detector[1].hits;
    wrong += o.detector[1].false_positives;
  }
  assert_true(hits >= 28 && hits <= 29);
  assert_int_equal(wrong, 0);
}

// Leaving a run out is the same as never having had it.
void left_out_is_as_if_never_seen(void **) {
  std::vector<InterferenceRun> runs = interference_world(kSeed + 1);
  runs.resize(6);
  const InterferenceTrainer all(runs, {});
  const std::vector<InterferenceRun> fewer(runs.begin(), runs.begin() + 5);
  const InterferenceTrainer less(fewer, {});
  const rim_interference_model a = all.with_p_mi(5, 1e-6), b = less.with_p_mi(5, 1e-6);
  assert_memory_equal(&a, &b, sizeof a);
}

void false_positives_are_counted(void **) {
  InterferenceRun run = plain_run();
  const std::vector<InterferenceRun> runs = interference_world(kSeed + 2);
  const InterferenceTrainer trainer(runs, {});
  const rim_interference_model model = trainer.train(runs.size()).model;
  InterferenceOutcome o = detect(model, run);
  assert_int_equal(o.detector[1].hits, 1);
  assert_int_equal(o.detector[1].false_positives, 0);
  assert_true(o.detector[1].delays_s.at(0) < 0.5);
  run.intervals.clear();
  o = detect(model, run);
  assert_int_equal(o.events, 0);
  assert_true(o.detector[1].false_positives >= 1);
}

void bad_runs_are_refused(void **) {
  const auto with = [](const InterferenceRun &run) {
    return [run] {
      const std::vector<InterferenceRun> runs{run};
      const InterferenceTrainer trainer(runs, {});
    };
  };
  InterferenceRun run = plain_run();
  run.intervals.push_back({4.5, 6.0, "hold"});
  assert_true(is_refused(with(run), "overlap"));
  run.intervals = {{4.0, 20.0, "hold"}};
  assert_true(is_refused(with(run), "leaves the log"));
  run.intervals = {{0.0, 9.0, "hold"}}; // from its first row on
  assert_true(is_refused(with(run), "add a run without interference"));
  run.intervals.clear();
  run.t_s.resize(8);
  assert_true(is_refused(with(run), "need 9"));
  const std::vector<InterferenceRun> none;
  assert_true(is_refused([&] { const InterferenceTrainer trainer(none, {}); }, "no run"));
}

void unseen_states_are_named(void **) {
  std::vector<InterferenceRun> runs{plain_run()};
  runs[0].intervals.clear();
  for (double &u : runs[0].command_mps)
    u = 0.0;
  for (double &v : runs[0].speed_mps)
    v = 0.0;
  const InterferenceTrainer trainer(runs, {});
  const InterferenceTraining t = trainer.train(1);
  assert_int_equal(t.unseen.size(), 4);
  rim_interference state;
  assert_int_equal(rimi_interference_init(&state, &t.model), RIM_OK);
}

// A tail that is known less well asks for more; so does a longer silence.
void thresholds_grow_with_caution(void **) {
  const std::vector<InterferenceRun> runs = interference_world(kSeed + 3);
  InterferenceOptions options;
  options.margin = 1.0;
  const auto open_loop = [&] {
    return InterferenceTrainer(runs, options).train(runs.size()).model.open_loop.threshold;
  };
  const double usual = open_loop();
  options.tail_z = 0.0;
  const double estimated = open_loop();
  assert_true(estimated < usual);
  options.quiet_h *= 10.0;
  assert_true(open_loop() > estimated);
}

void holds_are_put_where_it_drives(void **) {
  InterferenceRun run;
  for (int i = 0; i < 1500; ++i) { // 300 s: stands, drives from 100 s on, a gap at 200 s
    run.t_s.push_back(0.2 * i + (i >= 1000 ? 5.0 : 0.0));
    run.command_mps.push_back(i < 500 ? 0.0 : 0.2);
    run.speed_mps.push_back(run.command_mps.back());
  }
  const experiment::HeldRuns holds;
  const InterferenceRun held = experiment::with_holds(run, holds, kSeed);
  assert_true(held.intervals.size() >= 3 && held.intervals.size() <= 5);
  for (std::size_t i = 0; i < run.t_s.size(); ++i) {
    bool inside = false;
    for (const auto &interval : held.intervals)
      inside = inside || (run.t_s[i] >= interval.start_s && run.t_s[i] <= interval.end_s);
    if (inside)
      assert_true(run.command_mps[i] > 0.0 && held.speed_mps[i] <= holds.most_share * 0.2);
    else
      assert_true(held.speed_mps[i] == run.speed_mps[i]);
  }
  for (const auto &interval : held.intervals) {
    assert_true(interval.end_s - interval.start_s <= holds.duration_s);
    assert_false(interval.start_s < 200.0 && interval.end_s > 204.0); // not over the gap
  }
}

// Garwood's table.
void poisson_intervals_are_exact(void **) {
  const double low[] = {0.0, 0.0253178, 0.2422093}, high[] = {3.6888795, 5.5716434, 7.2246877};
  for (std::size_t k = 0; k < 3; ++k) {
    const RateInterval interval = poisson_interval(k);
    assert_true(std::fabs(interval.low - low[k]) < 1e-6);
    assert_true(std::fabs(interval.high - high[k]) < 1e-6);
  }
}

// Of many events: chi-squared quantiles by Wilson and Hilferty, which are good to 1e-3 there.
void poisson_intervals_hold_for_many_events(void **) {
  const auto half_chi_squared = [](double degrees, double z) {
    const double c = 2.0 / (9.0 * degrees);
    return 0.5 * degrees * std::pow(1.0 - c + z * std::sqrt(c), 3.0);
  };
  for (const std::size_t k : {690u, 750u, 5000u, 1000000u}) {
    const RateInterval interval = poisson_interval(k);
    const auto n = static_cast<double>(k);
    assert_true(interval.low < n && n < interval.high);
    assert_true(std::fabs(interval.low / half_chi_squared(2.0 * n, -1.959964) - 1.0) < 1e-4);
    assert_true(std::fabs(interval.high / half_chi_squared(2.0 * n + 2.0, 1.959964) - 1.0) < 1e-4);
  }
}

} // namespace

int main() {
  std::printf("seed %d\n", static_cast<int>(kSeed));
  const CMUnitTest tests[] = {cmocka_unit_test(labels_follow_the_rules),
                              cmocka_unit_test(training_learns_the_vehicle),
                              cmocka_unit_test(left_out_is_as_if_never_seen),
                              cmocka_unit_test(false_positives_are_counted),
                              cmocka_unit_test(bad_runs_are_refused),
                              cmocka_unit_test(unseen_states_are_named),
                              cmocka_unit_test(thresholds_grow_with_caution),
                              cmocka_unit_test(holds_are_put_where_it_drives),
                              cmocka_unit_test(poisson_intervals_are_exact),
                              cmocka_unit_test(poisson_intervals_hold_for_many_events)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
