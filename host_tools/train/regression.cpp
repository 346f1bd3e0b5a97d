// SPDX-License-Identifier: MIT
// Ridge regressions over folds of runs.
#include "train/regression.hpp"

#include <Eigen/Cholesky>

#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

void take_off(double part, Rows *rows) {
  rows->x.rowwise() -= (part * rows->x.colwise().mean()).eval();
  rows->y.rowwise() -= (part * rows->y.colwise().mean()).eval();
}

} // namespace

Rows Regression::fitted(std::size_t run) const {
  Rows of_run = rows(run);
  if (within > 0.0 && of_run.x.rows() > 0)
    take_off(within, &of_run);
  return of_run;
}

void add_folds(Regression *r, bool clips) {
  parallel_in_order(
      r->runs,
      [&](std::size_t i) {
        Rows rows = r->rows(i);
        if (clips) // an outcome that is far off is no guide to what healthy ones say of each other
          rows.y = rows.y.array().max(-AGREEMENT_CLIP).min(AGREEMENT_CLIP).matrix().eval();
        if (r->within > 0.0 && rows.x.rows() > 0)
          take_off(r->within, &rows);
        return Sums{rows.x.transpose() * rows.x, rows.x.transpose() * rows.y};
      },
      [&](std::size_t i, const Sums &sums) {
        const Eigen::Index p = sums.gram.rows(), o = sums.cross.cols();
        if (i == 0)
          r->folds.assign(kFolds + 1, {Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, o)});
        for (std::size_t f = 0; f <= kFolds; ++f) {
          if (i % kFolds == f)
            continue;
          r->folds[f].gram += sums.gram;
          r->folds[f].cross += sums.cross;
        }
      });
}

Eigen::VectorXd solve(const Sums &sums, const std::vector<Eigen::Index> &columns, Eigen::Index y,
                      double ridge) {
  const auto k = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd g(k, k);
  Eigen::VectorXd c(k);
  for (Eigen::Index p = 0; p < k; ++p) {
    for (Eigen::Index q = 0; q < k; ++q)
      g(p, q) =
          sums.gram(columns[static_cast<std::size_t>(p)], columns[static_cast<std::size_t>(q)]);
    c[p] = sums.cross(columns[static_cast<std::size_t>(p)], y);
  }
  g.diagonal().array() += ridge;
  const Eigen::VectorXd w = g.ldlt().solve(c);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(sums.gram.rows());
  for (Eigen::Index p = 0; p < k; ++p)
    all[columns[static_cast<std::size_t>(p)]] = static_cast<double>(static_cast<float>(w[p]));
  return all;
}

Fit best_fit(const Regression &r, const std::vector<Eigen::Index> &columns, Eigen::Index y,
             const std::vector<double> &ridges) {
  const std::size_t n = ridges.size();
  std::vector<Fit> fits(n);
  for (std::size_t f = 0; f < kFolds; ++f) {
    for (std::size_t l = 0; l < n; ++l)
      fits[l].weight.push_back(solve(r.folds[f], columns, y, ridges[l]));
    for (std::size_t i = f; i < r.runs; i += kFolds) {
      const Rows rows = r.fitted(i);
      for (Fit &fit : fits) {
        fit.squares += (rows.y.col(y) - rows.x * fit.weight[f]).squaredNorm();
        fit.own += rows.y.col(y).squaredNorm();
      }
    }
  }
  Fit best;
  best.squares = 1e300;
  for (std::size_t l = 0; l < n; ++l) {
    if (fits[l].squares >= best.squares)
      continue;
    best = fits[l];
    best.weight.push_back(solve(r.folds[kFolds], columns, y, ridges[l]));
  }
  return best;
}

} // namespace rim
