// SPDX-License-Identifier: MIT
// stats/robust.hpp - location and scale that outliers do not move.
#pragma once

#include <vector>

namespace rim {

// The middle value; of an even number of values the upper of the two in the middle, so that it is
// always one of them. 0 for no value. O(n).
double median(std::vector<double> values);

// The middle value; of an even number the mean of the two in the middle. NaN for no value.
double median_midpoint(std::vector<double> values);

// Median absolute deviation from `center`, scaled to the standard deviation of a normal
// distribution (times 1.4826). 0 for no value.
double mad_sd(std::vector<double> values, double center);

} // namespace rim
