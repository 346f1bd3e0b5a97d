// SPDX-License-Identifier: MIT
// Ridge regressions over folds of runs.
#include "train/regression.hpp"

#include <algorithm>
#include <set>

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

Eigen::VectorXd solve(const Sums &sums, const std::vector<Eigen::Index> &columns, Eigen::Index y) {
  Eigen::MatrixXd g = sums.gram(columns, columns);
  g.diagonal().array() += kUnshrunk;
  const Eigen::VectorXd w = g.ldlt().solve(sums.cross(columns, y));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(sums.gram.rows());
  all(columns) = w.cast<float>().cast<double>();
  return all;
}

Fit plain_fit(const Regression &r, const std::vector<Eigen::Index> &columns, Eigen::Index y,
              Across across) {
  Fit fit;
  for (const Sums &of_fold : r.sums(across))
    fit.weight.push_back(solve(of_fold, columns, y));
  for (std::size_t i = 0; i < r.runs; ++i) {
    const Rows rows = r.fitted(i, across);
    fit.squares += (rows.y.col(y) - rows.x * fit.weight[i % kFolds]).squaredNorm();
    fit.own += rows.y.col(y).squaredNorm();
  }
  return fit;
}

namespace {

// Where the columns of a target, and the others of all targets, are among all of these.
struct Places {
  std::vector<Eigen::Index> kept, left_out;
};

std::vector<Eigen::Index> columns_of_all(const std::vector<Target> &targets) {
  std::set<Eigen::Index> all;
  for (const Target &t : targets)
    all.insert(t.columns.begin(), t.columns.end());
  return {all.begin(), all.end()};
}

Places places_of(const Target &target, const std::vector<Eigen::Index> &all) {
  Places places;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_kept = std::binary_search(target.columns.begin(), target.columns.end(), all[i]);
    (is_kept ? places.kept : places.left_out).push_back(static_cast<Eigen::Index>(i));
  }
  return places;
}

// The solution with the columns that are kept, from the inverse P of the matrix with all of them:
// P c - P_S (P_SS)^-1 (P c)_S, where S is left out and c is 0 there, by the inverse of a block
// matrix.
Eigen::VectorXd solution_without(const Eigen::MatrixXd &inverse, const Places &places,
                                 Eigen::VectorXd c) {
  const std::vector<Eigen::Index> &s = places.left_out;
  c(s).setZero();
  Eigen::VectorXd w = inverse * c;
  if (s.empty())
    return w;
  const Eigen::MatrixXd columns = inverse(Eigen::all, s);
  w -= columns * columns(s, Eigen::all).llt().solve(w(s));
  w(s).setZero();
  return w;
}

// Of every target and ridge, a column each; targets come one after the other.
Eigen::Index column_of(std::size_t target, std::size_t ridge, std::size_t ridges) {
  return static_cast<Eigen::Index>(target * ridges + ridge);
}

// Weights per fold: regressors x (target, ridge).
std::vector<Eigen::MatrixXd> ridge_weights(const std::vector<Sums> &sums,
                                           const std::vector<Target> &targets,
                                           const std::vector<double> &ridges) {
  const std::vector<Eigen::Index> all = columns_of_all(targets);
  const std::size_t n = ridges.size();
  std::vector<Places> places;
  for (const Target &t : targets)
    places.push_back(places_of(t, all));
  std::vector<Eigen::MatrixXd> weights;
  for (const Sums &of_fold : sums)
    weights.emplace_back(
        Eigen::MatrixXd::Zero(of_fold.gram.rows(), column_of(targets.size(), 0, n)));
  parallel_for(all.empty() ? 0 : sums.size() * n, [&](std::size_t i) {
    const std::size_t f = i / n, l = i % n;
    Eigen::MatrixXd g = sums[f].gram(all, all);
    g.diagonal().array() += ridges[l];
    const Eigen::MatrixXd inverse = g.llt().solve(Eigen::MatrixXd::Identity(g.rows(), g.cols()));
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const Eigen::VectorXd w =
          solution_without(inverse, places[t], sums[f].cross(all, targets[t].y));
      weights[f](all, column_of(t, l, n)) = w.cast<float>().cast<double>();
    }
  });
  return weights;
}

// Squared errors per (target, ridge), and the targets' own squares.
struct Squares {
  Eigen::RowVectorXd left, own;
};

Squares squares_of(const Rows &rows, const std::vector<Target> &targets, std::size_t ridges,
                   const Eigen::MatrixXd &weights) {
  Squares squares{{}, Eigen::RowVectorXd(targets.size())};
  Eigen::MatrixXd left = rows.x * weights;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Eigen::VectorXd y = rows.y.col(targets[t].y);
    left.middleCols(column_of(t, 0, ridges), static_cast<Eigen::Index>(ridges)).colwise() -= y;
    squares.own[static_cast<Eigen::Index>(t)] = y.squaredNorm();
  }
  squares.left = left.colwise().squaredNorm();
  return squares;
}

} // namespace

std::vector<Fit> best_fits(const Regression &r, const std::vector<Target> &targets,
                           const std::vector<double> &ridges, Across across) {
  const std::size_t n = ridges.size();
  const std::vector<Eigen::MatrixXd> weights = ridge_weights(r.sums(across), targets, ridges);
  Squares sum{Eigen::RowVectorXd::Zero(column_of(targets.size(), 0, n)),
              Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(targets.size()))};
  parallel_in_order(
      targets.empty() ? 0 : r.runs,
      [&](std::size_t i) {
        return squares_of(r.fitted(i, across), targets, n, weights[i % kFolds]);
      },
      [&](std::size_t, const Squares &of_run) {
        sum.left += of_run.left;
        sum.own += of_run.own;
      });
  std::vector<Fit> fits(targets.size());
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Eigen::Index first = column_of(t, 0, n);
    Eigen::Index best = 0;
    fits[t].squares = sum.left.segment(first, static_cast<Eigen::Index>(n)).minCoeff(&best);
    fits[t].own = sum.own[static_cast<Eigen::Index>(t)];
    for (const Eigen::MatrixXd &w : weights)
      fits[t].weight.emplace_back(w.col(first + best));
  }
  return fits;
}

} // namespace rim
