// SPDX-License-Identifier: MIT
// thesis/experiment/golf.hpp - the golf experiment of thesis 4.2.3 (p. 55) with the online region
// search.
//
// For each number of dimensions three sets of runs, none in common:
//   calibration  without effect: the threshold is the ceil((n + 1) 0.95)-th smallest of the runs'
//                largest scores (conformal: at most 5 % of such runs raise any alarm)
//   nominal      without effect: how many do raise one
//   bump         with the effect, until 30 shots were taken from behind the bump: F1 of the points
//                (eq. 4.7), and anomalous shots until the alarm
// A run without effect has the same places and the same length as a run with a bump, but no shift.
// score = best ln anom less its null maximum, over the growth max(kLeastGrowth, ln n).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "stats/bootstrap.hpp"
#include "thesis/shard.hpp"

namespace rim {

// How much the search does a step; the engine is the same. flight: what an image of the flight
// profile does (rim replay --flight); rich: what one of the ground's does on logs as short as
// these; standard: the library's default.
enum class GolfSearch { flight, standard, rich };

struct GolfExperiment {
  std::vector<std::size_t> dims{2, 10, 30, 100};
  std::size_t runs = 100;
  std::size_t nominal = 400;
  std::size_t calibration = 800;
  std::uint64_t seed = 20000; // of the first run; below 10000 the search was tuned
  GolfSearch search = GolfSearch::rich;
};

// One run of the world watched by the search.
struct GolfRun {
  double f1 = 0.0;      // eq. 4.7, by membership
  double f1_best = 0.0; // by the single best region
  bool right_features = false;
  std::size_t shots = 0;
  double largest_score = 0.0;
  std::vector<double> score_by_anomalous; // [k]: largest score before the (k + 1)-th anomalous shot
  double seconds = 0.0;                   // in the search
};
GolfRun run_golf(std::size_t dims, std::uint64_t seed, bool effect, GolfSearch search);

struct GolfSummary {
  std::size_t dims = 0;
  Bootstrapped f1, f1_best, shots_to_alarm; // intervals by bootstrap over runs
  double right_features = 0.0;
  double false_alarms = 0.0; // share of nominal runs with any alarm
  double threshold = 0.0;
  std::size_t missed = 0; // bump runs without alarm
};

// The units of this shard, on all threads.
Campaign run_golf_campaign(const GolfExperiment &experiment, const Shard &shard);
// Throws DataError when the campaign is of another kind or incomplete.
std::vector<GolfSummary> summarise_golf(const Campaign &campaign);
void print_golf(const Campaign &campaign);

GolfSearch parse_golf_search(const std::string &name); // throws UsageError
std::size_t golf_search_bytes(std::size_t dims, GolfSearch search);

} // namespace rim
