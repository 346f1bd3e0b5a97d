// SPDX-License-Identifier: MIT
// diagnose/rollout.hpp - a simulation and its extension rolled out over a horizon: each step's own
// prediction is the next step's state, where the simulation carries it; what comes from outside is
// as measured.
#pragma once

#include <string>
#include <vector>

#include "diagnose/gain.hpp"
#include "predict/predictor.hpp"

namespace rim::diagnose {

// Every row of `log` (as the predictor made it) from which the steps to the horizon follow without
// a gap is rolled out, all rows side by side; judged: measured outcome at the horizon beside what
// is predicted without and with the terms. Units are twentieths of the log; inside: some term acts
// on the row of the start. False where the simulation cannot be rolled out. O(steps x (rows x
// terms + the predictor's advance())).
bool append_rolled(const std::vector<Term> &terms, const Log &log, const std::string &channel,
                   double horizon_s, const world::Predictor &predictor, Judged *judged);

} // namespace rim::diagnose
