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

} // namespace rim
