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

// Of a feature whose unit is that of an angle (rad, degrees): a whole turn in it; else 0.
double whole_turn(const Layout &layout, std::size_t feature);
// Marks a feature with such a unit, whose readings jump by most of a turn, as an angle.
void mark_angle(Layout *layout, std::size_t feature);
bool is_angle(const Layout &layout, std::size_t feature);
// Of an outcome: bits of RIM_SECTION_COMMANDS.
std::uint8_t role_of_outcome(const Layout &layout, std::size_t outcome);
// False of commands and context, and of all features in front of own predictions.
bool is_outcome(const Layout &layout, std::size_t feature);

} // namespace rim
