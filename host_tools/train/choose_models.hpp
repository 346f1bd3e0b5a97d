// SPDX-License-Identifier: MIT
// train/choose_models.hpp - which terms every outcome is predicted from: the simplest that no
// richer ones beat by enough, on runs left out.
#pragma once

#include <cstdint>
#include <vector>

#include "train/behaviour.hpp"
#include "train/fitter.hpp"

namespace rim {

// A set of groups, and by how much it must lower the error to be preferred to the simpler ones.
struct Choice {
  bool shape, slow, initial, steep;
  double must_win;
};

// Beside the commands.
struct Further {
  std::vector<std::uint16_t> outside; // features of the outcomes that are inputs
  std::vector<std::uint16_t> states;  // rolled ones
};

// outcome: the one whose first reading may be used; those of others are noise more often than not.
std::vector<Eigen::Index> terms_of(const Basis &basis, const Choice &choice, std::size_t outcome,
                                   const Further &further);

// Those of a target's model.
std::vector<Eigen::Index> terms_of(const Basis &basis, const Layout &layout,
                                   const TargetModel &model, std::size_t outcome);

// The features that a term is made of: commands, context, and sensors from outside. A rolled state
// and a first reading are of their own outcome, and are not among them.
std::vector<std::uint16_t> features_of(const Basis &basis, const Basis::Term &term);

// The outcomes' features.
std::vector<std::uint16_t> features_of(const Layout &layout, const std::vector<std::size_t> &set);

// Error of every outcome, runs left out, by the simplest models with these inputs: by it sets of
// inputs are compared.
std::vector<double> screened(const Fitter &fitter, const Basis &basis, std::size_t outcomes,
                             const Further &further);

// What every target is predicted from, and the outcomes that come from outside.
struct Chosen {
  std::vector<TargetModel> targets;
  std::vector<std::size_t> outside;
};

// Which groups of terms, and which outcomes from outside, every target is predicted from. Where the
// commands move less than half of the outcomes, what moves the others was not logged: they are no
// disturbances. integrated: of every outcome, whether it is the integral of others.
Chosen choose_targets(const Fitter &fitter, const Basis &basis, const Layout &layout,
                      const std::vector<bool> &integrated, const RunStore &runs);

// Places among the inputs of what may drive a rolled state: commands and context, their magnitudes,
// cosines and sines, and disturbances.
std::vector<std::uint16_t> drivers(const Basis &basis, const Layout &layout,
                                   const std::vector<std::size_t> &outside);

// The outcomes that are worth to be rolled forward, with what a state must win against.
std::vector<double> worth_rolling(const Fitter &fitter, const Chosen &chosen, const Layout &layout);

// Takes for every outcome one rolled state or all of them as inputs, beside the disturbances that
// it has already, where that lowers the error enough, and that of whole runs too: a state begins
// where its own sensor is.
void choose_states(const Fitter &fitter, const Basis &basis, const Layout &layout, Chosen *chosen);

// Takes the slow filters of commands (less: quick), or how commands move (less: still), away from
// every target that does as well without them.
void choose_less(const Fitter &fitter, const Basis &basis, const Layout &layout,
                 bool TargetModel::*less, Chosen *chosen);

} // namespace rim
