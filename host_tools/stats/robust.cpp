// SPDX-License-Identifier: MIT
#include "stats/robust.hpp"

#include <algorithm>
#include <cmath>

namespace rim {

double median(std::vector<double> values) {
  if (values.empty())
    return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_midpoint(std::vector<double> values) {
  if (values.empty())
    return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

double mad_sd(std::vector<double> values, double center) {
  for (double &value : values)
    value = std::abs(value - center);
  return 1.4826 * median(std::move(values));
}

} // namespace rim
