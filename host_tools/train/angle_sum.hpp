// SPDX-License-Identifier: MIT
// An angle that is others' sum: a wind's direction is the nacelle's and the vane's, two compasses
// differ by how they are mounted. Whole turns cancel only where every weight is 1 or -1, so that no
// regression finds it.
#pragma once

#include <optional>
#include <vector>

#include "image/layout.hpp"
#include "train/run_store.hpp"

namespace rim {

// An angle within half a turn of 0; anything else as it is. role: bits of RIM_SECTION_COMMANDS.
Eigen::VectorXd wrapped(Eigen::VectorXd x, std::uint8_t role);

struct AngleSum {
  Eigen::VectorXd weight;       // per outcome: 1, 0 or -1
  std::vector<double> constant; // of each fold, and of all runs; single precision holds it
};

// Of an outcome that is an angle: the one or two others, in the same unit, that it follows from
// best, where what remains is less than a tenth of a turn (its circular standard deviation).
// without: an outcome that is not among them. O(blocks x angles^2).
std::optional<AngleSum> angle_sum(const Layout &layout, const RunStore &runs, Eigen::Index outcome,
                                  std::optional<Eigen::Index> without = std::nullopt);

} // namespace rim
