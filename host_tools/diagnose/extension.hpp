// SPDX-License-Identifier: MIT
// diagnose/extension.hpp - extension.toml: the accepted terms, for people to read and for
// simulate, replay and the next diagnose to load (--extension).
//
//   schema = "rim-extension/1"
//   [[term]]
//   channel = "speed_mps" ; cause = "quadratic_drag" ; form = "quadratic_drag" ; kind = "mean"
//   basis = ["-v*abs(v)"]
//   arguments = { v = "s.speed_mps" }
//   [[term.size]]   name value stderr unit
//   [[term.shape]]  name value stderr unit
//   [term.region]   features units lower upper shape = "box"|"ellipse" center inverse_shape
//   [term.support]  the same, a box: rows beyond it were not seen, and nothing is added there
//   table: knots, values; delay, lag_command: [term.response] "u.a*s.b" = 0.5, and [[term.ridge]]
//   weights = { "u.a" = 1.0 } knots values
#pragma once

#include <string>
#include <vector>

#include "diagnose/term.hpp"

namespace rim::diagnose {

// `made_by`: lines for the comment at the head (version, seed, command line). Atomic.
std::string extension_toml(const std::vector<Term> &terms, const std::string &made_by);
// DataError with file, line and key: an unknown key or form, a number of sizes that does not fit
// the basis, an expression that does not parse or names what is not an argument, bounds the wrong
// way round, a channel's term that takes its own outcome (z.) as argument: a cycle.
std::vector<Term> read_extension(const std::string &path);
// DataError (file, line): a channel or feature that the table has not, or has in another unit.
void check_extension(const std::vector<Term> &terms, const Measured &measured,
                     const std::string &path);

} // namespace rim::diagnose
