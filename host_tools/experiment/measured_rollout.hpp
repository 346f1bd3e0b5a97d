// A simulation and its extension rolled out over a horizon: each step's own prediction is the next
// step's state, where the simulation carries it; what comes from outside is as measured.
#ifndef RIM_EXPERIMENT_MEASURED_ROLLOUT_HPP
#define RIM_EXPERIMENT_MEASURED_ROLLOUT_HPP

#include <vector>

#include "diagnose/gain.hpp"

namespace rim::experiment {

// Every row of `log` (as the predictor made it) from which the steps to the horizon follow without
// a gap is rolled out, all rows side by side; judged: measured outcome at the horizon beside what
// is predicted without and with the terms. Units are twentieths of the log, `inside` is 0. False
// where the simulation cannot be rolled out. O(steps x (rows x terms + the predictor's advance())).
bool append_rolled(const std::vector<diagnose::Term> &terms, const Log &log,
                   const std::string &channel, double horizon_s, const world::Predictor &predictor,
                   diagnose::Judged *judged);

} // namespace rim::experiment
#endif
