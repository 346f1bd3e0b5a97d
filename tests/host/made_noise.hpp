// SPDX-License-Identifier: MIT
// Residuals of a known make, as the noise models and the search get them: no rows, no models.
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "base/rng.h"
#include "train/calibrate.hpp"

extern "C" {
#include "image/noise.h"
}

struct MadeNoise {
  std::size_t outcomes = 1, means = 0;
  Eigen::Index blocks = 240;
  double offset_sd = 0.0; // of the run
  double gain_sd = 0.0;   // of the run, times the standardised prediction
  double rho = 0.0, s = 1.0;
  double slow_sd = 0.0, slow_rho = 0.0; // of a wander that is added
  double ln_sigma = 0.0;                // of what is new in a block, per standardised prediction
  double ln_active = 0.0;               // per logarithm of the first prediction's movement
  // Predictions rest, but for the last 24 of every 72 blocks: there the noise has rho_moving.
  bool rests = false;
  double rho_moving = 0.0;
  bool is_resting(Eigen::Index block) const { return rests && block % 72 < 48; }
};

// One run: every outcome has its channel of kind BEHAVIOUR; with all_kinds the other three kinds
// follow, alike and independent.
struct MadeRun {
  rim::BlockRun blocks;
  rim::Matrix predicted, residual;
  Eigen::VectorXd disturbance;
  std::vector<double> offset; // per channel
  rim::SearchRun seen() const { return {&blocks, &predicted, &predicted, &residual, &disturbance}; }
};

inline MadeRun made_noise(std::uint64_t seed, const MadeNoise &made, bool all_kinds = false) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 92);
  const auto o = static_cast<Eigen::Index>(made.outcomes);
  const Eigen::Index n = made.blocks, channels = all_kinds ? 4 * o : o;
  MadeRun run;
  run.blocks.context.resize(n, 2 + o);
  run.blocks.outcome = rim::Matrix::Zero(n, o);
  run.blocks.means.resize(n, static_cast<Eigen::Index>(made.means));
  run.disturbance = Eigen::VectorXd::Zero(n);
  run.blocks.follows.assign(static_cast<std::size_t>(n), true);
  run.blocks.follows.front() = false;
  run.blocks.time_s.resize(n);
  run.predicted.resize(n, o);
  run.residual.resize(n, channels);
  double wander = rimi_rng_normal(&rng), other = rimi_rng_normal(&rng);
  for (Eigen::Index b = 0; b < n; ++b) {
    wander = 0.9 * wander + std::sqrt(1.0 - 0.81) * rimi_rng_normal(&rng);
    other = 0.8 * other + 0.6 * rimi_rng_normal(&rng);
    run.blocks.time_s[b] = static_cast<double>(b) + 0.5;
    for (Eigen::Index k = 0; k < o; ++k)
      run.predicted(b, k) = made.is_resting(b) ? 0.0 : k % 2 == 0 ? wander : other;
    run.blocks.context.row(b).head(2) << wander, other;
    run.blocks.context.row(b).tail(o) = run.predicted.row(b);
    for (Eigen::Index m = 0; m < run.blocks.means.cols(); ++m)
      run.blocks.means(b, m) = rimi_rng_normal(&rng);
  }
  for (Eigen::Index c = 0; c < channels; ++c) {
    const double offset = made.offset_sd * rimi_rng_normal(&rng);
    const double gain = made.gain_sd * rimi_rng_normal(&rng);
    double noise = 0.0, slow = made.slow_sd > 0.0 ? made.slow_sd * rimi_rng_normal(&rng) : 0.0;
    for (Eigen::Index b = 0; b < n; ++b) {
      const double p = run.predicted(b, c % o);
      const double moved = b == 0 ? 1.0 : std::abs(run.predicted(b, 0) - run.predicted(b - 1, 0));
      const double fresh = made.s * std::exp(made.ln_sigma * p) *
                           std::pow(moved + NOISE_STILL, made.ln_active) * rimi_rng_normal(&rng);
      const double rho = made.rests && !made.is_resting(b) ? made.rho_moving : made.rho;
      noise = b == 0 ? fresh / std::sqrt(1.0 - rho * rho) : rho * noise + fresh;
      if (made.slow_sd > 0.0)
        slow = made.slow_rho * slow + made.slow_sd *
                                          std::sqrt(1.0 - made.slow_rho * made.slow_rho) *
                                          rimi_rng_normal(&rng);
      run.residual(b, c) = offset + gain * p + noise + slow;
    }
    run.offset.push_back(offset);
  }
  return run;
}

inline std::vector<MadeRun> made_noises(std::uint64_t first, std::size_t count,
                                        const MadeNoise &made, bool all_kinds = false) {
  std::vector<MadeRun> runs;
  for (std::size_t i = 0; i < count; ++i)
    runs.push_back(made_noise(first + i, made, all_kinds));
  return runs;
}

// Inputs of the noise models that are standardised already.
inline rim::Basis made_basis(const MadeNoise &made) {
  rim::Basis basis;
  basis.means.assign(made.means, 0);
  basis.mean_center.assign(made.means, 0.0);
  basis.mean_inverse_sd.assign(made.means, 1.0);
  return basis;
}

inline rim::NoiseModel fit_made(const MadeNoise &made, const std::vector<MadeRun> &runs) {
  std::vector<rim::SearchRun> seen;
  std::vector<std::size_t> which;
  for (const MadeRun &run : runs) {
    which.push_back(which.size());
    seen.push_back(run.seen());
  }
  return rim::fit_noise(made_basis(made), seen, which, 1.0);
}
