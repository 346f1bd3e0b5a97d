// SPDX-License-Identifier: MIT
#include "thesis/poisson.hpp"

#include <boost/math/distributions/chi_squared.hpp>

namespace rim {

RateInterval poisson_interval(std::size_t count) {
  const auto n = static_cast<double>(count);
  const auto half_of = [](double degrees, double chance) {
    return 0.5 * boost::math::quantile(boost::math::chi_squared(degrees), chance);
  };
  return {count == 0 ? 0.0 : half_of(2.0 * n, 0.025), half_of(2.0 * (n + 1.0), 0.975)};
}

} // namespace rim
