// SPDX-License-Identifier: MIT
// bus/model_lcm.hpp - the numbers in our LCM messages as constants of a type for lcm-gen.
#pragma once

#include <string>

#include "image/facts.hpp"

namespace rim {

// An .lcm file: codes, flags, and the index of every feature and outcome of the image, named. Names
// that would be the same constant get their index behind them.
std::string model_lcm(const ImageFacts &facts);

} // namespace rim
