// SPDX-License-Identifier: MIT
// plan/plan_line.hpp - one line to 'rim plan': a state, the reward of an action, or an experience
// from before; as JSON or as CSV.
//
//   {"id": 7, "state": [0.4], "nominal": [...], "allowed": [...], "actions": [[...], ...]}
//   {"id": 7, "reward": 0.3}
//   {"x": [0.4, 0.1], "reward": 0.3, "nominal": 0.1, "var": 0.01, "plan": 0}
//   state,0.4
//   reward,0.3
#pragma once

#include "plan/planner.hpp"

#include <string>

namespace rim {

struct PlanLine {
  enum Kind { STATE, REWARD, EXPERIENCE } kind = STATE;
  std::string id; // as JSON text; empty: none
  PlanRequest request;
  double reward = 0.0;
  std::vector<double> x; // EXPERIENCE
  double nominal = 0.0, var = 0.0;
  std::uint32_t plan = 0;
};

// Throws DataError with the reason.
PlanLine read_plan_line(const std::string &line);

// One JSON object without a line end; `answer` nullptr: no action is allowed.
std::string plan_answer_json(const PlanLine &line, const PlanAnswer *answer);

} // namespace rim
