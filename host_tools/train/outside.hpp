// SPDX-License-Identifier: MIT
// train/outside.hpp - which sensors show what acts on the vehicle from outside.
//
// Wind, ambient temperature or slope move what other sensors show, and no command moves them. A
// controller answers them, so commands and disturbance agree, and a regression on the commands
// seems to explain them. What tells them apart is the order in time: an outcome that the vehicle
// brings about is predicted better from its own past and the commands before than from its own past
// alone (Granger causality); a disturbance is not.
#pragma once

#include <functional>
#include <vector>

#include "train/run_store.hpp"

namespace rim {

// Those of the outcomes `asked` that the commands do not move. terms(r): standardised filtered
// commands of run r, blocks x terms. Whole runs are left out. Cost: for each outcome a regression
// of all blocks on the terms; one run's terms in memory per thread.
std::vector<std::size_t> not_moved(const std::vector<std::size_t> &asked, const RunStore &runs,
                                   const std::function<Matrix(std::size_t)> &terms);

} // namespace rim
