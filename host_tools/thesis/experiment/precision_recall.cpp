// SPDX-License-Identifier: MIT
#include "thesis/experiment/precision_recall.hpp"

#include <cstddef>

namespace rim {

PrecisionRecall compare_points(const std::vector<bool> &inside, const std::vector<bool> &truth) {
  double hit = 0.0, found = 0.0, real = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    hit += inside[i] && truth[i] ? 1.0 : 0.0;
    found += inside[i] ? 1.0 : 0.0;
    real += truth[i] ? 1.0 : 0.0;
  }
  PrecisionRecall out;
  out.precision = found > 0.0 ? hit / found : 0.0;
  out.recall = real > 0.0 ? hit / real : 0.0;
  out.f1 = found + real > 0.0 ? 2.0 * hit / (found + real) : 0.0;
  return out;
}

} // namespace rim
