// SPDX-License-Identifier: MIT
// thesis/experiment/cobot_watch.hpp - the library's detection on drives of the service robot: the
// online search while it drives (rim/select.h), the region of a finished drive (rim/interval.h,
// rim/cem.h).
#pragma once

#include <cstdint>
#include <vector>

#include "rim/region.h"
#include "thesis/experiment/cobot_points.hpp"

namespace rim {

// Residuals of each channel less what the drive so far says of its own constant size (a gain that
// differs from drive to drive is a share of the speed and shows in proportion to it, `slopes` of
// cobot_points.hpp), over their deviation: a Kalman filter whose state is the size. White in
// nominal drives, where the residuals are not; what depends on context stays.
std::vector<double> innovations(const std::vector<double> &residuals,
                                const std::vector<double> &slopes,
                                const std::array<double, kCobotChannels> &size_variance);
std::vector<double> cobot_innovations(const CobotDrive &drive, const CobotScatter &scatter);

// Score after every point: largest ln anom of any channel, less its null maximum, over the growth
// of chance with the number of points, max(3.5, ln n). In channels whose effect is proportional to
// the speed, a point is weighted by w, at least 1: a plain mean over points of different speeds
// would blur the effect.
std::vector<double> watch_cobot(const CobotDrive &drive, const CobotScatter &scatter,
                                std::uint64_t seed);

struct CobotRegion {
  std::size_t channel = 0;
  rim_region region{};      // dims 0: everywhere
  double ln_anom = 0.0;     // of its size, with an offset of the whole drive beside it
  double score = 0.0;       // less the price of the alternatives: what it was chosen by
  std::vector<bool> inside; // [n]
};
// Everywhere, the exact most anomalous interval of every feature, and ellipses over pairs of
// features ranked by H3 (eq. 4.5), each for every channel. A region of a share of the speed holds
// no point at standstill, unless it is everywhere or over a feature that tells the speed. Where the
// best is no ellipse, the points inside are those that lie in the region with a chance of .7: the
// average over everywhere and all intervals of all features and channels, by their likelihood.
CobotRegion explain_cobot(const CobotDrive &drive, const CobotScatter &scatter, std::uint64_t seed);

} // namespace rim
