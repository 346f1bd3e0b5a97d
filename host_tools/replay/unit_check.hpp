// SPDX-License-Identifier: MIT
// replay/unit_check.hpp - is an outcome read in another unit than the model's?
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "image/names.hpp"

namespace rim {

// An outcome whose readings are what is expected of them times a factor between two units. A
// reading in too small a unit leaves the trained range; in too large a unit (rad/s where the model
// has rpm) it stays within, and seems to be a deviation of nine tenths. Units of temperature also
// begin elsewhere: a kiln that is read in K instead of degC may stay within its range as well.
struct OtherUnit {
  std::size_t outcome = 0;
  double factor = 0.0;    // reading over expectation, by least squares; with `more`: of the units
  double more = 0.0;      // what the reading has beyond that factor; 0 where scales begin alike
  std::string looks_like; // "rad/s"
};

// Gathers blocks of one log.
class UnitCheck {
public:
  explicit UnitCheck(std::size_t outcomes) : sums_(outcomes) {}
  // Means of a block's readings, and what was expected of them; [outcomes] in the outcomes' units.
  void add(const Eigen::VectorXd &measured, const Eigen::VectorXd &expected);
  // The outcomes in another unit: of at least ten blocks nearly all of the readings is what was
  // expected, times a factor that leads from the outcome's unit to another, and from where the one
  // scale begins to where the other does. O(outcomes units).
  std::vector<OtherUnit> found(const Names &names) const;

private:
  std::optional<OtherUnit> scale_that_begins_elsewhere(std::size_t outcome,
                                                       const std::string &unit) const;
  struct Sums {
    double readings = 0.0, products = 0.0, expected = 0.0; // of squares, and of both
    double reading = 0.0, expectation = 0.0;
  };
  std::vector<Sums> sums_;
  std::size_t blocks_ = 0;
};

} // namespace rim
