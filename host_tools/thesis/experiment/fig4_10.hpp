// SPDX-License-Identifier: MIT
// thesis/experiment/fig4_10.hpp - figures 4.10 and 4.11 of the thesis (p. 61): corridor and
// left-turn failure of the service robot in contexts of 7, 15, 30 and 100 dimensions (4.2.4). F1 of
// the points at the end of a drive of three minutes: ours (experiment/cobot_watch.hpp), and the
// thesis's searches over its three velocities against their work (experiment/search_curve.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "thesis/experiment/cobot_points.hpp"
#include "thesis/shard.hpp"

namespace rim {

struct Fig410 {
  CobotCase failure = CobotCase::corridor; // or left_turn: figure 4.11
  std::vector<std::size_t> dims{7, 15, 30, 100};
  std::size_t runs = 20;
  bool searches = true; // the thesis's too
  std::uint64_t seed = 20000;
};

Campaign run_fig4_10(const Fig410 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. plot: file, or empty.
void print_fig4_10(const Campaign &campaign, const std::string &plot);

} // namespace rim
