// SPDX-License-Identifier: MIT
// A figure of ln anom against its threshold over time, drawn by gnuplot.
#pragma once

#include <string>
#include <vector>

namespace rim {

struct TracePoint {
  double t_s, ln_anom, threshold;
};

// One panel.
struct Trace {
  std::string title;
  std::vector<TracePoint> points;
  std::vector<double> alarms_s; // when an alarm was raised
  std::string sentence;         // what was found, in a few words; empty: nothing
};

// The figure appears whole. DataError: gnuplot is missing or fails, or the file cannot be written.
void write_plot(const std::vector<Trace> &traces, const std::string &path);

} // namespace rim
