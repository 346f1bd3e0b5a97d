// SPDX-License-Identifier: MIT
// Outcomes as integrals of others.
#include "train/integral.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

constexpr double kIntegrandWins = 0.05; // part by which each integrand must lower the squared error
constexpr double kProductWins = 0.2;    // part of what a product explains that is not counted
constexpr double kConstantWins = 0.8;   // of the squares of what remains, at most, with a constant

// Integrands over the time from block to block, in standard deviations, each integrand being later
// than what integrates it by `lag` blocks.
Matrix integrated(const Agreement &a, const WideBlocks &run, double lag) {
  Matrix x = Matrix::Zero(run.early.rows(), run.early.cols());
  for (Eigen::Index i = 1; i < x.rows(); ++i)
    x.row(i) =
        run.early.row(i) + run.late.row(i - 1) -
        lag * (run.early.row(i) + run.late.row(i) - run.early.row(i - 1) - run.late.row(i - 1));
  for (Eigen::Index g = 0; g < x.cols(); ++g)
    x.col(g) *= a.integrand_inverse_sd[static_cast<std::size_t>(g)];
  return x;
}

} // namespace

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

Regression integral_regression(const Agreement &a, const RunStore &runs) {
  Regression of_all;
  of_all.runs = runs.size();
  of_all.rows = [&a, &runs](std::size_t r) {
    const BlockRun &run = runs[r];
    const Matrix x = integrated(a, *runs.wide(r), 0.0);
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
  add_folds(&of_all, false);
  return of_all;
}

// The weights and the lag of `outcome` by least squares, per fold left out and of all runs, from
// weights without a lag. A lag moves what the integrands changed by; a reading that is half a
// sampling period late shows that in every turn, and would hide a bias of the rate.
std::vector<Integral> with_lag(const Agreement &a, const RunStore &runs, Eigen::Index outcome,
                               const std::vector<Eigen::Index> &columns,
                               const std::vector<Eigen::VectorXd> &weight) {
  const auto k = static_cast<Eigen::Index>(columns.size());
  std::vector<Eigen::MatrixXd> gram(weight.size(), Eigen::MatrixXd::Zero(k + 1, k + 1));
  std::vector<Eigen::VectorXd> cross(weight.size(), Eigen::VectorXd::Zero(k + 1));
  Eigen::VectorXd x(k + 1);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const BlockRun &run = runs[r];
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    const Matrix plain = integrated(a, *wide, 0.0), late = integrated(a, *wide, 1.0) - plain;
    for (std::size_t f = 0; f < weight.size(); ++f) {
      if (r % kFolds == f)
        continue;
      const Eigen::VectorXd lagging = late * weight[f];
      for (Eigen::Index i = 1; i < run.blocks(); ++i) {
        if (!run.follows[static_cast<std::size_t>(i)])
          continue;
        for (Eigen::Index c = 0; c < k; ++c)
          x[c] = plain(i, columns[static_cast<std::size_t>(c)]);
        x[k] = lagging[i];
        gram[f] += x * x.transpose();
        cross[f] += x * (run.outcome(i, outcome) - run.outcome(i - 1, outcome));
      }
    }
  }
  std::vector<Integral> all;
  for (std::size_t f = 0; f < weight.size(); ++f) {
    gram[f].diagonal().array() += kUnshrunk;
    const Eigen::VectorXd w = gram[f].ldlt().solve(cross[f]);
    Integral of{
        Eigen::VectorXd::Zero(weight[f].size()),
        static_cast<double>(static_cast<float>(std::clamp(w[k], -AGREEMENT_LAG, AGREEMENT_LAG)))};
    for (Eigen::Index c = 0; c < k; ++c)
      of.weight[columns[static_cast<std::size_t>(c)]] =
          static_cast<double>(static_cast<float>(w[c]));
    all.push_back(std::move(of));
  }
  return all;
}

std::vector<Integral> with_constant(const Agreement &a, const RunStore &runs, Eigen::Index outcome,
                                    std::vector<Integral> of) {
  // Of every fold's relation: what it leaves of the changes, over the runs it learnt from.
  std::vector<double> left(of.size(), 0.0), blocks(of.size(), 0.0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const BlockRun &run = runs[r];
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    for (std::size_t f = 0; f < of.size(); ++f) {
      if (r % kFolds == f)
        continue;
      const Eigen::VectorXd change = integrated(a, *wide, of[f].lag) * of[f].weight;
      for (Eigen::Index i = 1; i < run.blocks(); ++i) {
        if (!run.follows[static_cast<std::size_t>(i)])
          continue;
        left[f] += run.outcome(i, outcome) - run.outcome(i - 1, outcome) - change[i];
        blocks[f] += 1.0;
      }
    }
  }
  std::vector<Integral> with = of;
  for (std::size_t f = 0; f < of.size(); ++f)
    with[f].constant = static_cast<double>(static_cast<float>(left[f] / std::max(blocks[f], 1.0)));
  double without = 0.0, squares = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    without += summed(a, runs, r, outcome, of[runs.fold(r)]).remains.squaredNorm();
    squares += summed(a, runs, r, outcome, with[runs.fold(r)]).remains.squaredNorm();
  }
  return squares <= kConstantWins * without ? with : of;
}

Summed summed(const Agreement &a, const RunStore &runs, std::size_t r, Eigen::Index outcome,
              const Integral &of) {
  const BlockRun &run = runs[r];
  const Eigen::VectorXd change =
      (integrated(a, *runs.wide(r), of.lag) * of.weight).array() + of.constant;
  Summed sum{Eigen::VectorXd::Zero(run.blocks()), Eigen::VectorXd::Zero(run.blocks())};
  for (Eigen::Index i = 1; i < run.blocks(); ++i) {
    sum.remains[i] = sum.remains[i - 1];
    sum.integrated[i] = sum.integrated[i - 1];
    if (!run.follows[static_cast<std::size_t>(i)])
      continue;
    sum.remains[i] = AGREEMENT_KEEPS * sum.remains[i - 1] + run.outcome(i, outcome) -
                     run.outcome(i - 1, outcome) - change[i];
    sum.integrated[i] = AGREEMENT_KEEPS * sum.integrated[i - 1] + change[i];
  }
  return sum;
}

// More than a few would explain noise by noise. A product must explain clearly more than any single
// outcome.
std::vector<Eigen::Index> choose_integrands(const Regression &r, const Agreement &a,
                                            Eigen::Index outcome,
                                            const std::vector<std::uint16_t> &without) {
  const auto is_without = [&without](std::uint16_t feature) {
    return std::find(without.begin(), without.end(), feature) != without.end();
  };
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
      if (is_without(of.a) || is_without(of.b) ||
          std::find(chosen.begin(), chosen.end(), g) != chosen.end())
        continue;
      std::vector<Eigen::Index> with = chosen;
      with.push_back(g);
      const Eigen::VectorXd w = solve(all, with, outcome);
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

// Its usual variation has the largest effect.
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
    const auto others = choose_integrands(changes, a, j, {layout.outcome_feature[o]});
    if (others.empty())
      return;
    const Fit fit = plain_fit(changes, others, j);
    of[o] = fit.squares < (1.0 - kIntegrates) * fit.own ? 1 : 0;
  });
  for (std::size_t o = 0; o < of.size(); ++o)
    integrated[o] = of[o] != 0;
  return integrated;
}

} // namespace rim
