// SPDX-License-Identifier: MIT
// train/survey.hpp - what training must know of all runs before it looks at any of them closely.
//
// Every log is read once for it, in any order, and a few numbers of it are kept.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "image/layout.hpp"
#include "log/log_set.hpp"

namespace rim {

// A feature that takes more values than this, one that is no whole number, or one that is farther
// from zero than kLargestMode, is a quantity and not the number of a mode.
constexpr std::size_t kMostModes = 12;
constexpr double kLargestMode = 32.0;

// One feature in one run, in its own unit.
struct FeatureFacts {
  double low = 1e300, high = -1e300; // of its rows
  double first = 0.0;                // mean of its first eight
  bool jumps = false;                // an angle that goes on through the end of its turn
  std::vector<double> values; // ascending, each once; empty: they are not numbers of modes
};

struct RunFacts {
  std::string path;
  std::size_t rows = 0, skipped = 0, filtered = 0;
  std::uint64_t content[2] = {0, 0}; // hash of its values: equal for equal runs
  std::vector<std::pair<double, std::uint32_t>> periods_s; // ascending, and how often each came
  std::vector<FeatureFacts> features;
};

struct Survey {
  Layout layout; // with its angles
  std::vector<RunFacts> runs;

  double low(std::size_t feature) const;  // of all runs
  double high(std::size_t feature) const; // of all runs
  // How many modes it tells apart by their numbers, over all runs; 0: it is a quantity.
  std::size_t modes(std::size_t feature) const;
  // Median time between the rows of all runs. DataError with fewer than two rows.
  double period_s() const;
};

// DataError as of read_log() and check_layout(), of the first log that has one.
Survey survey_of(LogSet *logs);

// Hash of a log's values, which differs between different runs.
void hash_of(const Log &log, std::uint64_t content[2]);
// Median time between the rows of one run. DataError with fewer than two rows.
double period_of(const RunFacts &run);

} // namespace rim
