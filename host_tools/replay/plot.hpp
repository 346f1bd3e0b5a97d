// SPDX-License-Identifier: MIT
// A figure of ln anom against its threshold over time, drawn by gnuplot.
#ifndef RIM_REPLAY_PLOT_HPP
#define RIM_REPLAY_PLOT_HPP

#include <functional>
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

// UsageError unless the name ends in .svg or .png.
void check_plot_path(const std::string &path);

// Any figure: a gnuplot script that draws into the file `to`, as SVG or PNG. Errors as write_plot.
using PlotScript = std::function<std::string(const std::string &to, bool svg)>;
void write_gnuplot(const PlotScript &script_of, const std::string &path);

// The figure appears whole. DataError: gnuplot is missing or fails, or the file cannot be written.
void write_plot(const std::vector<Trace> &traces, const std::string &path);

} // namespace rim
#endif
