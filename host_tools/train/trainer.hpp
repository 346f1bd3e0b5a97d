// SPDX-License-Identifier: MIT
// From healthy logs to a flight image: models, noise, calibration.
#pragma once

#include <string>
#include <vector>

#include "image/flight_image.hpp"
#include "train/behaviour.hpp"
#include "train/calibrate.hpp"
#include "train/fit.hpp"
#include "train/healthy_runs.hpp"

namespace rim {

struct TrainOptions {
  CalibrationOptions calibration;
  BlockingOptions blocking;
  // Input older than this is STALE, but never before five rows should have come: rows of a plant
  // may be a minute apart.
  double stale_s = 2.0;
};

// How well one outcome is modelled, and how large a fault must be to be seen.
struct OutcomeReport {
  double r2 = 0.0, error = 0.0;                // of behaviour, runs left out
  double agreement = 1.0;                      // its error over behaviour's
  int source = 0;                              // agreement_source
  double noise = 0.0, effect = 0.0, rho = 0.0; // of the better channel
  // Constant offset over half of a run that reaches the alarm; infinite: none does.
  double detectable = 0.0;
  std::string model;       // which terms, in words
};

struct Training {
  FlightPlan plan; // make_image(plan) is the flight image
  std::vector<OutcomeReport> outcomes;
  std::vector<RunScore> scores;   // per run, by what the others taught
  std::vector<std::string> paths; // of the runs
  std::vector<std::string> warnings;
  std::vector<std::size_t> unlike; // runs whose score is far above the others'
  NoiseModel noise;
  Promise promise;
  InputRows input;
};

// At least three logs with the same columns: of sensors (s. columns), or with the user's own
// predictions (z. m. columns), of which noise and thresholds alone are learnt. DataError otherwise,
// and for runs of different rates. Deterministic.
Training train(const std::vector<Log> &logs, const TrainOptions &options);
// The same from runs that were made elsewhere: of files (LogSet), or of part files.
Training train(HealthyRuns healthy, const TrainOptions &options);

} // namespace rim
