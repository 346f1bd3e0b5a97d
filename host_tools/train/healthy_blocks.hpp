// SPDX-License-Identifier: MIT
// Healthy logs as blocks: exactly what the flight code makes of them, by the flight code.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "image/basis.hpp"
#include "image/layout.hpp"
#include "train/survey.hpp"

namespace rim {

// Everything the models may use: exponential means of the commands and of their products and
// magnitudes with time constants from one row to the run's length, their products and triple
// products, directions, decays, integrals and initial readings. run_rows: median length of a run.
// What it lacks is how the runs begin, learn_start(): their blocks do not depend on it.
Basis make_basis(const Survey &survey, double run_rows);

// So many inputs are commands, and an angle is two: with nine filters of each there is room for no
// more among the terms of an image.
constexpr std::size_t kMostCommands = 36;
// The commands and context beyond that, of which no model knows; features, ascending.
std::vector<std::uint16_t> no_inputs(const Survey &survey);

// Mean and standard deviation over the runs of every feature in the first block; starts: of every
// run, as BlockRun has it; low, high: of the features over all rows.
void learn_start(Basis *basis, const std::vector<Eigen::VectorXd> &starts,
                 const std::vector<double> &low, const std::vector<double> &high);

// What an outcome may be the integral of: lib/src/image/basis.h, section AGREEMENT.
struct Integrand {
  std::uint16_t op, a, b; // features
};

// Every outcome; products of two of them where there are few; outcomes times the cosine and sine of
// every angle.
std::vector<Integrand> possible_integrands(const Layout &layout);
std::vector<std::uint8_t> integrand_bytes(const std::vector<Integrand> &integrands);

struct BlockRun {
  Matrix context, outcome, predicted; // blocks x features, outcomes; predicted: external only
  Matrix scatter, repeats;            // blocks x outcomes
  Matrix terms, means;                // raw, blocks x terms, means
  Matrix early, late;                 // blocks x integrands
  Eigen::VectorXd first;              // [outcomes]
  Eigen::VectorXd start;              // [features]: mean of the first block's rows; no rows: empty
  Eigen::VectorXd time_s;             // [blocks], since the start of the run
  Eigen::VectorXd share;              // [blocks], rimi_blocks_share()
  std::vector<bool> follows;          // the block before is its neighbour in time
  std::size_t left_out = 0;           // blocks after gaps
  Eigen::Index blocks() const { return outcome.rows(); }
};

struct BlockOptions {
  std::uint32_t block_rows = 1;
  double period_s = 0.0;
  std::vector<float> low, high; // per feature: range of the rows
  std::vector<Integrand> integrands;
};

// A log's blocks. Blocks before the first readings are known are left out, as in flight; so are
// those after a gap for as long as it leaves a filtered command unknown. In flight only those
// outcomes do without them that need that filter; here the models that say so are not learnt yet.
BlockRun block_run(const Log &log, const Layout &layout, const Basis &basis,
                   const BlockOptions &options);

} // namespace rim
