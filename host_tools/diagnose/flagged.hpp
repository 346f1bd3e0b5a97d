// SPDX-License-Identifier: MIT
// diagnose/flagged.hpp - rows that are no measurements: a reading that repeats itself, or is
// exactly zero, more than its own resolution and the stated noise allow.
#pragma once

#include <cstdint>
#include <vector>

#include "diagnose/measured.hpp"

namespace rim::diagnose {

struct Flagged {
  std::vector<std::uint8_t> stuck, dropout; // per row, 1 where flagged
  double stuck_ln = 0.0, dropout_ln = 0.0;  // ln likelihood ratio of the best run; of all zeros
  std::size_t stuck_rows = 0, dropout_rows = 0;
};

// A run of equal readings is stuck when the chance that the noise made it, at the reading's own
// resolution (the steps between its values), is below exp(-5) over all rows. O(n log n).
Flagged find_flagged(const Measured &measured, const Channel &channel);

// The step between neighbouring values: the middle one where readings are quantised (few values),
// a small one where they are not.
double resolution(const Vector &z);

// Whether all that is predicted in these rows (1: inside) lies within one step of a coarse reading:
// its error there is by where within the step that is, and scatters less, or more, for it.
bool is_of_one_step(const Channel &channel, const Vector &inside);

} // namespace rim::diagnose
