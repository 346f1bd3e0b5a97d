// SPDX-License-Identifier: MIT
// train/integral.hpp - an outcome as the integral of others (position, attitude, charge): section
// AGREEMENT of lib/src/image/basis.h.
#ifndef TRAIN_INTEGRAL_HPP
#define TRAIN_INTEGRAL_HPP

#include <vector>

#include "train/behaviour.hpp"
#include "train/regression.hpp"

namespace rim {

// Part of the changes that others must explain for an outcome to be called their integral.
constexpr double kIntegrates = 0.5;

// Standard deviation of every integrand, and what it changes by per unit of its factors.
void learn_integrands(Agreement *a, const Layout &layout, const RunStore &runs);

// Changes of the outcomes from what may be integrated: rows whose block follows the one before.
// a and runs must outlive it.
Regression integral_regression(const Agreement &a, const RunStore &runs);

// The few integrands that explain the change of an outcome, of none of the features `without`.
std::vector<Eigen::Index> choose_integrands(const Regression &r, const Agreement &a,
                                            Eigen::Index outcome,
                                            const std::vector<std::uint16_t> &without);

// The outcome that this one mostly integrates, -1: none.
double mostly_integrated(const Agreement &a, const Layout &layout, const Eigen::VectorXd &weight,
                         const RunStore &runs);

// An outcome as the integral of a few others: weights of all integrands, by how many blocks the
// outcome's reading is later than theirs, and what it changes by beside, per block, in its unit.
struct Integral {
  Eigen::VectorXd weight;
  double lag = 0.0, constant = 0.0;
};

// Of `outcome`, from weights without a lag of the integrands named; per fold left out, and of all.
std::vector<Integral> with_lag(const Agreement &a, const RunStore &runs, Eigen::Index outcome,
                               const std::vector<Eigen::Index> &columns,
                               const std::vector<Eigen::VectorXd> &weight);

// The same with a constant, where that lowers the squares of what remains in `runs`, each by what
// the others taught, to kConstantWins of them or less: a speed gains g t beside what an
// accelerometer reads, a battery feeds what no current sensor sees. Otherwise as they are.
std::vector<Integral> with_constant(const Agreement &a, const RunStore &runs, Eigen::Index outcome,
                                    std::vector<Integral> of);

// What the flight code sums up over a run: what remains of the outcome, and what was integrated.
struct Summed {
  Eigen::VectorXd remains, integrated;
};

Summed summed(const Agreement &a, const RunStore &runs, std::size_t r, Eigen::Index outcome,
              const Integral &of);

// Only the integrands that some outcome uses fly. weight: of every outcome, empty where none is.
void keep_used_integrands(Agreement *a, const std::vector<Eigen::VectorXd> &weight);

} // namespace rim

#endif
