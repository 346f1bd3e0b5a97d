// SPDX-License-Identifier: MIT
// train/fitter.hpp - ridge regressions of the outcomes on the terms of the basis, by runs left out.
#pragma once

#include <cstddef>
#include <vector>

#include "train/run_store.hpp"

namespace rim {

// Part of a run's own means that is left out of a fit: what is slow has only as many independent
// values as there are runs, and runs differ by offsets, which whatever happens to differ with them
// would explain.
constexpr double kWithin = 0.95;
constexpr double kMeansLeftOut = 1.0 - (1.0 - kWithin) * (1.0 - kWithin); // of their squares

inline constexpr double kRidges[] = {1e-5, 1e-3, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5};
// An outcome that follows its command closely is told from it by differences of filters that hardly
// differ, which the larger ridges take for noise. Those below kUsualRidge must lower the error of
// all others by so much: their large weights also answer what no healthy run has done, and a closed
// loop does that where it answers a fault.
constexpr double kUsualRidge = 0.1, kSlightMustWin = 0.3;

// Place of the ridge to take, by the errors with each.
std::size_t best_ridge(const std::vector<double> &errors);

// The sums over the runs of a fold, less those left out.
struct Fold {
  Eigen::MatrixXd gram, cross;
};

// Which terms explain which targets, columns of Fitter::y().
struct Question {
  std::vector<Eigen::Index> terms;
  Eigen::Index first, targets;
};

// The runs' terms are made when they are needed, run by run: those of all are too many to hold.
class Fitter {
public:
  // rolled: the values of the states that are terms of the basis, of every run; nullptr: none.
  Fitter(const Basis &basis, const RunStore &runs, const std::vector<Matrix> *rolled);

  // errors[question][target - first][ridge], root mean square over runs left out; then, from
  // errors[question][targets] on, those within runs alone.
  std::vector<std::vector<std::vector<double>>>
  errors(const std::vector<Question> &questions) const;
  // Weights of all terms for a target; fold kFolds: all runs.
  Eigen::VectorXd weights(const std::vector<Eigen::Index> &terms, double ridge, std::size_t fold,
                          Eigen::Index target) const;
  // Standardised terms of a run, blocks x terms.
  Matrix x(std::size_t run) const;
  const Matrix &y(std::size_t run) const { return y_[run]; } // less mean()
  const Eigen::RowVectorXd &mean() const { return mean_; }
  // What errors() says of a target that nothing explains.
  double spread(Eigen::Index target) const;
  const RunStore &runs() const { return runs_; }

private:
  // weights[question][fold and ridge]: of runs without the fold.
  std::vector<std::vector<Eigen::MatrixXd>>
  all_weights(const std::vector<Question> &questions) const;

  const Basis &basis_;
  const RunStore &runs_;
  const std::vector<Matrix> *rolled_;
  std::vector<Matrix> y_;
  std::vector<Fold> folds_;
  Eigen::RowVectorXd mean_;
};

// Some columns.
Matrix columns_of(const Matrix &m, const std::vector<Eigen::Index> &terms);

// What chooses: squares within runs, and a part of the squared mean of each run, which the run's
// own effects can explain. *within: the former alone.
double run_error(const Eigen::VectorXd &e, double *within);

// With the means in full; error, within: roots of means of run_error() over the runs.
double whole_error(double error, double within);

} // namespace rim
