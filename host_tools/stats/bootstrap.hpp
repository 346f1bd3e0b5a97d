// SPDX-License-Identifier: MIT
// stats/bootstrap.hpp - a 95 % interval by resampling whole units (runs, logs, blocks).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace rim {

struct Bootstrapped {
  double value = 0.0, low = 0.0, high = 0.0;
};

struct BootstrapOptions {
  std::size_t draws = 2000;
  std::uint64_t seed = 5100, stream = 0; // of base/rng.h
};

// statistic(indices of units) of all units once, and of `draws` samples of as many units with
// replacement: the value, and the order statistics at 2.5 % and 97.5 % of the draws. The same
// seed and stream draw the same units for every statistic. units >= 1.
Bootstrapped bootstrap(std::size_t units,
                       const std::function<double(const std::vector<std::size_t> &)> &statistic,
                       const BootstrapOptions &options = {});

// Of the mean; zeros for no value.
Bootstrapped bootstrap_mean(const std::vector<double> &values,
                            const BootstrapOptions &options = {});

} // namespace rim
