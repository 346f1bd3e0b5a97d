// experiment/figB_6.hpp - regret of learning free-kick plans online (thesis app. B, fig. B.6,
// p. 124): a bank of Gaussian processes, one a plan, by upper confidence bounds (Algorithm 9).
//
// Regret is eq. B.2, from the true chance of a goal. The prior expectation r_0^a(s) (B.3) is
//   flat    the same constant for every plan
//   own     the team's own model of its plan, which knows what all defences have in common but not
//           whom they mark (Freekick::own_estimate)
//   others  what the plan brings, on average, against the two defences that are not the opponent's
// With own and others most of the merit is the prior's: the regret of following the prior without
// learning, over the same kicks, is printed beside.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "util/shard.hpp"
#include "world/freekick.hpp"

namespace rim {

enum class FreekickPrior { flat, own, others };

struct FigB6 {
  std::size_t runs = 100;
  std::size_t kicks = 40;
  std::uint64_t seed = 20000; // of the first run
  FreekickPrior prior = FreekickPrior::own;
  // Chosen on seeds below 1000:
  double beta = 0.1;
  double signal = 0.1;   // prior sd of a plan's chance about its expectation
  double length_m = 1.5; // over which a plan's chance changes
};

struct FreekickRun {
  // True chances: of the plan taken, the best, the mean, the one that the prior prefers.
  std::vector<double> chosen, best, random, unlearnt;
};
FreekickRun run_freekick(const FreekickParams &params, Defence defence, const FigB6 &experiment,
                         std::uint64_t seed);

Campaign run_figB_6(const FigB6 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_figB_6(const Campaign &campaign, const std::string &plot);

} // namespace rim
