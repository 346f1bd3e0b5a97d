// SPDX-License-Identifier: MIT
// thesis/experiment/table3_1.hpp - table 3.1 of the thesis (p. 40): four failures of the service
// robot, data points until the alarm, precision and recall at the end.
//
// What a data point is, the nominal model and the channels: experiment/cobot_points.hpp. Drives of
// three minutes (4.2.4). Sets of drives, none in common, in the order of their seeds:
//   scatter      nominal: what is normal (24)
//   calibration  nominal: the threshold, the ceil((n + 1) 0.95)-th smallest of their largest scores
//   nominal      how many of them raise an alarm
//   failures     each with the same seeds for the four failures
// Beside it, on the same drives, the thesis's own procedure: FARO over pose and commands (6-D), eq.
// 3.7 over three velocities, alarm at twice the largest ln anom of 20 nominal minutes.
#pragma once

#include <cstdint>
#include <string>

#include "thesis/shard.hpp"

namespace rim {

struct Table31 {
  std::size_t runs = 20; // of each failure
  std::size_t nominal = 60;
  std::size_t calibration = 99;
  bool thesis = true; // its own procedure too
  std::uint64_t seed = 20000;
};

Campaign run_table3_1(const Table31 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. plot: file, or empty.
void print_table3_1(const Campaign &campaign, const std::string &plot);

} // namespace rim
