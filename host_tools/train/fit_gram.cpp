// SPDX-License-Identifier: MIT
#include "train/fit_gram.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace rim {

std::vector<Gram> run_grams(const Matrix &xs, const Matrix &ys, RunSpan rows, const Gates &gates,
                            Eigen::Index prototypes) {
  const Eigen::Index d = xs.cols();
  const Eigen::Index width = 1 + d + ys.cols();
  constexpr std::size_t chunk = 1024;
  std::vector<Gram> grams(static_cast<std::size_t>(prototypes), Gram::Zero(width, width));
  // Column-major with a row of data a column: each SYRK reads its data in order.
  Eigen::MatrixXd scaled(width, static_cast<Eigen::Index>(chunk));
  for (std::size_t first = rows.begin; first < rows.end; first += chunk) {
    const std::size_t last = std::min(rows.end, first + chunk);
    for (Eigen::Index p = 0; p < prototypes; ++p) {
      Eigen::Index used = 0;
      for (std::size_t i = first; i < last; ++i) {
        for (std::size_t k = i * gates.top; k < (i + 1) * gates.top; ++k) {
          if (gates.index[k] != p || gates.weight[k] < 1e-12) {
            continue;
          }
          const double root = std::sqrt(gates.weight[k]);
          const auto row = static_cast<Eigen::Index>(i);
          scaled(0, used) = root;
          scaled.col(used).segment(1, d) = root * xs.row(row).transpose();
          scaled.col(used).tail(ys.cols()) = root * ys.row(row).transpose();
          ++used;
        }
      }
      if (used > 0) {
        grams[static_cast<std::size_t>(p)].selfadjointView<Eigen::Lower>().rankUpdate(
            scaled.leftCols(used));
      }
    }
  }
  for (Gram &g : grams) {
    g.triangularView<Eigen::StrictlyUpper>() = g.transpose();
  }
  return grams;
}

Matrix ridge_maps(const Gram &gram, const RidgeShape &shape, const Matrix &prior, double ridge) {
  const Eigen::Index d = shape.inputs;
  const Eigen::Index o = shape.outputs;
  const double n = gram(0, 0);
  if (!(n > 1e-9)) {
    return prior;
  }
  const Eigen::VectorXd mean_x = gram.col(0).segment(1, d) / n;
  const Eigen::VectorXd mean_y = gram.col(0).tail(o) / n;
  const auto prior_a = prior.rightCols(d);
  Eigen::MatrixXd sxx = gram.block(1, 1, d, d) - n * mean_x * mean_x.transpose();
  const Eigen::MatrixXd sxy = gram.block(1, 1 + d, d, o) - n * mean_x * mean_y.transpose();
  const Eigen::MatrixXd right = sxy - sxx * prior_a.transpose();
  sxx.diagonal() += ridge * shape.input_error;
  const Eigen::MatrixXd inverse = sxx.ldlt().solve(Eigen::MatrixXd::Identity(d, d));
  Eigen::MatrixXd delta = inverse * right; // d x o
  for (Eigen::Index j = 0; j < o && !shape.exclude.empty(); ++j) {
    const int e = shape.exclude[static_cast<std::size_t>(j)];
    if (e >= 0) {
      // The solution with one coefficient held at zero, from the free one (block inverse).
      delta.col(j) -= inverse.col(e) * (delta(e, j) / inverse(e, e));
      delta(e, j) = 0.0;
    }
  }
  Matrix maps(o, 1 + d);
  maps.rightCols(d) = prior_a + delta.transpose();
  const Eigen::VectorXd prior_mean = prior.col(0) + prior_a * mean_x;
  const Eigen::VectorXd mean = (n * mean_y + prior_mean) / (n + 1.0);
  maps.col(0) = mean - maps.rightCols(d) * mean_x;
  return maps;
}

Matrix ridge_maps(const Gram &gram, const RidgeShape &shape, const Matrix &prior,
                  const std::vector<double> &ridge) {
  std::vector<double> distinct(ridge);
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  Matrix maps(shape.outputs, 1 + shape.inputs);
  for (const double value : distinct) {
    const Matrix all = ridge_maps(gram, shape, prior, value);
    for (Eigen::Index j = 0; j < shape.outputs; ++j) {
      if (ridge[static_cast<std::size_t>(j)] == value) {
        maps.row(j) = all.row(j);
      }
    }
  }
  return maps;
}

Eigen::VectorXd squared_error(const Gram &gram, const RidgeShape &shape, const Matrix &maps) {
  const Eigen::Index width = 1 + shape.inputs;
  const Eigen::MatrixXd product = maps * gram.topLeftCorner(width, width); // o x (1 + d)
  const auto cross = gram.topRightCorner(width, shape.outputs);
  Eigen::VectorXd error(shape.outputs);
  for (Eigen::Index j = 0; j < shape.outputs; ++j) {
    const double e = product.row(j).dot(maps.row(j)) - 2.0 * maps.row(j).dot(cross.col(j)) +
                     gram(width + j, width + j);
    error[j] = std::max(e, 0.0); // rounding where the fit is exact
  }
  return error;
}

} // namespace rim
