// SPDX-License-Identifier: MIT
#include "image/layout.hpp"

#include <algorithm>

#include "rim/monitor.h"
#include "util/error.hpp"

extern "C" {
#include "monitor/blocks.h"
}

namespace rim {

namespace {

// The library's arrays have room for so many and no more.
void check_counts(const Layout &layout, const Log &log) {
  const auto check = [&log](std::size_t count, std::size_t most, const char *what) {
    if (count > most)
      throw DataError(log.path + ": has " + std::to_string(count) + " columns " + what +
                      ", and the monitor takes at most " + std::to_string(most) +
                      ": leave some of them out (leave_out = [\"NAME\"] in a schema)");
  };
  check(layout.features(), RIM_MONITOR_MAX_FEATURES, "x. u. s.");
  check(layout.outcomes(), RIM_MONITOR_MAX_OUTCOMES, "to monitor");
}

} // namespace

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
  check_counts(layout, log);
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

namespace {
bool in_degrees(const std::string &unit) { return unit == "deg" || unit == "degrees"; }
} // namespace

double whole_turn(const Layout &layout, std::size_t feature) {
  const std::string &unit = layout.feature_units[feature];
  return in_degrees(unit) ? 360.0 : unit == "rad" ? 2.0 * 3.14159265358979323846 : 0.0;
}

void mark_angle(Layout *layout, std::size_t feature) {
  const unsigned bit =
      in_degrees(layout->feature_units[feature]) ? BLOCKS_ANGLE_DEG : BLOCKS_ANGLE_RAD;
  layout->command[feature] = static_cast<std::uint8_t>(layout->command[feature] | bit);
}

bool is_angle(const Layout &layout, std::size_t feature) {
  return (layout.command[feature] & (BLOCKS_ANGLE_RAD | BLOCKS_ANGLE_DEG)) != 0;
}

std::uint8_t role_of_outcome(const Layout &layout, std::size_t outcome) {
  return layout.external ? std::uint8_t{0} : layout.command[layout.outcome_feature[outcome]];
}

bool is_outcome(const Layout &layout, std::size_t feature) {
  const std::vector<std::uint16_t> &of = layout.outcome_feature;
  return std::find(of.begin(), of.end(), feature) != of.end();
}

} // namespace rim
