// SPDX-License-Identifier: MIT
// util/gnuplot.hpp - figures drawn by gnuplot.
#pragma once

#include <functional>
#include <string>

namespace rim {

// UsageError unless the name ends in .svg or .png.
void check_plot_path(const std::string &path);

// The text as a string of a gnuplot script: in single quotes, inside of which a quote is doubled.
// Line breaks are left out.
std::string gnuplot_text(const std::string &text);

// A gnuplot script that draws, as SVG or PNG, after 'set output ' + to. `to` is quoted already.
using PlotScript = std::function<std::string(const std::string &to, bool svg)>;

// The figure appears whole. UsageError as check_plot_path; DataError: gnuplot is missing or fails,
// or the file cannot be written.
void write_gnuplot(const PlotScript &script_of, const std::string &path);

} // namespace rim
