// SPDX-License-Identifier: MIT
#include "image/layout.hpp"

#include <algorithm>
#include <cmath>

#include "util/error.hpp"

namespace rim {

Layout layout_of(const Log &log) {
  Layout layout;
  for (const int c : feature_columns(log)) {
    const Column &column = log.columns[static_cast<std::size_t>(c)];
    if (column.role == Role::sensor) {
      layout.outcome_feature.push_back(static_cast<std::uint16_t>(layout.features()));
      layout.outcome_names.push_back(column.name);
      layout.outcome_units.push_back(column.unit);
    }
    layout.feature_names.push_back(column.name);
    layout.feature_units.push_back(column.unit);
    layout.command.push_back(column.role == Role::command ? 1 : 0);
  }
  const std::vector<int> measured = role_columns(log, Role::outcome);
  if (!measured.empty()) {
    layout.external = true;
    layout.outcome_feature.clear();
    layout.outcome_names.clear();
    layout.outcome_units.clear();
    for (const int c : measured) {
      layout.outcome_names.push_back(log.columns[static_cast<std::size_t>(c)].name);
      layout.outcome_units.push_back(log.columns[static_cast<std::size_t>(c)].unit);
    }
  }
  if (layout.outcomes() == 0) {
    throw DataError(log.path + ": nothing to monitor: no column 's.NAME' and none 'z.NAME'");
  }
  if (layout.features() == 0) {
    throw DataError(log.path + ": no context: no column 'x.NAME', 'u.NAME' or 's.NAME'");
  }
  return layout;
}

void check_layout(const Layout &layout, const Log &log) {
  const Layout other = layout_of(log);
  const auto compare = [&log](const std::vector<std::string> &expected,
                              const std::vector<std::string> &found) {
    for (std::size_t i = 0; i < std::max(expected.size(), found.size()); ++i) {
      if (i >= found.size()) {
        throw DataError(log.path + ": column '" + expected[i] + "' is missing");
      }
      if (i >= expected.size()) {
        throw DataError(log.path + ": column '" + found[i] + "' is not in the model or first log");
      }
      if (expected[i] != found[i]) {
        throw DataError(log.path + ": column '" + found[i] + "' where '" + expected[i] +
                        "' is expected (same columns in the same order)");
      }
    }
  };
  compare(layout.feature_names, other.feature_names);
  compare(layout.outcome_names, other.outcome_names);
}

void find_angles(Layout *layout, const std::vector<Log> &logs) {
  for (std::size_t f = 0; f < layout->features(); ++f) {
    const std::string &unit = layout->feature_units[f];
    const bool degrees = unit == "deg" || unit == "degrees";
    if (unit != "rad" && !degrees)
      continue;
    const double turn = degrees ? 360.0 : 2.0 * 3.14159265358979323846;
    std::size_t jumps = 0;
    for (const Log &log : logs) {
      const int c = find_column(log, layout->feature_names[f]);
      for (Eigen::Index t = 1; c >= 0 && t < log.values.rows(); ++t)
        jumps += std::abs(log.values(t, c) - log.values(t - 1, c)) > 0.75 * turn;
    }
    if (jumps > 0)
      layout->command[f] = static_cast<std::uint8_t>(layout->command[f] | (degrees ? 4U : 2U));
  }
}

double median_period_s(const std::vector<Log> &logs) {
  std::vector<double> periods;
  for (const Log &log : logs) {
    for (std::size_t t = 1; t < log.t_s.size(); ++t)
      periods.push_back(log.t_s[t] - log.t_s[t - 1]);
  }
  if (periods.empty())
    throw DataError("the logs have fewer than two rows");
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

} // namespace rim
