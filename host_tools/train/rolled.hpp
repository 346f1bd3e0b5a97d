// SPDX-License-Identifier: MIT
// train/rolled.hpp - outcomes that keep what was put into them, rolled forward from the start of
// the run on commands and disturbances alone.
//
// A speed under a cruise control, the level of a tank or a temperature is the integral of what acts
// on it, and what acts on it depends on where it is: a filter of the commands does not follow it.
// Its change per second is learnt as a sum of a few products of commands, disturbances, states and
// itself, from its changes over windows of blocks (the weak form of sparse identification of
// dynamics: the sensor is not differentiated), and is then rolled forward by the flight code.
#pragma once

#include <cstdint>
#include <vector>

#include "image/basis.hpp"
#include "train/fitter.hpp"
#include "train/run_store.hpp"

namespace rim {

// The rolled states, which depend on one another in this order at most.
struct Rolled {
  std::vector<Basis::State> states;
  // rates[f]: learnt from the runs without those r with r % kFolds == f; the last: from all.
  std::vector<std::vector<Basis::Rate>> rates;
  std::vector<Matrix> values; // of all() runs, by rates without it: blocks x states
};

// asked[o]: the error that a state of outcome o must win against, root mean square; 0: not asked.
// inputs: places among basis.inputs that may drive a state; without any there is none.
// error_of(residual of a run): what is averaged over the runs; its root is compared with `asked`.
// Cost: per asked outcome at most three regressions of all blocks on at most 240 products.
Rolled fit_rolled(const Basis &basis, const RunStore &runs, const std::vector<double> &asked,
                  const std::vector<std::uint16_t> &inputs, double block_s,
                  double (*error_of)(const Eigen::VectorXd &));

// Products of the states with one another, with themselves and with `inputs`, as terms of `basis`;
// as many as BASIS_MAX_TERMS leaves room for, the states themselves first. The states and rates of
// all runs go into `basis`. False when not even the states have room.
bool add_rolled_terms(Basis *basis, const Rolled &rolled, const std::vector<std::uint16_t> &inputs);

// Raw values of all terms: those of `wide` and, behind them, the rolled ones of values (of the same
// run).
Matrix with_rolled(const Basis &basis, const Matrix &wide, const Matrix &values);

} // namespace rim
