// SPDX-License-Identifier: MIT
#include "plan/confidence.hpp"

#include "base/rng.h"
#include "util/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rim {

std::vector<double> nominal_maxima(const rim_extent_config &config,
                                   const std::vector<double> &contexts,
                                   const std::vector<double> &var, std::uint32_t runs,
                                   std::uint32_t slices, std::uint64_t seed) {
  rim_extent_config c = config;
  c.knots = 0; // ln anom does not depend on it
  c.rims = 1;
  const std::size_t lambdas = c.lambdas > 0 ? c.lambdas : RIM_EXTENT_DEFAULT_LAMBDAS;
  std::vector<std::uint64_t> memory(RIM_EXTENT_SIZE(c.dims, c.points, lambdas, 1) / 8 + 1);
  if (contexts.size() != var.size() * c.dims)
    throw DataError("contexts and variances: different numbers");
  std::vector<double> maxima(runs);
  for (std::uint32_t run = 0; run < runs; ++run) {
    c.seed = seed + run;
    rim_extent *extent = nullptr;
    const rim_status status = rim_extent_init(&extent, memory.data(), memory.size() * 8, &c);
    if (status != RIM_OK)
      throw UsageError(fmt::format("regions: {}", rim_status_text(status)));
    rim_rng rng;
    rimi_rng_seed(&rng, seed, run);
    for (std::size_t i = 0; i < var.size(); ++i) {
      const double dz = std::sqrt(var[i]) * rimi_rng_normal(&rng);
      if (rim_extent_add(extent, contexts.data() + i * c.dims, dz, var[i]) != RIM_OK)
        throw DataError(fmt::format("context {}: not finite, or variance not above 0", i + 1));
    }
    rim_extent_search(extent, slices);
    for (std::uint32_t i = 0; i < lambdas; ++i) {
      rim_extent_region region;
      if (rim_extent_get_region(extent, 0, i, &region) == RIM_OK)
        maxima[run] = std::max(maxima[run], region.ln_anom);
    }
  }
  std::sort(maxima.begin(), maxima.end());
  return maxima;
}

void set_confidence(rim_extent_config &config, const std::vector<double> &maxima) {
  if (maxima.size() < 8 || !(maxima.back() > maxima.front()))
    throw DataError("confidence: at least 8 nominal runs are needed, not all alike");
  const double all = static_cast<double>(maxima.size()) + 1.0;
  config.knots = 0;
  for (int k = 0; k < RIM_EXTENT_MAX_KNOTS; ++k) {
    // Closer together where confidence is high: the upper tail decides.
    const double part = static_cast<double>(k) / (RIM_EXTENT_MAX_KNOTS - 1);
    const double rank =
        (1.0 - (1.0 - part) * (1.0 - part)) * static_cast<double>(maxima.size() - 1);
    const double value = maxima[static_cast<std::size_t>(rank)];
    if (config.knots > 0 && !(value > config.ln_anom[config.knots - 1]))
      continue;
    const auto above = maxima.end() - std::lower_bound(maxima.begin(), maxima.end(), value);
    config.ln_anom[config.knots] = value;
    config.confidence[config.knots] = 1.0 - (1.0 + static_cast<double>(above)) / all;
    ++config.knots;
  }
}

} // namespace rim
