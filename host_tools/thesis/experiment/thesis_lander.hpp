// SPDX-License-Identifier: MIT
// The thesis's own procedure on the lander (4.2.5, p. 62-66), to compare with: kernel-average
// nominal model (eq. 4.13, 4.14), offline FS-RIM (Alg. 4, p. 49) every 100 rows on all rows so far,
// eq. 3.7 (p. 28) over all outcomes together, and a threshold of its own for every instant
// (eq. 3.9, p. 32).
//
// What is ours in it, each time to its advantage or because the thesis leaves it open: the kernel
// sum is cut after the nearest rows; its bandwidth is the most likely one on left-out runs; a
// predicted variance is never below the reading's white noise (a kernel with one near row claims
// none at all); contexts are binned, 16 a feature; projections have at most two features.
//
// The default sizes are those that found most on 36 faulty landings (12 faults, 3 runs each, 20
// fresh nominal runs, 5 % run-level false alarms): 12000 rows with 256 neighbours found one, 60000
// rows with 32 or 128 neighbours and sums over all of 3000 rows none. The kernel's errors are
// systematic and add up in nominal runs too, and the threshold has to follow them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "log/log.hpp"

namespace rim {

// The most anomalous region after a number of rows.
struct ThesisPoint {
  std::uint32_t rows = 0;     // observations so far
  double ln_anom = 0.0;       // eq. 3.7, summed over the outcomes
  double normalised = 0.0;    // over the threshold of this instant at 95 % confidence
  int outcome = -1;           // with the largest share of ln_anom
  int features[2] = {-1, -1}; // of the region; -1: none
};

struct ThesisDetection {
  bool found = false;
  std::uint32_t rows = 0; // observations needed
  int outcome = -1;       // index among the sensors, in file order
};

struct ThesisOptions {
  std::size_t kernel_rows = 12000;
  std::size_t neighbours = 256;
  std::vector<double> bandwidth{0.5, 1, 2, 4, 8}; // candidates, times the spacing of the rows
  std::uint32_t every_rows = 100;
  std::uint32_t expansions = 20; // i_max of Alg. 4
  double confidence = 0.95;      // of the threshold of an instant
  std::uint64_t seed = 1;
};

class ThesisLander {
public:
  // Learns from nominal logs of equal columns; the threshold from each log left out of the model.
  // About 1.2 s a log on one core, two at a time. Throws DataError for fewer than three logs.
  ThesisLander(const std::vector<Log> &nominal, const ThesisOptions &options);
  ~ThesisLander();

  // A point every 100 rows, and at the end of the log. Safe to call from several threads.
  std::vector<ThesisPoint> run(const Log &log) const;

  double bandwidth() const;
  // Of the instant after `rows` observations.
  double threshold(std::uint32_t rows) const;

private:
  struct Model;
  std::unique_ptr<Model> model_;
};

// The least factor on the threshold with which at most `rate` of these runs raise any alarm.
double thesis_scale(const std::vector<std::vector<ThesisPoint>> &nominal, double rate);

// First point above the threshold times `scale`.
ThesisDetection thesis_detect(const std::vector<ThesisPoint> &run, double scale);

} // namespace rim
