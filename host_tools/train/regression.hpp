// SPDX-License-Identifier: MIT
// train/regression.hpp - ridge regressions of outcomes on common regressors, over folds of runs.
#ifndef TRAIN_REGRESSION_HPP
#define TRAIN_REGRESSION_HPP

#include <functional>
#include <vector>

#include "train/fitter.hpp"

namespace rim {

struct Sums {
  Eigen::MatrixXd gram;
  Eigen::MatrixXd cross;
};

// Regressors and targets (one per outcome) of one run.
struct Rows {
  Matrix x, y;
};

// What a fit explains: what differs from block to block wherever, or within runs alone. Runs differ
// by offsets, and what differs with these in a few dozen runs would explain them.
enum class Across { all_blocks, within_runs };

// Of all runs, made when they are needed; and their sums per fold left out, fold kFolds: of all.
struct Regression {
  std::size_t runs = 0;
  std::function<Rows(std::size_t)> rows;
  std::vector<Sums> folds, folds_within;

  Rows fitted(std::size_t run, Across across) const; // within runs: less kWithin of their means
  const std::vector<Sums> &sums(Across across) const {
    return across == Across::within_runs ? folds_within : folds;
  }
};

// Fills the folds; targets are clipped at AGREEMENT_CLIP where clips.
void add_folds(Regression *r, bool clips);

// A ridge that only keeps the solution finite: a relation of physics holds outside of what was
// trained too, if it is not shrunk.
constexpr double kUnshrunk = 1e-6;

// Weights of all regressors for target y, 0 but of the columns named: by kUnshrunk.
Eigen::VectorXd solve(const Sums &sums, const std::vector<Eigen::Index> &columns, Eigen::Index y);

// Weights per fold, the last of all runs; squared error over the runs left out, and that of 0.
struct Fit {
  std::vector<Eigen::VectorXd> weight;
  double squares = 0.0, own = 0.0;
};

// By solve(). Reads every run once.
Fit plain_fit(const Regression &r, const std::vector<Eigen::Index> &columns, Eigen::Index y,
              Across across = Across::all_blocks);

// A target and the regressors that may explain it, ascending.
struct Target {
  Eigen::Index y = 0;
  std::vector<Eigen::Index> columns;
};

// One fit per target, by the ridge with the least error over runs left out. Reads every run once.
// Targets share the inverse of each Gram matrix: with n regressors in all, of which every target
// leaves out a few, it takes some 2 n^3 operations per fold and ridge, whatever the number of
// targets, and n^2 per target.
std::vector<Fit> best_fits(const Regression &r, const std::vector<Target> &targets,
                           const std::vector<double> &ridges, Across across = Across::all_blocks);

} // namespace rim

#endif
