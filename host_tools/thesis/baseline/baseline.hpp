// SPDX-License-Identifier: MIT
// thesis/baseline/baseline.hpp - what others would use: the detectors of table 6.1 of the thesis
// (p. 91), for comparison on the same residuals. Each is the plain textbook form over standardised
// residuals r (mean 0, variance 1 in nominal running), looking at every channel and both signs.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace rim {

struct BaselineData {
  std::size_t n = 0, dims = 0, channels = 0;
  const double *u = nullptr;              // [n][dims] unit features
  const double *r = nullptr;              // [n][channels]
  std::array<std::size_t, 2> space{0, 1}; // features that a spatial scan looks at
};

struct BaselineResult {
  std::vector<double> score; // [n] after each point; an alarm where it exceeds a threshold
  bool is_pointwise = false; // a score is the point's own: those above the threshold are reported
  std::vector<bool> inside;  // [n] what is reported at the end, unless pointwise
};

// Wald's sequential probability ratio test of 0 against a mean of one standard deviation, begun
// anew where it accepts 0 with an error of 5 % (Wald 1945). The alternative must be known. Reports
// the points of the test that reached the largest ratio. O(1) a point.
BaselineResult detect_sprt(const BaselineData &data);

// The same with restarts at 0 (Page 1954): CUSUM. O(1) a point.
BaselineResult detect_cusum(const BaselineData &data);

// Generalised likelihood ratio of a mean that changed at an unknown time to an unknown value
// (Lorden 1971): max over k of (sum of the last k)^2 / 2 k. Reports those points. O(n) a point.
BaselineResult detect_glrt(const BaselineData &data);

// Distance to the fifth nearest earlier point in features and residuals together, a standard
// deviation counting as a quarter of a feature's range (Ramaswamy et al. 2000). Pointwise, from the
// 30th point on. O(n dims) a point.
BaselineResult detect_spatial_outlier(const BaselineData &data);

// Residual less the mean of those of the eight nearest earlier contexts (Shekhar et al. 2003).
// Pointwise, from the ninth point on. O(n dims) a point.
BaselineResult detect_context_outlier(const BaselineData &data);

// Spatial scan statistic (Kulldorff 1997), Gaussian: max of S^2 / 2 n over all circles about a
// point through another, in the two features of `space`. Exhaustive; every stride() points. O(n^2
// log n).
BaselineResult detect_spatial_scan(const BaselineData &data);

// Fast Subset Scan (Neill 2012): the best subset of each point's 20 nearest neighbours, which by
// linear-time subset scanning is one of those that hold the k largest (or smallest) residuals.
// Every stride() points. O(n^2 dims).
BaselineResult detect_subset_scan(const BaselineData &data);

// Points between two scans that look at everything: 10 up to 300 points, then 25.
std::size_t scan_stride(std::size_t n);

struct Baseline {
  const char *name;
  BaselineResult (*detect)(const BaselineData &data);
};
const std::vector<Baseline> &baselines();

} // namespace rim
