// SPDX-License-Identifier: MIT
// What healthy residuals do: the effects of a run, autocorrelation, a scale that depends on the
// context (lib/src/image/noise.h), learnt from whole healthy runs that the models had not seen.
#pragma once

#include <cstdint>
#include <vector>

#include "train/behaviour.hpp"

namespace rim {

struct ChannelNoise {
  bool active = true;
  double rho = 0.0, s = 1.0;
  double rho_rise = 0.0; // what is added to rho where predictions move more than is usual
  double rho_of(bool moving) const { return rho + (moving ? rho_rise : 0.0); }
  double limit = 0.0; // of what counts in a block (rimi_noise_counted()), in s; 0: none
  double p_center = 0.0, p_scale = 1.0;
  double ln_sigma[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
  double mean = 0.0;  // of the healthy share of repeats, which is taken off; 0 elsewhere
  Matrix combination; // fields x raw: per s, so that a field's effect is N(0, 1) in healthy runs
  double effect_sd = 0.0; // of a run's effects, root mean square over blocks, in the outcome's unit
  std::vector<double> phi; // per family of hypotheses
};

struct NoiseModel {
  double run_s = 1.0, decay_s = 1.0, trend_s = 1.0;
  double activity = 0.0; // mean of healthy blocks, see rimi_noise_activity()
  std::size_t means = 0;
  std::size_t runs = 0;               // that taught it; 0: the effects' variances are known
  std::vector<ChannelNoise> channels; // kind * outcomes + outcome
  bool with_gaps = false;             // half of the runs or more have one that no step covers
};

// One healthy run, as models see it that were made without it.
struct SearchRun {
  const BlockRun *blocks;
  const Matrix *predicted;            // blocks x outcomes
  const Matrix *agreed;               // blocks x outcomes: what the other sensors let expect
  const Matrix *residual;             // blocks x channels, in the outcomes' units
  const Eigen::VectorXd *disturbance; // [blocks], by rimi_noise_disturbance()
  const Matrix *unknown =
      nullptr; // blocks x outcomes: 1 where agreement says nothing; nullptr: nowhere
};

// What a channel's residuals are the rest of, per block.
Eigen::VectorXd expected(const SearchRun &run, Eigen::Index channel);

// From the runs `which` of those seen. block_s: length of a block.
NoiseModel fit_noise(const Basis &basis, const std::vector<SearchRun> &seen,
                     const std::vector<std::size_t> &which, double block_s);
std::vector<std::uint8_t> noise_section(const NoiseModel &noise);

} // namespace rim
