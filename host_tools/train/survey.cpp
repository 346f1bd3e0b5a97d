// SPDX-License-Identifier: MIT
#include "train/survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim {

namespace {

constexpr Eigen::Index kFirstRows = 8;

using Counted = std::vector<std::pair<double, std::uint32_t>>;

// The upper of the two in the middle, as median() of the values written out.
double median_of(Counted counted) {
  std::size_t all = 0;
  for (const auto &[value, times] : counted)
    all += times;
  if (all == 0)
    throw DataError("the logs have fewer than two rows");
  std::sort(counted.begin(), counted.end());
  std::size_t below = 0;
  for (const auto &[value, times] : counted) {
    below += times;
    if (below > all / 2)
      return value;
  }
  return counted.back().first;
}

Counted periods_of(const std::vector<double> &t_s) {
  std::vector<double> periods;
  for (std::size_t t = 1; t < t_s.size(); ++t)
    periods.push_back(t_s[t] - t_s[t - 1]);
  std::sort(periods.begin(), periods.end());
  Counted counted;
  for (const double p : periods) {
    if (counted.empty() || counted.back().first < p)
      counted.emplace_back(p, 0U);
    ++counted.back().second;
  }
  return counted;
}

// Puts a value among those that are there; false: it is not the number of a mode, or one too many.
bool add_mode(std::vector<double> *values, double value) {
  if (value != std::floor(value) || std::abs(value) > kLargestMode)
    return false;
  const auto at = std::lower_bound(values->begin(), values->end(), value);
  if (at == values->end() || *at != value)
    values->insert(at, value);
  return values->size() <= kMostModes;
}

FeatureFacts facts_of_feature(const Log &log, const Layout &layout, std::size_t feature) {
  const auto column = log.values.col(find_column(log, layout.feature_names[feature]));
  FeatureFacts facts;
  if (column.size() == 0)
    return facts;
  facts.low = column.minCoeff();
  facts.high = column.maxCoeff();
  facts.first = column.head(std::min(kFirstRows, column.size())).mean();
  const auto is_mode = [&facts](double value) { return add_mode(&facts.values, value); };
  if (!std::all_of(column.begin(), column.end(), is_mode))
    facts.values.clear();
  const double turn = whole_turn(layout, feature);
  for (Eigen::Index t = 1; turn > 0.0 && t < column.size() && !facts.jumps; ++t)
    facts.jumps = std::abs(column[t] - column[t - 1]) > 0.75 * turn;
  return facts;
}

RunFacts facts_of(const Log &log, const Layout &layout) {
  RunFacts run;
  run.path = log.path;
  run.rows = log.t_s.size();
  run.skipped = log.rows_skipped;
  run.filtered = log.rows_filtered;
  hash_of(log, run.content);
  run.periods_s = periods_of(log.t_s);
  for (std::size_t f = 0; f < layout.features(); ++f)
    run.features.push_back(facts_of_feature(log, layout, f));
  return run;
}

} // namespace

void hash_of(const Log &log, std::uint64_t content[2]) {
  content[0] = static_cast<std::uint64_t>(log.values.rows()) + 0x9E3779B97F4A7C15U;
  content[1] = static_cast<std::uint64_t>(log.values.cols()) + 0xC2B2AE3D27D4EB4FU;
  for (Eigen::Index i = 0; i < log.values.size(); ++i) {
    const double value = log.values.data()[i] + 0.0; // -0 is 0
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    content[0] = (content[0] ^ bits) * 0xFF51AFD7ED558CCDU;
    content[0] ^= content[0] >> 32;
    content[1] = (content[1] + bits) * 0x9FB21C651E98DF25U;
    content[1] ^= content[1] >> 29;
  }
}

double period_of(const RunFacts &run) {
  if (run.periods_s.empty())
    throw DataError(run.path + ": has fewer than two rows: there is no rate to learn");
  return median_of(run.periods_s);
}

double Survey::low(std::size_t feature) const {
  double least = 1e300;
  for (const RunFacts &run : runs)
    least = std::min(least, run.features[feature].low);
  return least;
}

double Survey::high(std::size_t feature) const {
  double most = -1e300;
  for (const RunFacts &run : runs)
    most = std::max(most, run.features[feature].high);
  return most;
}

std::size_t Survey::modes(std::size_t feature) const {
  std::vector<double> all;
  for (const RunFacts &run : runs) {
    const std::vector<double> &values = run.features[feature].values;
    const auto is_mode = [&all](double value) { return add_mode(&all, value); };
    if ((run.rows > 0 && values.empty()) || !std::all_of(values.begin(), values.end(), is_mode))
      return 0;
  }
  return all.size();
}

double Survey::period_s() const {
  Counted all;
  for (const RunFacts &run : runs)
    all.insert(all.end(), run.periods_s.begin(), run.periods_s.end());
  return median_of(std::move(all));
}

Survey survey_of(LogSet *logs) {
  Survey survey;
  survey.layout = layout_of(*logs->get(0));
  survey.runs.resize(logs->size());
  Progress progress("read", logs->size());
  parallel_for(logs->size(), [&](std::size_t r) {
    const std::shared_ptr<const Log> log = logs->get(r);
    check_layout(survey.layout, *log);
    survey.runs[r] = facts_of(*log, survey.layout);
    progress.add();
  });
  for (std::size_t f = 0; f < survey.layout.features(); ++f) {
    for (const RunFacts &run : survey.runs) {
      if (run.features[f].jumps)
        mark_angle(&survey.layout, f);
    }
  }
  return survey;
}

} // namespace rim
