// SPDX-License-Identifier: MIT
// train/interference.hpp - learns the motion-interference model of rim/interference.h from logs
// (thesis App. C).
//
// Transitions and emissions are counted from labelled rows (eq. C.1-C.5). Where only the times of
// interference are known the rows are labelled by the rules of C.3.1. p_mi is the one of a grid
// with the highest recall without a false positive on the runs given. Latency and acceleration
// limits are the best of a grid on nominal rows; each detector's threshold is such that nominal
// rows would cross it once in quiet_h, extrapolated from the exponential tail of its
// excursions.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "log/log.hpp"
#include "rim/interference.h"
#include "world/cobot_log.hpp"

namespace rim {

struct InterferenceRun {
  std::string name;
  std::vector<double> t_s, command_mps, speed_mps;
  std::vector<world::CobotInterval> intervals; // of interference
};

struct InterferenceOptions {
  double noise_mps = 0.028; // sd at constant speed, C.3.1; separates the states
  double settle_s = 0.3;
  double slack_one_step = 0.6, slack_open_loop = 1.0;
  double quiet_h = 3000.0; // nominal driving until a detector crosses its threshold once
  // Errors of latency and limits last through a ramp: they add up as noise does not.
  double ramp_caution = 2.0; // factor on sd_ramp
  double margin = 1.8;       // and at least so much above what the runs reach
  // The largest excursions are taken as exponential: those above this quantile. Correlated
  // disturbances make the far tail heavier than what smaller ones suggest.
  double tail = 0.95;
  // Some minutes show few excursions: the tail's scale is taken at its upper confidence limit.
  double tail_z = 1.645; // one-sided 95 %; 0: as estimated
};

// rim_motion of every row by C.3.1; MI where interference acted.
std::vector<int> label_motion(const InterferenceRun &run, double noise_mps);

struct InterferenceTraining {
  rim_interference_model model;
  double p_mi = 0.0;
  std::size_t rows = 0;
  std::array<std::size_t, RIM_INTERFERENCE_STATES> state_rows{};
  std::vector<std::string> unseen; // states that no run shows: emissions of all rows, smoothed
};

// What a run contributes, so that leaving one out is a subtraction.
struct InterferenceEvidence;
class InterferenceTrainer {
public:
  // DataError: no run, a run shorter than the windows, labels that overlap or leave the run.
  InterferenceTrainer(const std::vector<InterferenceRun> &runs, InterferenceOptions options);
  ~InterferenceTrainer();
  // Without run `left_out` (runs.size(): with all).
  InterferenceTraining train(std::size_t left_out) const;
  // The thesis's HMM for a p_mi that is given: thresholds of the CUSUMs are not set.
  rim_interference_model with_p_mi(std::size_t left_out, double p_mi) const;

private:
  const std::vector<InterferenceRun> &runs_;
  InterferenceOptions options_;
  std::vector<InterferenceEvidence> evidence_;
};

// 1e-1 .. 1e-20 and the like, largest first.
const std::vector<double> &p_mi_grid();

// A run under a model. Detectors: 0 the HMM as in the thesis (P(MI) > 1/2), 1 all together.
struct InterferenceOutcome {
  struct Detector {
    std::size_t hits = 0, false_positives = 0;
    std::vector<double> delays_s; // of the hits
  };
  std::array<Detector, 2> detector;
  std::size_t events = 0;
};
InterferenceOutcome detect(const rim_interference_model &model, const InterferenceRun &run);

// Columns: the command (u.vx_mps), the speed (s.vx_mps or z.vx_mps; or s.enc1_ticks .. s.enc4_ticks
// with the wheels). Throws DataError naming the log.
InterferenceRun interference_run(const Log &log, const rim_wheels *wheels);

} // namespace rim
