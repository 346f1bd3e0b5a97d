// SPDX-License-Identifier: MIT
#include "train/begin.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "image/image_writer.hpp"
#include "train/choose_models.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

constexpr std::size_t kMostRuns = 48;
constexpr double kBeginAlike = 0.05; // standard deviation of the first rows, over the range
// The past must lower the error by so much, on average over the outcomes.
constexpr double kBeginMustWin = 0.02;
// Blocks after this part of a run are later ones.
constexpr double kLaterFrom = 0.1;
// As one of these a first block must be likelier, and by so many nats more than any first one was.
// Where every first one is clearer, also without the outcome that tells it best, one that is less
// clear by so many nats, and by this part of what they have at least, is none already.
constexpr double kLateNats = 3.0, kLatePart = 0.1;
constexpr double kLeastSd = 0.01; // of a feature's range
// A mean tells of itself where less than this part of it comes from before the first row.
constexpr double kMostFromBefore = 0.5;

// Sums of a weighted straight line g(u).
struct Line {
  double n = 0.0, u = 0.0, g = 0.0, uu = 0.0, ug = 0.0;
  void add(double weight, double x, double y) {
    n += weight;
    u += weight * x;
    g += weight * y;
    uu += weight * x * x;
    ug += weight * x * y;
  }
  // {offset, slope}; an input that does not vary says nothing.
  std::pair<double, double> fit() const {
    const double spread = uu - u * u / std::max(n, 1e-300);
    if (!(n > 0.0) || spread <= 1e-12 * uu)
      return {0.0, 1.0};
    const double slope = (ug - u * g / n) / spread;
    return {(g - slope * u) / n, slope};
  }
};

// runs: with means that are 0 before the first row.
std::vector<double> begin_of(const Basis &basis, const RunStore &runs, double period_s) {
  const std::size_t times = basis.share.size();
  std::vector<Eigen::Index> term(basis.inputs.size() * times, -1); // of every filter
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    if (basis.terms[i].op == BASIS_MEAN)
      term[basis.terms[i].a] = static_cast<Eigen::Index>(i);
  }
  std::vector<Line> lines(term.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    for (std::size_t f = 0; f < term.size(); ++f) {
      if (rimi_basis_is_movement(basis.inputs[f / times].b))
        continue; // nothing moved before the first row
      const Eigen::Index input = term[f - f % times];
      for (Eigen::Index b = 0; b < runs[r].blocks() && term[f] >= 0 && input >= 0; ++b) {
        const double rows = runs[r].time_s[b] / period_s + 1.0;
        const double before = std::pow(1.0 - basis.share[f % times], rows);
        if (before < kMostFromBefore)
          lines[f].add(1.0 - before, wide->terms(b, input),
                       wide->terms(b, term[f]) / (1.0 - before));
      }
    }
  }
  std::vector<double> begin;
  for (const Line &line : lines) {
    const auto [offset, slope] = line.fit();
    begin.push_back(offset);
    begin.push_back(slope);
  }
  return begin;
}

} // namespace

std::vector<std::size_t> runs_for_begin(const Survey &survey) {
  const Layout &layout = survey.layout;
  bool differ = false;
  for (std::size_t f = 0; f < layout.features() && !layout.external; ++f) {
    if (is_outcome(layout, f))
      continue;
    double n = 0.0, sum = 0.0, squares = 0.0;
    for (const RunFacts &run : survey.runs) {
      if (run.rows == 0)
        continue;
      n += 1.0;
      sum += run.features[f].first;
      squares += run.features[f].first * run.features[f].first;
    }
    const double variance = (squares - sum * sum / std::max(n, 1.0)) / std::max(n - 1.0, 1.0);
    differ |= std::sqrt(std::max(variance, 0.0)) > kBeginAlike * (survey.high(f) - survey.low(f));
  }
  std::vector<std::size_t> chosen;
  const std::size_t count = std::min(kMostRuns, survey.runs.size());
  for (std::size_t k = 0; k < count && differ; ++k)
    chosen.push_back(k * survey.runs.size() / count);
  return chosen;
}

namespace {

std::vector<double> errors_with(Basis basis, const RunStore &runs) {
  learn_terms(&basis, runs);
  const Fitter fitter(basis, runs, nullptr);
  return screened(fitter, basis, basis.first.size(), {});
}

} // namespace

void learn_begin(Basis *basis, double period_s,
                 const std::function<RunStore(const Basis &)> &blocks) {
  Basis other = *basis;
  other.begin.assign(2 * basis->inputs.size() * basis->share.size(), 0.0);
  other.begin = begin_of(*basis, blocks(other), period_s);
  const std::vector<double> as_first = errors_with(*basis, blocks(*basis));
  const std::vector<double> as_usual = errors_with(other, blocks(other));
  double gain = 0.0;
  for (std::size_t o = 0; o < as_first.size(); ++o)
    gain += std::log(std::max(as_first[o], 1e-300) / std::max(as_usual[o], 1e-300));
  if (gain > kBeginMustWin * static_cast<double>(as_first.size()))
    basis->begin = other.begin;
}

namespace {

// Sums over blocks of their features, less `from`: numbers near zero keep their digits.
struct Moments {
  Eigen::VectorXd from, sum;
  Eigen::MatrixXd products;
  double n = 0.0, runs = 0.0; // blocks, and the runs that they are of
  explicit Moments(const Eigen::VectorXd &x)
      : from(x), sum(Eigen::VectorXd::Zero(x.size())),
        products(Eigen::MatrixXd::Zero(x.size(), x.size())) {}
  void add(const Eigen::VectorXd &x, double times = 1.0) { // -1: takes it away
    const Eigen::VectorXd d = x - from;
    sum += times * d;
    products += times * d * d.transpose();
    n += times;
  }
  Eigen::VectorXd mean() const { return from + sum / n; }
  Eigen::MatrixXd covariance() const { return products / n - (sum / n) * (sum / n).transpose(); }
};

// Correlations of the features but angles, shrunk towards none by as much as is best in the mean
// for blocks of so many runs (Schaefer and Strimmer 2005, their target D), at least a little: two
// sensors of the same may agree to the last digit.
Eigen::MatrixXd correlations(const Moments &of, const Layout &layout) {
  constexpr double least = 0.02;
  Eigen::MatrixXd r = of.covariance();
  const Eigen::VectorXd sd = r.diagonal().cwiseMax(0.0).cwiseSqrt();
  double squares = 0.0, variance = 0.0;
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    for (Eigen::Index j = 0; j < r.cols(); ++j) {
      const bool goes_along = sd[i] > 0.0 && sd[j] > 0.0 &&
                              !is_angle(layout, static_cast<std::size_t>(i)) &&
                              !is_angle(layout, static_cast<std::size_t>(j));
      r(i, j) = goes_along && i != j ? std::clamp(r(i, j) / (sd[i] * sd[j]), -1.0, 1.0) : 0.0;
      const double rest = 1.0 - r(i, j) * r(i, j);
      squares += r(i, j) * r(i, j);
      variance += goes_along && i != j ? rest * rest / std::max(of.runs - 1.0, 1.0) : 0.0;
    }
  }
  r *= 1.0 - std::clamp(variance / std::max(squares, 1e-300), least, 1.0);
  r.diagonal().setOnes();
  return r;
}

// The lower triangle of the inverse correlations, by rows. Returns ln det of the correlations.
double learn_inverse(const Moments &of, const Layout &layout, std::vector<double> *triangle) {
  const Eigen::MatrixXd r = correlations(of, layout);
  const Eigen::LLT<Eigen::MatrixXd> llt(r);
  const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(r.rows(), r.cols()));
  triangle->clear();
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j)
      triangle->push_back(inverse(i, j));
  }
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

// By how many nats a first block is rather a later one: without the outcome that says most for it,
// as begins_late() in lib/src/monitor/blocks_unknown.c, and without the one that says most against
// it, whose sensor might be wrong.
struct Later {
  double without_for, without_against;
};

class LaterTest {
public:
  // constant: what is the same for every block.
  LaterTest(const Basis &basis, const Layout &layout, double constant)
      : layout_(layout), constant_(constant) {
    later_.f32(0.0F);
    for (const auto *numbers :
         {&basis.later, &basis.later_sd, &basis.start_inverse, &basis.later_inverse})
      later_.f32s(*numbers);
    start_.f32s(basis.start);
    start_sd_.f32s(basis.start_sd);
    view_.start = start_.bytes().data();
    view_.start_sd = start_sd_.bytes().data();
    view_.later = later_.bytes().data();
  }
  Later operator()(const Eigen::VectorXd &start) const {
    const auto features = static_cast<std::uint32_t>(start.size());
    basis_place place;
    rimi_basis_place(&view_, features, start.data(), &place);
    double nats = constant_, most = 0.0, least = 0.0;
    for (std::uint32_t f = 0; f < features; ++f) {
      double alone = 0.0;
      nats += rimi_basis_later(&view_, features, &place, f, &alone);
      if (!is_outcome(layout_, f))
        continue;
      most = std::max(most, alone);
      least = std::min(least, alone);
    }
    return {nats - most, nats - least};
  }

private:
  const Layout &layout_;
  double constant_;
  SectionBytes start_, start_sd_, later_;
  rim_basis view_{};
};

// The first blocks of the runs, and the later ones.
struct Blocks {
  Moments first, later;
  Eigen::ArrayXd low, high; // of all blocks
};

Blocks blocks_of(const RunStore &runs, const Eigen::VectorXd &from) {
  Blocks blocks{Moments(from), Moments(from), from, from};
  for (const BlockRun &run : runs) {
    blocks.later.runs += 1.0;
    if (run.start.size() > 0) {
      blocks.first.add(run.start);
      blocks.first.runs += 1.0;
    }
    const auto first = static_cast<Eigen::Index>(kLaterFrom * static_cast<double>(run.blocks()));
    for (Eigen::Index b = 0; b < run.blocks(); ++b) {
      const Eigen::VectorXd x = run.context.row(b);
      blocks.low = blocks.low.min(x.array());
      blocks.high = blocks.high.max(x.array());
      if (b > first)
        blocks.later.add(x);
    }
  }
  return blocks;
}

// The likeliness as a later block that no run's first one has, by the constants above. The
// correlations are those of the other runs.
double late_nats(Basis basis, const Layout &layout, const RunStore &runs, Moments first,
                 double ln_det_later) {
  double likely = -kLateNats, clear = -HUGE_VAL; // the most of any run: without_for, _against
  for (const BlockRun &run : runs) {
    if (run.start.size() == 0)
      continue;
    first.add(run.start, -1.0);
    const double constant = learn_inverse(first, layout, &basis.start_inverse) - ln_det_later;
    first.add(run.start);
    const Later later = LaterTest(basis, layout, 0.5 * constant)(run.start);
    likely = std::max(likely, later.without_for);
    clear = std::max(clear, later.without_against);
  }
  return std::min(likely + kLateNats, clear + std::max(kLateNats, -kLatePart * clear));
}

} // namespace

void learn_later(Basis *basis, const Layout &layout, const RunStore &runs) {
  basis->later.clear();
  basis->later_sd.clear();
  const auto any = std::find_if(runs.begin(), runs.end(),
                                [](const BlockRun &run) { return run.start.size() > 0; });
  if (any == runs.end())
    return;
  const Blocks blocks = blocks_of(runs, any->start);
  if (blocks.later.n < 1.0)
    return;
  const Eigen::VectorXd mean = blocks.later.mean();
  const Eigen::VectorXd variance = blocks.later.covariance().diagonal();
  for (Eigen::Index f = 0; f < mean.size(); ++f) {
    const auto k = static_cast<std::size_t>(f);
    const double width = blocks.high[f] - blocks.low[f] + 1e-6 * std::abs(mean[f]) + 1e-9;
    const double sd = std::max(std::sqrt(std::max(variance[f], 0.0)), kLeastSd * width);
    basis->later.push_back(is_angle(layout, k) ? basis->start[k] : mean[f]);
    basis->later_sd.push_back(is_angle(layout, k) ? basis->start_sd[k] : sd);
  }
  const double of_first = learn_inverse(blocks.first, layout, &basis->start_inverse);
  const double of_later = learn_inverse(blocks.later, layout, &basis->later_inverse);
  basis->late_nats =
      late_nats(*basis, layout, runs, blocks.first, of_later) - 0.5 * (of_first - of_later);
}

} // namespace rim
