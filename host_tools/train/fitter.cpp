// SPDX-License-Identifier: MIT
#include "train/fitter.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "train/rolled.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

constexpr double kRunMeanWeight = 0.2; // of a run's own mean error, in the error that chooses

struct Moments {
  Eigen::MatrixXd gram;  // terms x terms, within runs
  Eigen::MatrixXd cross; // terms x targets: y, and y less its first reading
};

Matrix standard_terms(const Basis &basis, const Matrix &terms) {
  Matrix x = terms;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    x.col(i) = ((x.col(i).array() - basis.center[k]) * basis.inverse_sd[k])
                   .max(-BASIS_CLIP)
                   .min(BASIS_CLIP);
  }
  return x;
}

// A run's targets: outcomes, scatter; then outcomes less their first readings.
Matrix targets_of(const BlockRun &run) {
  const Eigen::Index o = run.outcome.cols();
  Matrix y(run.blocks(), 3 * o);
  y.leftCols(o) = run.outcome;
  y.middleCols(o, o) = run.scatter;
  y.rightCols(o) = run.outcome.rowwise() - run.first.transpose();
  return y;
}

// The mean of the runs is kept apart by 1 - kWithin only.
Moments moments_of(const Matrix &x, const Matrix &y) {
  const double n = static_cast<double>(x.rows());
  const double off = n * kMeansLeftOut;
  const Eigen::RowVectorXd mx = x.colwise().mean(), my = y.colwise().mean();
  Moments m;
  m.gram.noalias() = x.transpose() * x;
  m.gram.noalias() -= off * mx.transpose() * mx;
  m.cross.noalias() = x.transpose() * y;
  m.cross.noalias() -= off * mx.transpose() * my;
  return m;
}

Eigen::MatrixXd sub_gram(const Eigen::MatrixXd &gram, const std::vector<Eigen::Index> &terms) {
  const auto k = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd g(k, k);
  for (Eigen::Index i = 0; i < k; ++i) {
    for (Eigen::Index j = 0; j < k; ++j)
      g(i, j) = gram(terms[static_cast<std::size_t>(i)], terms[static_cast<std::size_t>(j)]);
  }
  return g;
}

Eigen::MatrixXd sub_rows(const Eigen::MatrixXd &m, const std::vector<Eigen::Index> &terms) {
  Eigen::MatrixXd s(static_cast<Eigen::Index>(terms.size()), m.cols());
  for (std::size_t i = 0; i < terms.size(); ++i)
    s.row(static_cast<Eigen::Index>(i)) = m.row(terms[i]);
  return s;
}

// By Cholesky: the ridge makes it definite, and of hundreds of terms this is where the time goes.
Eigen::MatrixXd ridge_weights(Eigen::MatrixXd gram, double ridge, const Eigen::MatrixXd &cross) {
  gram.diagonal().array() += ridge;
  return gram.llt().solve(cross);
}

} // namespace

Matrix columns_of(const Matrix &m, const std::vector<Eigen::Index> &terms) {
  Matrix some(m.rows(), static_cast<Eigen::Index>(terms.size()));
  for (Eigen::Index i = 0; i < some.cols(); ++i)
    some.col(i) = m.col(terms[static_cast<std::size_t>(i)]);
  return some;
}

double run_error(const Eigen::VectorXd &e, double *within) {
  const double mean = e.mean();
  *within = (e.array() - mean).square().mean();
  return *within + kRunMeanWeight * mean * mean;
}

double whole_error(double error, double within) {
  const double means = (error * error - within * within) / kRunMeanWeight;
  return std::sqrt(std::max(within * within + means, 0.0));
}

std::size_t best_ridge(const std::vector<double> &errors) {
  const auto first = static_cast<std::ptrdiff_t>(
      std::find(std::begin(kRidges), std::end(kRidges), kUsualRidge) - std::begin(kRidges));
  const auto usual = std::min_element(errors.begin() + first, errors.end());
  const auto slight = std::min_element(errors.begin(), errors.begin() + first);
  const bool is_slight = *slight < (1.0 - kSlightMustWin) * *usual;
  return static_cast<std::size_t>((is_slight ? slight : usual) - errors.begin());
}

Fitter::Fitter(const Basis &basis, const RunStore &runs, const std::vector<Matrix> *rolled)
    : basis_(basis), runs_(runs), rolled_(rolled) {
  const std::size_t n = runs.size();
  y_.resize(runs.all());
  parallel_for(y_.size(), [&](std::size_t r) { y_[r] = targets_of(runs[r]); });
  mean_ = Eigen::RowVectorXd::Zero(y_.front().cols());
  for (std::size_t r = 0; r < n; ++r)
    mean_ += y_[r].colwise().mean() / static_cast<double>(n);
  for (Matrix &y : y_)
    y.rowwise() -= mean_; // numbers near zero: sums keep their digits
  const auto p = static_cast<Eigen::Index>(basis.terms.size());
  folds_.assign(kFolds + 1, {Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, mean_.cols())});
  parallel_in_order(
      n, [&](std::size_t r) { return moments_of(x(r), y_[r]); },
      [&](std::size_t r, const Moments &m) {
        for (std::size_t f = 0; f <= kFolds; ++f) {
          if (r % kFolds == f)
            continue;
          folds_[f].gram += m.gram;
          folds_[f].cross += m.cross;
        }
      });
}

Matrix Fitter::x(std::size_t run) const {
  const std::shared_ptr<const WideBlocks> wide = runs_.wide(run);
  return standard_terms(
      basis_, rolled_ == nullptr ? wide->terms : with_rolled(basis_, wide->terms, (*rolled_)[run]));
}

std::vector<std::vector<Eigen::MatrixXd>>
Fitter::all_weights(const std::vector<Question> &questions) const {
  const std::size_t ridges = std::size(kRidges);
  std::vector<std::vector<Eigen::MatrixXd>> weights(
      questions.size(), std::vector<Eigen::MatrixXd>(kFolds * ridges));
  const std::size_t folds = std::min(kFolds, runs_.size()); // the others leave out no run
  parallel_for(questions.size() * folds, [&](std::size_t i) {
    const Question &q = questions[i / folds];
    const std::size_t f = i % folds;
    const Eigen::MatrixXd gram = sub_gram(folds_[f].gram, q.terms);
    const Eigen::MatrixXd cross =
        sub_rows(folds_[f].cross, q.terms).middleCols(q.first, q.targets);
    for (std::size_t l = 0; l < ridges; ++l)
      weights[i / folds][f * ridges + l] = ridge_weights(gram, kRidges[l], cross);
  });
  return weights;
}

std::vector<std::vector<std::vector<double>>>
Fitter::errors(const std::vector<Question> &questions) const {
  const std::size_t ridges = std::size(kRidges);
  const auto weights = all_weights(questions);
  // Of one run: [question](target, ridge).
  using OfRun = std::vector<Eigen::MatrixXd>;
  const auto of_run = [&](std::size_t r) {
    const std::size_t f = r % kFolds;
    const Matrix all = x(r);
    OfRun of(questions.size());
    for (std::size_t k = 0; k < questions.size(); ++k) {
      const Question &q = questions[k];
      const Matrix some = columns_of(all, q.terms);
      of[k].resize(2 * q.targets, static_cast<Eigen::Index>(ridges));
      for (std::size_t l = 0; l < ridges; ++l) {
        const Eigen::MatrixXd &w = weights[k][f * ridges + l];
        const Matrix e = y_[r].middleCols(q.first, q.targets) - some * w;
        const auto at = static_cast<Eigen::Index>(l);
        for (Eigen::Index t = 0; t < q.targets; ++t)
          of[k](t, at) = run_error(e.col(t), &of[k](q.targets + t, at));
      }
    }
    return of;
  };
  // part[question][fold]: summed over the fold's runs; the folds are put together afterwards.
  std::vector<OfRun> part(questions.size(), OfRun(kFolds));
  for (std::size_t k = 0; k < questions.size(); ++k) {
    for (Eigen::MatrixXd &p : part[k])
      p = Eigen::MatrixXd::Zero(2 * questions[k].targets, static_cast<Eigen::Index>(ridges));
  }
  parallel_in_order(runs_.size(), of_run, [&](std::size_t r, const OfRun &of) {
    for (std::size_t k = 0; k < of.size(); ++k)
      part[k][r % kFolds] += of[k];
  });
  std::vector<std::vector<std::vector<double>>> errors(questions.size());
  for (std::size_t k = 0; k < questions.size(); ++k) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(part[k][0].rows(), part[k][0].cols());
    for (const Eigen::MatrixXd &p : part[k])
      sum += p;
    for (Eigen::Index t = 0; t < sum.rows(); ++t) {
      errors[k].emplace_back();
      for (Eigen::Index l = 0; l < sum.cols(); ++l)
        errors[k].back().push_back(std::sqrt(sum(t, l) / static_cast<double>(runs_.size())));
    }
  }
  return errors;
}

double Fitter::spread(Eigen::Index target) const {
  double sum = 0.0, within = 0.0;
  for (std::size_t r = 0; r < runs_.size(); ++r)
    sum += run_error(y_[r].col(target), &within);
  return std::sqrt(sum / static_cast<double>(runs_.size()));
}

Eigen::VectorXd Fitter::weights(const std::vector<Eigen::Index> &terms, double ridge,
                                std::size_t fold, Eigen::Index target) const {
  const Eigen::VectorXd w = ridge_weights(sub_gram(folds_[fold].gram, terms), ridge,
                                          sub_rows(folds_[fold].cross.col(target), terms));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(folds_[fold].gram.rows());
  for (std::size_t i = 0; i < terms.size(); ++i)
    all[terms[i]] = static_cast<double>(static_cast<float>(w[static_cast<Eigen::Index>(i)]));
  return all;
}

} // namespace rim
