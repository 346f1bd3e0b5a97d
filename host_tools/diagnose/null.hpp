// SPDX-License-Identifier: MIT
// diagnose/null.hpp - what the whole search finds where nothing is hidden (eq. 3.9, p. 29).
#pragma once

#include <cstdint>
#include <vector>

#include "diagnose/catalogue.hpp"
#include "diagnose/library.hpp"

namespace rim::diagnose {

// Largest scores of simulated residuals on the logs' own contexts, a Gumbel law fitted to them by
// moments: with some 60 maxima its tail is known better than any order statistic.
struct Null {
  double location = 0.0, spread = 1.0;
  std::size_t channels = 1; // searched together

  // Score that noise exceeds, in any channel, with this probability.
  double threshold(double false_alarm) const;
  // Probability that noise reaches this score in any channel; not below 1e-12.
  double p_value(double score) const;
};

// Residuals drawn from N(0, 1), searched `runs` times in each channel, in parallel; the same for
// any number of threads. kept: the channels' libraries, where they are few enough to be held at
// once; else none, and each is made anew when its channel is searched.
Null simulate_null(const Measured &measured, const Catalogue &catalogue, std::size_t runs,
                   std::uint64_t seed, std::vector<Library> *kept);

} // namespace rim::diagnose
