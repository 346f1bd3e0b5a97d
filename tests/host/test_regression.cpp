// SPDX-License-Identifier: MIT
// Ridge regressions of several targets at once: each as if it were alone with its own columns.
#include "check.hpp"
#include "train/regression.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

extern "C" {
#include "base/rng.h"
}

namespace {

constexpr std::uint64_t kSeed = 8640;
constexpr std::size_t kRuns = 9;
constexpr Eigen::Index kRows = 50, kRegressors = 8, kTargets = 3;

// Regressors that go together, and targets that follow from some of them; runs differ by offsets.
rim::Rows rows_of(std::size_t run) {
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, static_cast<std::uint32_t>(run));
  rim::Rows rows{rim::Matrix(kRows, kRegressors), rim::Matrix(kRows, kTargets)};
  const double offset = rimi_rng_normal(&rng);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double common = rimi_rng_normal(&rng);
    for (Eigen::Index k = 0; k < kRegressors; ++k)
      rows.x(i, k) = common + rimi_rng_normal(&rng);
    for (Eigen::Index t = 0; t < kTargets; ++t)
      rows.y(i, t) = 0.5 * rows.x(i, t) - rows.x(i, t + 3) + offset + rimi_rng_normal(&rng);
  }
  return rows;
}

rim::Regression regression() {
  rim::Regression r;
  r.runs = kRuns;
  r.rows = rows_of;
  rim::add_folds(&r, false);
  return r;
}

// The first may have all regressors, the others lack some; the last may have none.
std::vector<rim::Target> targets() {
  return {{0, {0, 1, 2, 3, 4, 5, 6, 7}}, {1, {0, 1, 4, 6, 7}}, {1, {2, 3}}, {2, {}}};
}

// Where a ridge regression has its least, X'(y - X w) = ridge w in each of its columns.
void each_target_has_the_weights_of_its_own_columns(void **) {
  const rim::Regression r = regression();
  const double ridge = 20.0;
  for (const rim::Across across : {rim::Across::all_blocks, rim::Across::within_runs}) {
    const std::vector<rim::Fit> fits = rim::best_fits(r, targets(), {ridge}, across);
    assert_int_equal(fits.size(), targets().size());
    for (std::size_t t = 0; t < fits.size(); ++t) {
      const rim::Target of = targets()[t];
      assert_int_equal(fits[t].weight.size(), rim::kFolds + 1);
      for (std::size_t fold = 0; fold <= rim::kFolds; ++fold) {
        const Eigen::VectorXd &w = fits[t].weight[fold];
        Eigen::VectorXd slope = -ridge * w;
        for (std::size_t run = 0; run < kRuns; ++run) {
          const rim::Rows rows = r.fitted(run, across);
          if (run % rim::kFolds != fold)
            slope += rows.x.transpose() * (rows.y.col(of.y) - rows.x * w);
        }
        for (Eigen::Index k = 0; k < kRegressors; ++k) {
          const bool is_own =
              std::find(of.columns.begin(), of.columns.end(), k) != of.columns.end();
          assert_true(is_own ? std::abs(slope[k]) < 1e-3 : w[k] == 0.0); // weights are of float
        }
      }
    }
  }
}

// Of each target that ridge is taken by which the runs that its fold leaves out have the least
// error; and the error is that of those runs.
void each_target_has_the_best_ridge_for_itself(void **) {
  const rim::Regression r = regression();
  const std::vector<double> ridges = {1.0, 30.0, 1e3, 1e5};
  const std::vector<rim::Fit> best = rim::best_fits(r, targets(), ridges);
  for (std::size_t t = 0; t < best.size(); ++t) {
    double least = 1e300, own = 0.0;
    for (const double ridge : ridges) {
      const rim::Fit fit = rim::best_fits(r, targets(), {ridge})[t];
      double squares = 0.0;
      own = 0.0;
      for (std::size_t run = 0; run < kRuns; ++run) {
        const rim::Rows rows = rows_of(run);
        const Eigen::VectorXd y = rows.y.col(targets()[t].y);
        squares += (y - rows.x * fit.weight[run % rim::kFolds]).squaredNorm();
        own += y.squaredNorm();
      }
      least = std::min(least, squares);
    }
    assert_true(std::abs(best[t].squares - least) < 1e-9 * least);
    assert_true(std::abs(best[t].own - own) < 1e-9 * own);
  }
}

// One target less or more changes nothing of the others but the last digits.
void a_target_does_not_depend_on_the_others(void **) {
  const rim::Regression r = regression();
  const std::vector<double> ridges = {1.0, 100.0};
  const std::vector<rim::Fit> together = rim::best_fits(r, targets(), ridges);
  for (std::size_t t = 0; t < together.size(); ++t) {
    const rim::Fit alone = rim::best_fits(r, {targets()[t]}, ridges)[0];
    for (std::size_t fold = 0; fold <= rim::kFolds; ++fold)
      assert_true((together[t].weight[fold] - alone.weight[fold]).cwiseAbs().maxCoeff() < 1e-6);
  }
  assert_true(rim::best_fits(r, {}, ridges).empty());
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const CMUnitTest tests[] = {
      cmocka_unit_test(each_target_has_the_weights_of_its_own_columns),
      cmocka_unit_test(each_target_has_the_best_ridge_for_itself),
      cmocka_unit_test(a_target_does_not_depend_on_the_others),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
