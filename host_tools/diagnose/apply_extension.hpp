// SPDX-License-Identifier: MIT
// diagnose/apply_extension.hpp - an extension put to use: logs with corrected predictions, flight
// images with a correction section.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/term.hpp"
#include "image/layout.hpp"
#include "log/log.hpp"

namespace rim::diagnose {

// The terms of one file.
struct Extension {
  std::string path;
  std::vector<Term> terms;
};
std::vector<Extension> read_extensions(const std::vector<std::string> &paths);

// m. and sd. columns as the extended model predicts them: every mean term is added to m, every
// variance ratio multiplies sd squared (left as it is where there is no sd. column). Terms of kind
// stuck and dropout say what is no measurement and change no prediction. All features of the log
// count, those that never change too. DataError with the extension's file and line: a channel or
// feature that the log has not, or has in another unit.
void apply_extension(const std::vector<Extension> &extensions, Log *log);

// What of an extension can ride in a flight image.
struct Correction {
  std::vector<std::uint8_t> section; // of rim/correct.h, overlaps SUM; empty: no term can
  std::size_t terms = 0;             // that it holds
  std::vector<std::string> left_out; // "speed_mps: quadratic_drag: only constant shifts ..."
};

// Mean terms of constant size (basis "1") of the layout's outcomes, everywhere or in boxes and
// ellipses of at most RIM_REGION_MAX_DIMS of the layout's features, at most RIM_CORRECT_MAX_REGIONS
// different regions in all; accepted, so of confidence 1. kinds: mask of rim_kind whose predictions
// they correct. Terms of other channels than the layout's are left out too.
Correction correction_section(const std::vector<Extension> &extensions, const Layout &layout,
                              std::uint32_t kinds);

// The image with this section (instead of the one it may have), and the model id that belongs to
// its new content. DataError "NAME: reason" where it is no image.
std::vector<std::uint8_t> with_correction(const std::vector<std::uint8_t> &image,
                                          const std::vector<std::uint8_t> &section,
                                          const std::string &name);

} // namespace rim::diagnose
