// SPDX-License-Identifier: MIT
// plan/planner.hpp - a bandit (rim/bandit.h) with memory of its own, over states and a grid of
// actions, a set of plans, or actions that come with every state.
#pragma once

#include "rim/plan/bandit.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace rim {

// One dimension of states or actions. count: steps of a grid of actions, ends included; 0: none.
struct PlanAxis {
  double low = 0.0, high = 1.0;
  std::uint32_t count = 0;
};

struct PlannerConfig {
  std::vector<PlanAxis> state;
  std::vector<PlanAxis> action; // empty: actions come with every state, or plans of a bank
  std::size_t features = 0;     // of such actions; otherwise states + actions
  rim_bandit_config bandit{};   // gp.dims, extent.dims and the extent's box are filled in; lengths
                                // of 0 become a fifth of their axis
};

struct PlanRequest {
  std::vector<double> state;
  std::vector<std::vector<double>> features; // of the actions proposed; empty: the grid or bank
  std::vector<double> nominal, var;          // one an action; empty: none
  std::vector<std::uint8_t> allowed;         // one an action; empty: all
};

struct PlanAnswer {
  rim_bandit_choice choice{};
  std::vector<double> action;   // coordinates on the grid; empty without one
  std::vector<double> features; // what to give to observe()
  double nominal = 0.0, var = 0.0;
};

class Planner {
public:
  // Throws UsageError for a configuration that librim refuses.
  explicit Planner(const PlannerConfig &config);

  // Nothing where no action is allowed. Throws DataError for a request that does not fit.
  std::optional<PlanAnswer> choose(const PlanRequest &request);

  // Throws DataError for numbers that are refused.
  void observe(const PlanAnswer &answer, double reward);
  void observe(const std::vector<double> &features, std::uint32_t plan, double nominal, double var,
               double reward);

  rim_bandit *bandit() { return bandit_; }
  std::size_t features() const { return features_; }
  std::size_t states() const { return config_.state.size(); }
  bool is_bank() const { return config_.bandit.policy == RIM_BANDIT_BANK; }

private:
  std::vector<double> action_at(std::size_t index) const;
  std::vector<double> features_of(const PlanRequest &request, std::size_t &count) const;

  PlannerConfig config_;
  std::size_t features_ = 0, grid_ = 0;
  std::vector<std::uint64_t> memory_; // aligned to 8
  rim_bandit *bandit_ = nullptr;
};

} // namespace rim
