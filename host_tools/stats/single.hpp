// SPDX-License-Identifier: MIT
// Numbers as a flight image holds them.
#pragma once

namespace rim {

// x in single precision.
inline double single(double x) { return static_cast<double>(static_cast<float>(x)); }

// What x is off by in an image. Of a clock that counts from 1970 that is minutes.
inline double rounding(double x) { return single(x) - x; }

} // namespace rim
