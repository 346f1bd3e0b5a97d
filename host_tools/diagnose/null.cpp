// SPDX-License-Identifier: MIT
#include "diagnose/null.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/rng.h"
#include "diagnose/search.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim::diagnose {

namespace {
constexpr double kEuler = 0.5772156649015329, kPi = 3.141592653589793;
constexpr std::size_t kAtOnce = 4; // channels: their libraries are large
constexpr double kLeastP = 1e-12;  // a fitted law's tail is not believed further
} // namespace

double Null::threshold(double false_alarm) const {
  const double one = std::pow(1.0 - false_alarm, 1.0 / static_cast<double>(channels));
  return location - spread * std::log(-std::log(one));
}

double Null::p_value(double score) const {
  // 1 - exp(-c exp(-u)) without cancellation.
  return std::max(kLeastP, -std::expm1(-static_cast<double>(channels) *
                                       std::exp(-(score - location) / spread)));
}

Null simulate_null(const Measured &measured, const Catalogue &catalogue, std::size_t runs,
                   std::uint64_t seed, std::vector<Library> *kept) {
  const std::size_t channels = measured.channels.size();
  const Vector ones = Vector::Ones(static_cast<Eigen::Index>(measured.rows()));
  std::vector<double> best(channels * runs);
  Progress progress("what noise would show", best.size());
  for (std::size_t first = 0; first < channels; first += kAtOnce) {
    const std::size_t now = std::min(kAtOnce, channels - first);
    std::vector<Library> libraries(now);
    std::vector<std::unique_ptr<Scanner>> scanners(now);
    parallel_for(now, [&](std::size_t c) {
      libraries[c] = make_library(measured, measured.channels[first + c], catalogue);
      scanners[c] = std::make_unique<Scanner>(libraries[c], ones);
    });
    parallel_for(now * runs, [&](std::size_t i) {
      const std::size_t c = i % now, of_all = i / now * channels + first + c;
      Vector y(ones.size());
      rim_rng rng;
      rimi_rng_seed(&rng, seed, of_all);
      for (Eigen::Index k = 0; k < y.size(); ++k)
        y(k) = rimi_rng_normal(&rng);
      best[of_all] = null_score(libraries[c], *scanners[c], y);
      progress.add();
    });
    if (channels <= kAtOnce)
      *kept = std::move(libraries);
  }
  double mean = 0.0, squares = 0.0;
  for (const double score : best)
    mean += score / static_cast<double>(best.size());
  for (const double score : best)
    squares +=
        (score - mean) * (score - mean) / std::max(1.0, static_cast<double>(best.size()) - 1.0);
  Null null;
  null.channels = channels;
  null.spread = std::max(0.3, std::sqrt(6.0 * squares) / kPi);
  null.location = mean - kEuler * null.spread;
  return null;
}

} // namespace rim::diagnose
