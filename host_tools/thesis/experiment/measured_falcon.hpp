// SPDX-License-Identifier: MIT
// Measured Falcon 9 flights against a point mass under gravity: each full descent left out in turn,
// what the others show is diagnosed, and the extension is judged on the one.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "thesis/experiment/measured_common.hpp"

namespace rim::experiment {

struct FalconLeftOut {
  std::string flight;
  Judgement one_step, aero, coast; // all rows; engine off in air; above it
  diagnose::Gain horizon;
  std::string first, others; // causes claimed
  Judgement second;          // in air: with all terms over with the first alone, fitted alone
  bool has_second = false;
};

// DataError where the folder lacks missions.csv or holds fewer than three flights.
std::vector<FalconLeftOut> run_measured_falcon(const MeasuredOptions &options);
void print_measured_falcon(const std::vector<FalconLeftOut> &flights,
                           const MeasuredOptions &options, std::FILE *to);

} // namespace rim::experiment
