// SPDX-License-Identifier: MIT
#include "train/outside.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "train/fitter.hpp"
#include "util/parallel_for.hpp"

namespace rim {

namespace {

constexpr Eigen::Index kNear = 3; // blocks of an outcome's own past
// Exponential means of its farther past, in blocks: a command that follows a disturbance remembers
// what the last blocks do not say, and would seem to move it.
const double kFarBlocks[] = {4.0, 12.0, 36.0};
constexpr Eigen::Index kPast = kNear + static_cast<Eigen::Index>(std::size(kFarBlocks));
// What follows the commands within the block is not predicted better by those before, either. Of it
// the commands of the block itself leave less than this part of that error.
constexpr double kNotFollowed = 0.4;

// One run: what may explain an outcome, and the outcome.
struct Rows {
  Matrix x; // its own past, 1, the terms of the block before, and those of the block itself
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
  Rows rows{Matrix(run.blocks(), kPast + 1 + 2 * terms.cols()), Eigen::VectorXd(run.blocks())};
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
    rows.x.row(n).segment(kPast + 1, terms.cols()) = terms.row(i - 1);
    rows.x.row(n).tail(terms.cols()) = terms.row(i);
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

// Per fold the sums of the runs without it.
std::vector<Sums> sums_without(std::size_t runs, const std::function<Rows(std::size_t)> &rows) {
  std::vector<Sums> folds(kFolds);
  for (std::size_t r = 0; r < runs; ++r) {
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
  return folds;
}

} // namespace

Moved moved_by(const RunStore &runs, std::size_t asked,
               const std::function<Matrix(std::size_t)> &terms) {
  const auto outcome = static_cast<Eigen::Index>(asked);
  const Scale scale = scale_of(runs, outcome);
  const auto rows = [&](std::size_t r) { return rows_of(runs[r], terms(r), outcome, scale); };
  const std::vector<Sums> folds = sums_without(runs.size(), rows);
  const Eigen::Index all = folds.front().cross.size(), past = kPast + 1;
  const Eigen::Index columns[] = {past, past + (all - past) / 2, all};
  double least[std::size(columns)]; // squared error by the first columns
  std::vector<std::vector<Eigen::MatrixXd>> weights(std::size(columns));
  std::vector<Eigen::RowVectorXd> errors(std::size(columns),
                                         Eigen::RowVectorXd::Zero(std::size(kRidges)));
  for (std::size_t k = 0; k < weights.size(); ++k) {
    for (const Sums &fold : folds)
      weights[k].push_back(weights_of(fold, columns[k]));
  }
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Rows of = rows(r);
    for (std::size_t k = 0; k < errors.size(); ++k)
      errors[k] += ((of.x.leftCols(columns[k]) * weights[k][r % kFolds]).colwise() - of.y)
                       .colwise()
                       .squaredNorm();
  }
  for (std::size_t k = 0; k < errors.size(); ++k)
    least[k] = errors[k].minCoeff();
  return {std::sqrt(least[1] / least[0]), std::sqrt(least[2] / least[0])};
}

namespace {

bool is_moved(const Moved &by, bool explained) {
  return by.before < kNotMoved || (explained && by.now < kNotFollowed);
}

} // namespace

std::vector<std::size_t> not_moved(const std::vector<std::size_t> &asked,
                                   const std::vector<bool> &explained, const RunStore &runs,
                                   const std::function<Matrix(std::size_t)> &terms) {
  std::vector<char> moved(asked.size(), 0);
  parallel_for(asked.size(), [&](std::size_t i) {
    moved[i] = is_moved(moved_by(runs, asked[i], terms), explained[asked[i]]) ? 1 : 0;
  });
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (moved[i] == 0)
      found.push_back(asked[i]);
  }
  return found;
}

} // namespace rim
