// SPDX-License-Identifier: MIT
// predict/falcon_fall.hpp - world "falcon": a rocket stage falling with its engines off, as a point
// mass under gravity and deliberately nothing else.
//
// Needs s.speed_mps, s.altitude_m, u.engine_on (0 or 1), some 10 Hz or more; u.near_event (1:
// close to an ignition or cut-off) where there is one, and x.altitude_step_m, the step in which the
// altitude is shown (without it: its median change). Predicts the speed one second later.
//
// Rows: one a second, on the grid from the first row on, where the engines are off and no event is
// near from a quarter of a second before to a quarter of a second after the step, where the
// readings have no gap of over 0.2 s at either end, and where the stage moves (over 10 m/s). Steps
// do not overlap; a row's outcome and the next row's speed are one value, so that the readings'
// noise in neighbouring rows correlates by -1/2.
//
//   s.speed_mps   straight line through the readings within +-0.25 s, at the row
//   x.climb_mps   slope at the row of a quadratic through the altitude of the last 5 s (10 s where
//   s.altitude_m  the step is 500 m or more), and its value. Where the altitude's steps make the
//                 slope so uncertain that it spoils the prediction by over 0.15 m/s, the window
//                 grows by halves, up to 60 s, while no engine runs in it and the quadratic fits
//   x.sin_gamma   climb over speed: sine of the path angle
//   z. m. sd.speed_mps   the speed a second later; by gravity; its standard deviation: both speed
//                 readings and the slope, each from its own scatter
#pragma once

#include "predict/predictor.hpp"

namespace rim::world {

constexpr double kFallStep_s = 1.0;

// Standard gravity at the Earth's mean radius, inverse square above.
double fall_gravity_mps2(double altitude_m);

// Speed of a point mass after step_s, from the energy: v^2 - 2 g (climb - (g - vh^2/r)/2 step)
// step with vh the horizontal speed. Exact to the third order of step_s; not below 0.
double fall_speed_mps(double speed_mps, double altitude_m, double sin_gamma, double step_s);

class FalconFall final : public Predictor {
public:
  std::string name() const override { return "world falcon"; }
  double step_s() const override { return kFallStep_s; }
  // DataError also where no row is left.
  Log predict(const Log &log) const override;
  // Carries the speed; altitude and path angle are those measured.
  bool advance(const Log &now, const Matrix &outcome, Log *next) const override;
};

} // namespace rim::world
