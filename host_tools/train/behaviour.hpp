// SPDX-License-Identifier: MIT
// Nominal models of a block's outcomes, learnt from healthy runs with whole runs left out.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "train/quadratic.hpp"
#include "train/run_store.hpp"

namespace rim {

// Ridge regression of one outcome on groups of terms.
struct TargetModel {
  bool shape = false, slow = false, initial = false, steep = false; // groups beside the means
  bool quick = false;                 // without the slow filters of commands
  bool still = false;                 // without how commands move
  std::vector<std::size_t> outside;   // outcomes that are inputs of this one
  std::vector<std::uint16_t> states;  // rolled states that are inputs of this one
  std::vector<std::uint16_t> without; // features of which no term is made: see leave_out()
  double ridge = 1.0;
  double intercept = 0.0;
  Eigen::VectorXd weight;   // per term, standardised
  double r2 = 0.0;          // of the blocks' variance, runs left out
  double error = 0.0;       // root mean square, runs left out, in the outcome's unit
  double whole_error = 0.0; // of the one that was chosen, with the runs' own means in full
};

struct Behaviour {
  std::vector<TargetModel> targets; // outcomes, then their scatter
  std::vector<std::uint32_t> kept;  // terms of the basis that any target uses
  // Of all() runs, by models without it: blocks x outcomes.
  std::vector<Matrix> predicted, residual, scatter;
};

// Learns the basis' centers and scales and the models, of at least two runs.
//
// An outcome that the commands do not move (not_moved()) and that lowers another's error comes from
// outside (wind, ambient temperature, slope): the other's model takes it as an input, as it takes
// the commands. Not where it is the integral of others (integrated_outcomes()): what a position
// says of a speed is the speed itself, and a vehicle that is too slow would not be seen.
// integrands: of the runs' columns early and late. Outcomes that keep what was put into them are
// rolled forward (rolled.hpp), and may be inputs of all. block_s: length of a block.
Behaviour fit_behaviour(Basis *basis, const Layout &layout,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        double block_s);

// Learns the centers and scales of the basis' terms alone.
void learn_terms(Basis *basis, const RunStore &runs);
// Learns the centers and scales of the basis' means alone.
void learn_means(Basis *basis, const RunStore &runs);

// Drops the terms that no target uses, and the inputs that nothing uses then.
void shrink_basis(Basis *basis, Behaviour *behaviour);
std::vector<std::uint8_t> behaviour_section(const Basis &basis, const Behaviour &behaviour);

// What remains of one outcome from what remains of the others (lib/src/image/basis.h).
struct Agreement {
  std::vector<double> inverse_sd;
  std::vector<Integrand> integrands;                 // that some outcome is the integral of
  std::vector<double> integrand_inverse_sd, partial; // partial: [integrands][2]
  Matrix row;                            // outcomes x (AGREEMENT_FIRST + outcomes (2 + means))
  std::vector<double> error;             // of each outcome, runs left out, over the behaviour's
  std::vector<int> source;               // of each outcome: agreement_source
  Quadratic quadratic;                   // the models of those whose source it is, and of steps
  std::vector<Matrix> remains, expected; // of all() runs: blocks x outcomes
  std::vector<bool> has_step;            // of each outcome
  std::vector<Matrix> steps;             // what its step leaves, as remains; 0 without

  bool has_steps() const {
    return std::find(has_step.begin(), has_step.end(), true) != has_step.end();
  }
};

// Which outcomes change mostly as the integral of others does (position, attitude, charge).
std::vector<bool> integrated_outcomes(const Layout &layout,
                                      const std::vector<Integrand> &integrands,
                                      const RunStore &runs);

// level: of all() runs, the outcomes as section LEVEL predicts them from the other sensors, by
// models without the run; empty: there is none. products: section QUADRATIC may be a source. steps:
// it is to hold what outcomes do next, too.
// integrands: of the runs' columns early and late.
// residual, predicted: of behaviour, blocks x outcomes of all() runs.
Agreement fit_agreement(const Layout &layout, const Basis &basis,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        const std::vector<Matrix> &residual, const std::vector<Matrix> &predicted,
                        const std::vector<Matrix> &level, bool products, bool steps = false);
// rimi_noise_disturbance() of every block, per run.
std::vector<Eigen::VectorXd> disturbances(const Agreement &agreement,
                                          const std::vector<Matrix> &residual);
std::vector<std::uint8_t> agreement_section(const Agreement &agreement, std::size_t means);

// Standardised values of the basis' means in a run.
Matrix standard_means(const Basis &basis, const BlockRun &run);

} // namespace rim
