// SPDX-License-Identifier: MIT
// Outliers, point by point: in features and residuals together, and among neighbouring contexts.
#include <algorithm>
#include <cmath>

#include "thesis/baseline/baseline.hpp"

namespace rim {
namespace {

constexpr std::size_t kNeighbour = 5;
constexpr std::size_t kLeastPoints = 30;
constexpr double kRangeASd = 0.25;
constexpr std::size_t kContexts = 8;

double distance2(const double *a, const double *b, std::size_t n) {
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k)
    sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

} // namespace

BaselineResult detect_spatial_outlier(const BaselineData &data) {
  BaselineResult out;
  out.is_pointwise = true;
  for (std::size_t i = 0; i < data.n; ++i) {
    if (i < kLeastPoints) {
      out.score.push_back(0.0);
      continue;
    }
    std::vector<double> distances;
    for (std::size_t j = 0; j < i; ++j)
      distances.push_back(
          distance2(data.u + i * data.dims, data.u + j * data.dims, data.dims) +
          kRangeASd * kRangeASd *
              distance2(data.r + i * data.channels, data.r + j * data.channels, data.channels));
    std::nth_element(distances.begin(), distances.begin() + (kNeighbour - 1), distances.end());
    out.score.push_back(std::sqrt(distances[kNeighbour - 1]));
  }
  return out;
}

BaselineResult detect_context_outlier(const BaselineData &data) {
  BaselineResult out;
  out.is_pointwise = true;
  const double scale = 1.0 / std::sqrt(1.0 + 1.0 / static_cast<double>(kContexts));
  for (std::size_t i = 0; i < data.n; ++i) {
    if (i < kContexts) {
      out.score.push_back(0.0);
      continue;
    }
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t j = 0; j < i; ++j)
      near.push_back({distance2(data.u + i * data.dims, data.u + j * data.dims, data.dims), j});
    std::nth_element(near.begin(), near.begin() + (kContexts - 1), near.end());
    double most = 0.0;
    for (std::size_t c = 0; c < data.channels; ++c) {
      double mean = 0.0;
      for (std::size_t k = 0; k < kContexts; ++k)
        mean += data.r[near[k].second * data.channels + c] / static_cast<double>(kContexts);
      most = std::max(most, scale * std::fabs(data.r[i * data.channels + c] - mean));
    }
    out.score.push_back(most);
  }
  return out;
}

} // namespace rim
