// SPDX-License-Identifier: MIT
#include "train/behaviour.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "stats/single.hpp"
#include "train/angle_sum.hpp"
#include "train/choose_models.hpp"
#include "train/fitter.hpp"
#include "train/leave_out.hpp"
#include "train/rolled.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

// Mean and 1 / standard deviation of a column, from its sums.
double center_of(double sum, double n) { return sum / std::max(n, 1.0); }

double inverse_of(double squares, double mean, double n) {
  const double sd = std::sqrt(squares / std::max(n, 1.0));
  return static_cast<double>(
      static_cast<float>(sd > 1e-9 * (1e-9 + std::abs(mean)) ? 1.0 / sd : 1e-6));
}

// Mean and 1 / standard deviation of every column of a matrix over all runs, which are gone through
// twice, in their order; matrix(r): that of run r.
template <class MatrixOf>
void learn(std::size_t runs, const MatrixOf &matrix, std::vector<double> *center,
           std::vector<double> *inverse) {
  std::vector<double> sum(center->size(), 0.0), squares = sum;
  double n = 0.0;
  for (std::size_t r = 0; r < runs; ++r) {
    const auto m = matrix(r);
    n += static_cast<double>(m->rows());
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += m->col(static_cast<Eigen::Index>(i)).sum();
  }
  for (std::size_t r = 0; r < runs; ++r) {
    const auto m = matrix(r);
    for (std::size_t i = 0; i < sum.size(); ++i)
      squares[i] +=
          (m->col(static_cast<Eigen::Index>(i)).array() - center_of(sum[i], n)).square().sum();
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double mean = center_of(sum[i], n);
    (*center)[i] = single(mean);
    (*inverse)[i] = inverse_of(squares[i], mean, n);
  }
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

void learn_terms(Basis *basis, const RunStore &runs) {
  // The wide matrices stay alive while their terms are looked at.
  const auto terms = [&](std::size_t r) {
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    return std::shared_ptr<const Matrix>(wide, &wide->terms);
  };
  learn(runs.size(), terms, &basis->center, &basis->inverse_sd);
}

void learn_means(Basis *basis, const RunStore &runs) {
  learn(
      runs.size(), [&](std::size_t r) { return &runs[r].means; }, &basis->mean_center,
      &basis->mean_inverse_sd);
}

namespace {

bool all_are_single(const std::vector<double> &numbers) {
  return std::all_of(numbers.begin(), numbers.end(),
                     [](double x) { return std::isfinite(single(x)); });
}

double error_of_run(const Eigen::VectorXd &e) {
  double within = 0.0;
  return run_error(e, &within);
}
// One target's model: weights[fold], the last of all runs, and its column of Fitter::y().
struct FoldModels {
  std::vector<Eigen::VectorXd> weight;
  std::vector<double> intercept;
  Eigen::Index column = 0;
};

// What the weights of one run's fold say of it, and the mean that is left of it by every other's.
struct RunPrediction {
  Matrix by_weights; // blocks x targets
  Matrix rest;       // targets x (kFolds + 1)
};

RunPrediction predict_run(const Fitter &fitter, const std::vector<FoldModels> &models,
                          std::size_t r) {
  const Matrix x = fitter.x(r);
  const auto targets = static_cast<Eigen::Index>(models.size());
  RunPrediction p{Matrix(x.rows(), targets), Matrix::Zero(targets, kFolds + 1)};
  for (Eigen::Index t = 0; t < targets; ++t) {
    const FoldModels &m = models[static_cast<std::size_t>(t)];
    for (std::size_t f = 0; f <= kFolds; ++f) {
      if (fitter.runs().fold(r) == f)
        p.by_weights.col(t) = x * m.weight[f];
      else if (r < fitter.runs().size())
        p.rest(t, static_cast<Eigen::Index>(f)) =
            fitter.y(r).col(m.column).mean() - (x * m.weight[f]).mean();
    }
  }
  return p;
}

// Predictions without the intercepts, per run; fills the intercepts: so that the mean error of the
// runs is zero, since terms have mean zero over all runs, not over a fold. They are as an image
// holds them: the noise of healthy runs has in it what that is off by.
std::vector<Matrix> predict_runs(const Fitter &fitter, std::vector<FoldModels> *models) {
  const RunStore &runs = fitter.runs();
  std::vector<Matrix> by_weights(runs.all());
  Matrix sum = Matrix::Zero(static_cast<Eigen::Index>(models->size()), kFolds + 1);
  double n[kFolds + 1] = {};
  parallel_in_order(
      runs.all(), [&](std::size_t r) { return predict_run(fitter, *models, r); },
      [&](std::size_t r, RunPrediction p) {
        by_weights[r] = std::move(p.by_weights);
        for (std::size_t f = 0; f <= kFolds && r < runs.size(); ++f) {
          if (r % kFolds == f)
            continue;
          sum.col(static_cast<Eigen::Index>(f)) += p.rest.col(static_cast<Eigen::Index>(f));
          n[f] += 1.0;
        }
      });
  for (std::size_t t = 0; t < models->size(); ++t) {
    FoldModels &m = (*models)[t];
    for (std::size_t f = 0; f <= kFolds; ++f)
      m.intercept.push_back(
          single(fitter.mean()[m.column] +
                 sum(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(f)) / n[f]));
  }
  return by_weights;
}

// What a target's models say of every run that they have not seen.
void judge_target(const Fitter &fitter, const Layout &layout, const RunStore &runs,
                  const std::vector<Matrix> &by_weights, const FoldModels &of_folds, std::size_t t,
                  Behaviour *b) {
  TargetModel &model = b->targets[t];
  const std::size_t outcomes = b->targets.size() / 2;
  const std::uint8_t role = t < outcomes ? role_of_outcome(layout, t) : std::uint8_t{0};
  const auto i = static_cast<Eigen::Index>(t % outcomes);
  double squares = 0.0, spread = 0.0, n = 0.0;
  for (std::size_t r = 0; r < runs.all(); ++r) {
    Eigen::VectorXd p =
        by_weights[r].col(static_cast<Eigen::Index>(t)).array() + of_folds.intercept[runs.fold(r)];
    if (model.initial)
      p.array() += runs[r].first[i];
    const Eigen::VectorXd y = t < outcomes ? runs[r].outcome.col(i) : runs[r].scatter.col(i);
    const Eigen::VectorXd e = wrapped(y - p, role);
    if (t < outcomes) {
      b->predicted[r].col(i) = p;
      b->residual[r].col(i) = e;
    } else {
      b->scatter[r].col(i) = e;
    }
    if (r >= runs.size())
      continue;
    squares += e.squaredNorm();
    const double mean = fitter.mean()[static_cast<Eigen::Index>(t)];
    spread += wrapped(y.array() - mean, role).squaredNorm();
    n += static_cast<double>(y.size());
  }
  model.weight = of_folds.weight[kFolds];
  model.intercept = of_folds.intercept[kFolds];
  model.error = std::sqrt(squares / n);
  model.r2 = spread > 0.0 ? 1.0 - squares / spread : 0.0;
}

// The models of all targets as they were chosen.
Behaviour fit_targets(const Fitter &fitter, const Basis &basis, const Layout &layout,
                      const RunStore &runs, const std::vector<TargetModel> &targets) {
  const std::size_t outcomes = layout.outcomes();
  Behaviour b;
  b.targets = targets;
  std::vector<FoldModels> models(2 * outcomes);
  parallel_for(2 * outcomes, [&](std::size_t t) {
    const TargetModel &model = b.targets[t];
    models[t].column = static_cast<Eigen::Index>(model.initial ? 2 * outcomes + t : t);
    const auto used = terms_of(basis, layout, model, t);
    for (std::size_t f = 0; f <= kFolds; ++f)
      models[t].weight.push_back(fitter.weights(used, model.ridge, f, models[t].column));
  });
  const std::vector<Matrix> by_weights = predict_runs(fitter, &models);
  for (std::size_t r = 0; r < runs.all(); ++r) {
    for (auto *matrices : {&b.predicted, &b.residual, &b.scatter})
      matrices->emplace_back(runs[r].blocks(), static_cast<Eigen::Index>(outcomes));
  }
  parallel_for(2 * outcomes, [&](std::size_t t) {
    judge_target(fitter, layout, runs, by_weights, models[t], t, &b);
  });
  return b;
}

} // namespace

Behaviour fit_behaviour(Basis *basis, const Layout &layout,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        double block_s) {
  learn_terms(basis, runs);
  learn_means(basis, runs);
  auto fitter = std::make_unique<Fitter>(*basis, runs, nullptr);
  const std::vector<bool> integrated = integrated_outcomes(layout, integrands, runs);
  Chosen chosen = choose_targets(*fitter, *basis, layout, integrated, runs);
  const std::vector<std::uint16_t> inputs = drivers(*basis, layout, chosen.outside);
  const Rolled rolled = fit_rolled(*basis, runs, worth_rolling(*fitter, chosen, layout), inputs,
                                   block_s, error_of_run);
  const Basis without = *basis;
  if (add_rolled_terms(basis, rolled, inputs)) {
    const auto all = [&](std::size_t r) {
      return std::make_shared<const Matrix>(
          with_rolled(*basis, runs.wide(r)->terms, rolled.values[r]));
    };
    learn(runs.size(), all, &basis->center, &basis->inverse_sd);
    if (all_are_single(basis->center)) {
      fitter = std::make_unique<Fitter>(*basis, runs, &rolled.values);
      choose_states(*fitter, *basis, layout, &chosen);
    } else { // products of states that an image could not hold
      *basis = without;
    }
  }
  for (const auto less : {&TargetModel::quick, &TargetModel::still})
    choose_less(*fitter, *basis, layout, less, &chosen);
  leave_out(*fitter, *basis, layout, &chosen.targets);
  return fit_targets(*fitter, *basis, layout, runs, chosen.targets);
}

} // namespace rim
