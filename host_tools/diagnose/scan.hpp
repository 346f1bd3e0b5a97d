// SPDX-License-Identifier: MIT
// diagnose/scan.hpp - what next would explain most of a residual: every candidate, everywhere, in
// every interval of every feature, in every box of every pair of features.
//
// Intervals are rimi_interval_find's (App. A, p. 115) over bins of sufficient statistics s = sum g
// e, w = sum g^2 (eq. 3.7, p. 28 with the shift proportional to g); boxes by prefix sums over a
// grid.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "diagnose/library.hpp"
#include "diagnose/model.hpp"

namespace rim::diagnose {

// An interval [lower, upper] of Library::gates[feature], in its (turned) values.
struct Bound {
  int feature = 0;
  double lower = 0.0, upper = 0.0;
};

// Nats that the second feature of a region must be worth: half of what cannot be told apart (BIC).
inline constexpr double kOfFeature = 3.0;

struct Proposal {
  int candidate = -1;        // -1: a variance
  std::vector<Bound> bounds; // none: everywhere
  bool is_ellipse = false;
  std::vector<double> center, inverse_shape; // of an ellipse
  double gain = 0.0;                         // ln likelihood ratio, divisor applied
  double penalty = 0.0;
  double ratio = 1.0; // variance: inside over outside
  double score() const { return gain - penalty; }
};

// Sums over the coarse cells of a pair of features: first bin * kCoarseBins + second bin.
using Cells = std::array<double, static_cast<std::size_t>(kCoarseBins *kCoarseBins)>;

class Scanner {
public:
  Scanner(const Library &library, const Vector &weight);

  // The best of each candidate without a gate, with an interval and with a box; worst ones left
  // out, best first by score. Other members count as orthogonal to what is gated: fit what comes
  // out. O(rows x (columns + gated candidates x features)).
  std::vector<Proposal> mean(const Fit &fit, const Noise &noise, std::size_t most) const;

  // The interval and the box in which the variance differs most from elsewhere, best first;
  // whatever the scale of all.
  std::vector<Proposal> variance(const Fit &fit, const Noise &noise) const;

  // A mean proposal's bounds at fine resolution, one after the other, and for a pair the ellipse by
  // cross-entropy search (3.2, p. 29) where it explains more. `residual` is what remains without
  // it.
  void refine(const Vector &residual, const Noise &noise, Proposal *proposal,
              bool ellipses = true) const;

  Vector inside(const Proposal &proposal) const; // 1 or 0 a row
  Gate gate(const Proposal &proposal) const;

private:
  struct Gated {
    int candidate = 0;
    bool is_pair = false;
    Eigen::MatrixXd w;         // fine bins x gates
    std::vector<Cells> w_grid; // one a pair, where is_pair
  };
  Cells sums(std::size_t pair, const Vector &x) const;
  double fixed_gain(const Vector &weighted, double now, double corner, Eigen::Index column) const;
  void propose_gated(const Gated &gated, const Vector &e, const Noise &noise,
                     std::vector<Proposal> *out) const;
  void propose_pairs(int candidate, const Vector &e, const Noise &noise,
                     std::vector<Proposal> *out) const;
  void refine_pair(const Vector &residual, Proposal *proposal) const;
  void propose_boxes(const Gated &gated, const Vector &e, const Noise &noise,
                     std::vector<Proposal> *out) const;
  Proposal variance_interval(const Vector &q, const Vector &used, double spread) const;
  Proposal variance_box(const Vector &q, const Vector &used, double spread) const;
  void refine_bound(const Vector &products, const Vector &squares, std::size_t which,
                    Proposal *proposal) const;
  void try_ellipse(const Vector &products, const Vector &squares, Proposal *proposal) const;

  const Library &library_;
  Vector weight_, root_;
  Vector norm_;               // weighted squares of the library's columns
  Eigen::MatrixXd fine_rows_; // that are measurements: fine bins x gates
  std::vector<Gated> gated_;
  std::vector<int> gated_pairs_; // candidates of two columns that may be gated
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::vector<std::uint8_t>> cells_; // of every pair: each row's
  std::vector<Cells> rows_in_;                   // that are measurements
  double least_rows_;
};

} // namespace rim::diagnose
