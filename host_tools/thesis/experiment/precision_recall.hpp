// SPDX-License-Identifier: MIT
// thesis/experiment/precision_recall.hpp - how well the points that were flagged are the anomalous
// ones.
#pragma once

#include <vector>

namespace rim {

struct PrecisionRecall {
  double precision = 0.0, recall = 0.0, f1 = 0.0; // eq. 3.31, 3.32, 4.7; 0 where undefined
};

// Both of one length.
PrecisionRecall compare_points(const std::vector<bool> &inside, const std::vector<bool> &truth);

} // namespace rim
