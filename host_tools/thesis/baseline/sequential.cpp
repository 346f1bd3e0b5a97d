// SPDX-License-Identifier: MIT
// SPRT, CUSUM, GLRT: tests over time that know no context.
#include <algorithm>
#include <cmath>

#include "thesis/baseline/baseline.hpp"

namespace rim {
namespace {

constexpr double kShift = 1.0;         // of the alternative, standard deviations
const double kAccept = std::log(0.05); // of the SPRT

// The stretch of points [first, last] with the largest statistic.
struct Stretch {
  double value = 0.0;
  std::size_t first = 1, last = 0;
};

std::vector<bool> points_of(const Stretch &stretch, std::size_t n) {
  std::vector<bool> out(n);
  for (std::size_t i = stretch.first; i <= stretch.last && i < n; ++i)
    out[i] = true;
  return out;
}

// Sums of log likelihood ratios, begun anew where they fall to `restart`.
BaselineResult run_ratio(const BaselineData &data, double restart) {
  struct Sum {
    double value = 0.0;
    std::size_t first = 0;
  };
  std::vector<Sum> sums(2 * data.channels);
  BaselineResult out;
  Stretch best;
  for (std::size_t i = 0; i < data.n; ++i) {
    double most = 0.0;
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const double sign = k % 2 == 0 ? 1.0 : -1.0;
      const double r = data.r[i * data.channels + k / 2];
      sums[k].value += kShift * (sign * r) - 0.5 * kShift * kShift;
      if (sums[k].value <= restart)
        sums[k] = {0.0, i + 1};
      most = std::max(most, sums[k].value);
      if (sums[k].value > best.value)
        best = {sums[k].value, sums[k].first, i};
    }
    out.score.push_back(most);
  }
  out.inside = points_of(best, data.n);
  return out;
}

} // namespace

BaselineResult detect_sprt(const BaselineData &data) { return run_ratio(data, kAccept); }

BaselineResult detect_cusum(const BaselineData &data) { return run_ratio(data, 0.0); }

BaselineResult detect_glrt(const BaselineData &data) {
  BaselineResult out;
  Stretch best;
  for (std::size_t i = 0; i < data.n; ++i) {
    double most = 0.0;
    for (std::size_t c = 0; c < data.channels; ++c) {
      double sum = 0.0;
      for (std::size_t k = 0; k <= i; ++k) {
        sum += data.r[(i - k) * data.channels + c];
        const double value = sum * sum / (2.0 * static_cast<double>(k + 1));
        most = std::max(most, value);
        if (value > best.value)
          best = {value, i - k, i};
      }
    }
    out.score.push_back(most);
  }
  out.inside = points_of(best, data.n);
  return out;
}

} // namespace rim
