// SPDX-License-Identifier: MIT
// log/labels.hpp - which rows of which log belong to a finding: CSV log,row,t_s,finding.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "log/log.hpp"

namespace rim {

// Every row of one file. t_s: NaN where the row was not used (written as an empty field); of a
// resampled log the time on the grid. finding: the number of the finding from 1, or 0 for none.
struct LabelledLog {
  std::string path;
  std::vector<double> t_s;
  std::vector<std::uint32_t> finding;
};

// The rows of a log, with their times and without a finding.
LabelledLog unlabelled(const Log &log);

// The header line; then a line per row, the path quoted where it must be.
std::string labels_header();
std::string labels_text(const LabelledLog &log);

// A field of a CSV file: in double quotes where it holds a comma, a quote or a line break.
std::string csv_field(const std::string &text);

} // namespace rim
