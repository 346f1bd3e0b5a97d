// SPDX-License-Identifier: MIT
// Few runs to learn from: each is judged by models that are learnt again without it, so that the
// alarm is one that a fresh run rarely reaches.
#include "learnt.hpp"
#include "made_vehicle.hpp"
#include "replay/replay.hpp"
#include "train/trainer.hpp"

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 8600; // of the first run
constexpr std::size_t kRuns = 8;
constexpr Eigen::Index kOutcome = 0;           // s.lag_m
constexpr double kShift = 5.0;                 // m

std::vector<rim::Log> vehicles(std::uint64_t first, std::size_t n, const MadeVehicle &made) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < n; ++i)
    logs.push_back(made_vehicle(first + i, made));
  return logs;
}

const Learnt &whole() {
  static const Learnt l = learn(vehicles(kSeed, kRuns, {}));
  return l;
}

void a_run_stands_behind_the_others(void **) {
  const rim::RunStore some = whole().runs.without(2);
  assert_int_equal(some.size(), kRuns - 1);
  assert_int_equal(some.all(), kRuns);
  assert_int_equal(some.end() - some.begin(), kRuns - 1);
  const std::size_t order[kRuns] = {0, 1, 3, 4, 5, 6, 7, 2};
  for (std::size_t k = 0; k < kRuns; ++k) {
    assert_true(some[k].first == whole().runs[order[k]].first);
    assert_true(some.wide(k)->terms == whole().runs.wide(order[k])->terms);
    assert_int_equal(some.fold(k), k < kRuns - 1 ? k % rim::kFolds : rim::kFolds);
  }
}

// The runs with their wide matrices.
std::vector<rim::BlockRun> complete_runs() {
  std::vector<rim::BlockRun> runs;
  for (std::size_t r = 0; r < kRuns; ++r) {
    runs.push_back(whole().runs[r]);
    const auto wide = whole().runs.wide(r);
    runs.back().terms = wide->terms;
    runs.back().early = wide->early;
    runs.back().late = wide->late;
  }
  return runs;
}

// Every wide matrix of every run comes back as it was: from memory, and from the file.
void wide_matrices_come_back_from_a_file(void **) {
  const std::vector<rim::BlockRun> runs = complete_runs();
  const auto bytes = static_cast<std::size_t>(runs[0].terms.size()) * sizeof(double);
  for (const std::size_t room : {std::size_t{0}, kRuns / 2 * bytes}) {
    rim::RunStore store(kRuns, room);
    for (std::size_t r = 0; r < kRuns; ++r)
      store.put(r, runs[r]);
    for (std::size_t r = 0; r < kRuns; ++r) {
      const auto wide = store.wide(r);
      assert_true(wide->terms.size() > 0 && wide->terms == runs[r].terms);
      assert_true(wide->early.size() > 0 && wide->early == runs[r].early);
      assert_true(wide->late.size() > 0 && wide->late == runs[r].late);
    }
  }
}

// What is learnt without run 0, whose outcome is shifted.
struct Without {
  rim::Basis basis = whole().basis;
  rim::Behaviour behaviour;
  rim::Agreement agreement;
};

Without without_run_0(double shift) {
  std::vector<rim::BlockRun> runs = complete_runs();
  runs[0].outcome.col(kOutcome).array() += shift;
  const rim::RunStore store = rim::RunStore(runs).without(0);
  Without w;
  const auto terms = static_cast<std::size_t>(runs[0].terms.cols()); // as before it was learnt
  w.basis.terms.resize(terms);
  w.basis.center.resize(terms);
  w.basis.inverse_sd.resize(terms);
  w.basis.states.clear();
  w.basis.rates.clear();
  const auto &integrands = whole().options.integrands;
  w.behaviour = rim::fit_behaviour(&w.basis, whole().layout, integrands, store,
                                   kBlockRows * whole().options.period_s);
  w.agreement = rim::fit_agreement(whole().layout, w.basis, integrands, store, w.behaviour.residual,
                                   w.behaviour.predicted, {}, false);
  return w;
}

const Without &plainly() {
  static const Without w = without_run_0(0.0);
  return w;
}

void a_run_that_is_only_judged_teaches_nothing(void **) {
  const Without &plain = plainly(), shifted = without_run_0(kShift);
  assert_true(plain.basis.center == shifted.basis.center);
  for (std::size_t t = 0; t < plain.behaviour.targets.size(); ++t) {
    assert_true(plain.behaviour.targets[t].weight == shifted.behaviour.targets[t].weight);
    assert_true(plain.behaviour.targets[t].error == shifted.behaviour.targets[t].error);
  }
  assert_true(plain.agreement.row == shifted.agreement.row);
  assert_true(plain.agreement.error == shifted.agreement.error);
  const std::size_t run_0 = kRuns - 1;
  assert_true(plain.behaviour.predicted[run_0] == shifted.behaviour.predicted[run_0]);
  const Eigen::ArrayXd by = shifted.behaviour.residual[run_0].col(kOutcome) -
                            plain.behaviour.residual[run_0].col(kOutcome);
  assert_true((by - kShift).abs().maxCoeff() < 1e-9);
}

void it_is_predicted_as_well_as_the_others(void **) {
  const Without &w = plainly();
  const double said = w.behaviour.targets[kOutcome].error;
  const Eigen::VectorXd e = w.behaviour.residual.back().col(kOutcome);
  const double error = std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
  print_message("a run that is only judged: error %.2f of the others'\n", error / said);
  assert_true(error > 0.5 * said && error < 2.0 * said);
}

// Runs differ by offsets, of which five runs tell little. Over two sets of five, or eight with
// RIM_LONG (`make test-long`), the promise of one alarm in six healthy flights holds.
void a_few_runs_keep_their_promise(void **) {
  constexpr std::size_t taught = 5, flights = 12;
  const std::size_t sets = std::getenv("RIM_LONG") != nullptr ? 8 : 2;
  MadeVehicle made;
  made.rows = 1200;
  made.run_spread = 0.2;
  std::size_t alarms = 0;
  for (std::size_t set = 0; set < sets; ++set) {
    const std::uint64_t first = kSeed + 100 * (set + 1);
    const rim::Training training = rim::train(vehicles(first, taught, made), {});
    assert_true(std::abs(training.promise.rate - 1.0 / 6.0) < 1e-9);
    rim::Replayer replayer(rim::make_image(training.plan), "made");
    for (const rim::Log &flight : vehicles(first + 50, flights, made))
      alarms += replayer.replay(flight, {}).raised > 0 ? 1 : 0;
  }
  print_message("seed %u: %zu of %zu healthy flights alarm\n", static_cast<unsigned>(kSeed), alarms,
                sets * flights);
  assert_true(6 * alarms <= sets * flights);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(a_run_stands_behind_the_others),
      cmocka_unit_test(wide_matrices_come_back_from_a_file),
                              cmocka_unit_test(a_run_that_is_only_judged_teaches_nothing),
                              cmocka_unit_test(it_is_predicted_as_well_as_the_others),
                              cmocka_unit_test(a_few_runs_keep_their_promise)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
