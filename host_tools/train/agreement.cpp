// SPDX-License-Identifier: MIT
// What remains of one outcome from what remains of the others.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "train/behaviour.hpp"
#include "image/image_writer.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
const double kRidges[] = {10.0, 100.0, 1e3, 1e4};
// A relation of physics holds outside of what was trained too, if it is not shrunk.
const double kIntegralRidges[] = {1e-6};
// Part of the changes that others must explain for an outcome to be called their integral.
constexpr double kIntegrates = 0.5;
constexpr std::size_t kIntegrands = 3;  // at most, each of which must lower the squared error
constexpr double kIntegrandWins = 0.05; // by this part
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

// Regressors, targets (one per outcome), and their sums per fold left out; fold kFolds: of all.
struct Regression {
  std::vector<Matrix> x, y;
  std::vector<Sums> folds;
};

void add_folds(Regression *r, Eigen::Index clip_from) {
  const Eigen::Index p = r->x.front().cols(), o = r->y.front().cols();
  std::vector<Sums> sums(r->x.size());
  parallel_for(r->x.size(), [&](std::size_t i) {
    sums[i].gram = r->x[i].transpose() * r->x[i];
    // An outcome that is far off is no guide to what healthy ones say of each other.
    const Matrix y = clip_from > 0
                         ? Matrix(r->y[i].array().max(-AGREEMENT_CLIP).min(AGREEMENT_CLIP).matrix())
                         : r->y[i];
    sums[i].cross = r->x[i].transpose() * y;
  });
  r->folds.assign(kFolds + 1, {Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, o)});
  for (std::size_t f = 0; f <= kFolds; ++f) {
    for (std::size_t i = 0; i < r->x.size(); ++i) {
      if (i % kFolds == f)
        continue;
      r->folds[f].gram += sums[i].gram;
      r->folds[f].cross += sums[i].cross;
    }
  }
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
  Fit best;
  best.squares = 1e300;
  for (const double ridge : ridges) {
    Fit fit;
    for (std::size_t f = 0; f < kFolds; ++f) {
      fit.weight.push_back(solve(r.folds[f], columns, y, ridge));
      for (std::size_t i = f; i < r.x.size(); i += kFolds) {
        fit.squares += (r.y[i].col(y) - r.x[i] * fit.weight[f]).squaredNorm();
        fit.own += r.y[i].col(y).squaredNorm();
      }
    }
    if (fit.squares >= best.squares)
      continue;
    fit.weight.push_back(solve(r.folds[kFolds], columns, y, ridge));
    best = fit;
  }
  return best;
}

void learn_levels(Agreement *a, const std::vector<BlockRun> &runs, Eigen::Index o) {
  for (Eigen::Index j = 0; j < o; ++j) {
    double n = 0.0, sum = 0.0, squares = 0.0;
    for (const BlockRun &run : runs) {
      sum += run.outcome.col(j).sum();
      n += static_cast<double>(run.blocks());
    }
    const double mean = sum / std::max(n, 1.0);
    for (const BlockRun &run : runs)
      squares += (run.outcome.col(j).array() - mean).square().sum();
    const double sd = std::sqrt(squares / std::max(n, 1.0));
    a->level_inverse_sd.push_back(
        static_cast<double>(static_cast<float>(1.0 / std::max(sd, 1e-9 * (1.0 + std::abs(mean))))));
  }
}

// Values of all outcomes in standard deviations, of this block and the one before.
Matrix levels(const Agreement &a, const BlockRun &run) {
  const Eigen::Index n = run.blocks(), o = run.outcome.cols();
  Matrix x = Matrix::Zero(n, 2 * o);
  for (Eigen::Index j = 0; j < o; ++j)
    x.col(j) = run.outcome.col(j) * a.level_inverse_sd[static_cast<std::size_t>(j)];
  if (n > 1)
    x.block(1, o, n - 1, o) = x.topLeftCorner(n - 1, o);
  return x;
}

// Changes of the outcomes from the sums of two blocks' levels, which is the trapezium rule: rows
// whose block follows the one before.
Regression integral_regression(const Agreement &a, const std::vector<BlockRun> &runs) {
  Regression r;
  for (const BlockRun &run : runs) {
    const Matrix x = levels(a, run);
    const Eigen::Index o = run.outcome.cols();
    Matrix rows(run.blocks(), o), y(run.blocks(), o);
    Eigen::Index n = 0;
    for (Eigen::Index i = 1; i < run.blocks(); ++i) {
      if (!run.follows[static_cast<std::size_t>(i)])
        continue;
      rows.row(n) = x.row(i).head(o) + x.row(i).tail(o);
      y.row(n++) = run.outcome.row(i) - run.outcome.row(i - 1);
    }
    r.x.push_back(rows.topRows(n));
    r.y.push_back(y.topRows(n));
  }
  add_folds(&r, 0);
  return r;
}

// What the flight code sums up over a run.
Eigen::VectorXd integral_remains(const Agreement &a, const BlockRun &run, Eigen::Index outcome,
                                 const Eigen::VectorXd &weight) {
  const Matrix x = levels(a, run);
  const Eigen::Index o = run.outcome.cols();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(run.blocks());
  for (Eigen::Index i = 0; i < run.blocks(); ++i) {
    const double before = i > 0 ? sum[i - 1] : 0.0;
    sum[i] = before;
    if (!run.follows[static_cast<std::size_t>(i)])
      continue;
    const double change = (x.row(i).head(o) + x.row(i).tail(o)).dot(weight);
    sum[i] =
        AGREEMENT_KEEPS * before + run.outcome(i, outcome) - run.outcome(i - 1, outcome) - change;
  }
  return sum;
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

// The few others that explain an outcome's change: more would explain noise by noise.
std::vector<Eigen::Index> choose_integrands(const Regression &r, Eigen::Index outcome) {
  const Sums &all = r.folds[kFolds];
  double own = 0.0;
  for (const Matrix &y : r.y)
    own += y.col(outcome).squaredNorm();
  std::vector<Eigen::Index> chosen;
  double left = own;
  while (chosen.size() < kIntegrands) {
    double least = left;
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < all.gram.rows(); ++j) {
      if (j == outcome || std::find(chosen.begin(), chosen.end(), j) != chosen.end())
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
    if (best < 0 || least > (1.0 - kIntegrandWins) * left)
      break;
    left = least;
    chosen.push_back(best);
  }
  return chosen;
}

// The outcome that this one mostly integrates: the largest effect.
void name_integrand(Agreement *a, Eigen::Index outcome, const Eigen::VectorXd &weight) {
  const Eigen::Index o = a->row.rows();
  double most = 0.0, all = 0.0;
  Eigen::Index best = -1;
  for (Eigen::Index j = 0; j < o; ++j) {
    const double effect = std::abs(weight[j]);
    all += effect * effect;
    if (effect > most) {
      most = effect;
      best = j;
    }
  }
  if (most * most < 0.5 * all)
    best = -1;
  a->row(outcome, 2) = static_cast<double>(best);
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
Regression linear_regression(const Agreement &a, const Basis &basis,
                             const std::vector<BlockRun> &runs,
                             const std::vector<Matrix> &residual) {
  Regression linear;
  linear.x.resize(runs.size());
  linear.y.resize(runs.size());
  parallel_for(runs.size(), [&](std::size_t r) {
    linear.x[r] = regressors(residual[r], a.inverse_sd, standard_means(basis, runs[r]));
    linear.y[r] = residual[r];
    for (Eigen::Index j = 0; j < residual[r].cols(); ++j)
      linear.y[r].col(j) *= a.inverse_sd[static_cast<std::size_t>(j)];
  });
  add_folds(&linear, 1);
  return linear;
}

// The relation by section LEVEL: what remains of the outcome, and its error over the behaviour's.
double level_remains(const std::vector<BlockRun> &runs, const std::vector<Matrix> &level,
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

} // namespace

Agreement fit_agreement(const Basis &basis, const std::vector<BlockRun> &runs,
                        const std::vector<Matrix> &residual, const std::vector<Matrix> &level,
                        bool may_integrate) {
  const std::size_t n = runs.size();
  const Eigen::Index o = residual.front().cols();
  const auto m = static_cast<Eigen::Index>(basis.means.size());
  const Eigen::Index total = o * (2 + m);
  Agreement a;
  learn_scales(&a, residual);
  learn_levels(&a, runs, o);
  const Regression linear = linear_regression(a, basis, runs, residual);
  const Regression integral = integral_regression(a, runs);
  a.row = Matrix::Zero(o, AGREEMENT_FIRST + total);
  a.row.col(2).setConstant(-1.0);
  a.error.assign(static_cast<std::size_t>(o), 1.0);
  a.source.assign(static_cast<std::size_t>(o), AGREEMENT_RESIDUALS);
  a.remains = residual;
  parallel_for(static_cast<std::size_t>(o), [&](std::size_t outcome) {
    const auto j = static_cast<Eigen::Index>(outcome);
    std::vector<Eigen::VectorXd> remains(n);
    const auto take = [&](int source, const std::vector<Eigen::VectorXd> &series) {
      a.source[outcome] = source;
      a.row(j, 0) = source;
      for (std::size_t r = 0; r < n; ++r)
        a.remains[r].col(j) = series[r];
    };
    const std::vector<Eigen::Index> columns = columns_without(o, j, total);
    double best = 1e300;
    if (o > 1) {
      const Fit fit = best_fit(linear, columns, j, kRidges);
      a.error[outcome] = std::sqrt(fit.squares / std::max(fit.own, 1e-300));
      a.row.row(j).tail(total) = fit.weight[kFolds].transpose();
      for (std::size_t r = 0; r < n; ++r)
        remains[r] =
            (linear.y[r].col(j) - linear.x[r] * fit.weight[r % kFolds]) / a.inverse_sd[outcome];
      best = offset_variance(remains);
      take(AGREEMENT_RESIDUALS, remains);
    }
    if (!level.empty()) {
      const double error = level_remains(runs, level, residual, j, &remains);
      const double variance = offset_variance(remains);
      if (variance < kMustWin * best) {
        best = variance;
        a.error[outcome] = error;
        take(AGREEMENT_LEVEL, remains);
      }
    }
    if (o > 1 && may_integrate) {
      const std::vector<Eigen::Index> others = choose_integrands(integral, j);
      if (others.empty())
        return;
      const Fit fit = best_fit(integral, others, j, kIntegralRidges);
      if (fit.squares < (1.0 - kIntegrates) * fit.own)
        name_integrand(&a, j, fit.weight[kFolds]);
      for (std::size_t r = 0; r < n; ++r)
        remains[r] = integral_remains(a, runs[r], j, fit.weight[r % kFolds]);
      if (offset_variance(remains) < kMustWin * best) {
        take(AGREEMENT_INTEGRAL, remains);
        const Eigen::VectorXd &w = fit.weight[kFolds];
        a.row.row(j).tail(total).setZero();
        a.row.row(j).segment(AGREEMENT_FIRST, o) = w.transpose();
        a.row.row(j).segment(AGREEMENT_FIRST + o, o) = w.transpose();
      }
    }
  });
  return a;
}

std::vector<std::uint8_t> agreement_section(const Agreement &a, std::size_t means) {
  SectionBytes bytes;
  bytes.u32(2);
  bytes.u32(static_cast<std::uint32_t>(a.inverse_sd.size()));
  bytes.u32(static_cast<std::uint32_t>(means));
  bytes.u32(0);
  for (const auto *numbers : {&a.inverse_sd, &a.level_inverse_sd}) {
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
