// SPDX-License-Identifier: MIT
// thesis/experiment/fig5_10.hpp - reward of three policies against three goalies (thesis 5.3,
// fig. 5.10, p. 82): GP-UCB, RIM-UCB and RIM+GP-UCB.
//
// Run i of every policy and goalie sees the same states and heading errors, so differences between
// policies are paired. Attainable gain: expected reward of the best action of the grid less that of
// the action the nominal model prefers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rim/plan/extent.h"
#include "rim/plan/gp.h"
#include "thesis/shard.hpp"
#include "world/goalie.hpp"

namespace rim {

// What a policy is told; chosen on runs of seeds below 1000. Its prior mean is the nominal model's.
struct GoaliePolicy {
  double beta = 1.0, power = 1.0; // beta / t^power at shot t
  double signal_m = 0.2;          // prior sd of the deviation from the nominal reward
  double noise_m = 0.001;         // least sd of a reward that is tried again
  double length_s_m = 1.0, length_a_m = 0.2;
  std::uint8_t kernel = RIM_GP_MATERN_5_2;
  // Policies with RIMs: rim/bandit.h and rim/extent.h say what they are.
  std::uint8_t set = RIM_EXTENT_SAMPLED, shape = RIM_EXTENT_BOX;
  double threshold = 7.0;
  double lambda_min = -16.0, lambda_max = 16.0; // nats a unit of volume (eq. 5.4)
  double temper = 0.2;                          // of a sampled set
  double least_s_m = 0.16, most_a_m = 0.6;      // bounds of half a region's extent in s, in a
  double smooth_m = 0.0, unseen_m = 0.0, gain = 0.0, min_points = 3.0;
  unsigned rims = 1, slices = 9, lambdas = 9;
};

enum class GoaliePolicyKind { gp, rim, rim_gp };
constexpr std::size_t kGoaliePolicies = 3;
GoaliePolicy default_goalie_policy(GoaliePolicyKind kind);

struct Fig510 {
  std::size_t runs = 200; // a policy that hovers about 80 % gets there early or never by chance
  std::size_t shots = 100;
  std::uint64_t seed = 62000; // of the first run
  std::array<GoaliePolicy, kGoaliePolicies> policies{
      default_goalie_policy(GoaliePolicyKind::gp), default_goalie_policy(GoaliePolicyKind::rim),
      default_goalie_policy(GoaliePolicyKind::rim_gp)};
};

struct GoalieRun {
  std::vector<double> reward;   // observed
  std::vector<double> expected; // of the action taken
  std::vector<double> nominal;  // of the action the nominal model prefers
  std::vector<double> best;     // of the best action
};
GoalieRun run_goalie(const Goalie &world, const GoaliePolicy &policy, GoaliePolicyKind kind,
                     std::size_t shots, std::uint64_t seed);

Campaign run_fig5_10(const Fig510 &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete. A picture, made by gnuplot,
// where plot is not empty (.svg or .png).
void print_fig5_10(const Campaign &campaign, const std::string &plot);

} // namespace rim
