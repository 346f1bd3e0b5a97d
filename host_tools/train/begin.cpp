// SPDX-License-Identifier: MIT
#include "train/begin.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
constexpr double kLateNats = 3.0;
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

// By rimi_basis_later() of all features, as begins_late() in lib/src/monitor/blocks_unknown.c.
double nats_later(const Basis &basis, const Layout &layout, const Eigen::VectorXd &start) {
  double nats = 0.0, most = 0.0;
  for (std::size_t f = 0; f < basis.later.size(); ++f) {
    if (is_angle(layout, f))
      continue;
    const double first[2] = {basis.start[f], basis.start_sd[f]};
    const double later[2] = {basis.later[f], basis.later_sd[f]};
    const double of_one = rimi_basis_later(start[static_cast<Eigen::Index>(f)], first, later);
    nats += of_one;
    if (is_outcome(layout, f))
      most = std::max(most, of_one);
  }
  return nats - most;
}

} // namespace

void learn_later(Basis *basis, const Layout &layout, const RunStore &runs) {
  const auto features = static_cast<Eigen::Index>(layout.features());
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(features), squares = sum;
  Eigen::ArrayXd low = Eigen::ArrayXd::Constant(features, HUGE_VAL), high = -low;
  double n = 0.0;
  for (const BlockRun &run : runs) {
    const auto first = static_cast<Eigen::Index>(kLaterFrom * static_cast<double>(run.blocks()));
    for (Eigen::Index b = 0; b < run.blocks(); ++b) {
      const Eigen::ArrayXd x = run.context.row(b).transpose();
      low = low.min(x);
      high = high.max(x);
      if (b <= first)
        continue;
      sum += x;
      squares += x.square();
      n += 1.0;
    }
  }
  basis->later.clear();
  basis->later_sd.clear();
  if (n < 1.0)
    return;
  for (Eigen::Index f = 0; f < features; ++f) {
    const double mean = sum[f] / n;
    const double variance = std::max(squares[f] / n - mean * mean, 0.0);
    const double width = high[f] - low[f] + 1e-6 * std::abs(mean) + 1e-9;
    basis->later.push_back(mean);
    basis->later_sd.push_back(std::max(std::sqrt(variance), kLeastSd * width));
  }
  basis->late_nats = 0.0;
  for (const BlockRun &run : runs) {
    if (run.start.size() > 0)
      basis->late_nats =
          std::max(basis->late_nats, nats_later(*basis, layout, run.start) + kLateNats);
  }
}

} // namespace rim
