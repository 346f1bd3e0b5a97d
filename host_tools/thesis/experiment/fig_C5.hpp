// SPDX-License-Identifier: MIT
// thesis/experiment/fig_C5.hpp - motion interference on the robot (thesis App. C.3, fig. C.5, p.
// 133): precision against recall as p_mi varies; recall without a false positive, and delays.
//
// A world: 29 short runs with an event each (15 collisions, 6 holds, 8 stuck wheels) and 2 control
// runs of three minutes, from one seed. Leave one out: every run is judged by what the others
// taught. False alarms are counted in nominal driving that no model was taught with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "thesis/shard.hpp"
#include "train/interference.hpp"

namespace rim {

struct FigC5 {
  std::size_t worlds = 10;
  double nominal_h = 10.0;    // a world
  std::uint64_t seed = 20000; // of the first world
  InterferenceOptions options;
};

// The runs of a world: events first.
std::vector<InterferenceRun> interference_world(std::uint64_t seed);

Campaign run_fig_C5(const FigC5 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_fig_C5(const Campaign &campaign, const std::string &plot);

} // namespace rim
