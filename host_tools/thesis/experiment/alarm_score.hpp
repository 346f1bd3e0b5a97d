// SPDX-License-Identifier: MIT
// thesis/experiment/alarm_score.hpp - from scores to alarms: a threshold that holds for whole runs,
// and how many anomalous points it takes until it is exceeded.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

namespace rim {

// The ceil((n + 1)(1 - rate))-th smallest of n nominal runs' largest scores: at most that share of
// such runs exceeds it (conformal). Infinite where so few runs cannot promise the rate.
double run_level_threshold(std::vector<double> maxima, double rate);

// A run's score as it grew: [largest score, anomalous points until then], for every new largest.
nlohmann::json score_records(const std::vector<double> &score, const std::vector<bool> &anomalous);

struct PointsToAlarm {
  bool found = false;
  double points = 0.0; // 0: the alarm came before the first of them
};
PointsToAlarm points_to_alarm(const nlohmann::json &records, double threshold);

} // namespace rim
