// SPDX-License-Identifier: MIT
#include "stats/bootstrap.hpp"

#include <algorithm>
#include <numeric>

#include "base/rng.h"

namespace rim {

Bootstrapped bootstrap(std::size_t units,
                       const std::function<double(const std::vector<std::size_t> &)> &statistic,
                       const BootstrapOptions &options) {
  std::vector<std::size_t> pick(units);
  std::iota(pick.begin(), pick.end(), std::size_t{0});
  Bootstrapped out;
  out.value = statistic(pick);
  rim_rng rng;
  rimi_rng_seed(&rng, options.seed, options.stream);
  std::vector<double> values(options.draws);
  for (double &value : values) {
    for (std::size_t &i : pick)
      i = rimi_rng_below(&rng, static_cast<std::uint32_t>(units));
    value = statistic(pick);
  }
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  out.low = at(0.025);
  out.high = at(0.975);
  return out;
}

Bootstrapped bootstrap_mean(const std::vector<double> &values, const BootstrapOptions &options) {
  if (values.empty())
    return {};
  return bootstrap(
      values.size(),
      [&values](const std::vector<std::size_t> &pick) {
        double sum = 0.0;
        for (const std::size_t i : pick)
          sum += values[i];
        return sum / static_cast<double>(pick.size());
      },
      options);
}

} // namespace rim
