// SPDX-License-Identifier: MIT
// plan/gp_fit.hpp - hyperparameters of a Gaussian process by maximum marginal likelihood.
#pragma once

#include "rim/plan/gp.h"

#include <cstdint>

namespace rim {

struct GpFitOptions {
  std::uint32_t iterations = 100; // of each climb
  bool fit_noise = true;          // false: noise_var stays as it is (it also stays when it is 0)
  double range = 1e4;             // no parameter leaves [start / range, start * range]
};

struct GpFit {
  double before = 0.0, after = 0.0; // logarithm of the marginal likelihood
  std::uint32_t iterations = 0;     // of the best climb
  bool converged = false;           // its gradient vanished, parameters at a bound apart
};

// Climbs by BFGS from the process's own hyperparameters and from lengths a third and three times as
// long, and leaves the best in force; the likelihood never falls. O(n^3) an iteration.
GpFit fit_gp(rim_gp *gp, const GpFitOptions &options = {});

} // namespace rim
