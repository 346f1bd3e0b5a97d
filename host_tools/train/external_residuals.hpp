// SPDX-License-Identifier: MIT
// Are a log's residuals what its alarm threshold takes them for: independent, of the stated sd and,
// over several logs, without an offset of the log's own?
//
// Noise is fitted as r = w + v, w an AR(1), v white, by maximum likelihood, and taken for real only
// if that gains enough over white noise of sd 1. An error that depends on the context looks like
// slow noise where contexts change slowly: so first what contexts explain is taken out, by the best
// region, a line or a table over one feature, a mean, or a shift since some time, each if the
// likelihood, with the noise fitted again, gains more by it than its description costs. What cannot
// be told apart in one log: noise as slow as the log is long, and an error that takes many terms to
// describe.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "train/calibrate_external.hpp"

namespace rim {

// r = w + v in units of the stated sd: variance `scale` in all, `share` of it in w, which keeps
// `keeps` of itself from row to row.
struct ResidualNoise {
  double scale = 1.0, share = 0.0, keeps = 0.0;
  double gain = 0.0; // nats over independent residuals of variance 1

  double lag_one() const { return share * keeps; } // correlation of neighbours
  // Variance of the sum of this many consecutive rows, divided by their number.
  double inflation(double rows) const;
};

// Maximum likelihood over series that know nothing of each other.
ResidualNoise fit_noise(const std::vector<std::vector<double>> &series);

// What one outcome's residuals were found to be.
struct ResidualTest {
  ResidualNoise noise;       // with white noise of variance 1 where nothing else is significant
  double offset_sd = 0.0; // of the logs' own offsets, in sd; 0: none that is significant
  double inflation = 1.0; // times the evidence to be asked of this outcome, at least 1
};

// In fewer logs an offset of all but a few cannot be told from a fault of some.
inline constexpr std::size_t kLogsForOffsets = 5;

// One a outcome. The plan is that of the logs, ready to fly but for the alarm: alarm_score and the
// search are used to look for regions.
std::vector<ResidualTest> test_residuals(const FlightPlan &plan,
                                         const std::vector<ExternalRows> &logs);

// One sentence for a person.
std::string residuals_sentence(const std::vector<ResidualTest> &tests,
                               const std::vector<std::string> &outcomes, std::size_t logs);

} // namespace rim
