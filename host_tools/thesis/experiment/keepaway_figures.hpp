// SPDX-License-Identifier: MIT
// thesis/experiment/keepaway_figures.hpp - Interception-Keepaway with model correction
// (thesis 3.5.4, p. 42-45).
//
// Fig. 3.4: pass completion TP (eq. 3.36) and failure reduction rate FRR (eq. 3.37) over the passes
// of a run, as moving averages of 50. theta_0 of eq. 3.37 is the nominal planner in runs of the
// same seeds, over all its passes. Fig. 3.5: prediction accuracy MPA (eq. 3.38) of observations
// inside regions found before, in runs in which the planner ignores the corrections (p. 43).
#pragma once

#include <cstdint>
#include <string>

#include "thesis/experiment/keepaway.hpp"
#include "thesis/shard.hpp"

namespace rim {

struct KeepawayFigure {
  std::size_t runs = 40;
  std::size_t passes = 300;
  std::uint64_t seed = 20000; // of the first run; nominal runs for eq. 3.26 follow the last
  KeepawayLearner learner;
};

Campaign run_fig3_4(const KeepawayFigure &experiment, const Shard &shard);
Campaign run_fig3_5(const KeepawayFigure &experiment, const Shard &shard);
// Throw DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_fig3_4(const Campaign &campaign, const std::string &plot);
void print_fig3_5(const Campaign &campaign, const std::string &plot);

} // namespace rim
