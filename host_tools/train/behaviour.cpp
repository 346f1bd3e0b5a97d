// SPDX-License-Identifier: MIT
#include "train/behaviour.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "image/image_writer.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
// A slow term has only as many independent values as there are runs: most of what differs between
// runs is left out of the fit.
constexpr double kWithin = 0.95;
constexpr double kRunMeanWeight = 0.2; // of a run's own mean error, in the error that chooses
const double kRidges[] = {0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5};

// A set of groups, and by how much it must lower the error to be preferred to the simpler ones.
struct Choice {
  bool shape, slow, initial;
  double must_win;
};
const Choice kChoices[] = {{false, false, false, 0.0}, {true, false, false, 0.03},
                           {false, true, false, 0.03}, {true, true, false, 0.05},
                           {false, false, true, 0.10}, {true, false, true, 0.12},
                           {true, true, true, 0.15}};

struct Moments {
  Eigen::MatrixXd gram;  // terms x terms, within runs
  Eigen::MatrixXd cross; // terms x targets: y, and y less its first reading
};

Matrix standard_terms(const Basis &basis, const BlockRun &run) {
  Matrix x = run.terms;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    x.col(i) = ((x.col(i).array() - basis.center[k]) * basis.inverse_sd[k])
                   .max(-BASIS_CLIP)
                   .min(BASIS_CLIP);
  }
  return x;
}

// Mean and 1 / standard deviation of every column over all runs.
void learn(const std::vector<BlockRun> &runs, Matrix BlockRun::*member, std::vector<double> *center,
           std::vector<double> *inverse) {
  for (std::size_t i = 0; i < center->size(); ++i) {
    double n = 0.0, sum = 0.0, squares = 0.0;
    for (const BlockRun &run : runs) {
      const auto column = (run.*member).col(static_cast<Eigen::Index>(i));
      n += static_cast<double>(column.size());
      sum += column.sum();
    }
    const double mean = sum / std::max(n, 1.0);
    for (const BlockRun &run : runs)
      squares += ((run.*member).col(static_cast<Eigen::Index>(i)).array() - mean).square().sum();
    const double sd = std::sqrt(squares / std::max(n, 1.0));
    (*center)[i] = static_cast<double>(static_cast<float>(mean));
    (*inverse)[i] = static_cast<double>(
        static_cast<float>(sd > 1e-9 * (1e-9 + std::abs(mean)) ? 1.0 / sd : 1e-6));
  }
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
  const double off = n * (1.0 - (1.0 - kWithin) * (1.0 - kWithin));
  const Eigen::RowVectorXd mx = x.colwise().mean(), my = y.colwise().mean();
  Moments m;
  m.gram.noalias() = x.transpose() * x;
  m.gram.noalias() -= off * mx.transpose() * mx;
  m.cross.noalias() = x.transpose() * y;
  m.cross.noalias() -= off * mx.transpose() * my;
  return m;
}

// outcome: the one whose first reading may be used; those of others are noise more often than not.
std::vector<Eigen::Index> terms_of(const Basis &basis, const Choice &choice, std::size_t outcome) {
  std::vector<Eigen::Index> terms;
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    const TermGroup g = basis.terms[i].group;
    if (g == TermGroup::mean || (g == TermGroup::shape && choice.shape) ||
        (g == TermGroup::slow && choice.slow) ||
        (g == TermGroup::initial && choice.initial && basis.terms[i].a == outcome))
      terms.push_back(static_cast<Eigen::Index>(i));
  }
  return terms;
}

struct Fold {
  Eigen::MatrixXd gram, cross;
  Eigen::RowVectorXd mean_y; // of the targets over the fold's training runs
};

class Fitter {
public:
  Fitter(const Basis &basis, const std::vector<BlockRun> &runs) : basis_(basis) {
    const std::size_t n = runs.size();
    x_.resize(n);
    y_.resize(n);
    moments_.resize(n);
    parallel_for(n, [&](std::size_t r) {
      x_[r] = standard_terms(basis, runs[r]);
      y_[r] = targets_of(runs[r]);
    });
    mean_ = Eigen::RowVectorXd::Zero(y_.front().cols());
    for (const Matrix &y : y_)
      mean_ += y.colwise().mean() / static_cast<double>(n);
    for (Matrix &y : y_)
      y.rowwise() -= mean_; // numbers near zero: sums keep their digits
    parallel_for(n, [&](std::size_t r) { moments_[r] = moments_of(x_[r], y_[r]); });
    for (std::size_t f = 0; f <= kFolds; ++f)
      folds_.push_back(fold_without(f));
  }

  // errors[target - first][ridge], root mean square over runs left out, of some targets.
  std::vector<std::vector<double>> errors(const std::vector<Eigen::Index> &terms,
                                          Eigen::Index first, Eigen::Index targets) const;
  // Weights of all terms for a target; fold kFolds: all runs.
  Eigen::VectorXd weights(const std::vector<Eigen::Index> &terms, double ridge, std::size_t fold,
                          Eigen::Index target) const;
  double intercept(const Eigen::VectorXd &weight, std::size_t fold, Eigen::Index target) const;
  const Matrix &x(std::size_t run) const { return x_[run]; }
  const Matrix &y(std::size_t run) const { return y_[run]; } // less mean()
  const Eigen::RowVectorXd &mean() const { return mean_; }
  std::size_t runs() const { return x_.size(); }

private:
  Fold fold_without(std::size_t f) const {
    Fold fold;
    const Eigen::Index p = x_.front().cols(), t = y_.front().cols();
    fold.gram = Eigen::MatrixXd::Zero(p, p);
    fold.cross = Eigen::MatrixXd::Zero(p, t);
    for (std::size_t r = 0; r < x_.size(); ++r) {
      if (r % kFolds == f)
        continue;
      fold.gram += moments_[r].gram;
      fold.cross += moments_[r].cross;
    }
    return fold;
  }

  const Basis &basis_;
  std::vector<Matrix> x_, y_;
  std::vector<Moments> moments_;
  std::vector<Fold> folds_;
  Eigen::RowVectorXd mean_;
};

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

// What chooses: squares within runs, and a part of the squared mean of each run, which the run's
// own effects can explain.
double run_error(const Eigen::VectorXd &e) {
  const double mean = e.mean();
  return (e.array() - mean).square().mean() + kRunMeanWeight * mean * mean;
}

std::vector<std::vector<double>> Fitter::errors(const std::vector<Eigen::Index> &terms,
                                                Eigen::Index first, Eigen::Index targets) const {
  const auto k = static_cast<Eigen::Index>(terms.size());
  const std::size_t ridges = std::size(kRidges);
  std::vector<std::vector<double>> sums(static_cast<std::size_t>(targets),
                                        std::vector<double>(ridges, 0.0));
  std::vector<std::vector<std::vector<double>>> part(kFolds * ridges, sums);
  parallel_for(kFolds * ridges, [&](std::size_t job) {
    const std::size_t f = job / ridges, l = job % ridges;
    Eigen::MatrixXd g = sub_gram(folds_[f].gram, terms);
    g.diagonal().array() += kRidges[l];
    const Eigen::MatrixXd w =
        g.ldlt().solve(sub_rows(folds_[f].cross, terms).middleCols(first, targets));
    for (std::size_t r = f; r < x_.size(); r += kFolds) {
      Matrix x(x_[r].rows(), k);
      for (Eigen::Index i = 0; i < k; ++i)
        x.col(i) = x_[r].col(terms[static_cast<std::size_t>(i)]);
      const Matrix e = y_[r].middleCols(first, targets) - x * w;
      for (Eigen::Index t = 0; t < targets; ++t)
        part[job][static_cast<std::size_t>(t)][l] += run_error(e.col(t));
    }
  });
  for (std::size_t job = 0; job < part.size(); ++job) {
    const std::size_t l = job % ridges;
    for (std::size_t t = 0; t < sums.size(); ++t)
      sums[t][l] += part[job][t][l];
  }
  for (auto &row : sums) {
    for (double &v : row)
      v = std::sqrt(v / static_cast<double>(x_.size()));
  }
  return sums;
}

Eigen::VectorXd Fitter::weights(const std::vector<Eigen::Index> &terms, double ridge,
                                std::size_t fold, Eigen::Index target) const {
  Eigen::MatrixXd g = sub_gram(folds_[fold].gram, terms);
  g.diagonal().array() += ridge;
  const Eigen::VectorXd w = g.ldlt().solve(sub_rows(folds_[fold].cross.col(target), terms));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(x_.front().cols());
  for (std::size_t i = 0; i < terms.size(); ++i)
    all[terms[i]] = static_cast<double>(static_cast<float>(w[static_cast<Eigen::Index>(i)]));
  return all;
}

// So that the mean error of the runs is zero: terms have mean zero over all runs, not over a fold.
double Fitter::intercept(const Eigen::VectorXd &weight, std::size_t fold,
                         Eigen::Index target) const {
  double sum = 0.0, n = 0.0;
  for (std::size_t r = 0; r < x_.size(); ++r) {
    if (r % kFolds == fold)
      continue;
    sum += y_[r].col(target).mean() - (x_[r] * weight).mean();
    n += 1.0;
  }
  return mean_[target] + sum / n;
}

// The simplest choice that no richer one beats by enough.
TargetModel choose(const std::vector<std::vector<std::vector<double>>> &errors, std::size_t target,
                   std::size_t outcomes) {
  TargetModel best;
  double least = 1e300, bar = 1e300;
  const bool is_outcome = target < outcomes;
  for (std::size_t c = 0; c < std::size(kChoices); ++c) {
    if (kChoices[c].initial && !is_outcome)
      continue;
    for (std::size_t l = 0; l < std::size(kRidges); ++l) {
      const double e = errors[c][target][l];
      if (e < (1.0 - kChoices[c].must_win) * bar && e < least) {
        least = e;
        best.shape = kChoices[c].shape;
        best.slow = kChoices[c].slow;
        best.initial = kChoices[c].initial;
        best.ridge = kRidges[l];
      }
    }
    if (c == 0)
      bar = least; // of the simplest
  }
  best.error = least;
  return best;
}

} // namespace

Matrix standard_means(const Basis &basis, const BlockRun &run) {
  Matrix m = run.means;
  for (Eigen::Index i = 0; i < m.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    m.col(i) = ((m.col(i).array() - basis.mean_center[k]) * basis.mean_inverse_sd[k])
                   .max(-BASIS_MEAN_CLIP)
                   .min(BASIS_MEAN_CLIP);
  }
  return m;
}

void learn_means(Basis *basis, const std::vector<BlockRun> &runs) {
  learn(runs, &BlockRun::means, &basis->mean_center, &basis->mean_inverse_sd);
}

Behaviour fit_behaviour(Basis *basis, const std::vector<BlockRun> &runs, std::size_t outcomes) {
  if (runs.size() < 3)
    throw DataError("training needs at least 3 runs");
  learn(runs, &BlockRun::terms, &basis->center, &basis->inverse_sd);
  learn_means(basis, runs);
  Behaviour b;
  const Fitter fitter(*basis, runs);
  const auto o = static_cast<Eigen::Index>(outcomes);
  // errors[choice][target]: of outcomes and scatter, or of outcomes less their first readings.
  std::vector<std::vector<std::vector<double>>> errors;
  for (const Choice &choice : kChoices) {
    errors.emplace_back();
    if (!choice.initial)
      errors.back() = fitter.errors(terms_of(*basis, choice, 0), 0, 2 * o);
    for (Eigen::Index t = 0; choice.initial && t < o; ++t)
      errors.back().push_back(
          fitter.errors(terms_of(*basis, choice, static_cast<std::size_t>(t)), 2 * o + t, 1)
              .front());
  }
  for (const BlockRun &run : runs) {
    for (auto *matrices : {&b.predicted, &b.residual, &b.scatter})
      matrices->emplace_back(run.blocks(), o);
  }
  b.targets.resize(2 * outcomes);
  parallel_for(2 * outcomes, [&](std::size_t t) {
    TargetModel &model = b.targets[t];
    model = choose(errors, t, outcomes);
    const auto column = static_cast<Eigen::Index>(model.initial ? 2 * outcomes + t : t);
    const auto terms = terms_of(*basis, {model.shape, model.slow, model.initial, 0.0}, t);
    double squares = 0.0, spread = 0.0, n = 0.0;
    for (std::size_t f = 0; f <= kFolds; ++f) {
      const Eigen::VectorXd w = fitter.weights(terms, model.ridge, f, column);
      const double intercept = fitter.intercept(w, f, column);
      if (f == kFolds) {
        model.weight = w;
        model.intercept = static_cast<double>(static_cast<float>(intercept));
        break;
      }
      for (std::size_t r = f; r < runs.size(); r += kFolds) {
        Eigen::VectorXd p = (fitter.x(r) * w).array() + intercept;
        const auto i = static_cast<Eigen::Index>(t % outcomes);
        if (model.initial)
          p.array() += runs[r].first[i];
        const Eigen::VectorXd y = t < outcomes ? runs[r].outcome.col(i) : runs[r].scatter.col(i);
        const Eigen::VectorXd e = y - p;
        squares += e.squaredNorm();
        spread += (y.array() - fitter.mean()[static_cast<Eigen::Index>(t)]).square().sum();
        n += static_cast<double>(y.size());
        if (t < outcomes) {
          b.predicted[r].col(i) = p;
          b.residual[r].col(i) = e;
        } else {
          b.scatter[r].col(i) = e;
        }
      }
    }
    model.error = std::sqrt(squares / n);
    model.r2 = spread > 0.0 ? 1.0 - squares / spread : 0.0;
  });
  return b;
}

void shrink_basis(Basis *basis, Behaviour *behaviour) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < basis->terms.size(); ++i) {
    const bool used = std::any_of(behaviour->targets.begin(), behaviour->targets.end(),
                                  [i](const TargetModel &m) {
                                    return std::abs(m.weight[static_cast<Eigen::Index>(i)]) > 0.0;
                                  });
    if (used)
      kept.push_back(i);
  }
  Basis small = *basis;
  small.terms.clear();
  small.center.clear();
  small.inverse_sd.clear();
  for (const std::size_t i : kept) {
    small.terms.push_back(basis->terms[i]);
    small.center.push_back(basis->center[i]);
    small.inverse_sd.push_back(basis->inverse_sd[i]);
  }
  for (TargetModel &m : behaviour->targets) {
    Eigen::VectorXd w(static_cast<Eigen::Index>(kept.size()));
    for (std::size_t i = 0; i < kept.size(); ++i)
      w[static_cast<Eigen::Index>(i)] = m.weight[static_cast<Eigen::Index>(kept[i])];
    m.weight = w;
  }
  *basis = small;
}

std::vector<std::uint8_t> behaviour_section(const Basis &basis, const Behaviour &behaviour) {
  SectionBytes bytes;
  bytes.u32(1);
  bytes.u32(static_cast<std::uint32_t>(basis.terms.size()));
  bytes.u32(static_cast<std::uint32_t>(behaviour.targets.size()));
  bytes.u32(0);
  for (const TargetModel &m : behaviour.targets)
    bytes.u32(m.initial ? 1 : 0);
  for (const TargetModel &m : behaviour.targets)
    bytes.f32(static_cast<float>(m.intercept));
  for (const TargetModel &m : behaviour.targets) {
    for (Eigen::Index i = 0; i < m.weight.size(); ++i)
      bytes.f32(static_cast<float>(m.weight[i]));
  }
  return bytes.bytes();
}

} // namespace rim
