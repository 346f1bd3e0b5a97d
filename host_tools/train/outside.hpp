// SPDX-License-Identifier: MIT
// train/outside.hpp - which sensors show what acts on the vehicle from outside.
//
// Wind, ambient temperature or slope move what other sensors show, and no command moves them. A
// controller answers them, so commands and disturbance agree, and a regression on the commands
// seems to explain them. What tells them apart is the order in time: an outcome that the vehicle
// brings about is predicted better from its own past and the commands before than from its own past
// alone (Granger causality); a disturbance is not. That the commands explain its level does not
// tell them apart: a heating that answers the weather explains the weather. But what follows a
// command at once has no order in time, and the commands explain its level; so where they do, those
// of the same moment must leave a part of it.
#pragma once

#include <functional>
#include <vector>

#include "train/run_store.hpp"

namespace rim {

// Parts of the error, root mean square over runs left out, by which an outcome's own past predicts
// it: what stays where the terms of the block before are used as well, and those of the block too.
struct Moved {
  double before, now;
};

// terms(r): of run r, standardised, blocks x terms. Cost: a regression of all blocks on twice the
// terms, in two passes; one run's terms are in memory at a time.
Moved moved_by(const RunStore &runs, std::size_t outcome,
               const std::function<Matrix(std::size_t)> &terms);

// An outcome that no command moves leaves more than this of the error by its own past.
constexpr double kNotMoved = 0.97;

// Those of the outcomes `asked` that the commands do not move. explained[outcome]: the commands
// explain its level (of all outcomes). terms(r): filtered commands.
// Cost: moved_by() for each outcome.
std::vector<std::size_t> not_moved(const std::vector<std::size_t> &asked,
                                   const std::vector<bool> &explained, const RunStore &runs,
                                   const std::function<Matrix(std::size_t)> &terms);

} // namespace rim
