// experiment/fig5_10.hpp - reward of three policies against three goalies (thesis 5.3, fig. 5.10,
// p. 82): GP-UCB, RIM-UCB and RIM+GP-UCB.
//
// Run i of every policy and goalie sees the same states and heading errors, so differences between
// policies are paired. Attainable gain: expected reward of the best action of the grid less that of
// the action the nominal model prefers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "util/shard.hpp"
#include "world/goalie.hpp"

namespace rim {

// What a policy is told; chosen on runs of seeds below 1000.
struct GoaliePolicy {
  double beta;
  double signal_m; // prior sd of the deviation from the nominal reward
  double length_s_m, length_a_m;
  double threshold; // ln anom at which a RIM is as likely as not
  double lambda;    // nats a unit of volume, both ways (eq. 5.4)
  unsigned rims, slices;
  unsigned lambdas;      // 1: lambda alone, otherwise that many from -lambda to lambda
  double smooth_m = 0.0; // sd of deviations that are left to the GP
};

enum class GoaliePolicyKind { gp, rim, rim_gp };
constexpr std::size_t kGoaliePolicies = 3;
GoaliePolicy default_goalie_policy(GoaliePolicyKind kind);

struct Fig510 {
  std::size_t runs = 40;
  std::size_t shots = 100;
  std::uint64_t seed = 20000; // of the first run
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
