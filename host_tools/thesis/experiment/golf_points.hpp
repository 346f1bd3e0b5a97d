// SPDX-License-Identifier: MIT
// thesis/experiment/golf_points.hpp - a run of the golf world (thesis 4.2.3) as a finished set.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "batch/select_batch.h"

namespace rim {

struct GolfPoints {
  std::size_t dims = 0;
  std::vector<double> u, r;                 // [n][dims] unit features, [n] standardised residuals
  std::vector<bool> truth;                  // from behind the bump, whether or not it does anything
  std::array<std::size_t, 2> place{{0, 0}}; // which features are the field's

  rim_batch_data data() const;
};

// 30 shots from behind the bump; without effect the bump is there and spoils nothing.
GolfPoints golf_points(std::size_t dims, std::uint64_t seed, bool has_effect = true);

} // namespace rim
