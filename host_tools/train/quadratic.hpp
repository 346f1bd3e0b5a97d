// SPDX-License-Identifier: MIT
// train/quadratic.hpp - an outcome from products of the other readings, of the same block and of
// the block before: what section QUADRATIC holds (lib/src/image/quadratic.h).
#pragma once

#include <cstdint>
#include <vector>

#include "image/layout.hpp"
#include "train/run_store.hpp"

namespace rim {

// What sections LEVEL and QUADRATIC see of a block: its features, an angle as cosine and sine.
Eigen::Index reading_inputs(const Layout &layout);
Matrix reading_inputs(const Layout &layout, const Matrix &context); // blocks x inputs

struct Quadratic {
  Eigen::VectorXd centre, inverse_scale; // of the inputs, as single precision holds them
  Eigen::Index paired = 0; // inputs whose products are terms; 0: there are too few blocks
  struct Model {
    int use; // rim_quadratic_use
    std::size_t outcome;
    Eigen::VectorXd weight; // in the outcome's unit
  };
  std::vector<Model> models; // by use, then by outcome
};

// The inputs' scales, and of which of them there are products: of both blocks, of this block alone,
// or of none, by the number of inputs and of blocks.
Quadratic quadratic_inputs(const Layout &layout, const RunStore &runs);
// Terms of every block of a run: blocks x RIM_QUADRATIC_TERMS.
Matrix quadratic_terms(const Quadratic &of, const Layout &layout, const BlockRun &run);
// Which readings may be in an outcome's terms, beside commands and context: those of the other
// outcomes, of both blocks; with them its own of the block before; all, of the block before alone.
enum class Readings { others, own_before, before };
std::vector<Eigen::Index> quadratic_columns(const Quadratic &of, const Layout &layout,
                                            std::size_t outcome, Readings readings);
// A relation that follows its own reading of the block before takes an offset of that reading for
// what is to be expected, but for the share 1 - g, g its slope along that reading. So that what is
// left shows an offset in full, it is divided by 1 - g. weight: of (reading - mean) / sd, becomes
// (weight - g now) / (1 - g), with `now` the terms that give the block's own reading.
double slope_along_own(const Quadratic &of, Eigen::Index own, double sd,
                       const Eigen::VectorXd &weight);
void show_offset_in_full(const Quadratic &of, Eigen::Index own, double mean, double sd, double g,
                         Eigen::VectorXd *weight);
constexpr double kMostOwn = 0.95;                                 // g at most
std::vector<std::uint8_t> quadratic_section(const Quadratic &of); // empty without models

} // namespace rim
