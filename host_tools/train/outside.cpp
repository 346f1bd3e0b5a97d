// SPDX-License-Identifier: MIT
#include "train/outside.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "util/parallel_for.hpp"

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
constexpr Eigen::Index kNear = 3; // blocks of an outcome's own past
// Exponential means of its farther past, in blocks: a command that follows a disturbance remembers
// what the last blocks do not say, and would seem to move it.
const double kFarBlocks[] = {4.0, 12.0, 36.0};
constexpr Eigen::Index kPast = kNear + static_cast<Eigen::Index>(std::size(kFarBlocks));
// The error that a disturbance's own past leaves stays, but for chance, where the commands before
// are used as well; that of what a machine brings about falls clearly below this part of it.
constexpr double kNotMoved = 0.97;
const double kRidges[] = {0.1, 1.0, 10.0, 100.0};

// One run: what may explain an outcome, and the outcome.
struct Rows {
  Matrix x; // its own past, 1, and the terms of the block before
  Eigen::VectorXd y;
};

struct Scale {
  double mean = 0.0, sd = 1.0;
};

Scale scale_of(const RunStore &runs, Eigen::Index outcome) {
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (const BlockRun &run : runs) {
    n += static_cast<double>(run.blocks());
    sum += run.outcome.col(outcome).sum();
  }
  const double mean = sum / std::max(n, 1.0);
  for (const BlockRun &run : runs)
    squares += (run.outcome.col(outcome).array() - mean).square().sum();
  return {mean, std::sqrt(squares / std::max(n, 1.0)) + 1e-12 * (1.0 + std::abs(mean))};
}

// Blocks with kPast neighbours before them.
Rows rows_of(const BlockRun &run, const Matrix &terms, Eigen::Index outcome, const Scale &scale) {
  const Eigen::VectorXd y = (run.outcome.col(outcome).array() - scale.mean) / scale.sd;
  Rows rows{Matrix(run.blocks(), kPast + 1 + terms.cols()), Eigen::VectorXd(run.blocks())};
  Eigen::Index n = 0, neighbours = 0;
  Eigen::RowVectorXd far = Eigen::RowVectorXd::Constant(kPast - kNear, y[0]);
  for (Eigen::Index i = 1; i < run.blocks(); ++i) {
    neighbours = run.follows[static_cast<std::size_t>(i)] ? neighbours + 1 : 0;
    for (Eigen::Index k = 0; k < far.size(); ++k)
      far[k] += (y[i - 1] - far[k]) / kFarBlocks[k];
    if (neighbours < kNear)
      continue;
    for (Eigen::Index k = 0; k < kNear; ++k)
      rows.x(n, k) = y[i - 1 - k];
    rows.x.row(n).segment(kNear, far.size()) = far;
    rows.x(n, kPast) = 1.0;
    rows.x.row(n).tail(terms.cols()) = terms.row(i - 1);
    rows.y[n++] = y[i];
  }
  rows.x.conservativeResize(n, rows.x.cols());
  rows.y.conservativeResize(n);
  return rows;
}

struct Sums {
  Eigen::MatrixXd gram;
  Eigen::VectorXd cross;
};

// Weights from the first columns alone: one column of the matrix per ridge.
Eigen::MatrixXd weights_of(const Sums &sums, Eigen::Index columns) {
  Eigen::MatrixXd weights(columns, static_cast<Eigen::Index>(std::size(kRidges)));
  for (Eigen::Index l = 0; l < weights.cols(); ++l) {
    Eigen::MatrixXd g = sums.gram.topLeftCorner(columns, columns);
    g.diagonal().array() += kRidges[l];
    weights.col(l) = g.ldlt().solve(sums.cross.head(columns));
  }
  return weights;
}

// Whether the commands before lower the error of runs left out. Two passes over the runs, whose
// terms are not held.
bool is_moved(const RunStore &runs, Eigen::Index outcome,
              const std::function<Matrix(std::size_t)> &terms) {
  const Scale scale = scale_of(runs, outcome);
  const auto rows = [&](std::size_t r) { return rows_of(runs[r], terms(r), outcome, scale); };
  std::vector<Sums> folds(kFolds);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Rows of = rows(r);
    const Eigen::MatrixXd gram = of.x.transpose() * of.x;
    const Eigen::VectorXd cross = of.x.transpose() * of.y;
    for (std::size_t f = 0; f < kFolds; ++f) {
      if (r == 0)
        folds[f] = {Eigen::MatrixXd::Zero(gram.rows(), gram.cols()),
                    Eigen::VectorXd::Zero(cross.size())};
      if (r % kFolds == f)
        continue;
      folds[f].gram += gram;
      folds[f].cross += cross;
    }
  }
  std::vector<Eigen::MatrixXd> with, without;
  for (const Sums &fold : folds) {
    with.push_back(weights_of(fold, fold.cross.size()));
    without.push_back(weights_of(fold, kPast + 1));
  }
  Eigen::RowVectorXd by_all = Eigen::RowVectorXd::Zero(with.front().cols()), by_past = by_all;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Rows of = rows(r);
    const std::size_t f = r % kFolds;
    by_all += ((of.x * with[f]).colwise() - of.y).colwise().squaredNorm();
    by_past += ((of.x.leftCols(kPast + 1) * without[f]).colwise() - of.y).colwise().squaredNorm();
  }
  return by_all.minCoeff() < kNotMoved * kNotMoved * by_past.minCoeff();
}

} // namespace

std::vector<std::size_t> not_moved(const std::vector<std::size_t> &asked, const RunStore &runs,
                                   const std::function<Matrix(std::size_t)> &terms) {
  std::vector<char> moved(asked.size(), 0);
  parallel_for(asked.size(), [&](std::size_t i) {
    moved[i] = is_moved(runs, static_cast<Eigen::Index>(asked[i]), terms) ? 1 : 0;
  });
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (moved[i] == 0)
      found.push_back(asked[i]);
  }
  return found;
}

} // namespace rim
