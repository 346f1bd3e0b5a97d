// SPDX-License-Identifier: MIT
#include "stats/rate_interval.hpp"

#include <cmath>

namespace rim {

namespace {

// P(at most `count`) for a mean.
double at_most(std::size_t count, double mean) {
  double term = std::exp(-mean), sum = term;
  for (std::size_t k = 1; k <= count; ++k) {
    term *= mean / static_cast<double>(k);
    sum += term;
  }
  return sum;
}

// The mean at which P(at most `count`), which falls, is `p`.
double mean_at(std::size_t count, double p) {
  const auto n = static_cast<double>(count);
  double low = 0.0, high = n + 10.0 * std::sqrt(n + 1.0) + 10.0;
  for (int i = 0; i < 100; ++i) {
    const double mid = 0.5 * (low + high);
    (at_most(count, mid) > p ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

} // namespace

RateInterval poisson_interval(std::size_t count) {
  return {count == 0 ? 0.0 : mean_at(count - 1, 0.975), mean_at(count, 0.025)};
}

} // namespace rim
