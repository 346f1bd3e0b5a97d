// SPDX-License-Identifier: MIT
#include "log/derive.hpp"

#include "util/error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace rim {

namespace {

constexpr std::size_t kLeastRows = 5;

// Slope at the newest row of the least-squares polynomial through rows first..last; NaN when the
// window is not covered.
double trailing_slope(const Log &log, const Matrix &sources, Eigen::Index column, std::size_t first,
                      std::size_t last, const DeriveRule &rule) {
  const double newest_s = log.t_s[last];
  const std::size_t count = last - first + 1;
  // A regular stream misses up to one period of the window, a stream with gaps more.
  if (count < kLeastRows || newest_s - log.t_s[first] < 0.8 * rule.window_s)
    return std::numeric_limits<double>::quiet_NaN();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double origin = sources(static_cast<Eigen::Index>(last), column);
  for (std::size_t r = first; r <= last; ++r) {
    const double x = (log.t_s[r] - newest_s) / rule.window_s;
    const Eigen::Vector3d powers(1.0, x, x * x);
    normal += powers * powers.transpose();
    right += powers * (sources(static_cast<Eigen::Index>(r), column) - origin);
  }
  const Eigen::Index n = rule.order + 1;
  const Eigen::VectorXd fit = normal.topLeftCorner(n, n).ldlt().solve(right.head(n));
  return rule.scale * fit(1) / rule.window_s;
}

void keep_rows(Log &log, const std::vector<std::size_t> &rows) {
  Matrix values(static_cast<Eigen::Index>(rows.size()), log.values.cols());
  std::vector<double> t_s;
  std::vector<std::uint32_t> row;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    values.row(static_cast<Eigen::Index>(i)) = log.values.row(static_cast<Eigen::Index>(rows[i]));
    t_s.push_back(log.t_s[rows[i]]);
    row.push_back(log.row[rows[i]]);
  }
  log.values = std::move(values);
  log.t_s = std::move(t_s);
  log.row = std::move(row);
}

} // namespace

void derive_columns(Log &log, const Matrix &sources, const Schema &schema) {
  if (schema.derive.empty())
    return;
  const Eigen::Index columns = log.values.cols();
  log.values.conservativeResize(Eigen::NoChange, columns + sources.cols());
  for (Eigen::Index d = 0; d < sources.cols(); ++d) {
    const DeriveRule &rule = schema.derive[static_cast<std::size_t>(d)];
    std::size_t first = 0;
    for (std::size_t r = 0; r < log.t_s.size(); ++r) {
      while (log.t_s[r] - log.t_s[first] > rule.window_s)
        first++;
      log.values(static_cast<Eigen::Index>(r), columns + d) =
          trailing_slope(log, sources, d, first, r, rule);
    }
    Column column{rule.name, rule.unit.empty() ? unit_of_name(rule.name) : rule.unit,
                  Role::context};
    role_of_name(rule.name, column.role);
    log.columns.push_back(std::move(column));
  }
  std::vector<std::size_t> whole;
  for (std::size_t r = 0; r < log.t_s.size(); ++r)
    if (log.values.row(static_cast<Eigen::Index>(r)).allFinite())
      whole.push_back(r);
    else
      log.filtered.push_back(log.row[r]);
  std::sort(log.filtered.begin(), log.filtered.end());
  log.rows_filtered += static_cast<std::uint32_t>(log.t_s.size() - whole.size());
  if (whole.empty())
    throw DataError(log.path + ": shorter than the window of a derived column");
  keep_rows(log, whole);
}

void resample(Log &log, const Schema &schema) {
  if (!(schema.resample_hz > 0.0) || log.t_s.empty())
    return;
  const double period_s = 1.0 / schema.resample_hz;
  const double max_gap_s = schema.max_gap_s > 0.0 ? schema.max_gap_s : 10.0 * period_s;
  const Log source = log;
  std::vector<double> t_s;
  std::vector<std::uint32_t> row;
  std::vector<Eigen::VectorXd> values;
  std::size_t before = 0;
  // The grid is by index, not by accumulation, so that it has no drift.
  const auto steps_to = [&](double at) { return (at - source.t_s.front()) / period_s + 1e-9; };
  constexpr double kMostSteps = 1e15;
  if (!(steps_to(source.t_s.back()) < kMostSteps))
    throw DataError(fmt::format("{}: its time goes over {:.3g} s: too long for a grid of {:g} Hz",
                                log.path, source.t_s.back() - source.t_s.front(),
                                schema.resample_hz));
  const auto steps = static_cast<std::size_t>(steps_to(source.t_s.back()));
  for (std::size_t i = 0; i <= steps; ++i) {
    const double now_s = source.t_s.front() + static_cast<double>(i) * period_s;
    while (before + 1 < source.t_s.size() && source.t_s[before + 1] <= now_s + 1e-9)
      before++;
    const bool last = before + 1 == source.t_s.size();
    const double gap_s = last ? 0.0 : source.t_s[before + 1] - source.t_s[before];
    const bool exact = now_s - source.t_s[before] <= 1e-9;
    if (gap_s > max_gap_s && !exact) { // which lasts years where a clock was set
      i = std::max(i + 1, static_cast<std::size_t>(steps_to(source.t_s[before + 1]))) - 1;
      continue;
    }
    Eigen::VectorXd now = source.values.row(static_cast<Eigen::Index>(before));
    if (schema.resample_linear && !last && !exact) {
      const double part = (now_s - source.t_s[before]) / gap_s;
      now += part * (source.values.row(static_cast<Eigen::Index>(before + 1)).transpose() - now);
    }
    t_s.push_back(now_s);
    row.push_back(source.row[before]);
    values.push_back(std::move(now));
  }
  log.t_s = std::move(t_s);
  log.row = std::move(row);
  log.values.resize(static_cast<Eigen::Index>(values.size()), source.values.cols());
  for (std::size_t i = 0; i < values.size(); ++i)
    log.values.row(static_cast<Eigen::Index>(i)) = values[i];
}

} // namespace rim
