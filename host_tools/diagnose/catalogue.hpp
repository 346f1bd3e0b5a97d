// SPDX-License-Identifier: MIT
// diagnose/catalogue.hpp - data/causes.toml: the forms a discrepancy may have, and their names.
//
// A form is one or two basis functions of placeholders; a placeholder's role says which features
// may stand for it. The file explains itself; users lay a file of their own beside it (--causes).
#pragma once

#include <string>
#include <vector>

#include "diagnose/term.hpp"

namespace rim::diagnose {

// Which features may stand for a placeholder.
enum class ArgumentRole {
  any,       // every feature
  other,     // every feature but the channel's own velocity
  own,       // the velocity whose change the channel is; every velocity when it is not known
             // (diagnose/roles.hpp)
  velocity,  // unit m/s, km/s, rad/s or deg/s
  signed_,   // features that take both signs
  command,   // u. columns
  angle,     // wrapped angles
  heading,   // wrapped angles named heading, yaw, theta or psi; every angle when none is
  altitude,  // lengths named altitude or height, that change by 500 m at least
  state,     // the channel's own reading that the prediction starts from
  own_state, // that, where it is the own velocity
  stream,    // a velocity of what the vehicle moves in: wind, current
  alike,     // as other, in the unit of the argument before it
  lagged,    // a command, or any quantity where there is none, through a first-order lag
  held,      // no velocity, nor an angle that wraps: what springs that slip keep of the quantity
};

enum class GateKind { none, interval, pair };

struct Argument {
  std::string name; // placeholder
  ArgumentRole role = ArgumentRole::any;
};

// A parameter inside the basis, tried on a grid and then refined.
struct ShapeParameter {
  std::string name;
  std::string quantiles_of; // placeholder, "m", "t", or the abs() of one: the grid is its quantiles
  int count = 8;
  double low_share = 0.05, high_share = 0.95; // first and last quantile
  std::vector<double> values;                 // or these, in `unit`
  std::string share_of;        // argument: the values are multiples of rms of m over rms of it
  bool first_is_usual = false; // the first of them costs nothing
  double most_of_rms = 1e300;  // the most that a quantile is, as share of the root mean square
  std::string unit;            // empty: that of quantiles_of
};

struct Form {
  std::string cause, form, description;
  TermKind kind = TermKind::mean;
  std::vector<std::string> basis; // empty for the built-in delay, lag, stuck, dropout, noise
  std::vector<Argument> arguments;
  bool is_unordered = false; // arguments may be exchanged: each pair once
  bool is_fixed = false;     // its size is 1 and is not fitted
  bool is_positive = false;  // its size must be above 0
  GateKind gate = GateKind::none;
  std::vector<ShapeParameter> shape;   // at most two, the second of values
  std::vector<std::string> per;        // placeholders, "m" or "t" whose units divide the size's
  std::vector<std::string> size_names; // one a basis; empty: "size", or "sine" and "cosine"
  bool is_physical = false; // a law of physics: goes on beyond the rows that it was learnt from
  std::string better;       // a form that is meant where it can be had: this one then costs
  double worse_by = 5.0;    // so many nats more
  bool is_of_command = false; // not of a prediction that starts from the channel's own reading
  // Most sd over |mean| of the argument that the shape is a quantile of.
  double most_spread = 1e300;
  double least_spread = 0.0; // of every argument: sd over |mean|; a quantity that hardly varies
                             // is a constant under another name
  double cost = 0.0;         // nats, beside what is reckoned: for forms less likely a priori
  int line = 0;
};

struct Catalogue {
  std::string path;
  std::vector<Form> forms;
  std::vector<std::vector<std::string>> sets; // forms that come together: the search starts there
};

// DataError with file and line: unknown key, role, kind or form; a name given twice; an expression
// that does not parse or that uses a name it has no argument for.
Catalogue read_catalogue(const std::string &path);
// Forms of `more` after those of `base`; a form of the same name replaces it.
Catalogue merged(const Catalogue &base, const Catalogue &more);

} // namespace rim::diagnose
