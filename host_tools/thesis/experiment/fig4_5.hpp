// SPDX-License-Identifier: MIT
// thesis/experiment/fig4_5.hpp - figure 4.5 of the thesis (p. 57): F1 of the points in the golf
// domain against the work of the search, for FS-RIM with three heuristics, breadth first, and no
// selection of features. Work is counted in evaluations (experiment/search_curve.hpp), seconds are
// beside.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "thesis/shard.hpp"

namespace rim {

struct Fig45 {
  std::vector<std::size_t> dims{2, 10, 30, 100};
  std::size_t runs = 20;
  std::uint64_t seed = 20000;
};

Campaign run_fig4_5(const Fig45 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. plot: file, or empty.
void print_fig4_5(const Campaign &campaign, const std::string &plot);

} // namespace rim
