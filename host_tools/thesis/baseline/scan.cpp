// SPDX-License-Identifier: MIT
// Scans over regions: all circles of a plane, and the best subset of every neighbourhood.
#include <algorithm>
#include <cmath>

#include "thesis/baseline/baseline.hpp"

namespace rim {
namespace {

constexpr std::size_t kNeighbours = 20;

struct Found {
  double value = 0.0;
  std::vector<std::size_t> points;
};

using Distances = std::vector<std::pair<double, std::size_t>>;

Found scan_circles(const BaselineData &data, std::size_t n) {
  Found best;
  for (std::size_t i = 0; i < n; ++i) {
    Distances order;
    for (std::size_t j = 0; j < n; ++j) {
      const double dx =
          data.u[i * data.dims + data.space[0]] - data.u[j * data.dims + data.space[0]];
      const double dy =
          data.u[i * data.dims + data.space[1]] - data.u[j * data.dims + data.space[1]];
      order.push_back({dx * dx + dy * dy, j});
    }
    std::sort(order.begin(), order.end());
    for (std::size_t c = 0; c < data.channels; ++c) {
      double sum = 0.0;
      for (std::size_t k = 0; k < n; ++k) {
        sum += data.r[order[k].second * data.channels + c];
        const double value = sum * sum / (2.0 * static_cast<double>(k + 1));
        if (value <= best.value)
          continue;
        best.value = value;
        best.points.clear();
        for (std::size_t m = 0; m <= k; ++m)
          best.points.push_back(order[m].second);
      }
    }
  }
  return best;
}

// The k largest, or smallest, residuals of a neighbourhood.
void scan_subsets(const BaselineData &data, Distances near, std::size_t channel, double sign,
                  Found &best) {
  for (auto &entry : near)
    entry.first = -sign * data.r[entry.second * data.channels + channel];
  std::sort(near.begin(), near.end());
  double sum = 0.0;
  for (std::size_t k = 0; k < near.size(); ++k) {
    sum -= near[k].first;
    const double value = sum > 0.0 ? sum * sum / (2.0 * static_cast<double>(k + 1)) : 0.0;
    if (value <= best.value)
      continue;
    best.value = value;
    best.points.clear();
    for (std::size_t m = 0; m <= k; ++m)
      best.points.push_back(near[m].second);
  }
}

Found scan_neighbourhoods(const BaselineData &data, std::size_t n) {
  Found best;
  const std::size_t size = std::min(n, kNeighbours);
  for (std::size_t i = 0; i < n; ++i) {
    Distances near;
    for (std::size_t j = 0; j < n; ++j) {
      double square = 0.0;
      for (std::size_t f = 0; f < data.dims; ++f) {
        const double off = data.u[i * data.dims + f] - data.u[j * data.dims + f];
        square += off * off;
      }
      near.push_back({square, j});
    }
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(size), near.end());
    near.resize(size);
    for (std::size_t c = 0; c < data.channels; ++c) {
      scan_subsets(data, near, c, 1.0, best);
      scan_subsets(data, near, c, -1.0, best);
    }
  }
  return best;
}

BaselineResult every_stride(const BaselineData &data,
                            Found (*scan)(const BaselineData &, std::size_t)) {
  BaselineResult out;
  out.inside.assign(data.n, false);
  Found found;
  std::size_t next = scan_stride(0);
  for (std::size_t n = 1; n <= data.n; ++n) {
    if (n == next || n == data.n) {
      found = scan(data, n);
      next = n + scan_stride(n);
    }
    out.score.push_back(found.value);
  }
  for (const std::size_t i : found.points)
    out.inside[i] = true;
  return out;
}

} // namespace

std::size_t scan_stride(std::size_t n) { return n < 300 ? 10 : 25; }

BaselineResult detect_spatial_scan(const BaselineData &data) {
  return every_stride(data, scan_circles);
}

BaselineResult detect_subset_scan(const BaselineData &data) {
  return every_stride(data, scan_neighbourhoods);
}

const std::vector<Baseline> &baselines() {
  static const std::vector<Baseline> list = {
      {"SPRT", detect_sprt},
      {"CUSUM", detect_cusum},
      {"GLRT", detect_glrt},
      {"spatial outlier", detect_spatial_outlier},
      {"context outlier", detect_context_outlier},
      {"spatial scan", detect_spatial_scan},
      {"Fast Subset Scan", detect_subset_scan},
  };
  return list;
}

} // namespace rim
