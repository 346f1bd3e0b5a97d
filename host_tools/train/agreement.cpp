// SPDX-License-Identifier: MIT
// What remains of one outcome from what remains of the others.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <Eigen/Cholesky>

#include "image/image_writer.hpp"
#include "stats/single.hpp"
#include "train/angle_sum.hpp"
#include "train/behaviour.hpp"
#include "train/integral.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "image/noise.h"
#include "image/quadratic.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

const std::vector<double> kRidges{10.0, 100.0, 1e3, 1e4};
constexpr std::size_t kFew = 4;          // others at most, each of which must lower the squared
constexpr double kFewWins = 0.1;         // error by this part, all of them to at most
constexpr double kFewMustExplain = 0.25; // this part of the outcome's variance
const std::vector<double> kProductRidges{1.0, 10.0, 100.0, 1e3, 1e4};
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
  add_folds(&of_all, false);
  return of_all;
}

// Variance of the estimate of a constant offset over half a run, for AR(1) noise as the series has
// it, the run's own mean and trend (effects of the run) taken off: what a channel is worth.
double offset_variance(const std::vector<Eigen::VectorXd> &series, std::size_t runs) {
  double power = 0.0, lag = 0.0, n = 0.0;
  for (std::size_t r = 0; r < runs; ++r) {
    const Eigen::VectorXd &s = series[r];
    const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(s.size(), -1.0, 1.0);
    Eigen::ArrayXd e = s.array() - s.mean();
    e -= t * ((e * t).sum() / t.square().sum());
    power += e.square().sum();
    lag += (e.tail(e.size() - 1) * e.head(e.size() - 1)).sum();
    n += static_cast<double>(e.size());
  }
  const double rho = std::clamp(power > 0.0 ? lag / power : 0.0, 0.0, 0.995);
  const double variance = power / std::max(n, 1.0) * (1.0 - rho * rho);
  const double half = 0.5 * n / static_cast<double>(runs);
  return variance / (1.0 + half * (1.0 - rho) * (1.0 - rho));
}

// Variance of the difference between the parts of a run before and after a time, over healthy runs:
// what wanders slowly in them is no autocorrelation of blocks, and hides an offset as well.
double difference_variance(const std::vector<Eigen::VectorXd> &series, std::size_t runs) {
  double squares = 0.0, n = 0.0;
  for (std::size_t r = 0; r < runs; ++r) {
    const Eigen::VectorXd &e = series[r];
    for (const double part : {0.25, 0.5, 0.75}) {
      const auto before = static_cast<Eigen::Index>(part * static_cast<double>(e.size()));
      if (before < 1)
        continue;
      const double d = e.tail(e.size() - before).mean() - e.head(before).mean();
      squares += 4.0 * part * (1.0 - part) * d * d; // as if it were in the middle
      n += 1.0;
    }
  }
  return squares / std::max(n, 1.0);
}

// What chooses among relations that compare readings: the geometric mean of both variances. The
// first alone takes noise for autocorrelated that wanders, the second is that of a few dozen runs.
double channel_variance(const std::vector<Eigen::VectorXd> &series, std::size_t runs) {
  return std::sqrt(offset_variance(series, runs) * difference_variance(series, runs));
}

bool is_angle_outcome(const Layout &layout, Eigen::Index outcome) {
  return rimi_blocks_turn(role_of_outcome(layout, static_cast<std::size_t>(outcome))) > 0.0;
}

// The few others that an outcome follows from, and the constant; none where they explain little.
std::vector<Eigen::Index> choose_few(const Regression &r, const Layout &layout,
                                     Eigen::Index outcome, Across across) {
  const Sums &all = r.sums(across)[kFolds];
  const Eigen::Index constant = all.gram.rows() - 1;
  double left = 0.0;
  for (std::size_t i = 0; i < r.runs; ++i)
    left += r.fitted(i, across).y.col(outcome).squaredNorm();
  const double own = left;
  std::vector<Eigen::Index> chosen = {constant};
  while (!is_angle_outcome(layout, outcome) && chosen.size() <= kFew) {
    double least = (1.0 - kFewWins) * left;
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < constant; ++j) {
      if (j == outcome || is_angle_outcome(layout, j) ||
          std::find(chosen.begin(), chosen.end(), j) != chosen.end())
        continue;
      std::vector<Eigen::Index> with = chosen;
      with.push_back(j);
      const Eigen::VectorXd w = solve(all, with, outcome);
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

void learn_scales(Agreement *a, const std::vector<Matrix> &residual, std::size_t runs) {
  for (Eigen::Index j = 0; j < residual.front().cols(); ++j) {
    double squares = 0.0, count = 0.0;
    for (std::size_t r = 0; r < runs; ++r) {
      squares += residual[r].col(j).squaredNorm();
      count += static_cast<double>(residual[r].rows());
    }
    const double sd = std::sqrt(squares / std::max(count, 1.0));
    a->inverse_sd.push_back(static_cast<double>(static_cast<float>(1.0 / std::max(sd, 1e-12))));
  }
}

// The outcomes in standard deviations, from products of readings.
Regression quadratic_regression(const Quadratic &products, const Layout &layout,
                                const Levels &levels, const RunStore &runs) {
  Regression of_all;
  of_all.runs = runs.size();
  of_all.rows = [&products, &layout, &levels, &runs](std::size_t r) {
    return Rows{quadratic_terms(products, layout, runs[r]),
                (runs[r].outcome.rowwise() - levels.mean).array().rowwise() / levels.sd.array()};
  };
  if (products.paired > 0)
    add_folds(&of_all, true);
  return of_all;
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
  add_folds(&linear, true);
  return linear;
}

// The relation by section LEVEL: what remains of the outcome, and its error over the behaviour's.
double level_remains(const RunStore &runs, const std::vector<Matrix> &level,
                     const std::vector<Matrix> &residual, Eigen::Index outcome,
                     std::vector<Eigen::VectorXd> *remains) {
  double squares = 0.0, own = 0.0;
  for (std::size_t r = 0; r < runs.all(); ++r) {
    (*remains)[r] = runs[r].outcome.col(outcome) - level[r].col(outcome);
    if (r >= runs.size())
      continue;
    squares += (*remains)[r].squaredNorm();
    own += residual[r].col(outcome).squaredNorm();
  }
  return std::sqrt(squares / std::max(own, 1e-300));
}

constexpr std::array<Across, 2> kBothAcross = {Across::all_blocks, Across::within_runs};
constexpr std::array<Readings, 2> kOthersReadings = {Readings::others, Readings::own_before};

// What the agreement of the outcomes is chosen from.
struct Sources {
  const Layout &layout;
  const RunStore &runs;
  const std::vector<Matrix> &residual, &level;
  const Levels &levels;
  Regression linear, few, integral;
  const Quadratic &products; // paired 0: there are none
  Regression quadratic;
  std::vector<Fit> from_residuals{};               // one per outcome
  std::array<std::vector<Fit>, 2> from_products{}; // per kBothAcross: (outcome, kOthersReadings)
};

// Of every outcome from the others' residuals, where there are others.
std::vector<Fit> fit_residuals(const Sources &from, Eigen::Index total) {
  const auto outcomes = static_cast<Eigen::Index>(from.layout.outcomes());
  std::vector<Target> targets;
  for (Eigen::Index j = 0; j < outcomes && outcomes > 1; ++j)
    targets.push_back({j, columns_without(outcomes, j, total)});
  return best_fits(from.linear, targets, kRidges);
}

// Of every outcome but angles from products of the others' readings, without and with its own of
// the block before, where there are products.
std::vector<Fit> fit_products(const Sources &from, Across across) {
  std::vector<Target> targets;
  const std::size_t outcomes = from.products.paired > 0 ? from.layout.outcomes() : 0;
  for (std::size_t outcome = 0; outcome < outcomes; ++outcome) {
    for (const Readings readings : kOthersReadings) {
      targets.push_back({static_cast<Eigen::Index>(outcome), {}});
      if (!is_angle_outcome(from.layout, targets.back().y))
        targets.back().columns = quadratic_columns(from.products, from.layout, outcome, readings);
    }
  }
  return best_fits(from.quadratic, targets, kProductRidges, across);
}

void fit_together(Sources *sources, Eigen::Index total) {
  sources->from_residuals = fit_residuals(*sources, total);
  for (std::size_t i = 0; i < kBothAcross.size(); ++i)
    sources->from_products[i] = fit_products(*sources, kBothAcross[i]);
}

// What the regressors leave of a target in one run.
Eigen::VectorXd left_over(const Rows &rows, Eigen::Index target, const Eigen::VectorXd &weight) {
  return rows.y.col(target) - rows.x * weight;
}

// What products leave of blocks that do not follow on another: flight does not look at it.
void drop_first(const BlockRun &run, Eigen::VectorXd *left) {
  for (Eigen::Index i = 0; i < left->size(); ++i) {
    if (!run.follows[static_cast<std::size_t>(i)])
      (*left)[i] = 0.0;
  }
}

// One outcome's relation: the one that shows an offset over half a run best.
class Choice {
public:
  Choice(const Sources &from, const Agreement &scales, Eigen::Index outcome)
      : from_(from), a_(scales), j_(outcome),
        role_(role_of_outcome(from.layout, static_cast<std::size_t>(outcome))),
        remains_(from.runs.all()) {}

  // Nothing of the others.
  void start_from_behaviour() {
    for (std::size_t r = 0; r < remains_.size(); ++r)
      remains_[r] = from_.residual[r].col(j_);
    take(AGREEMENT_RESIDUALS, 1.0);
  }
  // The others' residuals.
  void try_residuals();
  // A few others' readings.
  void try_few(Across across);
  // Other angles.
  void try_angles(std::optional<Eigen::Index> without = std::nullopt);
  // Section LEVEL.
  void try_level() {
    const double part = level_remains(from_.runs, from_.level, from_.residual, j_, &remains_);
    const double of_both = channel_variance(remains_, from_.runs.size());
    // Better for an offset and no worse for both, or an integral comes, of which the offset is all.
    const double of_offset = offset_variance(remains_, from_.runs.size());
    const bool shows_more = of_both < of_channel && of_offset < kMustWin * variance;
    if (of_both < kMustWin * of_channel || shows_more)
      take(AGREEMENT_LEVEL, part);
  }
  // Products of the others' readings, and of its own of the block before.
  void try_quadratic(Across across, Fit fit);
  // The integral of others.
  void try_integral() {
    const std::uint16_t feature = from_.layout.outcome_feature[static_cast<std::size_t>(j_)];
    const std::vector<Eigen::Index> others = choose_integrands(from_.integral, a_, j_, {feature});
    if (others.empty())
      return;
    const Fit fit = plain_fit(from_.integral, others, j_);
    integrates = fit.squares < (1.0 - kIntegrates) * fit.own;
    if (integrates)
      integrand = mostly_integrated(a_, from_.layout, fit.weight[kFolds], from_.runs);
    std::vector<Integral> without;
    for (const Eigen::VectorXd &w : fit.weight)
      without.push_back({w, 0.0});
    take_integral(without);
    // What compares readings shows a bias from the start too; no lag makes up for that.
    if (integrates && source == AGREEMENT_INTEGRAL)
      take_integral(with_lag(a_, from_.runs, j_, others, fit.weight));
  }
  // The outcome that mostly integrates this one, where there is one: the clearest. The integral is
  // of this one, not of its twin.
  void try_into(Eigen::Index twin);

  int source = AGREEMENT_RESIDUALS;
  bool integrates = false; // its changes are mostly those of the integral, if that was tried
  double error = 1.0, variance = 1e300, of_channel = 1e300, integrand = -1.0, intercept = 0.0;
  Eigen::VectorXd weight, few, quadratic; // of the residuals, the readings, their products
  Integral integral;
  Eigen::Index into = -1; // INTO: the outcome that integrates this one
  std::vector<Eigen::VectorXd> series;

  // Of its row in the section, behind the source.
  double second_number() const {
    return source == AGREEMENT_INTO       ? static_cast<double>(into)
           : source == AGREEMENT_INTEGRAL ? integral.constant
           : source == AGREEMENT_FEW      ? intercept
                                          : 0.0;
  }
  // What was expected of a run's outcome (rimi_agreement_evaluate).
  Eigen::VectorXd expected(std::size_t run, const Matrix &predicted) const {
    if (source == AGREEMENT_INTEGRAL || source == AGREEMENT_INTO)
      return integrated_[run];
    if (source == AGREEMENT_RESIDUALS)
      return predicted.col(j_);
    return from_.runs[run].outcome.col(j_) - series[run];
  }

private:
  struct Few {
    Eigen::VectorXd weight;
    double intercept;
  };
  Few few_in_image(const Eigen::VectorXd &w) const;
  double leave(const Regression &of, const Fit &fit, const std::vector<double> &off);
  // Whether what remains_ says is better by kMustWin; a fit within runs, which leaves what runs
  // differ by, also has no larger error by as much: the effects of runs would swallow a fault.
  bool wins(Across across, double of_behaviour) const {
    const bool is_close = kMustWin * of_behaviour * of_behaviour <= error * error;
    return channel_variance(remains_, from_.runs.size()) < kMustWin * of_channel &&
           (across == Across::all_blocks || is_close);
  }
  void take_integral(const std::vector<Integral> &plain);
  void take(int which, double of_behaviour) {
    source = which;
    for (Eigen::VectorXd &run : remains_)
      run = wrapped(run, role_);
    error = of_behaviour;
    variance = offset_variance(remains_, from_.runs.size());
    of_channel = channel_variance(remains_, from_.runs.size());
    series = remains_;
  }
  const Sources &from_;
  const Agreement &a_;
  Eigen::Index j_;
  std::uint8_t role_;
  std::vector<Eigen::VectorXd> remains_, integrated_;
};

void Choice::try_residuals() {
  const Fit &fit = from_.from_residuals[static_cast<std::size_t>(j_)];
  const double inverse_sd = a_.inverse_sd[static_cast<std::size_t>(j_)];
  for (std::size_t r = 0; r < remains_.size(); ++r) {
    const Eigen::VectorXd &w = fit.weight[from_.runs.fold(r)];
    remains_[r] = left_over(from_.linear.rows(r), j_, w) / inverse_sd;
  }
  weight = fit.weight[kFolds];
  take(AGREEMENT_RESIDUALS, std::sqrt(fit.squares / std::max(fit.own, 1e-300)));
}

// remains_: what a fit to the readings leaves, whose intercepts in an image are off by `off`, of
// each fold. Returns its error over behaviour's.
double Choice::leave(const Regression &of, const Fit &fit, const std::vector<double> &off) {
  double left = 0.0, own = 0.0;
  for (std::size_t r = 0; r < remains_.size(); ++r) {
    const Eigen::VectorXd &w = fit.weight[from_.runs.fold(r)];
    remains_[r] = left_over(of.rows(r), j_, w) * from_.levels.sd[j_];
    remains_[r].array() -= off[from_.runs.fold(r)];
    if (r >= from_.runs.size())
      continue;
    left += remains_[r].squaredNorm();
    own += from_.residual[r].col(j_).squaredNorm();
  }
  return std::sqrt(left / std::max(own, 1e-300));
}

// Weights of the readings in their units, as an image holds them, and the intercept they need.
Choice::Few Choice::few_in_image(const Eigen::VectorXd &w) const {
  const double sd = from_.levels.sd[j_];
  Few in_units{w.head(w.size() - 1).array() * sd / from_.levels.sd.transpose().array(), 0.0};
  in_units.weight = in_units.weight.cast<float>().cast<double>().eval();
  in_units.intercept =
      from_.levels.mean[j_] + sd * w[w.size() - 1] - in_units.weight.dot(from_.levels.mean);
  return in_units;
}

void Choice::try_few(Across across) {
  const std::vector<Eigen::Index> others = choose_few(from_.few, from_.layout, j_, across);
  if (others.empty())
    return;
  const Fit fit = plain_fit(from_.few, others, j_, across);
  const Few in_image = few_in_image(fit.weight[kFolds]);
  std::vector<double> off;
  for (const Eigen::VectorXd &w : fit.weight)
    off.push_back(rounding(few_in_image(w).intercept));
  const double of_behaviour = leave(from_.few, fit, off);
  if (!wins(across, of_behaviour))
    return;
  few = in_image.weight;
  intercept = in_image.intercept;
  take(AGREEMENT_FEW, of_behaviour);
}

void Choice::try_angles(std::optional<Eigen::Index> without) {
  const std::optional<AngleSum> sum = angle_sum(from_.layout, from_.runs, j_, without);
  if (!sum)
    return;
  double left = 0.0, own = 0.0;
  for (std::size_t r = 0; r < remains_.size(); ++r) {
    const Matrix &outcome = from_.runs[r].outcome;
    remains_[r] =
        wrapped(outcome.col(j_) - outcome * sum->weight -
                    Eigen::VectorXd::Constant(outcome.rows(), sum->constant[from_.runs.fold(r)]),
                role_);
    if (r >= from_.runs.size())
      continue;
    left += remains_[r].squaredNorm();
    own += from_.residual[r].col(j_).squaredNorm();
  }
  const double of_behaviour = std::sqrt(left / std::max(own, 1e-300));
  if (!wins(Across::all_blocks, of_behaviour))
    return;
  few = sum->weight;
  intercept = sum->constant[kFolds];
  take(AGREEMENT_FEW, of_behaviour);
}

void Choice::try_quadratic(Across across, Fit fit) {
  const auto outcome = static_cast<std::size_t>(j_);
  const Eigen::Index own = from_.layout.outcome_feature[outcome];
  const double mean = from_.levels.mean[j_], sd = from_.levels.sd[j_];
  for (Eigen::VectorXd &w : fit.weight) {
    const double g = slope_along_own(from_.products, own, sd, w);
    if (g > kMostOwn)
      return;
    show_offset_in_full(from_.products, own, mean, sd, g, &w);
  }
  std::vector<double> off;
  for (const Eigen::VectorXd &w : fit.weight)
    off.push_back(rounding(mean + sd * w[0]));
  const double of_behaviour = leave(from_.quadratic, fit, off);
  for (std::size_t r = 0; r < remains_.size(); ++r)
    drop_first(from_.runs[r], &remains_[r]);
  if (!wins(across, of_behaviour))
    return;
  quadratic = sd * fit.weight[kFolds];
  quadratic[0] += mean;
  take(AGREEMENT_QUADRATIC, of_behaviour);
}

void Choice::take_integral(const std::vector<Integral> &plain) {
  const std::vector<Integral> of = with_constant(a_, from_.runs, j_, plain);
  std::vector<Eigen::VectorXd> change;
  for (std::size_t r = 0; r < remains_.size(); ++r) {
    Summed sum = summed(a_, from_.runs, r, j_, of[from_.runs.fold(r)]);
    remains_[r] = std::move(sum.remains);
    change.push_back(std::move(sum.integrated));
  }
  if (offset_variance(remains_, from_.runs.size()) >= kMustWin * variance)
    return;
  integral = of[kFolds];
  integrated_ = std::move(change);
  take(AGREEMENT_INTEGRAL, error);
}

void Choice::try_into(Eigen::Index twin) {
  const auto &feature = from_.layout.outcome_feature;
  const auto feature_of = [&feature](Eigen::Index o) {
    return feature[static_cast<std::size_t>(o)];
  };
  double least = 1.0 - kIntegrates;
  for (Eigen::Index o = 0; o < static_cast<Eigen::Index>(feature.size()); ++o) {
    if (o == j_ || o == twin)
      continue;
    const std::vector<Eigen::Index> others =
        choose_integrands(from_.integral, a_, o, {feature_of(o), feature_of(twin)});
    if (others.empty())
      continue;
    const Fit fit = plain_fit(from_.integral, others, o);
    const bool mostly = mostly_integrated(a_, from_.layout, fit.weight[kFolds], from_.runs) ==
                        static_cast<double>(j_);
    if (!mostly || fit.squares >= least * fit.own)
      continue;
    least = fit.squares / fit.own;
    into = o;
    const std::vector<Integral> of = with_lag(a_, from_.runs, o, others, fit.weight);
    integral = of[kFolds];
    integrated_.clear();
    for (std::size_t r = 0; r < remains_.size(); ++r) {
      Summed sum = summed(a_, from_.runs, r, o, of[from_.runs.fold(r)]);
      remains_[r] = -sum.remains;
      integrated_.push_back(std::move(sum.integrated));
    }
    take(AGREEMENT_INTO, std::sqrt(least));
  }
}

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
    choice->try_residuals();
  for (const Across across : kBothAcross) {
    if (o > 1 && has_integrands)
      choice->try_few(across);
  }
  if (is_angle_outcome(sources.layout, j))
    choice->try_angles();
  else if (!sources.level.empty())
    choice->try_level();
  // Where one other reading says the same, the two are compared with each other.
  if (sources.products.paired > 0 && !is_angle_outcome(sources.layout, j) &&
      only_other(*choice, a.inverse_sd.size()) == a.inverse_sd.size()) {
    for (std::size_t k = 0; k < kOthersReadings.size(); ++k) {
      for (std::size_t i = 0; i < kBothAcross.size(); ++i)
        choice->try_quadratic(kBothAcross[i],
                              sources.from_products[i][kOthersReadings.size() * outcome + k]);
    }
  }
  if (o > 1 && has_integrands)
    choice->try_integral();
  return choice;
}

// Of two that follow from each other alone, both say the same: the second is free to say what moves
// it, or what it moves; or, an angle, which others it is the sum of.
void free_twins(const Sources &sources, const Agreement &a,
                std::vector<std::unique_ptr<Choice>> *choices) {
  for (std::size_t j = 0; j < choices->size(); ++j) {
    const std::size_t twin = only_other(*(*choices)[j], choices->size());
    if (twin >= j || only_other(*(*choices)[twin], choices->size()) != j)
      continue;
    auto other = std::make_unique<Choice>(sources, a, static_cast<Eigen::Index>(j));
    other->start_from_behaviour();
    if (is_angle_outcome(sources.layout, static_cast<Eigen::Index>(j)))
      other->try_angles(static_cast<Eigen::Index>(twin));
    other->try_integral();
    if (other->source == AGREEMENT_RESIDUALS ||
        (other->source == AGREEMENT_INTEGRAL && !other->integrates))
      other->try_into(static_cast<Eigen::Index>(twin));
    if (other->source == AGREEMENT_INTO || other->source == AGREEMENT_FEW ||
        (other->source == AGREEMENT_INTEGRAL && other->integrates))
      (*choices)[j] = std::move(other);
  }
}

// What an outcome does next, from commands and from the readings of the block before.
struct Step {
  Eigen::VectorXd weight; // empty: there is no such model
  std::vector<Eigen::VectorXd> remains;
};

Step take_step(const Sources &from, std::size_t outcome, Fit fit) {
  const auto j = static_cast<Eigen::Index>(outcome);
  const double mean = from.levels.mean[j], sd = from.levels.sd[j];
  const Eigen::Index own = from.layout.outcome_feature[outcome];
  Step step;
  for (Eigen::VectorXd &w : fit.weight) {
    const double g = std::clamp(slope_along_own(from.products, own, sd, w), 0.0, kMostOwn);
    show_offset_in_full(from.products, own, mean, sd, g, &w);
  }
  for (std::size_t r = 0; r < from.runs.all(); ++r) {
    Eigen::VectorXd left = sd * left_over(from.quadratic.rows(r), j, fit.weight[from.runs.fold(r)]);
    drop_first(from.runs[r], &left);
    step.remains.push_back(std::move(left));
  }
  step.weight = sd * fit.weight[kFolds];
  step.weight[0] += mean;
  return step;
}

// Adds the steps of all outcomes but angles, where there are products.
void learn_steps(const Sources &sources, Agreement *a) {
  std::vector<Step> steps(a->inverse_sd.size());
  std::vector<Target> targets;
  for (std::size_t j = 0; j < steps.size() && sources.products.paired > 0; ++j) {
    const auto y = static_cast<Eigen::Index>(j);
    if (!is_angle_outcome(sources.layout, y))
      targets.push_back(
          {y, quadratic_columns(sources.products, sources.layout, j, Readings::before)});
  }
  const std::vector<Fit> fits = best_fits(sources.quadratic, targets, kProductRidges);
  parallel_for(targets.size(), [&](std::size_t i) {
    const auto j = static_cast<std::size_t>(targets[i].y);
    steps[j] = take_step(sources, j, fits[i]);
  });
  for (std::size_t r = 0; r < sources.runs.all(); ++r)
    a->steps.push_back(Matrix::Zero(sources.runs[r].blocks(), a->row.rows()));
  for (std::size_t j = 0; j < steps.size(); ++j) {
    a->has_step.push_back(steps[j].weight.size() > 0);
    if (!a->has_step[j])
      continue;
    a->quadratic.models.push_back({RIM_QUADRATIC_STEPS, j, steps[j].weight});
    for (std::size_t r = 0; r < a->steps.size(); ++r)
      a->steps[r].col(static_cast<Eigen::Index>(j)) = steps[j].remains[r];
  }
}

} // namespace

Agreement fit_agreement(const Layout &layout, const Basis &basis,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        const std::vector<Matrix> &residual, const std::vector<Matrix> &predicted,
                        const std::vector<Matrix> &level, bool products, bool steps) {
  const Eigen::Index o = residual.front().cols();
  const Eigen::Index total = o * (2 + static_cast<Eigen::Index>(basis.means.size()));
  Agreement a;
  a.integrands = integrands;
  learn_scales(&a, residual, runs.size());
  learn_integrands(&a, layout, runs);
  const Levels levels = learn_levels(runs);
  if (products)
    a.quadratic = quadratic_inputs(layout, runs);
  Sources sources{layout,
                  runs,
                  residual,
                  level,
                  levels,
                  linear_regression(a, basis, runs, residual),
                  level_regression(levels, runs),
                  integral_regression(a, runs),
                  a.quadratic,
                  quadratic_regression(a.quadratic, layout, levels, runs)};
  fit_together(&sources, total);
  a.row = Matrix::Zero(o, AGREEMENT_FIRST + total);
  a.error.assign(static_cast<std::size_t>(o), 1.0);
  a.source.assign(static_cast<std::size_t>(o), AGREEMENT_RESIDUALS);
  a.remains = residual;
  a.expected = predicted;
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
    a.row(j, 1) = choice.second_number();
    a.row(j, 2) = choice.integrand;
    if (choice.source == AGREEMENT_RESIDUALS && choice.weight.size() > 0)
      a.row.row(j).tail(total) = choice.weight.transpose();
    if (choice.source == AGREEMENT_FEW)
      a.row.row(j).segment(AGREEMENT_FIRST, o) = choice.few.transpose();
    if (choice.source == AGREEMENT_QUADRATIC)
      a.quadratic.models.push_back({RIM_QUADRATIC_AGREES, outcome, choice.quadratic});
    a.row(j, 3) = choice.integral.lag;
    integral.push_back(choice.integral.weight);
    for (std::size_t r = 0; r < choice.series.size(); ++r) {
      a.remains[r].col(j) = choice.series[r];
      a.expected[r].col(j) = choice.expected(r, predicted[r]);
    }
  }
  keep_used_integrands(&a, integral);
  if (steps)
    learn_steps(sources, &a);
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
  bytes.f32s(a.inverse_sd);
  for (const std::uint8_t byte : integrand_bytes(a.integrands))
    bytes.u8(byte);
  bytes.f32s(a.integrand_inverse_sd);
  bytes.f32s(a.partial);
  for (Eigen::Index i = 0; i < a.row.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.row.cols(); ++j)
      bytes.f32(static_cast<float>(a.row(i, j)));
  }
  return bytes.bytes();
}

} // namespace rim
