// SPDX-License-Identifier: MIT
// diagnose/mixed.hpp - a size that differs from log to log: its mean and its spread between them.
#pragma once

#include <vector>

namespace rim::diagnose {

struct MixedSize {
  double mean = 0.0, stderror = 0.0, between_sd = 0.0;
  // What a log that was not fitted is predicted with: the mean, but no more than twice the least
  // size that a log is expected to have; none where they differ in sign. Then none of the logs
  // that were fitted is worse off than without, and another of their kind only where its size is
  // below all of theirs.
  double new_log = 0.0;
};

// Sizes b_j with standard errors e_j (one size at least); the variance between logs by restricted
// likelihood.
MixedSize mixed_size(const std::vector<double> &size, const std::vector<double> &stderror);

} // namespace rim::diagnose
