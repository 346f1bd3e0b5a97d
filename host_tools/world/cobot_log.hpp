// SPDX-License-Identifier: MIT
// world/cobot_log.hpp - what a run of the cobot leaves behind, and its files.
#pragma once

#include "world/cobot.hpp"
#include "world/recording.hpp"

#include <string>
#include <vector>

namespace rim::world {

// Context of 7 dimensions: x.time_s x.x_m x.y_m x.phi_rad u.vx_mps u.vy_mps u.omega_radps; 15: and
// x.battery_v, three of the edge, four of the planes seen; more: and dims - 15 rays (thesis 4.2.4).
// Outcomes: z. m. sd. of vx_mps, vy_mps, omega_radps, m by eq. 4.10 from the velocity before and
// the command in force; with `encoders` the counters s.enc1_ticks .. s.enc4_ticks instead.
// Throws UsageError: dims not 7 or 15..515.
Recording record_cobot(Cobot &cobot, const CobotParams &params, std::size_t dims, std::size_t rows,
                       bool encoders);

// [[effect]] tables: kind (required), phase, after_s, duration_s, share, wheel 1..4, corridor 1..
// Throws DataError.
std::vector<CobotEffect> read_cobot_effects(const std::string &path, const CobotMap &map);

// Interference times as CSV: log,start_s,end_s,kind. Reading throws DataError naming file and row:
// columns, a number, an end not after its start.
struct InterferenceLabels {
  std::string log;
  std::vector<CobotInterval> intervals;
};
void write_labels(const std::vector<InterferenceLabels> &labels, const std::string &path);
std::vector<InterferenceLabels> read_labels(const std::string &path);

} // namespace rim::world
