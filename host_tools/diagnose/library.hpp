// SPDX-License-Identifier: MIT
// diagnose/library.hpp - every candidate term of a channel as columns over the rows, and the
// features that may gate them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/catalogue.hpp"
#include "diagnose/measured.hpp"
#include "diagnose/term.hpp"

namespace rim::diagnose {

// A feature cut into bins of about equally many rows, equal values together; an angle comes twice,
// cut open at pi and at 0, so that an interval may run through either.
struct GateFeature {
  std::string name, unit;
  bool is_turned = false;                 // an angle cut half a turn from where its column is
  double turn = 0.0, cut = 0.0;           // a whole turn; of one turned: where its column is cut
  Vector x;                               // turned where it is
  std::vector<std::uint8_t> fine, coarse; // bin of each row
  std::vector<double> fine_edge, coarse_edge; // bins + 1; inner ones midway between neighbours
  int fine_bins() const { return static_cast<int>(fine_edge.size()) - 1; }
  int coarse_bins() const { return static_cast<int>(coarse_edge.size()) - 1; }
};

constexpr int kFineBins = 40, kCoarseBins = 12;

struct Candidate {
  Term term; // without gate and sizes; shape and arguments filled in
  bool is_fixed = false, is_positive = false;
  GateKind gate = GateKind::none;
  int column = 0, columns = 1; // in Library::g
  double penalty = 0.0; // nats, without gate: k/2 ln n + the form's cost + ln of its alternatives
  // Where each shape parameter may be refined; equal: not.
  std::vector<std::pair<double, double>> shape_range;
  std::string group; // of one group there is one at most: variants of one thing
  bool is_physical = false;
  std::vector<std::string> size_names;
};

// Time is a proxy of whatever happens then: in an interval of it a term must explain more than what
// it stands for. Not where runs are known: there something begins at a time.
inline constexpr double kTimeShare = 0.9;

struct Library {
  Eigen::MatrixXd g; // rows x columns, each divided by the channel's stated sd
  std::vector<Candidate> candidates;
  std::vector<GateFeature> gates;
  std::vector<int> own;               // features taken for the channel's own velocity
  std::vector<std::vector<int>> sets; // candidates that come together, of Catalogue::sets
  double ln_rows = 0.0, time_share = kTimeShare;
  std::vector<std::string> size_units; // by candidate

  // ln of the number of intervals or boxes that a gate of so many features is chosen from.
  double gate_penalty(std::size_t features) const;
};

// O(rows x columns); some 100 to 1000 columns. Without may_delay there is no form that comes late.
Library make_library(const Measured &measured, const Channel &channel, const Catalogue &catalogue,
                     bool may_delay = true);

// Bounds over bins [first, last] of a gate feature as a Gate has them (an angle that was turned is
// turned back).
void add_bounds(const GateFeature &feature, double lower, double upper, Gate *gate);

} // namespace rim::diagnose
