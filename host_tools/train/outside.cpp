// SPDX-License-Identifier: MIT
#include "train/outside.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "util/parallel_for.hpp"

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
constexpr Eigen::Index kPast = 3; // blocks of an outcome's own past
// Part of the error of its own past that the commands before may take off a disturbance: the
// disturbances of five simulated machines leave .98 to 1.01, what the machines bring about .53 to
// .88.
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
  for (Eigen::Index i = 1; i < run.blocks(); ++i) {
    neighbours = run.follows[static_cast<std::size_t>(i)] ? neighbours + 1 : 0;
    if (neighbours < kPast)
      continue;
    for (Eigen::Index k = 0; k < kPast; ++k)
      rows.x(n, k) = y[i - 1 - k];
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

// Squared error of runs left out, from the first columns alone, per ridge.
double least_squares(const std::vector<Rows> &runs, const std::vector<Sums> &folds,
                     Eigen::Index columns) {
  double least = 1e300;
  for (const double ridge : kRidges) {
    double squares = 0.0;
    for (std::size_t f = 0; f < kFolds; ++f) {
      Eigen::MatrixXd g = folds[f].gram.topLeftCorner(columns, columns);
      g.diagonal().array() += ridge;
      const Eigen::VectorXd w = g.ldlt().solve(folds[f].cross.head(columns));
      for (std::size_t r = f; r < runs.size(); r += kFolds)
        squares += (runs[r].y - runs[r].x.leftCols(columns) * w).squaredNorm();
    }
    least = std::min(least, squares);
  }
  return least;
}

bool is_moved(const RunStore &runs, Eigen::Index outcome,
              const std::function<Matrix(std::size_t)> &terms) {
  const Scale scale = scale_of(runs, outcome);
  std::vector<Rows> rows;
  for (std::size_t r = 0; r < runs.size(); ++r)
    rows.push_back(rows_of(runs[r], terms(r), outcome, scale));
  const Eigen::Index p = rows.front().x.cols();
  std::vector<Sums> folds(kFolds, {Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p)});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Eigen::MatrixXd gram = rows[r].x.transpose() * rows[r].x;
    const Eigen::VectorXd cross = rows[r].x.transpose() * rows[r].y;
    for (std::size_t f = 0; f < kFolds; ++f) {
      if (r % kFolds == f)
        continue;
      folds[f].gram += gram;
      folds[f].cross += cross;
    }
  }
  return least_squares(rows, folds, p) <
         kNotMoved * kNotMoved * least_squares(rows, folds, kPast + 1);
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
