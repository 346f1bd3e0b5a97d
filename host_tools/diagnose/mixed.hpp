// SPDX-License-Identifier: MIT
// diagnose/mixed.hpp - a size that differs from log to log: its mean and its spread between them.
#pragma once

#include <vector>

namespace rim::diagnose {

struct MixedSize {
  double mean = 0.0, stderror = 0.0, between_sd = 0.0;
};

// Sizes b_j with standard errors e_j; the variance between logs by restricted likelihood.
MixedSize mixed_size(const std::vector<double> &size, const std::vector<double> &stderror);

} // namespace rim::diagnose
