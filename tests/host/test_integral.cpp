// SPDX-License-Identifier: MIT
// Outcomes as integrals of others: a reading that is late is told from a rate that is biased.
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
#include <vector>

#include "train/integral.hpp"

extern "C" {
#include "base/rng.h"
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 9100;
constexpr std::size_t kRuns = 12;
constexpr Eigen::Index kBlocks = 80, kRowsPerBlock = 10;
constexpr double kGain = 0.2; // of the integral, per row
constexpr double kNoise = 0.001;

// A rate that changes slowly, read exactly, and its integral, read `late` rows late; between the
// readings the rate stays. From block 40 on the rate's reading is biased. Beside, the integral
// gains `drift` per row, of which nothing reads.
rim::BlockRun turning(std::uint64_t seed, double late, double bias, double drift = 0.0) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 3);
  const double n = static_cast<double>(kRowsPerBlock), phase = 6.0 * rimi_rng_uniform(&rng);
  rim::BlockRun run;
  run.outcome = rim::Matrix::Zero(kBlocks, 2);
  run.context = run.outcome;
  run.early = rim::Matrix::Zero(kBlocks, 1);
  run.late = run.early;
  run.time_s = Eigen::VectorXd::LinSpaced(kBlocks, 0.0, static_cast<double>(kBlocks - 1));
  run.follows.assign(static_cast<std::size_t>(kBlocks), true);
  run.follows[0] = false;
  double angle = 0.0, before = 0.0;
  for (Eigen::Index b = 0; b < kBlocks; ++b) {
    double mean = 0.0, moment = 0.0;
    for (Eigen::Index k = 0; k < kRowsPerBlock; ++k) {
      const double t = static_cast<double>(b * kRowsPerBlock + k);
      const double rate = std::sin(t / 31.0 + phase) + 0.5 * std::sin(t / 13.0);
      angle += kGain * 0.5 * (rate + before) + drift;
      before = rate;
      const double read = rate + (b >= kBlocks / 2 ? bias : 0.0);
      mean += read / n;
      moment += ((static_cast<double>(k) + 0.5) / n - 0.5) * read / n;
      run.outcome(b, 0) += (angle - late * kGain * rate + kNoise * rimi_rng_normal(&rng)) / n;
    }
    run.outcome(b, 1) = mean;
    run.early(b, 0) = mean - 2.0 * moment;
    run.late(b, 0) = mean + 2.0 * moment;
  }
  run.context = run.outcome;
  return run;
}

struct Learnt {
  rim::Agreement a;
  rim::Integral plain, lagging, whole; // of all runs; whole: with a constant, where that is better
  double left_plain, left_lagging, left_whole; // largest remainders of a run not learnt from
};

Learnt learn(double late, double bias, double drift = 0.0) {
  std::vector<rim::BlockRun> runs;
  for (std::size_t r = 0; r < kRuns; ++r)
    runs.push_back(turning(kSeed + r, late, 0.0, drift));
  const rim::RunStore store(runs);
  rim::Layout layout;
  layout.feature_names = {"s.angle_rad", "s.rate_radps"};
  layout.outcome_names = layout.feature_names;
  layout.outcome_feature = {0, 1};
  layout.command = {0, 0};
  Learnt l;
  l.a.integrands = {{AGREEMENT_PLAIN, 1, 1}};
  rim::learn_integrands(&l.a, layout, store);
  const rim::Regression changes = rim::integral_regression(l.a, store);
  const auto columns = rim::choose_integrands(changes, l.a, 0, {0});
  assert_int_equal(columns.size(), 1);
  const rim::Fit fit = rim::plain_fit(changes, columns, 0);
  l.plain = {fit.weight.back(), 0.0};
  const std::vector<rim::Integral> of_folds = rim::with_lag(l.a, store, 0, columns, fit.weight);
  l.lagging = of_folds.back();
  l.whole = rim::with_constant(l.a, store, 0, of_folds).back();
  const rim::RunStore fresh({turning(kSeed + 100, late, bias, drift)});
  l.left_plain = rim::summed(l.a, fresh, 0, 0, l.plain).remains.cwiseAbs().maxCoeff();
  const rim::Summed sum = rim::summed(l.a, fresh, 0, 0, l.lagging);
  l.left_lagging = sum.remains.cwiseAbs().maxCoeff();
  l.left_whole = rim::summed(l.a, fresh, 0, 0, l.whole).remains.cwiseAbs().maxCoeff();
  // What remains and what was integrated are the outcome's change together, but for what leaks.
  const Eigen::VectorXd whole = fresh[0].outcome.col(0).array() - fresh[0].outcome(0, 0);
  assert_true((sum.remains + sum.integrated - whole).cwiseAbs().maxCoeff() <
              0.05 * std::abs(whole.maxCoeff() - whole.minCoeff()));
  return l;
}

void a_late_reading_is_told(void **) {
  for (const double late : {-3.0, -0.5, 0.0, 0.5, 3.0, 8.0}) {
    const Learnt l = learn(late, 0.0);
    print_message("seed %llu: %.1f rows late, found %.3f; left %.4f, without a lag %.4f rad\n",
                  static_cast<unsigned long long>(kSeed), late,
                  l.lagging.lag * static_cast<double>(kRowsPerBlock), l.left_lagging, l.left_plain);
    assert_true(std::abs(l.lagging.lag * static_cast<double>(kRowsPerBlock) - late) < 0.1);
    assert_true(l.left_lagging < 0.02);
    assert_true(std::abs(late) < 0.1 || l.left_plain > 2.0 * l.left_lagging);
  }
}

// A block is as late as a reading may be: the flight code refuses more.
void a_lag_is_bounded(void **) {
  const Learnt l = learn(25.0, 0.0);
  assert_true(std::abs(l.lagging.lag) <= AGREEMENT_LAG);
}

// A bias of the rate is not taken for a lag: it adds up.
void a_biased_rate_remains(void **) {
  const Learnt l = learn(0.5, 0.02);
  const double adds_up = kGain * 0.02 * static_cast<double>(kBlocks / 2 * kRowsPerBlock);
  print_message("a bias adds up to %.3f, left %.3f rad\n", adds_up, l.left_lagging);
  assert_true(std::abs(l.left_lagging - adds_up) < 0.1 * adds_up);
}

// What adds up in every run and no reading says is learnt, and nothing else.
void a_constant_rate_is_learnt(void **) {
  for (const double drift : {0.0, 0.001, -0.01}) {
    const Learnt l = learn(0.5, 0.0, drift);
    print_message("%.3f rad per row beside the rate: found %.5f; left %.4f, without it %.4f rad\n",
                  drift, l.whole.constant / static_cast<double>(kRowsPerBlock), l.left_whole,
                  l.left_lagging);
    if (std::abs(drift) < 1e-9) {
      assert_true(std::abs(l.whole.constant) < 1e-12);
      continue;
    }
    assert_true(std::abs(l.whole.constant / static_cast<double>(kRowsPerBlock) - drift) <
                0.02 * std::abs(drift));
    assert_true(l.left_whole < 0.03);
    assert_true(l.left_lagging > 10.0 * l.left_whole);
  }
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_late_reading_is_told), cmocka_unit_test(a_lag_is_bounded),
      cmocka_unit_test(a_biased_rate_remains), cmocka_unit_test(a_constant_rate_is_learnt)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
