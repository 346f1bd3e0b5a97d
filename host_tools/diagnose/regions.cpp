// SPDX-License-Identifier: MIT
#include "diagnose/regions.hpp"

#include <algorithm>
#include <cmath>

#include "batch/dmaps.h"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr Index kMostRows = 2500;
constexpr std::uint16_t kNodes = 20;
constexpr std::uint8_t kMostRegions = 4;

// A region of unit features in the features' own units.
Gate gate_of(const rim_region &region, const Measured &measured, const Vector &low,
             const Vector &span) {
  Gate gate;
  gate.is_ellipse = true;
  const std::size_t d = region.dims;
  for (std::size_t k = 0; k < d; ++k) {
    const auto f = static_cast<Index>(region.feature[k]);
    gate.features.push_back(measured.features[region.feature[k]].name);
    gate.units.push_back(measured.features[region.feature[k]].unit);
    gate.center.push_back(low(f) + region.center[k] * span(f));
    gate.lower.push_back(low(f) + region.lower[k] * span(f));
    gate.upper.push_back(low(f) + region.upper[k] * span(f));
    for (std::size_t l = 0; l < d; ++l)
      gate.inverse_shape.push_back(region.inverse_shape[k * d + l] /
                                   (span(f) * span(static_cast<Index>(region.feature[l]))));
  }
  return gate;
}

} // namespace

std::vector<ResidualRegion> find_regions(const Measured &measured, const Channel &channel,
                                         const Vector &used, double divisor) {
  std::vector<ResidualRegion> out;
  const Index features = measured.x.cols(), rows = measured.x.rows();
  if (features == 0 || features > 128)
    return out;
  const Index stride = std::max<Index>(1, (rows + kMostRows - 1) / kMostRows);
  const Vector low = measured.x.colwise().minCoeff().transpose(),
               span = (measured.x.colwise().maxCoeff().transpose() - low).cwiseMax(1e-300);
  std::vector<double> u, r;
  // What thins the evidence, besides the rows left out.
  const double unit = std::sqrt(std::max(1.0, divisor / static_cast<double>(stride)));
  for (Index i = 0; i < rows; i += stride) {
    if (used(i) <= 0.0)
      continue;
    for (Index f = 0; f < features; ++f)
      u.push_back((measured.x(i, f) - low(f)) / span(f));
    r.push_back((channel.z(i) - channel.m(i)) / channel.sd(i) / unit);
  }
  rim_batch_data data{};
  data.n = static_cast<std::uint32_t>(r.size());
  data.features = static_cast<std::uint16_t>(features);
  data.outcomes = 1;
  data.u = u.data();
  data.r = r.data();
  rim_dmaps_config config{};
  config.regions = kMostRegions;
  config.search.nodes = kNodes;
  std::vector<double> work(
      RIM_DMAPS_SIZE(r.size(), static_cast<std::size_t>(features), 1, kNodes) / sizeof(double) + 1);
  rim_dmaps_result found{};
  if (rimi_dmaps_find(&config, &data, nullptr, work.data(), work.size() * sizeof(double), &found) !=
      RIM_OK)
    return out;
  std::vector<std::uint8_t> assignment(r.size());
  if (rimi_dmaps_assign(&found, &data, nullptr, assignment.data()) != RIM_OK)
    return out;
  for (std::uint8_t k = 0; k < found.count; ++k) {
    ResidualRegion region;
    region.channel = channel.name;
    region.gate = gate_of(found.region[k].region.unit, measured, low, span);
    region.ln_anom = found.region[k].ln_anom;
    region.rows = found.region[k].count * static_cast<std::size_t>(stride);
    rimi_dmaps_shift(&data, assignment.data(), static_cast<std::uint8_t>(k + 1), &region.shift_sd);
    region.shift_sd *= unit;
    out.push_back(region);
  }
  return out;
}

} // namespace rim::diagnose
