// Calibration: what nominal runs do, so that an alarm means something.
//
// Every calibration run is judged as a run in flight is: by models, spreads and scales learnt from
// the other runs, with the flight code (rim_monitor_block) doing the search. The alarm threshold is
// an order statistic of the runs' largest scores: exchangeable runs give a finite-sample promise
// (rim/threshold.h).
#ifndef RIM_TRAIN_CALIBRATE_HPP
#define RIM_TRAIN_CALIBRATE_HPP

#include <cstdint>
#include <vector>

#include "train/flight_image.hpp"

namespace rim {

struct CalibrationOptions {
  double false_alarm = 0.05; // wished rate of runs with any false alarm
  double warn_rate = 0.25;   // the same for the warning level
  std::size_t region_features = 12;
  double redundant = 0.95; // correlation, by rank or value, from which on a feature repeats another
  std::uint32_t least_n = 8; // observations inside an interval before it is judged
  bool flight = false;       // searches less a row and holds less: see use_profile
};

// How much search a row, and how much memory. ground (the default): what finds most. flight: what a
// Cortex-M7 can afford (`make size` prints both). Calibration runs by the same profile, so the
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

// Features that may describe a region, in their order: those that tell the phase of a run
// (phase_weights) and that no earlier one repeats.
std::vector<std::uint16_t> choose_region_features(const std::vector<ChannelSeries> &series,
                                                  const CalibrationOptions &options);

// Fills the plan's ranges, region, channel scales, envelope and thresholds from the series of at
// least three nominal runs (each by models without it). Deterministic.
void calibrate_trained(FlightPlan *plan, const std::vector<ChannelSeries> &series,
                       const CalibrationOptions &options);

} // namespace rim
#endif
