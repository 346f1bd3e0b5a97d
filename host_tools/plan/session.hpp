// SPDX-License-Identifier: MIT
// plan/session.hpp - a conversation with the planner: states answered on stdout, rewards matched to
// the answers that they are for, what cannot be used told on stderr and counted.
#pragma once

#include "plan/plan_line.hpp"
#include "plan/planner.hpp"

#include "rim/lcm.h"

#include <deque>
#include <string>
#include <utility>

namespace rim {

class PlanSession {
public:
  explicit PlanSession(const PlannerConfig &config) : planner_(config) {}

  // One line of stdin; row for the message.
  void take(const std::string &text, unsigned long long row);

  // The state's numbers and, after them, the reward of the answer before (NaN or left out: none).
  void take(const rim_observation_message &message);

  // The totals on stderr. Throws DataError when there was something, but nothing that could be
  // used.
  void finish();

private:
  void answer(const PlanLine &line);
  void reward(const PlanLine &line);
  void refuse(const std::string &where, const std::string &reason);

  Planner planner_;
  std::deque<std::pair<std::string, PlanAnswer>> pending_; // answers whose reward may still come
  unsigned long long used_ = 0, refused_ = 0;
};

} // namespace rim
