// From nominal logs to a flight image: fit, channels, calibration.
#ifndef RIM_TRAIN_TRAINER_HPP
#define RIM_TRAIN_TRAINER_HPP

#include <vector>

#include "train/blocks.hpp"
#include "train/calibrate.hpp"
#include "train/flight_image.hpp"

namespace rim {

// Maps that follow the phase of flight alone keep a run's own offsets out of the models; prototypes
// placed where one map errs most (FitOptions::focus) gain a few percent in error at one step and
// lose more in the spread of whole runs, which is what detection lives on.
inline FitOptions flight_fit() {
  FitOptions fit;
  fit.focus = 0.0;
  return fit;
}

struct TrainOptions {
  CalibrationOptions calibration;
  FitOptions fit = flight_fit();
  double block_s = 1.0;                       // length of a block
  double stale_s = 2.0;                       // input older than this: STALE
  std::uint32_t kinds = ModelOptions{}.kinds; // mask of rim_kind
};

struct Training {
  FlightPlan plan;      // make_image(plan) is the flight image
  TrainedModels models; // fit results for the report; series are the calibration runs' channels
  Promise promise;
};

// At least three logs of sensors (s. columns) with the same columns; DataError otherwise.
// Deterministic. 50 runs of 8400 rows and 29 columns take some 20 s on two cores.
Training train(const std::vector<Log> &logs, const TrainOptions &options);

} // namespace rim
#endif
