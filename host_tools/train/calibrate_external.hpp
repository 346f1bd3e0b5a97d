// SPDX-License-Identifier: MIT
// Calibration of logs that bring their own predictions and no healthy logs to learn from.
//
// What chance does is known beforehand where predictions are right: z ~ N(m, sd), independent. So
// the alarm threshold comes from a table of the largest scores of such runs, by the numbers of
// features, outcomes and rows (train/external_table.hpp), or by Monte Carlo on the log's own
// contexts (thesis eq. 3.9, p. 30). Whether the log's residuals are as the table takes them is
// tested, and what is found is allowed for (train/external_residuals.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "train/calibrate.hpp"
#include "image/flight_image.hpp"

namespace rim {

// Least factor of the growth of chance scores with the number n of observations, ln n beyond:
// ln 12.
inline constexpr double kLeastGrowth = 2.5;

inline constexpr std::size_t kFewRows = 3000;   // up to this many are searched thoroughly
inline constexpr std::size_t kManyFeatures = 32; // with more the flight profile searches pairs

// A log with its own predictions. sd is the log's or, where it has none, estimated from the
// residuals.
struct ExternalRows {
  Matrix context, outcome, mean, sd; // rows x features, rows x outcomes
  std::vector<double> t_s;
  std::vector<bool> sd_estimated; // per outcome
};
// DataError naming file, row and column: a prediction missing, sd not above 0 or not to be
// estimated.
ExternalRows external_rows(const Log &log, const Layout &layout);

// All of the plan but its ranges and the alarm, for runs of `rows` rows. The plan has its layout.
void prepare_external(FlightPlan *plan, bool flight, std::size_t rows);

// Largest score of a run in which the predictions are right, z ~ N(m, sd), after the first `at[0]`,
// `at[1]`, ... rows (ascending, the last at most the log's). The plan has its ranges.
std::vector<float> nominal_maxima(const FlightPlan &plan, const ExternalRows &log,
                                  std::uint64_t stream, const std::vector<std::size_t> &at);

// Fills the plan's ranges from the logs, and the thresholds from the table (runs = 0) or from
// `runs` Monte Carlo runs on the logs' own contexts, which take turns. The plan has its layout.
void calibrate_external(FlightPlan *plan, const std::vector<ExternalRows> &logs, std::size_t runs,
                        const CalibrationOptions &options);

} // namespace rim
