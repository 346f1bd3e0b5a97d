// SPDX-License-Identifier: MIT
// replay/understand.hpp - would the monitor understand a log: before anybody trusts its silence.
#pragma once

#include <string>
#include <vector>

#include "image/facts.hpp"
#include "replay/replay.hpp"

namespace rim {

// One feature of the image beside the log's values of it.
struct ComparedColumn {
  std::string name, unit;
  double low = 0.0, high = 0.0;                 // of the log
  double trained_low = 0.0, trained_high = 0.0; // of the image
  double outside = 0.0; // share of rows further out than the monitor accepts
};

struct Understanding {
  std::vector<std::string> missing; // columns that the model needs
  std::vector<std::string> unused;  // columns that it does not know
  std::vector<ComparedColumn> columns;
  ReplayedLog replayed; // not filled where columns are missing
  std::string why_not;  // as replay says it; empty: understood
};

// Replays the log. Cost: that of a replay.
Understanding understand(Replayer *replayer, const ImageFacts &facts, const Log &log);

// For a person, with a table of the columns that differ (`all`: of every column).
std::string understanding_text(const Understanding &u, const Log &log, bool all);

} // namespace rim
