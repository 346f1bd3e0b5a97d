// SPDX-License-Identifier: MIT
// Weighted Gram matrices per run, and the ridge maps that follow from their sums and differences.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "train/fit_gate.hpp"

namespace rim {

// Gram of the columns [1, inputs, outputs] under one prototype's gate weights: symmetric, both
// halves.
using Gram = Eigen::MatrixXd;

struct RidgeShape {
  Eigen::Index inputs = 0, outputs = 0;
  std::vector<int> exclude;    // per output, -1: none
  Eigen::VectorXd input_error; // per input, variance of its reading's own error, standardised
};

// One Gram per prototype over the rows of one run. Cost rows * top * (1 + inputs + outputs)^2 / 2.
std::vector<Gram> run_grams(const Matrix &xs, const Matrix &ys, RunSpan rows, const Gates &gates,
                            Eigen::Index prototypes);

// Maps outputs x (1 + inputs), offset first, that minimise
//   sum w |y - b - A x|^2 + ridge sum_i input_error_i |A_i - A_prior,i|^2
// as if `ridge` more rows were known that hold nothing but the readings' errors: redundant sensors
// then share the weight by their quality, which a penalty equal for all inputs forbids. The
// excluded coefficient of each output is held at zero; in the prior it must be zero already. One
// more pseudo-row pulls the offset to the prior's, so that a prototype without rows is the prior.
Matrix ridge_maps(const Gram &gram, const RidgeShape &shape, const Matrix &prior, double ridge);

// The same with a ridge of its own for each output.
Matrix ridge_maps(const Gram &gram, const RidgeShape &shape, const Matrix &prior,
                  const std::vector<double> &ridge);

// Weighted squared error of each output that maps make on the rows behind a Gram.
Eigen::VectorXd squared_error(const Gram &gram, const RidgeShape &shape, const Matrix &maps);

} // namespace rim
