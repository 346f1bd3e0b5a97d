// SPDX-License-Identifier: MIT
// What remains of one outcome from what remains of the others.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include <Eigen/Cholesky>

#include "image/image_writer.hpp"
#include "train/behaviour.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "image/noise.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
const double kRidges[] = {10.0, 100.0, 1e3, 1e4};
// A relation of physics holds outside of what was trained too, if it is not shrunk.
const double kIntegralRidges[] = {1e-6};
// Part of the changes that others must explain for an outcome to be called their integral.
constexpr double kIntegrates = 0.5;
constexpr double kIntegrandWins = 0.05; // part by which each integrand must lower the squared error
constexpr double kProductWins = 0.2;    // part of what a product explains that is not counted
constexpr std::size_t kFew = 4;         // others at most, each of which must lower the squared
constexpr double kFewWins = 0.1;        // error by this part, all of them to at most
constexpr double kFewMustExplain = 0.25; // this part of the outcome's variance
constexpr double kMustWin = 0.8; // of the variance: a further source must be better by as much

// Regressors of all outcomes in one run: residuals of this block, of the block before, and of this
// block times the means, each in standard deviations and clipped.
Matrix regressors(const Matrix &residual, const std::vector<double> &inverse_sd,
                  const Matrix &means) {
  const Eigen::Index n = residual.rows(), o = residual.cols(), m = means.cols();
  Matrix now(n, o);
  for (Eigen::Index j = 0; j < o; ++j)
    now.col(j) = (residual.col(j).array() * inverse_sd[static_cast<std::size_t>(j)])
                     .max(-AGREEMENT_CLIP)
                     .min(AGREEMENT_CLIP);
  Matrix x = Matrix::Zero(n, o * (2 + m));
  x.leftCols(o) = now;
  if (n > 1)
    x.block(1, o, n - 1, o) = now.topRows(n - 1);
  for (Eigen::Index k = 0; k < m; ++k)
    x.middleCols((2 + k) * o, o) = now.array().colwise() * means.col(k).array();
  return x;
}

std::vector<Eigen::Index> columns_without(Eigen::Index o, Eigen::Index outcome,
                                          Eigen::Index total) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index c = 0; c < total; ++c) {
    if (c % o != outcome)
      columns.push_back(c);
  }
  return columns;
}

struct Sums {
  Eigen::MatrixXd gram;
  Eigen::MatrixXd cross;
};

// Regressors and targets (one per outcome) of one run.
struct Rows {
  Matrix x, y;
};

// Of all runs, made when they are needed; and their sums per fold left out, fold kFolds: of all.
struct Regression {
  std::size_t runs = 0;
  std::function<Rows(std::size_t)> rows;
  std::vector<Sums> folds;
};

void add_folds(Regression *r, Eigen::Index clip_from) {
  parallel_in_order(
      r->runs,
      [&](std::size_t i) {
        const Rows rows = r->rows(i);
        Sums sums;
        sums.gram = rows.x.transpose() * rows.x;
        // An outcome that is far off is no guide to what healthy ones say of each other.
        const Matrix y =
            clip_from > 0 ? Matrix(rows.y.array().max(-AGREEMENT_CLIP).min(AGREEMENT_CLIP).matrix())
                          : rows.y;
        sums.cross = rows.x.transpose() * y;
        return sums;
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

// The ridge with the least error over runs left out; weights per fold, the last of all runs.
struct Fit {
  std::vector<Eigen::VectorXd> weight;
  double squares = 0.0, own = 0.0;
};

template <std::size_t n>
Fit best_fit(const Regression &r, const std::vector<Eigen::Index> &columns, Eigen::Index y,
             const double (&ridges)[n]) {
  std::vector<Fit> fits(n);
  for (std::size_t f = 0; f < kFolds; ++f) {
    for (std::size_t l = 0; l < n; ++l)
      fits[l].weight.push_back(solve(r.folds[f], columns, y, ridges[l]));
    for (std::size_t i = f; i < r.runs; i += kFolds) {
      const Rows rows = r.rows(i);
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

// Standard deviation of every integrand, and what it changes by per unit of its factors.
void learn_integrands(Agreement *a, const Layout &layout, const RunStore &runs) {
  const auto count = static_cast<Eigen::Index>(a->integrands.size());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count), squares = sum;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(layout.features()));
  Eigen::VectorXd cosine = mean, sine = mean;
  double n = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const BlockRun &run = runs[r];
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    sum += wide->early.colwise().sum().transpose();
    squares += wide->early.colwise().squaredNorm().transpose();
    mean += run.context.colwise().sum().transpose();
    for (Eigen::Index f = 0; f < run.context.cols(); ++f) {
      const bool degrees = (layout.command[static_cast<std::size_t>(f)] & BLOCKS_ANGLE_DEG) != 0;
      const Eigen::ArrayXd angle = run.context.col(f).array() * (degrees ? M_PI / 180.0 : 1.0);
      cosine[f] += angle.cos().sum();
      sine[f] += angle.sin().sum();
    }
    n += static_cast<double>(run.blocks());
  }
  n = std::max(n, 1.0);
  for (Eigen::Index g = 0; g < count; ++g) {
    const Integrand &of = a->integrands[static_cast<std::size_t>(g)];
    const double middle = sum[g] / n;
    const double sd = std::sqrt(std::max(squares[g] / n - middle * middle, 0.0));
    a->integrand_inverse_sd.push_back(static_cast<double>(
        static_cast<float>(1.0 / std::max(sd, 1e-9 * (1.0 + std::abs(middle))))));
    const double of_b = of.op == AGREEMENT_PRODUCT  ? mean[of.b] / n
                        : of.op == AGREEMENT_COSINE ? cosine[of.b] / n
                        : of.op == AGREEMENT_SINE   ? sine[of.b] / n
                                                    : 1.0;
    a->partial.push_back(of_b);
    a->partial.push_back(of.op == AGREEMENT_PRODUCT ? mean[of.a] / n : 0.0);
  }
}

// Integrands over the time from block to block, in standard deviations.
Matrix integrated(const Agreement &a, const WideBlocks &run) {
  Matrix x = Matrix::Zero(run.early.rows(), run.early.cols());
  for (Eigen::Index i = 1; i < x.rows(); ++i)
    x.row(i) = run.early.row(i) + run.late.row(i - 1);
  for (Eigen::Index g = 0; g < x.cols(); ++g)
    x.col(g) *= a.integrand_inverse_sd[static_cast<std::size_t>(g)];
  return x;
}

// Changes of the outcomes from what may be integrated: rows whose block follows the one before.
Regression integral_regression(const Agreement &a, const RunStore &runs) {
  Regression of_all;
  of_all.runs = runs.size();
  of_all.rows = [&a, &runs](std::size_t r) {
    const BlockRun &run = runs[r];
    const Matrix x = integrated(a, *runs.wide(r));
    Matrix rows(run.blocks(), x.cols()), y(run.blocks(), run.outcome.cols());
    Eigen::Index n = 0;
    for (Eigen::Index i = 1; i < run.blocks(); ++i) {
      if (!run.follows[static_cast<std::size_t>(i)])
        continue;
      rows.row(n) = x.row(i);
      y.row(n++) = run.outcome.row(i) - run.outcome.row(i - 1);
    }
    return Rows{rows.topRows(n), y.topRows(n)};
  };
  add_folds(&of_all, 0);
  return of_all;
}

// What the flight code sums up over a run.
Eigen::VectorXd integral_remains(const Agreement &a, const RunStore &runs, std::size_t r,
                                 Eigen::Index outcome, const Eigen::VectorXd &weight) {
  const BlockRun &run = runs[r];
  const Eigen::VectorXd change = integrated(a, *runs.wide(r)) * weight;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(run.blocks());
  for (Eigen::Index i = 1; i < run.blocks(); ++i) {
    sum[i] = sum[i - 1];
    if (run.follows[static_cast<std::size_t>(i)])
      sum[i] = AGREEMENT_KEEPS * sum[i - 1] + run.outcome(i, outcome) -
               run.outcome(i - 1, outcome) - change[i];
  }
  return sum;
}

// Mean and standard deviation of every outcome over healthy blocks.
struct Levels {
  Eigen::RowVectorXd mean, sd;
};

Levels learn_levels(const RunStore &runs) {
  const Eigen::Index o = runs.front().outcome.cols();
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(o), squares = sum;
  double n = 0.0;
  for (const BlockRun &run : runs) {
    sum += run.outcome.colwise().sum();
    n += static_cast<double>(run.blocks());
  }
  const Eigen::RowVectorXd mean = sum / std::max(n, 1.0);
  for (const BlockRun &run : runs)
    squares += (run.outcome.rowwise() - mean).colwise().squaredNorm();
  const Eigen::RowVectorXd sd = (squares / std::max(n, 1.0)).cwiseSqrt();
  return {mean, sd.cwiseMax(1e-9 * (1.0 + mean.cwiseAbs().maxCoeff()))};
}

// The outcomes in standard deviations, and 1.
Regression level_regression(const Levels &levels, const RunStore &runs) {
  Regression of_all;
  of_all.runs = runs.size();
  of_all.rows = [&levels, &runs](std::size_t r) {
    Rows rows;
    rows.y = (runs[r].outcome.rowwise() - levels.mean).array().rowwise() / levels.sd.array();
    rows.x.resize(rows.y.rows(), rows.y.cols() + 1);
    rows.x.leftCols(rows.y.cols()) = rows.y;
    rows.x.rightCols(1).setOnes();
    return rows;
  };
  add_folds(&of_all, 0);
  return of_all;
}

// Variance of the estimate of a constant offset over half a run, for AR(1) noise as the series has
// it, the run's own mean and trend (effects of the run) taken off: what a channel is worth.
double offset_variance(const std::vector<Eigen::VectorXd> &series) {
  double power = 0.0, lag = 0.0, n = 0.0;
  for (const Eigen::VectorXd &s : series) {
    const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(s.size(), -1.0, 1.0);
    Eigen::ArrayXd e = s.array() - s.mean();
    e -= t * ((e * t).sum() / t.square().sum());
    power += e.square().sum();
    lag += (e.tail(e.size() - 1) * e.head(e.size() - 1)).sum();
    n += static_cast<double>(e.size());
  }
  const double rho = std::clamp(power > 0.0 ? lag / power : 0.0, 0.0, 0.995);
  const double variance = power / std::max(n, 1.0) * (1.0 - rho * rho);
  const double half = 0.5 * n / static_cast<double>(series.size());
  return variance / (1.0 + half * (1.0 - rho) * (1.0 - rho));
}

// The few others that an outcome follows from, and the constant; none where they explain little.
std::vector<Eigen::Index> choose_few(const Regression &r, const Layout &layout,
                                     Eigen::Index outcome) {
  const Sums &all = r.folds[kFolds];
  const Eigen::Index constant = all.gram.rows() - 1;
  const auto is_angle = [&](Eigen::Index j) {
    const std::uint16_t feature = layout.outcome_feature[static_cast<std::size_t>(j)];
    return (layout.command[feature] & (BLOCKS_ANGLE_RAD | BLOCKS_ANGLE_DEG)) != 0;
  };
  double left = 0.0;
  for (std::size_t i = 0; i < r.runs; ++i)
    left += r.rows(i).y.col(outcome).squaredNorm();
  const double own = left;
  std::vector<Eigen::Index> chosen = {constant};
  while (!is_angle(outcome) && chosen.size() <= kFew) {
    double least = (1.0 - kFewWins) * left;
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < constant; ++j) {
      if (j == outcome || is_angle(j) || std::find(chosen.begin(), chosen.end(), j) != chosen.end())
        continue;
      std::vector<Eigen::Index> with = chosen;
      with.push_back(j);
      const Eigen::VectorXd w = solve(all, with, outcome, kIntegralRidges[0]);
      const double squares = own - 2.0 * w.dot(all.cross.col(outcome)) + w.dot(all.gram * w);
      if (squares < least) {
        least = squares;
        best = j;
      }
    }
    if (best < 0)
      break;
    left = least;
    chosen.push_back(best);
  }
  if (chosen.size() < 2 || left > kFewMustExplain * own)
    chosen.clear();
  return chosen;
}

// The few integrands that explain an outcome's change: more would explain noise by noise. A product
// must explain clearly more than any single outcome.
std::vector<Eigen::Index> choose_integrands(const Regression &r, const Agreement &a,
                                            Eigen::Index outcome, std::uint16_t feature) {
  const Sums &all = r.folds[kFolds];
  double left = 0.0;
  for (std::size_t i = 0; i < r.runs; ++i)
    left += r.rows(i).y.col(outcome).squaredNorm();
  const double own = left;
  std::vector<Eigen::Index> chosen;
  while (chosen.size() < AGREEMENT_INTEGRANDS) {
    double least = (1.0 - kIntegrandWins) * left, score = least;
    Eigen::Index best = -1;
    for (Eigen::Index g = 0; g < all.gram.rows(); ++g) {
      const Integrand &of = a.integrands[static_cast<std::size_t>(g)];
      if (of.a == feature || of.b == feature ||
          std::find(chosen.begin(), chosen.end(), g) != chosen.end())
        continue;
      std::vector<Eigen::Index> with = chosen;
      with.push_back(g);
      const Eigen::VectorXd w = solve(all, with, outcome, kIntegralRidges[0]);
      const double squares = own - 2.0 * w.dot(all.cross.col(outcome)) + w.dot(all.gram * w);
      const double handicapped =
          of.op == AGREEMENT_PLAIN ? squares : squares + kProductWins * (left - squares);
      if (handicapped < score) {
        score = handicapped;
        least = squares;
        best = g;
      }
    }
    if (best < 0)
      break;
    left = least;
    chosen.push_back(best);
  }
  return chosen;
}

// The outcome that this one mostly integrates: its usual variation has the largest effect.
double mostly_integrated(const Agreement &a, const Layout &layout, const Eigen::VectorXd &weight,
                         const RunStore &runs) {
  const auto outcomes = static_cast<Eigen::Index>(layout.outcomes());
  double most = 0.0, all = 0.0, best = -1.0;
  for (Eigen::Index j = 0; j < outcomes; ++j) {
    double gain = 0.0, n = 0.0, sum = 0.0, squares = 0.0;
    for (std::size_t g = 0; g < a.integrands.size(); ++g) {
      const double w = weight[static_cast<Eigen::Index>(g)] * a.integrand_inverse_sd[g];
      const std::uint16_t feature = layout.outcome_feature[static_cast<std::size_t>(j)];
      if (a.integrands[g].a == feature)
        gain += w * a.partial[2 * g];
      if (a.integrands[g].op != AGREEMENT_PLAIN && a.integrands[g].b == feature)
        gain += w * a.partial[2 * g + 1];
    }
    for (const BlockRun &run : runs) {
      sum += run.outcome.col(j).sum();
      squares += run.outcome.col(j).squaredNorm();
      n += static_cast<double>(run.blocks());
    }
    const double effect = gain * gain * std::max(squares / n - (sum / n) * (sum / n), 0.0);
    all += effect;
    if (effect > most) {
      most = effect;
      best = static_cast<double>(j);
    }
  }
  return most < 0.5 * all ? -1.0 : best;
}

// Only the integrands that some outcome uses fly.
void keep_used_integrands(Agreement *a, const std::vector<Eigen::VectorXd> &weight) {
  std::vector<std::size_t> used;
  for (std::size_t g = 0; g < a->integrands.size(); ++g) {
    for (std::size_t o = 0; o < weight.size(); ++o) {
      if (weight[o].size() > 0 && weight[o][static_cast<Eigen::Index>(g)] != 0.0 &&
          (used.empty() || used.back() != g))
        used.push_back(g);
    }
  }
  Agreement kept;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const std::size_t g = used[k];
    kept.integrands.push_back(a->integrands[g]);
    kept.integrand_inverse_sd.push_back(a->integrand_inverse_sd[g]);
    kept.partial.push_back(a->partial[2 * g]);
    kept.partial.push_back(a->partial[2 * g + 1]);
    for (std::size_t o = 0; o < weight.size(); ++o) {
      if (weight[o].size() > 0)
        a->row(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(AGREEMENT_FIRST + k)) =
            weight[o][static_cast<Eigen::Index>(g)];
    }
  }
  a->integrands = kept.integrands;
  a->integrand_inverse_sd = kept.integrand_inverse_sd;
  a->partial = kept.partial;
}

void learn_scales(Agreement *a, const std::vector<Matrix> &residual) {
  for (Eigen::Index j = 0; j < residual.front().cols(); ++j) {
    double squares = 0.0, count = 0.0;
    for (const Matrix &r : residual) {
      squares += r.col(j).squaredNorm();
      count += static_cast<double>(r.rows());
    }
    const double sd = std::sqrt(squares / std::max(count, 1.0));
    a->inverse_sd.push_back(static_cast<double>(static_cast<float>(1.0 / std::max(sd, 1e-12))));
  }
}

// Residuals of every outcome, in standard deviations, from those of the others.
Regression linear_regression(const Agreement &a, const Basis &basis, const RunStore &runs,
                             const std::vector<Matrix> &residual) {
  Regression linear;
  linear.runs = runs.size();
  linear.rows = [&](std::size_t r) {
    Rows rows{regressors(residual[r], a.inverse_sd, standard_means(basis, runs[r])), residual[r]};
    for (Eigen::Index j = 0; j < residual[r].cols(); ++j)
      rows.y.col(j) *= a.inverse_sd[static_cast<std::size_t>(j)];
    return rows;
  };
  add_folds(&linear, 1);
  return linear;
}

// The relation by section LEVEL: what remains of the outcome, and its error over the behaviour's.
double level_remains(const RunStore &runs, const std::vector<Matrix> &level,
                     const std::vector<Matrix> &residual, Eigen::Index outcome,
                     std::vector<Eigen::VectorXd> *remains) {
  double squares = 0.0, own = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    (*remains)[r] = runs[r].outcome.col(outcome) - level[r].col(outcome);
    squares += (*remains)[r].squaredNorm();
    own += residual[r].col(outcome).squaredNorm();
  }
  return std::sqrt(squares / std::max(own, 1e-300));
}

// What the agreement of the outcomes is chosen from.
struct Sources {
  const Layout &layout;
  const RunStore &runs;
  const std::vector<Matrix> &residual, &level;
  const Levels &levels;
  Regression linear, few, integral;
};

// What the regressors leave of a target in one run.
Eigen::VectorXd left_over(const Rows &rows, Eigen::Index target, const Eigen::VectorXd &weight) {
  return rows.y.col(target) - rows.x * weight;
}

// One outcome's relation: the one that shows an offset over half a run best.
class Choice {
public:
  Choice(const Sources &from, const Agreement &scales, Eigen::Index outcome)
      : from_(from), a_(scales), j_(outcome), remains_(from.runs.size()) {}

  // Nothing of the others.
  void start_from_behaviour() {
    for (std::size_t r = 0; r < remains_.size(); ++r)
      remains_[r] = from_.residual[r].col(j_);
    take(AGREEMENT_RESIDUALS, 1.0);
  }
  // The others' residuals.
  void try_residuals(const std::vector<Eigen::Index> &columns) {
    const Fit fit = best_fit(from_.linear, columns, j_, kRidges);
    const double inverse_sd = a_.inverse_sd[static_cast<std::size_t>(j_)];
    for (std::size_t r = 0; r < remains_.size(); ++r)
      remains_[r] = left_over(from_.linear.rows(r), j_, fit.weight[r % kFolds]) / inverse_sd;
    weight = fit.weight[kFolds];
    take(AGREEMENT_RESIDUALS, std::sqrt(fit.squares / std::max(fit.own, 1e-300)));
  }
  // A few others' readings.
  void try_few() {
    const std::vector<Eigen::Index> others = choose_few(from_.few, from_.layout, j_);
    if (others.empty())
      return;
    const Fit fit = best_fit(from_.few, others, j_, kIntegralRidges);
    const double sd = from_.levels.sd[j_];
    double own = 0.0;
    for (std::size_t r = 0; r < remains_.size(); ++r) {
      remains_[r] = left_over(from_.few.rows(r), j_, fit.weight[r % kFolds]) * sd;
      own += from_.residual[r].col(j_).squaredNorm();
    }
    if (offset_variance(remains_) >= kMustWin * variance)
      return;
    const Eigen::VectorXd &w = fit.weight[kFolds];
    few = (w.head(w.size() - 1).array() * sd / from_.levels.sd.transpose().array()).matrix();
    intercept = from_.levels.mean[j_] + sd * w[w.size() - 1] - few.dot(from_.levels.mean);
    take(AGREEMENT_FEW, std::sqrt(fit.squares * sd * sd / std::max(own, 1e-300)));
  }
  // Section LEVEL.
  void try_level() {
    const double part = level_remains(from_.runs, from_.level, from_.residual, j_, &remains_);
    if (offset_variance(remains_) < kMustWin * variance)
      take(AGREEMENT_LEVEL, part);
  }
  // The integral of others.
  void try_integral() {
    const std::uint16_t feature = from_.layout.outcome_feature[static_cast<std::size_t>(j_)];
    const std::vector<Eigen::Index> others = choose_integrands(from_.integral, a_, j_, feature);
    if (others.empty())
      return;
    const Fit fit = best_fit(from_.integral, others, j_, kIntegralRidges);
    integrates = fit.squares < (1.0 - kIntegrates) * fit.own;
    if (integrates)
      integrand = mostly_integrated(a_, from_.layout, fit.weight[kFolds], from_.runs);
    for (std::size_t r = 0; r < remains_.size(); ++r)
      remains_[r] = integral_remains(a_, from_.runs, r, j_, fit.weight[r % kFolds]);
    if (offset_variance(remains_) >= kMustWin * variance)
      return;
    integral = fit.weight[kFolds];
    take(AGREEMENT_INTEGRAL, error);
  }

  int source = AGREEMENT_RESIDUALS;
  bool integrates = false; // its changes are mostly those of the integral, if that was tried
  double error = 1.0, variance = 1e300, integrand = -1.0, intercept = 0.0;
  Eigen::VectorXd weight, few, integral; // of the residuals, the readings, the integrands
  std::vector<Eigen::VectorXd> series;

private:
  void take(int which, double of_behaviour) {
    source = which;
    error = of_behaviour;
    variance = offset_variance(remains_);
    series = remains_;
  }
  const Sources &from_;
  const Agreement &a_;
  Eigen::Index j_;
  std::vector<Eigen::VectorXd> remains_;
};

// The only outcome whose reading says what this one reads; the number of outcomes: none or more.
std::size_t only_other(const Choice &choice, std::size_t outcomes) {
  if (choice.source != AGREEMENT_FEW || (choice.few.array() != 0.0).count() != 1)
    return outcomes;
  Eigen::Index at = 0;
  choice.few.cwiseAbs().maxCoeff(&at);
  return static_cast<std::size_t>(at);
}

std::unique_ptr<Choice> choose_relation(const Sources &sources, const Agreement &a,
                                        std::size_t outcome, bool has_integrands) {
  const auto j = static_cast<Eigen::Index>(outcome);
  const auto o = static_cast<Eigen::Index>(a.inverse_sd.size());
  auto choice = std::make_unique<Choice>(sources, a, j);
  if (o > 1)
    choice->try_residuals(columns_without(o, j, a.row.cols() - AGREEMENT_FIRST));
  if (o > 1 && has_integrands)
    choice->try_few();
  if (!sources.level.empty())
    choice->try_level();
  if (o > 1 && has_integrands)
    choice->try_integral();
  return choice;
}

// Of two that follow from each other alone, both say the same: the second is free to say what moves
// it.
void free_twins(const Sources &sources, const Agreement &a,
                std::vector<std::unique_ptr<Choice>> *choices) {
  for (std::size_t j = 0; j < choices->size(); ++j) {
    const std::size_t twin = only_other(*(*choices)[j], choices->size());
    if (twin >= j || only_other(*(*choices)[twin], choices->size()) != j)
      continue;
    auto other = std::make_unique<Choice>(sources, a, static_cast<Eigen::Index>(j));
    other->start_from_behaviour();
    other->try_integral();
    if (other->source == AGREEMENT_INTEGRAL && other->integrates)
      (*choices)[j] = std::move(other);
  }
}

} // namespace

std::vector<bool> integrated_outcomes(const Layout &layout,
                                      const std::vector<Integrand> &integrands,
                                      const RunStore &runs) {
  std::vector<bool> integrated(layout.outcomes(), false);
  if (integrands.empty() || layout.outcomes() < 2)
    return integrated;
  Agreement a;
  a.integrands = integrands;
  learn_integrands(&a, layout, runs);
  const Regression changes = integral_regression(a, runs);
  std::vector<char> of(integrated.size(), 0); // threads must not share a byte of bits
  parallel_for(of.size(), [&](std::size_t o) {
    const auto j = static_cast<Eigen::Index>(o);
    const auto others = choose_integrands(changes, a, j, layout.outcome_feature[o]);
    if (others.empty())
      return;
    const Fit fit = best_fit(changes, others, j, kIntegralRidges);
    of[o] = fit.squares < (1.0 - kIntegrates) * fit.own ? 1 : 0;
  });
  for (std::size_t o = 0; o < of.size(); ++o)
    integrated[o] = of[o] != 0;
  return integrated;
}

Agreement fit_agreement(const Layout &layout, const Basis &basis,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        const std::vector<Matrix> &residual, const std::vector<Matrix> &level) {
  const Eigen::Index o = residual.front().cols();
  const Eigen::Index total = o * (2 + static_cast<Eigen::Index>(basis.means.size()));
  Agreement a;
  a.integrands = integrands;
  learn_scales(&a, residual);
  learn_integrands(&a, layout, runs);
  const Levels levels = learn_levels(runs);
  const Sources sources{layout,
                        runs,
                        residual,
                        level,
                        levels,
                        linear_regression(a, basis, runs, residual),
                        level_regression(levels, runs),
                        integral_regression(a, runs)};
  a.row = Matrix::Zero(o, AGREEMENT_FIRST + total);
  a.error.assign(static_cast<std::size_t>(o), 1.0);
  a.source.assign(static_cast<std::size_t>(o), AGREEMENT_RESIDUALS);
  a.remains = residual;
  std::vector<std::unique_ptr<Choice>> choices(static_cast<std::size_t>(o));
  parallel_for(choices.size(), [&](std::size_t j) {
    choices[j] = choose_relation(sources, a, j, !integrands.empty());
  });
  free_twins(sources, a, &choices);
  std::vector<Eigen::VectorXd> integral;
  for (std::size_t outcome = 0; outcome < choices.size(); ++outcome) {
    const Choice &choice = *choices[outcome];
    const auto j = static_cast<Eigen::Index>(outcome);
    a.source[outcome] = choice.source;
    a.error[outcome] = choice.error;
    a.row(j, 0) = choice.source;
    a.row(j, 2) = choice.integrand;
    if (choice.source == AGREEMENT_RESIDUALS && choice.weight.size() > 0)
      a.row.row(j).tail(total) = choice.weight.transpose();
    if (choice.source == AGREEMENT_FEW) {
      a.row(j, 1) = choice.intercept;
      a.row.row(j).segment(AGREEMENT_FIRST, o) = choice.few.transpose();
    }
    integral.push_back(choice.integral);
    for (std::size_t r = 0; r < choice.series.size(); ++r)
      a.remains[r].col(j) = choice.series[r];
  }
  keep_used_integrands(&a, integral);
  return a;
}

std::vector<Eigen::VectorXd> disturbances(const Agreement &a, const std::vector<Matrix> &residual) {
  const Eigen::Map<const Eigen::RowVectorXd> inverse_sd(
      a.inverse_sd.data(), static_cast<Eigen::Index>(a.inverse_sd.size()));
  std::vector<Eigen::VectorXd> all;
  for (const Matrix &run : residual) {
    Eigen::VectorXd of_run(run.rows());
    for (Eigen::Index i = 0; i < run.rows(); ++i) {
      const Eigen::RowVectorXd in_sd = run.row(i).cwiseProduct(inverse_sd);
      of_run[i] = rimi_noise_disturbance(in_sd.data(), static_cast<std::size_t>(run.cols()));
    }
    all.push_back(of_run);
  }
  return all;
}

std::vector<std::uint8_t> agreement_section(const Agreement &a, std::size_t means) {
  SectionBytes bytes;
  bytes.u32(3);
  bytes.u32(static_cast<std::uint32_t>(a.inverse_sd.size()));
  bytes.u32(static_cast<std::uint32_t>(means));
  bytes.u32(static_cast<std::uint32_t>(a.integrands.size()));
  for (const double v : a.inverse_sd)
    bytes.f32(static_cast<float>(v));
  for (const std::uint8_t byte : integrand_bytes(a.integrands))
    bytes.u8(byte);
  for (const auto *numbers : {&a.integrand_inverse_sd, &a.partial}) {
    for (const double v : *numbers)
      bytes.f32(static_cast<float>(v));
  }
  for (Eigen::Index i = 0; i < a.row.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.row.cols(); ++j)
      bytes.f32(static_cast<float>(a.row(i, j)));
  }
  return bytes.bytes();
}

} // namespace rim
