// SPDX-License-Identifier: MIT
// diagnose/single_logs.hpp - effects that only some of the logs have. A fault in one log of several
// does not hold in the others, so that nothing which is judged from log to log can be said of it.
// It is looked for in that log alone, and judged on the parts of it that were not fitted.
#pragma once

#include <vector>

#include "diagnose/diagnose.hpp"
#include "diagnose/search.hpp"

namespace rim::diagnose {

// What is claimed of one channel in one log, and what that is worth in it.
struct InOneLog {
  std::vector<Finding> findings; // their terms name the log; rows as in the whole table
  std::vector<Gain> gains;       // of all channels in this log
};

// Per channel, what holds in single logs alone: where nothing is claimed of all of them that other
// data bears out. `gains`: cross-validated, of what was found in all.
std::vector<std::vector<InOneLog>> find_in_single_logs(const std::vector<Log> &logs,
                                                       const Measured &measured,
                                                       const std::vector<ChannelFindings> &found,
                                                       const std::vector<Gain> &gains,
                                                       const Options &options);

// What was found of a channel in all logs is not claimed where single logs say more; and where
// other data contradicts it and they do not, it has no cause.
void claim_in_single_logs(const std::vector<std::vector<InOneLog>> &single,
                          const Measured &measured, const std::vector<Gain> &gains,
                          std::vector<ChannelFindings> *found);

// Puts them among the findings, and their gains in place of those of all logs.
void add_single_logs(const std::vector<std::vector<InOneLog>> &single, const Measured &measured,
                     Diagnosis *diagnosis);

} // namespace rim::diagnose
