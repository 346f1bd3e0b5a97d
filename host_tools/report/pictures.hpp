// SPDX-License-Identifier: MIT
// report/pictures.hpp - the report's pictures, each a <figure> with title, key and note.
#pragma once

#include <string>
#include <vector>

#include "report/data.hpp"

namespace rim::diagnose::report {

constexpr double kWide = 1000.0, kHalf = 490.0; // px

enum class Mark { line, dots, area };
struct Key {
  Mark mark;
  std::string style, text; // class of report_style.cpp
};
// `note`: how to read it; may be empty. Text is escaped here.
std::string figure(const std::string &title, const std::string &svg, const std::vector<Key> &keys,
                   const std::string &note);

// Binned residual in sd over one feature, before and after, the interval shaded; of a variance
// term the root mean square in place of the mean.
std::string profile_picture(const Finding &finding, const View &view, const std::string &feature,
                            double width);
// Mean residual in cells of a plane of two of the gate's features, before beside after, the gate
// outlined. Pre: at least two features.
std::string map_picture(const Finding &finding, const View &view);
// What the finding's own term has to explain, in the channel's unit, over its argument, with the
// fitted curve.
std::string argument_picture(const Finding &finding, const View &view, double width);
// Measured, simulated and extended over the stretch of a log in which the finding acts most, and
// the residuals below.
std::string time_picture(const Finding &finding, const View &view);
// A lane a log and finding: when each acts.
std::string logs_picture(const Diagnosis &diagnosis, const Measured &measured);
// Small pictures of a channel's residual over its features, before and after.
std::string channel_pictures(const View &view);

} // namespace rim::diagnose::report
