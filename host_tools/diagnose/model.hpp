// SPDX-License-Identifier: MIT
// diagnose/model.hpp - a channel's residual as a sum of members, fitted jointly and robustly.
#pragma once

#include <vector>

#include "diagnose/library.hpp"

namespace rim::diagnose {

// What the noise is like, as far as it is known by now.
struct Noise {
  Vector weight;       // per row, of a squared residual in units of the stated sd: 0 for a row that
                       // is no measurement, else 1 / variance ratio there
  double scale = 1.0;  // sd of what remains over the stated sd (times the ratio's root), not below
                       // what is believed of a simulation (diagnose/sets.hpp)
  double spread = 1.0; // rows over effective rows: by how much autocorrelation and the model's own
                       // error thin the evidence
  double scatter = 1.0, spread_of_sizes = 1.0; // the same as they are, for standard errors
  double spread_of_squares = 1.0;              // the same for squares, times their excess variance
  double clip = 3.5;                           // scales at which a residual is cut: Huber's corner
  // A log likelihood ratio is the fall of the robust half sum of squares over this.
  double divisor() const { return scale * scale * spread; }
};

// One candidate put to use: its columns inside its gate.
struct Member {
  Term term;
  int candidate = -1; // in Library::candidates; -1: the smooth table
  bool is_fixed = false, is_positive = false;
  bool is_given = false;    // came with --extension: stays as it is
  bool keeps_shape = false; // the held-out logs chose it
  bool differs = false;     // its size differs between the logs: h has a column for each
  Eigen::MatrixXd h;        // rows x columns, in stated sd
  // Where they are not the candidate's.
  std::vector<std::string> size_names{}, size_units{};
  double penalty = 0.0;
  // Of what is periodic in time: what noise takes off at its frequency, and the chance that noise
  // takes off as much as it does at any.
  double background = 0.0, p_value = 1.0;
  std::vector<double> part_penalty{}; // of a formula: each product's share
};

struct Fit {
  Vector beta;                 // of the free columns, in members' order
  Vector fitted;               // rows, in stated sd: fixed members included
  Vector residual;             // y - fitted
  Vector clipped;              // the residual, large ones cut to Noise::clip scales
  double loss = 0.0;           // Huber's half sum of squares, weighted
  Eigen::MatrixXd covariance;  // of beta for scale 1, spread 1
  Eigen::MatrixXd orthonormal; // of the free columns with sqrt(weight): rows x free
  bool is_allowed = true;      // every positive member has a positive size
};

// Whether a column acts in nearly all rows. A resistance that is more in one direction by more than
// it is at all is then a constant force beside it; where a machine that stands is held by a brake,
// the constant too is only seen in motion.
bool acts_throughout(const Eigen::Ref<const Vector> &column);

// The diagonal of a gram matrix more by this share of itself, whatever the units of the columns:
// the cube of a place in metres may be 1e-9 of its force. A column of nothing gets a size of none.
void add_ridge(double share, Eigen::MatrixXd *gram);

// y: (z - m) / sd. A few passes of O(rows x columns^2).
Fit fit_members(const Vector &y, const std::vector<Member> &members, const Noise &noise);

} // namespace rim::diagnose
