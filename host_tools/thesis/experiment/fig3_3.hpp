// SPDX-License-Identifier: MIT
// thesis/experiment/fig3_3.hpp - one RIM found by FARO in the binary golf world (thesis 3.5.1,
// fig. 3.3, p. 37-38): precision and recall against the number of abnormal shots (p = .8, q = .2),
// and how many abnormal shots it takes until ln anom reaches 41.6 as q nears p.
//
// A shot's outcome is 0 or 1, its nominal mean p and variance p (1 - p): eq. 3.7. Precision and
// recall are eq. 3.31, 3.32, over the shots so far.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "thesis/shard.hpp"

namespace rim {

struct Fig33 {
  std::size_t runs = 30;      // a value of q
  std::size_t nominal = 30;   // runs without a bump, for the highest ln anom there
  std::size_t shots = 1000;   // of such a run
  std::uint64_t seed = 20000; // of the first run
  std::vector<double> q = {0.2, 0.3, 0.4, 0.5};
};

// The best ellipse each time a shot came from behind the bump.
struct FaroTrace {
  std::vector<double> ln_anom, precision, recall;
  double highest = 0.0; // ln anom of the whole run
};
// Ends after `abnormal` shots from behind the bump if ln anom is at least `enough` by then, else
// when it is, and at the latest after four thousand shots. Without a bump: after `shots`.
FaroTrace run_faro_golf(double q, std::size_t abnormal, double enough, std::uint64_t seed);
FaroTrace run_faro_nominal(std::size_t shots, std::uint64_t seed);

Campaign run_fig3_3(const Fig33 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_fig3_3(const Campaign &campaign, const std::string &plot);

} // namespace rim
