// SPDX-License-Identifier: MIT
// stats/rate_interval.hpp - exact 95 % interval of the mean of a Poisson count (Garwood 1936).
#pragma once

#include <cstddef>

namespace rim {

struct RateInterval {
  double low = 0.0, high = 0.0;
};

// Means under which at least `count`, and at most `count`, have a probability of 2.5 %. Low is 0
// for a count of 0. Accurate to 1e-9 of the mean.
RateInterval poisson_interval(std::size_t count);

} // namespace rim
