// SPDX-License-Identifier: MIT
// Calibration: what healthy runs do, so that an alarm means something.
//
// Every calibration run is judged as a run in flight is: by models learnt from the other runs, with
// the flight code doing the search. The alarm threshold is an order statistic of the runs' largest
// scores: exchangeable runs give a finite-sample promise (rim/threshold.h).
#ifndef RIM_TRAIN_CALIBRATE_HPP
#define RIM_TRAIN_CALIBRATE_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "image/flight_image.hpp"
#include "train/noise.hpp"

namespace rim {

struct CalibrationOptions {
  double false_alarm = 0.05; // wished rate of runs with any false alarm
  double warn_rate = 0.25;   // the same for the warning level
  std::size_t region_features = 12;
  double redundant =
      0.985;           // correlation, by rank or value, from which on a feature repeats another
  bool flight = false; // searches less per row and holds less: see use_profile
};

// How much search per row, and how much memory. ground (the default): what finds most. flight: what
// a Cortex-M7 can afford (`make size` prints both). Calibration runs by the same profile, so the
// promise holds in either. Call it before calibrating.
void use_profile(FlightPlan *plan, bool flight, bool few_rows);

// Which rank promises the wished rate: the k-th smallest of n maxima bounds the rate by
// (n + 1 - k) / (n + 1). With too few runs k = n and the promise is 1 / (n + 1).
struct Promise {
  std::uint32_t rank = 0;
  double rate = 1.0;
};
Promise promise_for(std::size_t runs, double false_alarm);

// Ranks, promised rate, alarm and warning score from the largest scores of nominal runs.
void set_alarm(Thresholds *thresholds, std::vector<float> maxima,
               const CalibrationOptions &options);

// One healthy run as the search sees it, by models that have not seen it.
struct SearchRun {
  const BlockRun *blocks;
  const Matrix *predicted; // blocks x outcomes
  const Matrix *residual;  // blocks x channels
};

// Features that may describe a region, with the outcome whose prediction stands for the feature
// (0xffff: as measured): commands and context, then sensors; those that repeat an earlier one are
// left out.
void choose_region(FlightPlan *plan, const std::vector<SearchRun> &runs,
                   const std::vector<double> &r2, const CalibrationOptions &options);

// What a run's own score tells beside its number, for the report.
struct RunScore {
  double score = 0.0;
  std::size_t channel = 0;
};

// Fills phi of the noise model and the plan's thresholds. Returns every run's score, by the phi of
// the others.
std::vector<RunScore> calibrate_runs(FlightPlan *plan, NoiseModel *noise,
                                     const std::vector<SearchRun> &runs,
                                     const CalibrationOptions &options);

} // namespace rim
#endif
