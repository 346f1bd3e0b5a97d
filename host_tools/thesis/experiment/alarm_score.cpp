// SPDX-License-Identifier: MIT
#include "thesis/experiment/alarm_score.hpp"

#include <algorithm>
#include <cmath>

namespace rim {

double run_level_threshold(std::vector<double> maxima, double rate) {
  std::sort(maxima.begin(), maxima.end());
  const auto n = static_cast<double>(maxima.size());
  const auto rank = static_cast<std::size_t>(std::ceil((n + 1.0) * (1.0 - rate)));
  return rank <= maxima.size() ? maxima[rank - 1] : INFINITY;
}

nlohmann::json score_records(const std::vector<double> &score, const std::vector<bool> &anomalous) {
  nlohmann::json out = nlohmann::json::array();
  double largest = 0.0;
  std::size_t points = 0;
  for (std::size_t i = 0; i < score.size(); ++i) {
    points += anomalous[i] ? 1 : 0;
    if (score[i] <= largest)
      continue;
    largest = score[i];
    out.push_back({largest, points});
  }
  return out;
}

PointsToAlarm points_to_alarm(const nlohmann::json &records, double threshold) {
  for (const nlohmann::json &record : records) {
    if (record.at(0).get<double>() > threshold)
      return {true, record.at(1).get<double>()};
  }
  return {};
}

} // namespace rim
