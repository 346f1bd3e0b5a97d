// SPDX-License-Identifier: MIT
#include "plan/planner.hpp"

#include "util/error.hpp"

#include <fmt/format.h>

namespace rim {

namespace {

constexpr std::size_t kMostActions = 100000;

// Lengths not given, and the box of regions, from the axes.
void fill_from_axes(rim_bandit_config &bandit, const std::vector<PlanAxis> &axes) {
  for (std::size_t d = 0; d < axes.size(); ++d) {
    const double range = axes[d].high - axes[d].low;
    if (!(range > 0.0))
      throw UsageError(
          fmt::format("axis {}: {} is not below {}", d + 1, axes[d].low, axes[d].high));
    if (d < RIM_GP_MAX_DIMS && !(bandit.gp.length[d] > 0.0))
      bandit.gp.length[d] = range / 5.0;
    if (d < RIM_EXTENT_MAX_DIMS) {
      bandit.extent.lower[d] = axes[d].low;
      bandit.extent.upper[d] = axes[d].high;
    }
  }
}

void expect_count(const char *what, std::size_t given, std::size_t wanted) {
  if (given != 0 && given != wanted)
    throw DataError(fmt::format("{}: {} numbers for {} actions", what, given, wanted));
}

} // namespace

Planner::Planner(const PlannerConfig &config) : config_(config) {
  rim_bandit_config &b = config_.bandit;
  std::vector<PlanAxis> axes = config_.state;
  if (!is_bank())
    axes.insert(axes.end(), config_.action.begin(), config_.action.end());
  features_ = config_.features > 0 ? config_.features : axes.size();
  if (features_ < 1 || features_ > RIM_GP_MAX_DIMS)
    throw UsageError(fmt::format("{} features: 1 to {} are possible", features_, RIM_GP_MAX_DIMS));
  const bool rims = b.policy == RIM_BANDIT_RIM_UCB || b.policy == RIM_BANDIT_RIM_GP_UCB;
  if (rims && features_ > RIM_EXTENT_MAX_DIMS)
    throw UsageError(fmt::format("{} features: policies with RIMs take at most {}", features_,
                                 RIM_EXTENT_MAX_DIMS));
  if (config_.features == 0)
    fill_from_axes(b, axes);
  b.gp.dims = b.extent.dims = static_cast<std::uint8_t>(features_);
  grid_ = config_.action.empty() || is_bank() ? 0 : 1;
  for (const PlanAxis &axis : config_.action) {
    if (axis.count < 2)
      throw UsageError("an axis of actions needs at least 2 steps");
    grid_ *= axis.count;
    if (grid_ > kMostActions)
      throw UsageError(fmt::format("more than {} actions", kMostActions));
  }
  std::size_t bytes = 0;
  rim_status status = rim_bandit_size(&b, &bytes);
  if (status == RIM_OK) {
    memory_.resize((bytes + 7) / 8);
    status = rim_bandit_init(&bandit_, memory_.data(), memory_.size() * 8, &b);
  }
  if (status != RIM_OK)
    throw UsageError(fmt::format("settings of the planner: {}", rim_status_text(status)));
}

// The first axis turns slowest.
std::vector<double> Planner::action_at(std::size_t index) const {
  std::vector<double> out(config_.action.size());
  for (std::size_t d = out.size(); d-- > 0;) {
    const PlanAxis &axis = config_.action[d];
    const std::size_t step = index % axis.count;
    index /= axis.count;
    out[d] = axis.low + (axis.high - axis.low) * static_cast<double>(step) /
                            static_cast<double>(axis.count - 1);
  }
  return out;
}

std::vector<double> Planner::features_of(const PlanRequest &request, std::size_t &count) const {
  std::vector<double> x;
  if (!request.features.empty()) {
    if (is_bank())
      throw DataError("actions: a bank's plans have no features");
    count = request.features.size();
    for (const std::vector<double> &one : request.features) {
      if (one.size() != features_)
        throw DataError(fmt::format("actions: {} features instead of {}", one.size(), features_));
      x.insert(x.end(), one.begin(), one.end());
    }
    return x;
  }
  if (request.state.size() != states() || states() == 0)
    throw DataError(fmt::format("state: {} numbers instead of {}", request.state.size(), states()));
  if (is_bank()) {
    count = config_.bandit.plans;
    return request.state;
  }
  if (grid_ == 0)
    throw DataError("actions: neither in the line nor as --action");
  count = grid_;
  for (std::size_t i = 0; i < grid_; ++i) {
    const std::vector<double> action = action_at(i);
    x.insert(x.end(), request.state.begin(), request.state.end());
    x.insert(x.end(), action.begin(), action.end());
  }
  return x;
}

std::optional<PlanAnswer> Planner::choose(const PlanRequest &request) {
  std::size_t count = 0;
  const std::vector<double> x = features_of(request, count);
  expect_count("nominal", request.nominal.size(), count);
  expect_count("var", request.var.size(), count);
  expect_count("allowed", request.allowed.size(), count);
  rim_bandit_actions actions{};
  actions.count = static_cast<std::uint32_t>(count);
  actions.x = x.data();
  actions.nominal = request.nominal.empty() ? nullptr : request.nominal.data();
  actions.var = request.var.empty() ? nullptr : request.var.data();
  actions.allowed = request.allowed.empty() ? nullptr : request.allowed.data();
  PlanAnswer answer;
  const rim_status status = rim_bandit_choose(bandit_, &actions, &answer.choice);
  if (status == RIM_E_DATA)
    return std::nullopt;
  if (status != RIM_OK)
    throw DataError(rim_status_text(status));
  const std::size_t chosen = answer.choice.action;
  const std::size_t first = is_bank() ? 0 : chosen * features_;
  answer.features.assign(x.begin() + static_cast<std::ptrdiff_t>(first),
                         x.begin() + static_cast<std::ptrdiff_t>(first + features_));
  if (request.features.empty() && grid_ > 0)
    answer.action = action_at(chosen);
  answer.nominal = request.nominal.empty() ? 0.0 : request.nominal[chosen];
  answer.var = request.var.empty() ? 0.0 : request.var[chosen];
  return answer;
}

void Planner::observe(const std::vector<double> &features, std::uint32_t plan, double nominal,
                      double var, double reward) {
  if (features.size() != features_)
    throw DataError(fmt::format("x: {} features instead of {}", features.size(), features_));
  const rim_status status =
      rim_bandit_observe(bandit_, features.data(), plan, nominal, var, reward);
  if (status != RIM_OK)
    throw DataError(fmt::format("reward: {}", rim_status_text(status)));
}

void Planner::observe(const PlanAnswer &answer, double reward) {
  observe(answer.features, answer.choice.action, answer.nominal, answer.var, reward);
}

} // namespace rim
