// SPDX-License-Identifier: MIT
// thesis/experiment/keepaway.hpp - keepers that learn where their model of passing is wrong
// (thesis 3.5.3, 3.5.4, p. 41-44): Algorithm 1 after every pass, DMAPS and the corrected model by
// librim.
//
// Expectation e_i of a pass: taker i does not have the ball first. Its context is eq. 3.35, its
// chance by the nominal model eq. 3.34 with t_i for t_t; the least of them is eq. 3.34. Outcome z_i
// is 0 where taker i touched the ball first, or where nobody did and taker i was the one that
// decided eq. 3.34; else 1. A corrected pass is worth the least of its corrected expectations
// (eq. 3.30, within 0 and 1): with no region the planner chooses as the nominal model.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "rim/plan/correct.h"
#include "batch/dmaps.h"
#include "world/keepaway.hpp"

namespace rim {

struct KeepawayLearner {
  // Chosen on seeds below 1000:
  double least_var = 0.05; // of an outcome: a model that is never wrong is not believed
  double quantile = 0.5;   // of nominal runs' largest ln anom: the price lambda of a region
  double lambda_dim = 2.0; // nats a further feature
  double border = 0.1;     // share of a touching region's ln anom
  std::uint32_t least = 4; // observations a region must hold
  unsigned max_dims = 2;
  unsigned regions = 5, nodes = 4, sweeps = 1;
  unsigned samples = 12, elites = 3, iterations = 4;
  // After a completed pass the regions stay as they are, this many times: what a search can find is
  // mostly in the failures.
  std::size_t patience = 10;
  std::size_t explanations = 16; // of the latest searches that count
  double temper = 0.2;           // how far a difference in their worth (eq. 3.12) is believed
  std::size_t nominal_runs = 99; // of play by the nominal model alone, for eq. 3.26

  // One set of regions, each nearly certain, instead of many weighed by what they are worth.
  KeepawayLearner certain() const {
    KeepawayLearner learner = *this;
    learner.quantile = 0.9;
    learner.explanations = 1;
    return learner;
  }
};

// Largest ln anom of runs in which the nominal model holds, after several numbers of passes: eq.
// 3.26. Contexts are those of play in a world without habits, outcomes drawn from the nominal
// model.
class KeepawayNull {
public:
  KeepawayNull(const world::KeepawayParams &params, const KeepawayLearner &learner,
               std::size_t passes, std::uint64_t seed);
  double lambda(std::size_t passes) const;
  // P(R follows theta_i), eq. 3.25 - 3.26.
  double confidence(std::size_t passes, double ln_anom) const;

private:
  void add_run(const world::KeepawayParams &params, const KeepawayLearner &learner,
               const std::vector<world::PassOption> &played, std::uint64_t seed,
               std::uint64_t draw);
  std::size_t row(std::size_t passes) const;

  double quantile_;
  std::vector<std::size_t> after_;
  std::vector<std::vector<double>> largest_; // [after][run], ascending
};

// What counts is not the latest set of regions alone. A planner that takes the best of 200 passes
// ends just outside of a region, where one search more would have drawn its edge elsewhere, or in a
// region that this search missed: it finds where the model errs in its favour. So the sets that the
// latest searches found, each from other random numbers, are kept; all are judged anew by all
// observations, and the prediction is their mean, each in proportion to exp(temper F), F its worth
// (eq. 3.12): likelihood and prior of an explanation, tempered since residuals are not normal.
class KeepawayMonitor {
public:
  // null must outlive it; nullptr: every region found is believed (for the null itself).
  KeepawayMonitor(const world::KeepawayParams &params, const KeepawayLearner &learner,
                  const KeepawayNull *null, std::uint64_t seed);

  void add(const world::PassContext &context, double expected, bool kept); // lines 2, 3 of Alg. 1
  // A pass that has ended; searches where it is time to.
  void observe(const world::PassOption &option, const world::PassResult &result);
  void update(); // lines 4, 5

  // Eq. 3.30 of expectation i, the explanations' mean; region: the number of the region of the best
  // explanation that it lies in, from 1, 0 for none.
  double corrected(const world::PassOption &option, std::size_t taker,
                   std::size_t *region = nullptr) const;
  double value(const world::PassOption &option) const;     // the least of them
  const rim_dmaps_result &found() const { return found_; } // the best explanation
  double shift(std::size_t region) const { return shift_[region]; }

private:
  struct Explanation {
    rim_dmaps_result found{};
    double worth = 0.0;  // F over all observations so far
    double weight = 0.0; // exp(temper F), of the best 1
    std::vector<double> shift;
    std::vector<std::uint64_t> section; // of the model
    rim_correct model{};
  };
  rim_batch_data data() const;
  double lambda() const;
  void search(rim_dmaps_result *found);
  void judge(Explanation *explanation) const;
  void correct(Explanation *explanation) const;

  world::KeepawayParams params_;
  KeepawayLearner learner_;
  const KeepawayNull *null_;
  std::uint64_t seed_;
  std::size_t passes_ = 0, waited_ = 0, searches_ = 0;
  std::vector<double> unit_, residual_, deviation_, variance_;
  std::vector<std::uint64_t> work_;
  std::vector<Explanation> latest_; // a ring, by searches_
  rim_dmaps_result found_{};        // of the best
  std::vector<double> shift_;
};

// The pass that eq. 3.30 (eq. 3.34 where monitor is nullptr) values most; of equals the one that a
// keeper has first. nullptr: there is none.
const world::PassOption *choose_pass(const std::vector<world::PassOption> &options,
                                     const KeepawayMonitor *monitor);

// One run of so many passes.
struct KeepawayRun {
  std::vector<double> success; // a pass each
  // Of observations inside regions that were found before: likelihood by the corrected and by the
  // nominal model (eq. 3.38).
  std::vector<double> corrected, nominal;
};
enum class KeepawayPlay {
  baseline, // the nominal planner, nothing learnt
  shadow,   // the nominal planner, the monitor learns and predicts (p. 43)
  adaptive  // the planner uses the corrected model
};
KeepawayRun run_keepaway(const world::KeepawayParams &params, const KeepawayLearner &learner,
                         const KeepawayNull &null, KeepawayPlay play, std::size_t passes,
                         std::uint64_t seed);

} // namespace rim
