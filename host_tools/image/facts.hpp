// SPDX-License-Identifier: MIT
// image/facts.hpp - what a flight image says, for people: rim show, rim check, the report of train.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/layout.hpp"
#include "image/names.hpp"

namespace rim {

struct ImageSectionSize {
  std::string name; // in words
  std::size_t bytes = 0;
};

struct ImageFacts {
  std::uint32_t model_id = 0;
  unsigned major = 0, minor = 0;
  Layout layout;
  Names names;
  std::vector<double> low, high;     // per feature: the trained range
  std::vector<std::uint16_t> region; // features that may describe a region
  double period_s = 0.0;             // 0: rows have no rate
  std::uint32_t block_rows = 1;
  double stale_s = 0.0;          // 0: never
  std::uint32_t persistence = 1; // blocks above the threshold before an alarm
  std::uint32_t runs = 0;        // that set the threshold
  double promised_rate = 1.0;    // share of healthy runs with any alarm, at most
  double alarm_score = 0.0, warn_score = 0.0;
  std::vector<ImageSectionSize> sections;
  std::size_t bytes = 0, monitor_bytes = 0;
};

// A section in words: "thresholds".
const char *section_name(std::uint32_t id);

// DataError "NAME: reason" where the monitor refuses the image, or it carries no names. O(bytes).
ImageFacts facts_of_image(const std::vector<std::uint8_t> &image, const std::string &name);

// How far beyond the trained range of a feature a value may lie and still count as within it.
double range_margin(const ImageFacts &facts, std::size_t feature);

} // namespace rim
