// SPDX-License-Identifier: MIT
// Measured drives of small robots without any interference, as control runs of the detector of
// motion interference (thesis App. C): each run is judged by what the others teach, or with
// `halves` robots of odd number by those of even number and the other way round. The command is
// what the diagnosed unicycle expects of it (delay and products included), the speed what was
// measured over the same 0.2 s. So that silence means something, the same runs with holds put in
// are judged too: there the measured speed is multiplied by a share for some seconds.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "thesis/experiment/measured_common.hpp"
#include "train/interference.hpp"

namespace rim::experiment {

struct HeldRuns {
  double every_s = 45.0, duration_s = 4.0; // one hold in every part of so many seconds
  double least_mps = 0.03;                 // expected all through it
  double most_share = 0.4;                 // drawn from 0 to this
};

struct ControlRun {
  std::string name, causes;
  double driven_s = 0.0; // rows at most a gap apart
  std::size_t rows = 0, gaps = 0;
  std::size_t false_alarms = 0, false_alarms_plain = 0; // plain: the commands as they were
  std::size_t holds = 0, found = 0;
  std::vector<double> delays_s; // of the holds that were found
};

// The run with holds put in, in its intervals.
InterferenceRun with_holds(InterferenceRun run, const HeldRuns &holds, std::uint64_t seed);

// DataError where a run would have no others to learn from.
std::vector<ControlRun> run_control_mrclam(const MeasuredOptions &options, const HeldRuns &holds,
                                           bool halves);
void print_control_mrclam(const std::vector<ControlRun> &runs, std::FILE *to);

} // namespace rim::experiment
