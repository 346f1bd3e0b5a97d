// SPDX-License-Identifier: MIT
// train/quadratic.hpp - an outcome from products of the other readings, of the same block and of
// the block before: what section QUADRATIC holds (lib/src/image/quadratic.h).
#pragma once

#include <cstdint>
#include <utility>
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
  std::vector<std::pair<std::size_t, Eigen::VectorXd>> models; // outcome, weights in its unit
};

// The inputs' scales, and of which of them there are products: of both blocks, of this block alone,
// or of none, by the number of inputs and of blocks.
Quadratic quadratic_inputs(const Layout &layout, const RunStore &runs);
// Terms of every block of a run: blocks x RIM_QUADRATIC_TERMS.
Matrix quadratic_terms(const Quadratic &of, const Layout &layout, const BlockRun &run);
// The terms that an outcome's own reading is not in.
std::vector<Eigen::Index> quadratic_columns(const Quadratic &of, const Layout &layout,
                                            std::size_t outcome);
std::vector<std::uint8_t> quadratic_section(const Quadratic &of); // empty without models

} // namespace rim
