// SPDX-License-Identifier: MIT
// Units and how many of one of them make another.
#ifndef RIM_HOST_LOG_UNITS_HPP
#define RIM_HOST_LOG_UNITS_HPP

#include <string>
#include <vector>

namespace rim {

struct Unit {
  const char *text;
  const char *kind;    // of what: two units of one kind measure the same quantity
  double value;        // how many of the kind's first unit one of it is
  const char *instead; // the unit with a suffix in names that a log is converted to; "": none
  double zero = 0.0;   // where its scale begins, in the kind's first unit
};

const std::vector<Unit> &known_units();

// NULL: it is not known.
const Unit *find_unit(const std::string &text);

} // namespace rim

#endif
