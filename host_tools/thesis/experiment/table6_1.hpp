// SPDX-License-Identifier: MIT
// thesis/experiment/table6_1.hpp - the detectors of table 6.1 of the thesis (p. 91) beside ours on
// the same residuals, each with the threshold that its own nominal runs give for 5 % false alarms a
// run.
//
// Domains: golf in 2 and 30 dimensions (4.2.3; a spatial scan is told which two features are the
// field), and the service robot's failures in 7 (experiment/cobot_points.hpp; a spatial scan looks
// at x and y). Ours on golf is the online search of 'rim-thesis experiment golf', on the robot that
// of table 3.1, both with the F1 that those report. F1 counts 0 in a run without alarm.
#pragma once

#include <cstdint>
#include <string>

#include "thesis/shard.hpp"

namespace rim {

struct Table61 {
  std::size_t runs = 20; // of each kind
  std::size_t calibration = 59;
  std::uint64_t seed = 20000;
};

Campaign run_table6_1(const Table61 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. plot: file, or empty.
void print_table6_1(const Campaign &campaign, const std::string &plot);

} // namespace rim
