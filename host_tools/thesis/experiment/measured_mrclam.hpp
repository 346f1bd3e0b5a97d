// SPDX-License-Identifier: MIT
// Measured drives of small robots against a robot that does at once what it was commanded: robots
// of odd number are diagnosed and the extension judged on those of even number, and the other way
// round.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "thesis/experiment/measured_common.hpp"

namespace rim::experiment {

constexpr double kTurning_radps = 0.3; // commanded turn rate from which a robot turns

struct MrclamFold {
  std::vector<std::string> trained, tested;
  Judgement turning, straight, all, turn_rate;
  std::string forward_causes, turn_causes;
};

// DataError where either half has no log.
std::vector<MrclamFold> run_measured_mrclam(const MeasuredOptions &options);
void print_measured_mrclam(const std::vector<MrclamFold> &folds, std::FILE *to);

} // namespace rim::experiment
