// SPDX-License-Identifier: MIT
#include "train/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "image/image_writer.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "image/noise.h"
#include "image/rolled.h"
#include "search/search.h"
}

namespace rim {

namespace {

constexpr int kRounds = 25;         // of expectation and maximisation
constexpr Eigen::Index kFields = 4; // that fly
constexpr double kFlatField = 1e-3; // variance of a raw field's own part, below which it is dropped
constexpr double kMostRho = 0.97;
constexpr double kChance = 2.5; // standard deviations of a correlation of independent effects
constexpr double kRealCorrelation = 0.5; // what is more is kept, however few the runs
// Raw fields (rim_noise).
enum : Eigen::Index { kRawOne, kRawPrediction, kRawTrend, kRawDecay };
// Sums of so many blocks in a row may be larger than those of independent blocks by this factor, in
// their squares. Otherwise rho is raised, by so many halvings of its interval, each of so many
// rounds.
constexpr std::array<Eigen::Index, 4> kWidths = {4, 8, 16, 32};
constexpr double kSlowPower = 1.1;
constexpr Eigen::Index kLeastSums = 16; // in a run: what is slower is the run's own wander
constexpr double kRounding = 1e-12;     // of a run's squares: below, effects leave nothing
constexpr int kHalvings = 6, kHalvingRounds = 6;
// Squares of the prediction and of the activity, among a constant and the scale's terms.
constexpr Eigen::Index kSquare = 2, kSquareActivity = 4;
// Ridge of ln sigma(x), per block; and the number of runs of which it is one more.
constexpr double kEven = 0.02, kFewScaleRuns = 10.0;
constexpr double kSdOfMedian = 1.4826; // a Gaussian's sd by its median distance from 0
constexpr double kFewRuns = 3.0;       // a variance over n runs is raised by 1 + this / n

// What is new in a block counts up to so many standard deviations where that lowers their variance
// to this part or less: that of Gaussian noise becomes .995 of what it was. The limit is in
// standard deviations that it lowers itself, therefore so many rounds.
constexpr double kLimit = 3.0, kHeavyTails = 0.97;
constexpr int kLimitRounds = 4;

// One channel in one run.
struct Series {
  Eigen::VectorXd r, w; // residual; 1 / sigma(x) of what is new in it
  Eigen::MatrixXd raw;  // blocks x raw fields
  Eigen::VectorXd p;    // prediction, standardised
  Eigen::VectorXd activity, disturbance;
  bool is_moving(Eigen::Index i) const { return activity[i] > 0.0; }
  double mean() const { return r.sum() / std::max(known.sum(), 1.0); }
  Eigen::VectorXd known;   // 1; 0 where the residual says nothing: it is 0 then, and so becomes w
  Eigen::VectorXd follows; // 1; 0 where a block does not adjoin the one before
  Eigen::VectorXd next;    // 1; 0 where the block before is not known, or does not adjoin
  Eigen::VectorXd apart;   // 1 where the block before is known and does not adjoin, else 0
};

Eigen::MatrixXd raw_fields(const Basis &basis, const BlockRun &run, const Eigen::VectorXd &p,
                           const NoiseModel &noise) {
  const Matrix means = standard_means(basis, run);
  Eigen::MatrixXd raw(run.blocks(), NOISE_RAW_FIRST + means.cols());
  raw.col(kRawOne).setOnes();
  raw.col(kRawPrediction) = p;
  raw.col(kRawTrend) = (1.0 - (-(run.time_s.array() / noise.trend_s).max(0.0).min(40.0)).exp()) *
                       noise.trend_s / noise.run_s;
  raw.col(kRawDecay) = (-(run.time_s.array() / noise.decay_s).min(40.0)).exp();
  raw.rightCols(means.cols()) = means;
  return raw;
}

// A Gaussian's standard deviation by the middle of its sizes; 0 of none.
double sd_by_median(std::vector<double> *sizes) {
  if (sizes->empty())
    return 0.0;
  const auto middle = sizes->begin() + static_cast<std::ptrdiff_t>(sizes->size() / 2);
  std::nth_element(sizes->begin(), middle, sizes->end());
  return kSdOfMedian * *middle;
}

// The scatter of one outcome as the search counts it (rimi_search_limited): there in units of the
// standard deviation that is fitted to it, here of one that a few large values do not change.
void limit_scatter(std::vector<Series> *series) {
  std::vector<double> all;
  for (const Series &s : *series) {
    for (const double x : s.r)
      all.push_back(std::abs(x));
  }
  const double sd = sd_by_median(&all);
  if (!(sd > 0.0))
    return;
  for (Series &s : *series) {
    double before = 0.0;
    for (double &x : s.r) {
      const double z = x / sd;
      x = sd * rimi_search_limited(z, before);
      before = z;
    }
  }
}

// The mean over all blocks, which leaves them. An effect of a run has mean 0 over the runs: a share
// of repeats that every healthy run has would count as what runs differ by, and hide a fault as
// large.
double take_off_mean(std::vector<Series> *series) {
  double sum = 0.0, n = 0.0;
  for (const Series &s : *series) {
    sum += s.r.sum();
    n += s.known.sum();
  }
  const double mean = static_cast<double>(static_cast<float>(sum / std::max(n, 1.0)));
  for (Series &s : *series)
    s.r -= mean * s.known;
  return mean;
}

// What ln sigma(x) depends on, in every block of a run.
Eigen::MatrixXd scale_terms(const Series &s) {
  Eigen::MatrixXd x(s.r.size(), static_cast<Eigen::Index>(NOISE_SIGMA_TERMS));
  x.col(0) = s.p;
  x.col(1) = s.p.array().square() - 1.0;
  x.col(2) = s.activity;
  x.col(3) = s.activity.array().square() - 1.0;
  x.col(4) = s.disturbance;
  return x;
}

// rho(x): where predictions move no more than is usual, and where they move more.
struct Rho {
  double usual = 0.0, moving = 0.0;
  double of(bool is_moving) const { return is_moving ? moving : usual; }
};

Rho everywhere(double rho) { return {rho, rho}; }

// Lag-1 correlation of the series, the run's own mean and trend (effects of the run) taken off.
double correlation(const std::vector<Series> &series) {
  double power = 0.0, lag = 0.0;
  for (const Series &s : series) {
    if (s.r.size() < 2)
      continue;
    const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(s.r.size(), -1.0, 1.0) * s.known.array();
    Eigen::ArrayXd e = (s.r.array() - s.mean()) * s.known.array();
    e -= t * ((e * t).sum() / std::max(t.square().sum(), 1e-300));
    power += e.square().sum();
    lag += (e.tail(e.size() - 1) * e.head(e.size() - 1)).sum();
  }
  return power > 0.0 ? lag / power : 0.0;
}

// What is new in every block of noise that keeps rho of what it was: the filter that makes AR(1)
// noise white, sigma(x) not taken off.
Eigen::MatrixXd innovations(const Series &s, const Eigen::MatrixXd &x, const Rho &rho_of) {
  Eigen::MatrixXd y = x;
  for (Eigen::Index i = x.rows(); i-- > 0;) {
    const double rho = rho_of.of(s.is_moving(i));
    if (s.next[i] > 0.0)
      y.row(i) -= rho * x.row(i - 1);
    else if (s.apart[i] > 0.0)
      y.row(i) = rimi_noise_gap_weight(rho) * (y.row(i) - rho * x.row(i - 1));
    else
      y.row(i) *= std::sqrt(1.0 - rho * rho);
  }
  return y;
}

// The middle size of what is new in the known blocks, as a Gaussian's standard deviation.
double usual_size(const std::vector<Series> &series, const std::vector<Eigen::VectorXd> &fresh) {
  std::vector<double> all;
  for (std::size_t r = 0; r < series.size(); ++r) {
    for (Eigen::Index i = 0; i < fresh[r].size(); ++i) {
      if (series[r].known[i] > 0.0)
        all.push_back(std::abs(fresh[r][i]));
    }
  }
  return sd_by_median(&all);
}

// ln sigma(x): ridge of ln|e|, e what is new in a block, on the prediction, the activity, their
// squares and, for what the sensors say of each other, the disturbance: where the vehicle itself
// deviates, behaviour must show it.
void fit_scale(ChannelNoise *c, bool is_agreement, std::vector<Series> *series) {
  constexpr Eigen::Index terms = NOISE_SIGMA_TERMS;
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(terms + 1, terms + 1);
  Eigen::VectorXd cross = Eigen::VectorXd::Zero(terms + 1);
  const Rho rho = everywhere(std::clamp(correlation(*series), 0.0, kMostRho));
  std::vector<Eigen::VectorXd> fresh;
  double n = 0.0;
  for (const Series &s : *series) {
    const Eigen::VectorXd without_mean = (s.r.array() - s.mean()) * s.known.array();
    fresh.push_back(innovations(s, without_mean, rho));
    n += s.known.sum();
  }
  const double sd = usual_size(*series, fresh);
  if (!(sd > 0.0))
    return;
  for (std::size_t r = 0; r < series->size(); ++r) {
    const Series &s = (*series)[r];
    Eigen::MatrixXd x(s.r.size(), terms + 1);
    x.col(0).setOnes();
    x.rightCols(terms) = scale_terms(s);
    const Eigen::VectorXd ln = (fresh[r].array().abs() / sd).max(1e-2).log() + 0.57;
    // A block without one before it has no activity of its own to learn from.
    const Eigen::MatrixXd known = s.known.cwiseProduct(s.follows).asDiagonal() * x;
    gram += known.transpose() * x;
    cross += known.transpose() * ln;
  }
  // A scale is kept unless the data insist, and those of few runs show what these happened to do.
  const double few = kFewScaleRuns / static_cast<double>(series->size());
  gram.diagonal().tail(terms).array() += (kEven + few * few * few) * n;
  const auto leave_out = [&](Eigen::Index term) {
    gram.row(term).setZero();
    gram.col(term).setZero();
    gram(term, term) = 1.0;
    cross[term] = 0.0;
  };
  if (!is_agreement)
    leave_out(terms);
  Eigen::VectorXd b = gram.ldlt().solve(cross);
  for (const Eigen::Index square : {kSquare, kSquareActivity}) {
    if (b[square] < 0.0) { // far from the middle, where few blocks are, noise would seem to vanish
      leave_out(square);
      b = gram.ldlt().solve(cross);
    }
  }
  for (Eigen::Index i = 0; i < terms; ++i)
    c->ln_sigma[i] = static_cast<double>(static_cast<float>(b[i + 1]));
  const Eigen::Map<const Eigen::Matrix<double, terms, 1>> slope(c->ln_sigma);
  for (Series &s : *series)
    s.w = (-(scale_terms(s) * slope).array().max(-NOISE_LN_SIGMA).min(NOISE_LN_SIGMA)).exp() *
          s.known.array();
}

// Columns that make the raw fields orthonormal over the healthy blocks, one after the other: each
// is a raw field without what those before it have of it. One of which hardly anything is left is
// dropped, or the effects along it would swallow a fault.
Eigen::MatrixXd orthonormal(const std::vector<Series> &series) {
  const Eigen::Index k = series.front().raw.cols();
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(k, k);
  double n = 0.0;
  for (const Series &s : series) {
    m += s.raw.transpose() * s.raw;
    n += static_cast<double>(s.raw.rows());
  }
  m /= std::max(n, 1.0);
  std::vector<Eigen::Index> order = {kRawOne, kRawTrend, kRawDecay, kRawPrediction};
  for (Eigen::Index i = NOISE_RAW_FIRST; i < k; ++i)
    order.push_back(i);
  Eigen::MatrixXd t(k, 0);
  for (const Eigen::Index i : order) {
    Eigen::VectorXd v = Eigen::VectorXd::Unit(k, i);
    v -= t * (t.transpose() * m.col(i));
    const double left = v.dot(m * v);
    if (left <= kFlatField * static_cast<double>(k) * std::max(m(i, i), 1e-12))
      continue;
    t.conservativeResize(k, t.cols() + 1);
    t.col(t.cols() - 1) = v / std::sqrt(left);
  }
  return t;
}

// Correlations of effects that so many runs may show by chance are left out: a run that differs
// much along one field would be expected to differ along the other as well, and does not.
Eigen::MatrixXd without_chance(const Eigen::MatrixXd &prior, std::size_t runs) {
  const double chance = std::min(kRealCorrelation, kChance / std::sqrt(static_cast<double>(runs)));
  const Eigen::VectorXd sd = prior.diagonal().cwiseSqrt();
  return (prior.array().abs() >= chance * (sd * sd.transpose()).array()).select(prior, 0.0);
}

// Of the fields and the residual of a run, at most; on the stack, or most time goes into memory.
constexpr int kMostColumns = static_cast<int>(NOISE_MAX_RAW) + 1;
using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;

// All that a round of improve() needs of a run: products of its columns, the fields and then the
// residual, over its blocks, weighted by w^2. By them a round costs no pass over the blocks.
struct Products {
  // Of columns c and those of the block before, c-: sums of c c', c c-' and c- c-'.
  struct Lagged {
    Small own, cross, before;
  };
  struct Part {
    Lagged next, apart; // over blocks that adjoin the one before, and over those behind a gap
    Small first;        // c c' over those without one before
  };
  Part usual, moving; // blocks that move no more than is usual, and those that move more
  double known = 0.0; // blocks

  // The columns become the fields times t, and the residual as it is.
  Products of_fields(const Eigen::MatrixXd &t) const;
  // Of innovations(), times w: of all columns.
  Small of_innovations(const Rho &rho_of) const;
};

Products products_of(const Series &s) {
  const Eigen::Index k = s.raw.cols(), n = s.r.size();
  Eigen::MatrixXd c(n, k + 1), before = Eigen::MatrixXd::Zero(n, k + 1);
  c << s.raw, s.r;
  before.bottomRows(n - 1) = c.topRows(n - 1);
  const Eigen::VectorXd w2 = s.w.array().square();
  const auto lagged = [&](const Eigen::VectorXd &which) {
    const Eigen::VectorXd weight = w2.cwiseProduct(which);
    const Eigen::MatrixXd last = weight.asDiagonal() * before;
    return Products::Lagged{c.transpose() * (weight.asDiagonal() * c), c.transpose() * last,
                            before.transpose() * last};
  };
  const Eigen::VectorXd alone = ((s.next.array() > 0.0) || (s.apart.array() > 0.0)).select(0.0, w2);
  const auto part = [&](const Eigen::VectorXd &in) {
    return Products::Part{lagged(s.next.cwiseProduct(in)), lagged(s.apart.cwiseProduct(in)),
                          c.transpose() * (alone.cwiseProduct(in).asDiagonal() * c)};
  };
  const Eigen::VectorXd moving = (s.activity.array() > 0.0).cast<double>();
  return {part(1.0 - moving.array()), part(moving), s.known.sum()};
}

std::vector<Products> products_of(const std::vector<Series> &series) {
  std::vector<Products> all;
  all.reserve(series.size());
  for (const Series &s : series)
    all.push_back(products_of(s));
  return all;
}

Products Products::of_fields(const Eigen::MatrixXd &t) const {
  Small with = Small::Zero(t.rows() + 1, t.cols() + 1);
  with.topLeftCorner(t.rows(), t.cols()) = t;
  with(t.rows(), t.cols()) = 1.0;
  const auto to = [&](const Small &m) -> Small { return with.transpose() * (m * with); };
  const auto each = [&](const Lagged &m) { return Lagged{to(m.own), to(m.cross), to(m.before)}; };
  const auto part = [&](const Part &p) { return Part{each(p.next), each(p.apart), to(p.first)}; };
  return {part(usual), part(moving), known};
}

Small Products::of_innovations(const Rho &rho_of) const {
  const auto of_part = [](const Part &p, double rho) -> Small {
    const auto filtered = [&](const Lagged &m) -> Small {
      return m.own - rho * (m.cross + m.cross.transpose()) + rho * rho * m.before;
    };
    const double gap = rimi_noise_gap_weight(rho);
    return filtered(p.next) + gap * gap * filtered(p.apart) + (1.0 - rho * rho) * p.first;
  };
  return of_part(usual, rho_of.usual) + of_part(moving, rho_of.moving);
}

std::vector<Products> of_fields(const std::vector<Products> &runs, const Eigen::MatrixXd &t) {
  std::vector<Products> all;
  all.reserve(runs.size());
  for (const Products &run : runs)
    all.push_back(run.of_fields(t));
  return all;
}

struct Effects {
  Eigen::MatrixXd prior; // covariance of b
  double s2 = 1.0;
  Rho rho;
  bool is_rho_given = false;
};

// One round: estimates the effects of every run given prior, s2 and rho; then those given them,
// without rho where it is given. O(runs k^3) for k fields.
void improve(const std::vector<Products> &runs, bool diagonal, Effects *e) {
  const Eigen::Index k = e->prior.rows();
  const Small precision = e->prior.inverse();
  Small moments = Small::Zero(k, k);
  double squares = 0.0, n = 0.0, lag = 0.0, power = 0.0;
  for (const Products &run : runs) {
    const Small m = run.of_innovations(e->rho);
    const Small xx = m.topLeftCorner(k, k);
    const SmallVector xy = m.col(k).head(k);
    const Small v = (xx / e->s2 + precision).inverse();
    const SmallVector b = v * xy / e->s2;
    moments += b * b.transpose() + v;
    // |y - x b|^2 as a difference of sums, which have rounding.
    const double left = m(k, k) - 2.0 * b.dot(xy) + b.dot(xx * b);
    squares += std::max(left, kRounding * m(k, k)) + v.cwiseProduct(xx).sum();
    n += run.known;
    SmallVector rest(k + 1); // of the columns, that leaves the residual less the effects
    rest << -b, 1.0;
    for (const Products::Part *part : {&run.usual, &run.moving}) {
      lag += rest.dot(part->next.cross * rest);
      power += rest.dot(part->next.before * rest);
    }
  }
  moments /= static_cast<double>(runs.size());
  const Eigen::MatrixXd only = moments.diagonal().asDiagonal();
  e->prior = diagonal ? only : Eigen::MatrixXd(0.7 * moments + 0.3 * only);
  e->prior.diagonal().array() += 1e-9 * e->s2;
  e->s2 = std::max(squares / std::max(n, 1.0), 1e-300);
  if (!e->is_rho_given)
    e->rho = everywhere(std::clamp(power > 0.0 ? lag / power : 0.0, 0.0, kMostRho));
}

enum class Stretches { Every, Moving }; // Moving: half of the blocks move more than is usual

// The squares of the sums of several blocks in a row of what is new in them, over those of
// independent blocks; the largest over kWidths. What is not known of a run's effects is added.
double slow_power(const std::vector<Series> &series, const Eigen::MatrixXd &t, const Effects &e,
                  Stretches which) {
  const Eigen::MatrixXd precision = e.prior.inverse();
  std::array<double, kWidths.size()> power{}, blocks{};
  for (const Series &s : series) {
    const Eigen::MatrixXd x = s.w.asDiagonal() * innovations(s, s.raw * t, e.rho);
    const Eigen::VectorXd y = s.w.asDiagonal() * innovations(s, s.r, e.rho);
    const Eigen::MatrixXd v = (x.transpose() * x / e.s2 + precision).inverse();
    const Eigen::VectorXd rest = y - x * (v * (x.transpose() * y) / e.s2);
    for (std::size_t k = 0; k < kWidths.size(); ++k) {
      if (kLeastSums * kWidths[k] > rest.size())
        continue;
      for (Eigen::Index i = 0; i + kWidths[k] <= rest.size(); i += kWidths[k]) {
        const Eigen::Index moving = (s.activity.segment(i, kWidths[k]).array() > 0.0).count();
        if (which == Stretches::Moving && 2 * moving < kWidths[k])
          continue;
        const double sum = rest.segment(i, kWidths[k]).sum();
        const Eigen::VectorXd fields = x.middleRows(i, kWidths[k]).colwise().sum();
        power[k] += sum * sum + fields.dot(v * fields);
        blocks[k] += s.known.segment(i, kWidths[k]).sum();
      }
    }
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < kWidths.size(); ++k)
    largest = std::max(largest, power[k] / (std::max(blocks[k], 1.0) * e.s2));
  return largest;
}

// Noise of two speeds, quick and slow, has a small lag-1 correlation, and yet sums of many blocks
// that are far larger than AR(1) noise of that correlation has. Every hypothesis is such a sum: rho
// is raised until the sums are as large as they would be, and quick noise is thought larger than it
// is. Otherwise the inflation phi would answer, which makes the run's effects larger as well.
void raise_rho(const std::vector<Series> &series, const std::vector<Products> &runs,
               const Eigen::MatrixXd &t, Effects *e) {
  const auto raise = [&](Stretches which) {
    const auto is_slow = [&] { return slow_power(series, t, *e, which) > kSlowPower; };
    if (!is_slow())
      return;
    e->is_rho_given = true;
    double low = e->rho.moving, high = kMostRho;
    for (int i = 0; i < kHalvings; ++i) {
      const double rho = 0.5 * (low + high);
      e->rho = which == Stretches::Every ? everywhere(rho) : Rho{e->rho.usual, rho};
      for (int k = 0; k < kHalvingRounds; ++k)
        improve(runs, true, e);
      (is_slow() ? low : high) = rho;
    }
  };
  raise(Stretches::Every);
  raise(Stretches::Moving);
}

void fit_channel(ChannelNoise *c, const std::vector<Series> &series) {
  Eigen::MatrixXd t = orthonormal(series);
  Effects e;
  double squares = 0.0, n = 0.0;
  for (const Series &s : series) {
    squares += s.r.squaredNorm();
    n += s.known.sum();
  }
  const double power = std::max(squares / std::max(n, 1.0), 1e-24);
  const Eigen::Index raw = series.front().raw.cols();
  c->combination = Matrix::Zero(0, raw);
  if (!(squares > 0.0)) {
    c->active = false;
    return;
  }
  e.s2 = 0.5 * power;
  e.prior = Eigen::MatrixXd::Identity(t.cols(), t.cols()) * 0.3 * power;
  const std::vector<Products> of_raw = products_of(series);
  std::vector<Products> runs = of_fields(of_raw, t);
  for (int i = 0; i < kRounds; ++i)
    improve(runs, false, &e);
  e.prior = without_chance(e.prior, runs.size());
  // Principal effects: the few along which runs differ most.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(e.prior);
  const Eigen::Index kept = std::min(kFields, t.cols());
  const Eigen::MatrixXd leading = solver.eigenvectors().rightCols(kept).rowwise().reverse();
  t = t * leading;
  e.prior =
      solver.eigenvalues().tail(kept).reverse().array().max(1e-9 * e.s2).matrix().asDiagonal();
  runs = of_fields(of_raw, t);
  for (int i = 0; i < kRounds; ++i)
    improve(runs, true, &e);
  raise_rho(series, runs, t, &e);
  const double s = std::sqrt(e.s2);
  c->s = static_cast<double>(static_cast<float>(s));
  c->rho = static_cast<double>(static_cast<float>(e.rho.usual));
  c->rho_rise = static_cast<double>(static_cast<float>(e.rho.moving - e.rho.usual));
  const double raise = 1.0 + kFewRuns / static_cast<double>(series.size());
  c->combination.resize(kept, raw);
  double effects = 0.0;
  for (Eigen::Index k = 0; k < kept; ++k) {
    const double sd = std::sqrt(raise * e.prior(k, k));
    c->combination.row(k) = (t.col(k) * (sd / s)).transpose();
    effects += sd * sd;
  }
  c->effect_sd = std::sqrt(effects);
}

// The residuals as they count in flight (lib/src/search/search.c, limited()).
Eigen::VectorXd counted(const Series &s, const ChannelNoise &c) {
  Eigen::VectorXd r = s.r;
  noise_level level{};
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    if (!(s.known[i] > 0.0))
      continue;
    const bool is_after = s.next[i] > 0.0 || s.apart[i] > 0.0;
    const double rho = c.rho_of(s.is_moving(i));
    const double kept = is_after ? rho * r[i - 1] : 0.0;
    const double part = !is_after          ? std::sqrt(1.0 - rho * rho)
                        : s.apart[i] > 0.0 ? rimi_noise_gap_weight(rho)
                                           : 1.0;
    const double weight = s.w[i] * part / c.s;
    r[i] = kept + rimi_noise_counted((r[i] - kept) * weight, kLimit, &level) / weight;
  }
  return r;
}

// Limits what counts of a fitted channel where healthy runs have heavy tails, and fits it again.
void limit_channel(ChannelNoise *c, const std::vector<Series> &series) {
  ChannelNoise limited = *c;
  std::vector<Series> counts = series;
  for (int round = 0; round < kLimitRounds; ++round) {
    for (std::size_t k = 0; k < series.size(); ++k)
      counts[k].r = counted(series[k], limited);
    fit_channel(&limited, counts);
    if (!limited.active)
      return;
  }
  if (limited.s * limited.s > kHeavyTails * c->s * c->s)
    return;
  *c = limited;
  c->limit = kLimit;
}

} // namespace

Eigen::VectorXd expected(const SearchRun &run, Eigen::Index channel) {
  const Eigen::Index outcomes = run.predicted->cols();
  const Matrix &of = channel / outcomes == RIM_CHANNEL_AGREEMENT ? *run.agreed : *run.predicted;
  return of.col(channel % outcomes);
}

namespace {

// Centre and scale of what a channel's residuals are the rest of.
void standardise(const std::vector<SearchRun> &seen, Eigen::Index channel, ChannelNoise *c) {
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (const SearchRun &run : seen) {
    sum += expected(run, channel).sum();
    n += static_cast<double>(run.predicted->rows());
  }
  c->p_center = static_cast<double>(static_cast<float>(sum / std::max(n, 1.0)));
  for (const SearchRun &run : seen)
    squares += (expected(run, channel).array() - c->p_center).square().sum();
  c->p_scale = static_cast<double>(
      static_cast<float>(std::max(std::sqrt(squares / std::max(n, 1.0)), 1e-9)));
}

// rimi_noise_activity() of every run's blocks, NOISE_APART where none adjoins; and its mean.
std::vector<Eigen::VectorXd> activities(const std::vector<SearchRun> &seen, NoiseModel *noise) {
  std::vector<Eigen::VectorXd> all;
  double sum = 0.0, n = 0.0;
  const Eigen::Index outcomes = seen.front().predicted->cols();
  for (const SearchRun &run : seen) {
    Eigen::VectorXd activity = Eigen::VectorXd::Constant(run.predicted->rows(), NOISE_APART);
    for (Eigen::Index i = 1; i < activity.size(); ++i) {
      if (!run.blocks->follows[static_cast<std::size_t>(i)])
        continue;
      double squares = 0.0;
      for (Eigen::Index o = 0; o < outcomes; ++o)
        squares += rimi_noise_moved((*run.predicted)(i, o), (*run.predicted)(i - 1, o),
                                    noise->channels[static_cast<std::size_t>(o)].p_scale);
      activity[i] = rimi_noise_ln_moved(squares, static_cast<std::size_t>(outcomes));
      sum += activity[i];
      n += 1.0;
    }
    all.push_back(std::move(activity));
  }
  noise->activity = static_cast<double>(static_cast<float>(sum / std::max(n, 1.0)));
  for (std::size_t r = 0; r < all.size(); ++r) {
    for (Eigen::Index i = 1; i < all[r].size(); ++i) {
      if (seen[r].blocks->follows[static_cast<std::size_t>(i)])
        all[r][i] -= noise->activity;
    }
  }
  return all;
}

// 1 where a block adjoins one that is known.
Eigen::VectorXd followers(const BlockRun &run, const Eigen::VectorXd &known) {
  Eigen::VectorXd next = Eigen::VectorXd::Zero(known.size());
  for (Eigen::Index i = 1; i < known.size(); ++i)
    next[i] = run.follows[static_cast<std::size_t>(i)] ? known[i - 1] : 0.0;
  return next;
}

// 1 where a block follows on one that is known behind a gap.
Eigen::VectorXd behind_gaps(const BlockRun &run, const Eigen::VectorXd &known) {
  Eigen::VectorXd apart = Eigen::VectorXd::Zero(known.size());
  for (Eigen::Index i = 1; i < known.size(); ++i)
    apart[i] = run.follows[static_cast<std::size_t>(i)] ? 0.0 : known[i - 1];
  return apart;
}

// Over which states that are rolled forward go on from their readings (lib/src/image/rolled.h).
bool has_gap(const SearchRun &run, double block_s) {
  const Eigen::VectorXd &t_s = run.blocks->time_s;
  for (Eigen::Index i = 1; i < t_s.size(); ++i) {
    if (t_s[i] - t_s[i - 1] > ROLLED_LONGEST * block_s)
      return true;
  }
  return false;
}

} // namespace

NoiseModel fit_noise(const Basis &basis, const std::vector<SearchRun> &seen,
                     const std::vector<std::size_t> &which, double block_s) {
  NoiseModel noise;
  std::vector<double> length; // of all runs: the fields are the same whichever are fitted
  for (const SearchRun &run : seen)
    length.push_back(run.blocks->blocks() > 0 ? run.blocks->time_s[run.blocks->blocks() - 1] : 1.0);
  std::sort(length.begin(), length.end());
  noise.run_s = static_cast<double>(static_cast<float>(std::max(length[length.size() / 2], 1e-6)));
  noise.decay_s = static_cast<double>(static_cast<float>(noise.run_s / 10.0));
  noise.trend_s = static_cast<double>(static_cast<float>(-block_s / std::log(AGREEMENT_KEEPS)));
  noise.means = basis.means.size();
  const auto gaps = std::count_if(
      seen.begin(), seen.end(), [block_s](const SearchRun &run) { return has_gap(run, block_s); });
  noise.with_gaps = 2 * static_cast<std::size_t>(gaps) >= seen.size();
  noise.runs = which.size();
  const auto outcomes = seen.front().predicted->cols();
  noise.channels.resize(static_cast<std::size_t>(seen.front().residual->cols()));
  parallel_for(noise.channels.size(), [&](std::size_t channel) {
    standardise(seen, static_cast<Eigen::Index>(channel), &noise.channels[channel]);
  });
  const std::vector<Eigen::VectorXd> activity = activities(seen, &noise);
  parallel_for(noise.channels.size(), [&](std::size_t channel) {
    ChannelNoise &c = noise.channels[channel];
    const auto column = static_cast<Eigen::Index>(channel);
    const Eigen::Index outcome = column % outcomes;
    std::vector<Series> series;
    for (const std::size_t r : which) {
      const SearchRun &run = seen[r];
      Series s;
      s.known = Eigen::VectorXd::Ones(run.residual->rows());
      if (run.unknown != nullptr && column / outcomes == RIM_CHANNEL_AGREEMENT)
        s.known -= run.unknown->col(outcome);
      s.r = run.residual->col(column).cwiseProduct(s.known);
      s.w = s.known;
      s.follows = followers(*run.blocks, Eigen::VectorXd::Ones(s.known.size()));
      s.next = followers(*run.blocks, s.known);
      s.apart = behind_gaps(*run.blocks, s.known);
      s.p = ((expected(run, column).array() - c.p_center) / c.p_scale).max(-4.0).min(4.0);
      s.activity = activity[r];
      s.disturbance = *run.disturbance;
      s.raw = raw_fields(basis, *run.blocks, s.p, noise);
      series.push_back(std::move(s));
    }
    if (column / outcomes == RIM_CHANNEL_SCATTER)
      limit_scatter(&series);
    if (column / outcomes == RIM_CHANNEL_REPEAT)
      c.mean = take_off_mean(&series);
    if (column < 2 * outcomes || column / outcomes == RIM_CHANNEL_STEP)
      fit_scale(&c, column >= outcomes, &series);
    fit_channel(&c, series);
    if (column < 2 * outcomes && c.active)
      limit_channel(&c, series);
    c.phi.assign(NOISE_FAMILIES, 1.0);
  });
  return noise;
}

std::vector<std::uint8_t> noise_section(const NoiseModel &noise) {
  std::size_t fields = 1;
  const std::size_t raw = NOISE_RAW_FIRST + noise.means;
  for (const ChannelNoise &c : noise.channels)
    fields = std::max(fields, static_cast<std::size_t>(c.combination.rows()));
  SectionBytes bytes;
  bytes.u32(noise.with_gaps ? NOISE_LAYOUT_GAPS : NOISE_LAYOUT);
  bytes.u32(static_cast<std::uint32_t>(noise.channels.size()));
  bytes.u32(static_cast<std::uint32_t>(raw));
  bytes.u32(static_cast<std::uint32_t>(fields));
  bytes.f32(static_cast<float>(noise.run_s));
  bytes.f32(static_cast<float>(noise.decay_s));
  bytes.f32(static_cast<float>(noise.trend_s));
  bytes.u32(static_cast<std::uint32_t>(noise.runs));
  bytes.f32(static_cast<float>(noise.activity));
  for (const ChannelNoise &c : noise.channels) {
    for (const double v :
         {c.active ? std::max(1.0, c.limit) : 0.0, static_cast<double>(c.combination.rows()), c.rho,
          c.s, c.p_center, c.p_scale, c.ln_sigma[0], c.ln_sigma[1], c.ln_sigma[2], c.ln_sigma[3],
          c.ln_sigma[4], c.mean, c.rho_rise})
      bytes.f32(static_cast<float>(v));
    for (std::size_t k = 0; k < fields; ++k)
      bytes.f32(1.0F);
    for (std::size_t k = 0; k < fields; ++k) {
      for (std::size_t r = 0; r < raw; ++r) {
        const bool has = static_cast<Eigen::Index>(k) < c.combination.rows();
        bytes.f32(has ? static_cast<float>(c.combination(static_cast<Eigen::Index>(k),
                                                         static_cast<Eigen::Index>(r)))
                      : 0.0F);
      }
    }
    for (const double phi : c.phi)
      bytes.f32(static_cast<float>(phi));
  }
  return bytes.bytes();
}

} // namespace rim
