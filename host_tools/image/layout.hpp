// SPDX-License-Identifier: MIT
// What the columns of the logs are to the monitor.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "log/log.hpp"

namespace rim {

struct Layout {
  std::vector<std::string> feature_names, feature_units; // context, command, sensor columns
  std::vector<std::string> outcome_names, outcome_units; // sensors, or z. columns
  std::vector<std::uint16_t> outcome_feature;            // trained: feature index of each outcome
  std::vector<std::uint8_t> command; // per feature: bits of RIM_SECTION_COMMANDS
  bool external = false;             // z. m. sd. columns bring predictions
  std::size_t features() const { return feature_names.size(); }
  std::size_t outcomes() const { return outcome_names.size(); }
};

// The layout of a log; DataError when it has neither sensors nor outcomes.
Layout layout_of(const Log &log);
// DataError naming the file and column where a log's columns differ from the layout.
void check_layout(const Layout &layout, const Log &log);

// Marks features that are angles: unit rad or degrees, and readings that jump by most of a turn.
void find_angles(Layout *layout, const std::vector<Log> &logs);

// Median time between rows of all logs; DataError with fewer than two rows.
double median_period_s(const std::vector<Log> &logs);

} // namespace rim
