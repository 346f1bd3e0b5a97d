// SPDX-License-Identifier: MIT
// diagnose/response.hpp - the simulation's prediction as a function of command and state, learnt
// from the logs: what it would have predicted had the command acted late.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/measured.hpp"
#include "diagnose/term.hpp"

namespace rim::diagnose {

struct Response {
  bool is_tried = false, is_known = false;
  std::map<std::string, double> products; // those with a command: Term::response
  std::vector<Ridge> ridges;
};

// Features, squares of commands and products of a command with a feature; where that says too
// little (limits), curves over weighted sums of features on top, one after the other. Not known
// where both together say less than .98 of the prediction's variance.
Response fit_response(const Measured &measured, const Channel &channel);

} // namespace rim::diagnose
