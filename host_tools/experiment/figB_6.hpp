// experiment/figB_6.hpp - regret of learning free-kick plans online (thesis app. B, fig. B.6,
// p. 124): a bank of Gaussian processes, one a plan, by upper confidence bounds (Algorithm 9).
//
// Regret is eq. B.2, from the true chance of a goal. The prior expectation r_0 is the same constant
// for every plan; or what a plan would bring, on average, against the two defences that are not the
// opponent's. The three defences are alike enough here for that to be most of what there is to
// know: the regret of the first kick, printed beside, is then the prior's merit and not learning's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "util/shard.hpp"
#include "world/freekick.hpp"

namespace rim {

struct FigB6 {
  std::size_t runs = 100;
  std::size_t kicks = 40;
  std::uint64_t seed = 20000; // of the first run
  bool others_prior = false;  // expect what the other two defences would allow
  // Chosen on seeds below 10000:
  double beta = 0.1;
  double signal = 0.2;   // prior sd of a plan's chance about its expectation
  double length_m = 1.5; // over which a plan's chance changes
};

struct FreekickRun {
  std::vector<double> chosen, best, random; // true chances: of the plan taken, the best, the mean
};
FreekickRun run_freekick(const FreekickParams &params, Defence defence, const FigB6 &experiment,
                         std::uint64_t seed);

Campaign run_figB_6(const FigB6 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_figB_6(const Campaign &campaign, const std::string &plot);

} // namespace rim
