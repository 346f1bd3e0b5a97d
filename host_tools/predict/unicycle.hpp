// SPDX-License-Identifier: MIT
// predict/unicycle.hpp - world "unicycle": a wheeled robot that does at once what it was commanded.
//
// Needs x.x_m x.y_m x.theta_rad (measured pose; the heading may be wrapped), u.cmd_v_mps
// u.cmd_w_radps (commanded speed and turn rate, held until the next row) and x.pose_ok (1 where the
// pose can be trusted), some 15 Hz or more. Predicts what is driven during the next 0.2 s.
//
// Rows: one every 0.2 s on the grid from the first row on, where every pose of the window is good
// and no two rows of it are over 0.1 s apart. Windows do not overlap; neighbours share a pose, so
// that the camera's part of their noise correlates by -1/2.
//
//   u.cmd_v_mps u.cmd_w_radps   the commands' mean over the window
//   x.x_m x.y_m x.theta_rad     pose at its begin, the heading wrapped
//   z. m. sd.forward_mps        displacement along the mean heading over the time; the command
//   z. m. sd.turn_radps         change of heading over the time; the command
//
// sd: robust scatter of the second differences of z over this log, which constant and smoothly
// changing motion does not enter.
#pragma once

#include "predict/predictor.hpp"

namespace rim::world {

constexpr double kUnicycleWindow_s = 0.2;

class Unicycle final : public Predictor {
public:
  std::string name() const override { return "world unicycle"; }
  double step_s() const override { return kUnicycleWindow_s; }
  // DataError also where fewer than kUnicycleLeastRows rows are left.
  Log predict(const Log &log) const override;
  // Commands come from outside and nothing else is carried: `next` stays as measured.
  bool advance(const Log &now, const Matrix &outcome, Log *next) const override;
};

constexpr std::size_t kUnicycleLeastRows = 10; // the scatter needs them

} // namespace rim::world
