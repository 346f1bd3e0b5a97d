// SPDX-License-Identifier: MIT
// thesis/experiment/figB_6.hpp - regret of learning free-kick plans online (thesis app. B, fig.
// B.6, p. 124), by upper confidence bounds.
//
// Regret is eq. B.2, from the true chance of a goal; 'after 20 kicks' is the mean over the kicks
// from the 21st on of its mean over the runs: the curve of fig. B.6, not a cumulative mean. Every
// way of choosing sees the same kicks:
//   shared   one Gaussian process for all plans, flat prior mean: its inputs are which plan it is
//   and
//            what the team's own model expects of that plan at this place (Freekick::own_estimate:
//            it knows what every defence has, but not whom this one marks). That this expectation
//            says anything about goals, and how much, is learnt from the kicks; a plan may still
//            differ from the others by what is learnt of it alone
//   bank     Algorithm 9: a process a plan over the place of the ball, flat prior mean
//   own      the same, the own model's expectation as prior mean r_0^a(s) (B.3)
//   unlearnt the plan of which the own model expects most, nothing learnt
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "thesis/shard.hpp"
#include "world/freekick.hpp"

namespace rim {

enum class FreekickLearner { shared, bank, own, unlearnt };
constexpr std::size_t kFreekickLearners = 4;

struct FigB6 {
  std::size_t runs = 100;
  std::size_t kicks = 40;
  std::uint64_t seed = 50000; // of the first run
  // Chosen on seeds 100-249. beta and signal (prior sd of a plan's chance about its expectation)
  // of shared, bank, own:
  std::array<double, 3> beta{0.09, 0.1, 0.1};
  std::array<double, 3> signal{0.32, 0.2, 0.1};
  double length_own = 0.8;   // shared: over which the chance changes with the own expectation
  double length_plan = 4.4;  // shared: 1 for the plan, 0 elsewhere: two plans correlate by .95
  double length_place = 1.5; // bank, own: over which a plan's chance changes, m
};

struct FreekickRun {
  // True chances: the best plan's, the mean over plans, the one taken by each learner.
  std::vector<double> best, random;
  std::array<std::vector<double>, kFreekickLearners> chosen;
};
FreekickRun run_freekick(const FreekickParams &params, Defence defence, const FigB6 &experiment,
                         std::uint64_t seed);

Campaign run_figB_6(const FigB6 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_figB_6(const Campaign &campaign, const std::string &plot);

} // namespace rim
