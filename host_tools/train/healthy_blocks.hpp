// SPDX-License-Identifier: MIT
// Healthy logs as blocks: exactly what the flight code makes of them, by the flight code.
#ifndef RIM_TRAIN_HEALTHY_BLOCKS_HPP
#define RIM_TRAIN_HEALTHY_BLOCKS_HPP

#include <vector>

#include <Eigen/Core>

#include "image/basis.hpp"
#include "image/layout.hpp"

namespace rim {

// Everything the models may use: exponential means of the commands and of their products and
// magnitudes with time constants from one row to the run's length, their products, decays,
// integrals and initial readings. run_rows: median length of a run.
Basis make_basis(const Layout &layout, const std::vector<Log> &logs, double run_rows);

struct BlockRun {
  Matrix context, outcome, predicted; // blocks x features, outcomes; predicted: external only
  Matrix scatter, repeats;            // blocks x outcomes
  Matrix terms, means;                // raw, blocks x terms, means
  Eigen::VectorXd first;              // [outcomes]
  Eigen::VectorXd change, time_s;     // [blocks]; time since the start of the run
  std::vector<bool> follows;          // the block before is its neighbour in time
  Eigen::Index blocks() const { return outcome.rows(); }
};

struct BlockOptions {
  std::uint32_t block_rows = 1;
  double period_s = 0.0;
  std::vector<float> low, high; // per feature: range of the rows
};

// A log's blocks. Blocks before the first readings are known are left out, as in flight.
BlockRun block_run(const Log &log, const Layout &layout, const Basis &basis,
                   const BlockOptions &options);

} // namespace rim
#endif
