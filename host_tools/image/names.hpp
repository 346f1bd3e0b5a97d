// SPDX-License-Identifier: MIT
// image/names.hpp - what the indices of an alarm are called.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rim/image.h"

namespace rim {

// One feature or outcome: its column's name ("s.altitude_m"), in words, and its unit.
struct Quantity {
  std::string name;  // as in the log; the key in JSON
  std::string words; // "altitude"
  std::string unit;  // "m"; empty: none
};

// From a column's name.
Quantity quantity_of(const std::string &column_name);

struct Names {
  std::vector<Quantity> features, outcomes;
  bool external = false; // rows bring the outcomes' predictions
  // Those of an index; "feature 7" where there is none: an alarm can be shown without its model.
  Quantity feature(std::size_t index) const;
  Quantity outcome(std::size_t index) const;
};

// From the NAMES section of a flight image; empty when it has none. DataError "NAME: reason" when
// the section does not hold as many names as the configuration says.
Names names_of_image(const rim_image &image, const std::string &name);
Names names_of_model(const std::string &path);

} // namespace rim
