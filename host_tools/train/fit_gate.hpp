// SPDX-License-Identifier: MIT
// Where the prototypes stand and how loudly each speaks in a context.
#pragma once

#include <cstdint>
#include <vector>

#include "train/fit.hpp"

namespace rim {

// Rows [begin, end) of one run.
struct RunSpan {
  std::size_t begin, end;
};
std::vector<RunSpan> run_spans(const std::vector<std::uint32_t> &run);

// The top-K gate weights of many rows, row-major n x top; index of the prototype beside it.
struct Gates {
  std::uint32_t top = 0;
  std::vector<std::uint8_t> index;
  std::vector<double> weight;
};

// Centre and inverse scale of the inputs, rounded to single precision; constant inputs get scale 1.
void standardise_inputs(const Matrix &x, NominalModel &model);
Matrix standardised(const NominalModel &model, const Matrix &x);

// At most `most` rows, each as often as its weight says; empty weights: evenly.
Matrix sample_rows(const Matrix &xs, const Eigen::VectorXd &weight, std::size_t most);

// k-means++ and Lloyd on standardised rows; sets prototypes (rounded), ln_mass = 0, reach = 0;
// returns per prototype the rms distance of the rows nearest to it. O(25 rows count inputs).
Eigen::VectorXd place_prototypes(const Matrix &sample, std::uint32_t count, std::uint64_t seed,
                                 NominalModel &model);

// Gates of rows [begin, end) of the standardised inputs written at their own place in `gates`;
// raises reach_squared[p] to the largest squared distance among the rows nearest to p.
void open_gates(const NominalModel &model, const Matrix &xs, RunSpan rows, Gates &gates,
                Eigen::VectorXd *reach_squared);

} // namespace rim
