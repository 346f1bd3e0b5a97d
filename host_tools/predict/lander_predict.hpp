// SPDX-License-Identifier: MIT
// predict/lander_predict.hpp - world "lander": the nominal vehicle of data/lander.toml, stepped one
// second from what its sensors read.
//
// Needs the columns of `rim simulate lander` (lander_columns(), data/README.md). Every row that has
// a row one second later without a gap is predicted, from the mean of the readings of the second
// before it, each carried to the row by what the commands did since. Commands, attitude and rates
// between the two rows are taken as measured; flows follow the commands with the engines' lag.
//
// Outcomes, a second later: position and velocity, altitudes, acceleration, gravity, mass, tank and
// chamber pressures; rates from the attitudes within half a second of it. Each velocity is
// predicted from the *other* instrument's, so that a constant error shows; in both, with opposite
// signs: which of the two is wrong they cannot tell. Attitude is no outcome: the jets that hold it
// are in no column. sd: the noise and rounding of the readings that enter, the dispersion of flow
// and impulse. Biases and scales that a run's sensors have by data/lander.toml are in no sd: they
// are discrepancies.
//
// Features: u.throttle_1.., x.thrust (their mean), and all sensors but pressures and gravity.
#pragma once

#include "predict/predictor.hpp"
#include "world/lander_dynamics.hpp"

namespace rim::world {

constexpr double kLanderPredictStep_s = 1.0;

class LanderPredictor final : public Predictor {
public:
  // Reads data/lander.toml.
  LanderPredictor();
  std::string name() const override { return "world lander"; }
  double step_s() const override { return kLanderPredictStep_s; }
  // DataError also where no row has others 0.5, 1 and 1.5 s later. O(rows x rows in a second).
  Log predict(const Log &log) const override;
  // Carries position, velocities and mass; what they change in the predictions is exact but for
  // gravity's and thrust's own change in a second.
  bool advance(const Log &now, const Matrix &outcome, Log *next) const override;

private:
  LanderParams params_;
  LanderVehicle vehicle_;
};

} // namespace rim::world
