// SPDX-License-Identifier: MIT
// What `rim train` prints.
#pragma once

#include <string>
#include <vector>

#include "train/trainer.hpp"

namespace rim {

// How well every outcome is modelled, what healthy runs' residuals do, how large a fault must be;
// then which outcomes cannot be watched by their behaviour.
std::string outcome_report(const Training &training);
// Blocks, and the features that may describe a region.
std::string choice_report(const Training &training);
std::string promise_report(const Training &training, double false_alarm);
std::string image_report(const std::vector<std::uint8_t> &image);

} // namespace rim
