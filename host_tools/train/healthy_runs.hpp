// SPDX-License-Identifier: MIT
// train/healthy_runs.hpp - from logs to all that learning takes from them: the runs' blocks.
//
// The logs are read twice, one at a time: for what must be known of all of them (train/survey.hpp),
// then for the blocks of each. A run's blocks depend on nothing else, so they can be made apart: a
// part file holds those of some runs, and what is learnt of part files is to the bit what is learnt
// of the logs.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "image/flight_image.hpp"
#include "log/log_set.hpp"
#include "train/run_store.hpp"
#include "util/shard.hpp"

namespace rim {

// By how much a range that was seen is widened: by a part of its spread, and by a thousandth of its
// magnitude where that is less than half of the spread. Else the range of a latitude would be
// kilometres wider than the field that was driven. What never changed has no spread.
double range_margin(double low, double high, double part);

// Of all logs together.
struct InputRows {
  std::size_t rows = 0, skipped = 0, filtered = 0;
  std::size_t blocks = 0, left_out = 0; // learnt from; after gaps
};

struct HealthyRuns {
  FlightPlan plan; // layout, ranges, period, block_rows, and the basis without centers
  std::vector<Integrand> integrands; // of the runs' wide matrices early and late
  std::vector<std::string> paths;
  std::vector<std::string> warnings;
  InputRows input;
  std::vector<double> low, high; // per feature, over all rows
  RunStore runs;
};

struct BlockingOptions {
  double block_s = 0.0;                          // length of a block; 0: a run has some 240
  std::size_t wide_bytes = RunStore::kWideBytes; // of the blocks, kept in memory
  std::string folder;                            // for the file of the others: as RunStore
};

// At least three logs with the same columns. DataError: fewer, other columns, runs of different
// rates, a run of fewer than 16 blocks, a file that changes while it is read. Deterministic.
HealthyRuns healthy_runs(LogSet *logs, const BlockingOptions &options);

// Makes the blocks of the runs that the shard owns, and writes them to a part file. Reads all logs,
// those of others once.
struct PartWritten {
  std::size_t runs = 0, all = 0;
};
PartWritten write_part(LogSet *logs, const BlockingOptions &options, const Shard &shard,
                       const std::string &path);

// The runs of part files, in any order, that together hold every run once. DataError naming the
// file: no part file or a damaged one, made by another version, of other logs or another
// --block-seconds, a run that comes twice or in none.
HealthyRuns merged_parts(const std::vector<std::string> &paths);

} // namespace rim
