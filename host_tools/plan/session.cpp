// SPDX-License-Identifier: MIT
#include "plan/session.hpp"

#include "util/error.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

namespace rim {

namespace {

constexpr std::size_t kMostPending = 1024;

} // namespace

void PlanSession::refuse(const std::string &where, const std::string &reason) {
  std::fprintf(stderr, "rim: %s: %s\n", where.c_str(), reason.c_str());
  ++refused_;
}

void PlanSession::take(const std::string &text, unsigned long long row) {
  try {
    const PlanLine line = read_plan_line(text);
    if (line.kind == PlanLine::STATE)
      answer(line);
    else if (line.kind == PlanLine::REWARD)
      reward(line);
    else
      planner_.observe(line.x, line.plan, line.nominal, line.var, line.reward);
    ++used_;
  } catch (const DataError &e) {
    refuse(fmt::format("stdin:row {}", row), e.what());
  }
}

void PlanSession::take(const rim_observation_message &message) {
  const std::string where = fmt::format("RIM_OBSERVATION {}", message.sequence);
  try {
    const std::size_t states = planner_.states();
    if (message.count != states && message.count != states + 1)
      throw DataError(
          fmt::format("{} numbers instead of {} or {}", message.count, states, states + 1));
    PlanLine line;
    line.reward = message.count > states ? message.value[states] : std::nan("");
    try {
      if (!std::isnan(line.reward))
        reward(line);
    } catch (const DataError &e) { // the state is answered all the same
      refuse(where, e.what());
    }
    line.id = std::to_string(message.sequence);
    line.request.state.assign(message.value, message.value + states);
    answer(line);
    ++used_;
  } catch (const DataError &e) {
    refuse(where, e.what());
  }
}

void PlanSession::answer(const PlanLine &line) {
  const std::optional<PlanAnswer> chosen = planner_.choose(line.request);
  std::puts(plan_answer_json(line, chosen ? &*chosen : nullptr).c_str());
  if (std::fflush(stdout) != 0)
    throw std::runtime_error("standard output: write failed");
  if (!chosen)
    return;
  pending_.push_back({line.id, *chosen});
  if (pending_.size() > kMostPending)
    pending_.pop_front();
}

void PlanSession::reward(const PlanLine &line) {
  for (std::size_t i = pending_.size(); i-- > 0;) {
    if (!line.id.empty() && pending_[i].first != line.id)
      continue;
    const PlanAnswer chosen = pending_[i].second;
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
    planner_.observe(chosen, line.reward);
    return;
  }
  throw DataError("reward: no answer waits for it");
}

void PlanSession::finish() {
  const rim_bandit_counters n = rim_bandit_get_counters(planner_.bandit());
  std::fprintf(stderr,
               "plan: %u answers, %u rewards, %u states without an allowed action, %llu lines "
               "refused\n",
               n.choices, n.observations, n.none_allowed, refused_);
  if (used_ == 0 && refused_ > 0)
    throw DataError("no line could be used");
}

} // namespace rim
