// SPDX-License-Identifier: MIT
// Everything a flight image says, and its bytes (rim/monitor.h lists the sections).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/basis.hpp"
#include "image/layout.hpp"
#include "rim/image.h"
#include "rim/monitor.h"
#include "search/select.h"

namespace rim {

// Section THRESHOLD: how scores are made of ln anom, and where the alarm is.
struct Thresholds {
  std::vector<float> offset, scale; // per channel
  std::vector<float> growth;        // e(n) at n = 2^k; empty: 1
  std::vector<float> maxima;        // largest score of each calibration run, ascending
  std::uint32_t rank = 0;           // of the alarm score among the maxima, from 1
  float alarm_score = 1e30F;
  float warn_score = 1e30F;
  float promised_rate = 1.0F; // run-level false alarms
  bool by_tail = false;       // alarm_score is tail_bound() of train/; not in the image
};

struct FlightPlan {
  Layout layout;
  std::vector<float> low, high;      // per feature: range of the search
  std::vector<std::uint16_t> region; // features that may describe a region
  // Trained: for each of them the outcome whose prediction stands for it; 0xffff or empty: none.
  std::vector<std::uint16_t> region_outcome;
  std::uint32_t block_rows = 1;
  double period_s = 0.0;
  double stale_s = 0.0;
  double inhibit_s = 10.0;       // between updates of an alarm; trained: at most
  std::uint32_t persistence = 4; // blocks above the threshold before an alarm is raised
  std::uint32_t clear = 30;      // blocks below the warning score before it is cleared; 0: never
  std::uint32_t ring = 0, bins = RIM_SELECT_DEFAULT_BINS, grid = 0, pairs = 0; // 0: select's
  std::uint32_t scans = 0, edges = 0, moves = 0, budget = 0;
  bool small = false; // the search for small processors
  std::uint32_t seed = 1;
  std::vector<float> inverse_sd; // not trained: of each outcome's residuals; empty: 1
  Basis basis;                   // trained: inputs of the models
  // Sections; empty: absent.
  std::vector<std::uint8_t> level, quadratic, behaviour, agreement, noise, cuts;
  Thresholds thresholds;

  std::size_t channels() const {
    return (noise.empty() ? 1 : RIM_MONITOR_KINDS) * layout.outcomes();
  }
};

// The image; its model id is the CRC-32 of its content.
std::vector<std::uint8_t> make_image(const FlightPlan &plan);

// Reads back what names and units an image carries. DataError where it has none.
Layout layout_of_image(const rim_image &image);

// A monitor with its image and memory, for the ground. Movable.
class Monitor {
public:
  // DataError "NAME: reason" when the image is refused.
  Monitor(std::vector<std::uint8_t> image, const std::string &name);
  rim_monitor *get() const { return monitor_; }
  std::size_t bytes() const { return memory_.size() * sizeof(std::uint64_t); }
  const rim_image &image() const { return view_; }

private:
  std::vector<std::uint64_t> image_, memory_;
  rim_image view_{};
  rim_monitor *monitor_ = nullptr;
};

} // namespace rim
