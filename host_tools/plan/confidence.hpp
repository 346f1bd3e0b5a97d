// SPDX-License-Identifier: MIT
// plan/confidence.hpp - P(anom) of eq. 5.2 by simulating nominal runs (3.4.2, p. 35).
#pragma once

#include "rim/plan/extent.h"

#include <cstdint>
#include <vector>

namespace rim {

// The largest ln anom that the search finds in rewards that follow the nominal model exactly, at
// these contexts: one number a run, ascending. contexts: [n][dims] with nominal variances var[n];
// each run takes them all and searches `slices` slices in the end. Throws UsageError for a
// configuration that librim refuses, DataError for contexts that it does.
std::vector<double> nominal_maxima(const rim_extent_config &config,
                                   const std::vector<double> &contexts,
                                   const std::vector<double> &var, std::uint32_t runs,
                                   std::uint32_t slices, std::uint64_t seed);

// Sets the knots of the configuration: confidence 1 - p, p = (1 + maxima at or above) / (runs + 1).
// At least 8 maxima of at least two values, or DataError.
void set_confidence(rim_extent_config &config, const std::vector<double> &maxima);

} // namespace rim
