// SPDX-License-Identifier: MIT
// report/data.hpp - what the report's pictures are drawn from: residuals binned, cells of
// a plane, the stretch of a log that tells most.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"
#include "report/svg.hpp"

namespace rim::diagnose::report {

using Rows = std::vector<std::size_t>;

// "quadratic drag": a cause's name in words.
std::string plain_cause(const std::string &cause);

// "altitude", "commanded turn", "time since the log began": a feature's name in words.
std::string feature_text(const std::string &name);

// One channel before and after the extension. Where the diagnosis has no state for it, after is as
// before.
struct View {
  const Diagnosis *diagnosis = nullptr;
  const Measured *measured = nullptr;
  const Channel *channel = nullptr;
  Vector m_after, sd_after;
  Vector before, after;   // (z - m) / sd, normalised residuals
  Rows usable;            // neither stuck nor dropped out, and every number finite
  double inflation = 1.0; // (1 + rho) / (1 - rho): of a mean's variance, by autocorrelation
};
View view_of(const Diagnosis &diagnosis, const Measured &measured, const Channel &channel);

// A quantity along an axis: a feature ("u.speed_mps@0.2": of 0.2 s ago), kTime, or "m", the
// prediction.
struct Quantity {
  std::string name, text; // "s.speed_mps", "speed (m/s)"
  Vector value;           // rows
};
// All zeros if the table has no such feature.
Quantity quantity_of(const std::string &name, const View &view);
Range range_of(const Vector &values);

// Rows of a bin along x: mean of y with the half width of its 95 % interval, and its root mean
// square with that.
struct Bin {
  double x = 0.0, mean = 0.0, half = 0.0, rms = 0.0, rms_half = 0.0;
  std::size_t rows = 0;
};
// Bins of at least 12 rows, about `most`: closed by rows where they crowd, by width where they are
// few; equal x never parted. O(n log n).
std::vector<Bin> bins_of(const Vector &x, const Vector &y, const Rows &rows, std::size_t most,
                         double inflation);
// Bins of equal width, empty ones left out: for a curve.
std::vector<Bin> steps_of(const Vector &x, const Vector &y, const Rows &rows, std::size_t count);

// Rows that lie within the gate's bounds of its features, those in `except` aside.
Rows rows_in_bounds(const Gate &gate, const View &view, const std::vector<std::string> &except);
// Whether the bounds hold for feature k; a wrapped interval runs through pi.
bool in_bounds(const Gate &gate, std::size_t k, double value);
// The two features (indices into gate.features) whose bounds keep out most rows; the same twice
// when there is one.
std::pair<std::size_t, std::size_t> best_projection(const Gate &gate, const View &view);
// Outline of the gate on two of its features, in their units: of an ellipsoid its shadow.
std::vector<std::pair<double, double>> outline(const Gate &gate, std::size_t i, std::size_t j);

// What one finding does, the channel's others standing: the residual (z - m) / sd without its term
// and with it. Alone on its channel that is before and after.
struct Share {
  bool alone = true;
  Vector m_without, sd_without, without, with;
};
Share share_of(const Finding &finding, const View &view, const Vector &effect);
// What the finding adds to m beside the others; zero for sensor and variance terms. Where it cannot
// be computed: what all terms of the channel add.
Vector effect_of(const Finding &finding, const View &view);
// Why it cannot be computed, for the reader; empty where it can.
std::string effect_problem(const Finding &finding, const View &view);
// The argument along which the finding's effect changes most; kTime when it has none.
std::string telling_argument(const Finding &finding, const View &view, const Vector &effect);

// At most `most` rows of one log, where the finding's effect is largest in sum of squares.
struct Stretch {
  std::size_t log = 0, first = 0, rows = 0;
};
Stretch telling_stretch(const Finding &finding, const View &view, const Vector &effect,
                        std::size_t most);
// Runs of rows of the table on which `acts` says so, within [first, first + rows).
std::vector<std::pair<std::size_t, std::size_t>> runs_of(const std::vector<std::uint8_t> &acts,
                                                         std::size_t first, std::size_t rows);
// Mean over `width` rows about each.
Vector running_mean(const Vector &values, std::size_t width);
// Every k-th of the list so that at most `most` are left.
Rows thinned(const Rows &rows, std::size_t most);

} // namespace rim::diagnose::report
