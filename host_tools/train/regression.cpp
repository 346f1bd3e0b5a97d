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

Sums sums_of(const Rows &rows) {
  return {rows.x.transpose() * rows.x, rows.x.transpose() * rows.y};
}

// The sums of rows less kWithin of their means.
Sums within_run(const Rows &rows, const Sums &sums) {
  const double off = static_cast<double>(rows.x.rows()) * kMeansLeftOut;
  const Eigen::RowVectorXd x = rows.x.colwise().mean(), y = rows.y.colwise().mean();
  return {sums.gram - off * x.transpose() * x, sums.cross - off * x.transpose() * y};
}

void add(const Sums &sums, std::size_t run, std::vector<Sums> *folds) {
  const Eigen::Index p = sums.gram.rows(), o = sums.cross.cols();
  if (folds->empty())
    folds->assign(kFolds + 1, {Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, o)});
  for (std::size_t f = 0; f <= kFolds; ++f) {
    if (run % kFolds == f)
      continue;
    (*folds)[f].gram += sums.gram;
    (*folds)[f].cross += sums.cross;
  }
}

} // namespace

Rows Regression::fitted(std::size_t run, Across across) const {
  Rows of_run = rows(run);
  if (across == Across::within_runs && of_run.x.rows() > 0) {
    of_run.x.rowwise() -= (kWithin * of_run.x.colwise().mean()).eval();
    of_run.y.rowwise() -= (kWithin * of_run.y.colwise().mean()).eval();
  }
  return of_run;
}

void add_folds(Regression *r, bool clips) {
  struct Both {
    Sums whole, within;
  };
  parallel_in_order(
      r->runs,
      [&](std::size_t i) {
        Rows rows = r->rows(i);
        if (clips) // an outcome that is far off is no guide to what healthy ones say of each other
          rows.y = rows.y.array().max(-AGREEMENT_CLIP).min(AGREEMENT_CLIP).matrix().eval();
        Both sums{sums_of(rows), {}};
        sums.within = rows.x.rows() > 0 ? within_run(rows, sums.whole) : sums.whole;
        return sums;
      },
      [&](std::size_t i, const Both &sums) {
        add(sums.whole, i, &r->folds);
        add(sums.within, i, &r->folds_within);
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
             const std::vector<double> &ridges, Across across) {
  const std::vector<Sums> &folds = r.sums(across);
  const std::size_t n = ridges.size();
  std::vector<Fit> fits(n);
  for (std::size_t f = 0; f < kFolds; ++f) {
    for (std::size_t l = 0; l < n; ++l)
      fits[l].weight.push_back(solve(folds[f], columns, y, ridges[l]));
    for (std::size_t i = f; i < r.runs; i += kFolds) {
      const Rows rows = r.fitted(i, across);
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
    best.weight.push_back(solve(folds[kFolds], columns, y, ridges[l]));
  }
  return best;
}

} // namespace rim
