// SPDX-License-Identifier: MIT
#include "train/external_table.hpp"

#include <algorithm>
#include <cmath>

#include "train/calibrate_external.hpp"

namespace rim {

namespace {

// A position among ascending knots: between `low` and `low + 1`, by `weight` towards the upper.
struct Place {
  std::size_t low = 0;
  double weight = 0.0;
};

// Below the first knot the first; above the last on as between the last two.
Place place_in(const std::vector<std::size_t> &knots, std::size_t value) {
  Place place;
  if (knots.size() < 2 || value <= knots.front())
    return place;
  const auto above = std::upper_bound(knots.begin(), knots.end() - 1, value) - knots.begin();
  place.low = static_cast<std::size_t>(above) - 1;
  const double low = std::log(static_cast<double>(knots[place.low]));
  const double high = std::log(static_cast<double>(knots[place.low + 1]));
  place.weight = (std::log(static_cast<double>(value)) - low) / (high - low);
  return place;
}

// -ln(-ln p): in it the quantiles of a largest of many lie on a line.
double reduced(double chance) {
  return -std::log(-std::log(chance));
}

// All levels at one size.
std::vector<double> quantiles_at(ExternalSearch search, const ExternalSize &size) {
  const ExternalKnots &knots = external_knots(search);
  const std::size_t levels = external_levels().size();
  const float *table = external_quantiles(search);
  const Place place[3] = {place_in(knots.features, size.features),
                          place_in(knots.outcomes, size.outcomes),
                          place_in(knots.rows, size.rows)};
  const std::size_t count[3] = {knots.features.size(), knots.outcomes.size(), knots.rows.size()};
  std::vector<double> out(levels, 0.0);
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::size_t at = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const bool upper = (corner >> k & 1u) != 0;
      weight *= upper ? place[k].weight : 1.0 - place[k].weight;
      at = at * count[k] + std::min(place[k].low + (upper ? 1 : 0), count[k] - 1);
    }
    for (std::size_t l = 0; l < levels; ++l)
      out[l] += weight * static_cast<double>(table[at * levels + l]);
  }
  for (std::size_t l = 1; l < levels; ++l) // extrapolated ones might cross
    out[l] = std::max(out[l], out[l - 1]);
  return out;
}

double between_levels(const std::vector<double> &quantile, double chance) {
  const std::vector<double> &levels = external_levels();
  const double y = reduced(chance);
  // Beyond the last: ln anom falls off as exp(-x), the score is ln anom over kLeastGrowth or more.
  if (chance >= levels.back())
    return quantile.back() + (y - reduced(levels.back())) / kLeastGrowth;
  const auto above = std::upper_bound(levels.begin() + 1, levels.end() - 1, chance);
  const auto high = static_cast<std::size_t>(above - levels.begin());
  const double from = reduced(levels[high - 1]), to = reduced(levels[high]);
  const double slope = (quantile[high] - quantile[high - 1]) / (to - from);
  return std::max(0.0, quantile[high - 1] + slope * (y - from));
}

} // namespace

ExternalSearch external_search(std::size_t features, std::size_t rows, bool flight) {
  if (flight)
    return features > kManyFeatures ? ExternalSearch::flight_wide : ExternalSearch::flight;
  return rows <= kFewRows ? ExternalSearch::thorough : ExternalSearch::standard;
}

const std::vector<double> &external_levels() {
  static const std::vector<double> levels{0.05, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98, 0.99};
  return levels;
}

const ExternalKnots &external_knots(ExternalSearch search) {
  static const ExternalKnots knots[kExternalSearches] = {
      {{1, 2, 10, 32, 128}, {1, 8, 64}, {32, 128, 512, 1536}, 200},
      {{1, 2, 10, 128}, {1, 8, 64}, {2048, 4096}, 200},
      {{1, 2, 10, kManyFeatures}, {1, 8, 64}, {32, 128, 512, 2048}, 300},
      {{kManyFeatures + 1, 128}, {1, 8, 64}, {32, 128, 512, 2048}, 300}};
  return knots[static_cast<std::size_t>(search)];
}

double external_quantile(ExternalSearch search, const ExternalSize &size, double chance) {
  return between_levels(quantiles_at(search, size), chance);
}

std::vector<float> external_maxima(ExternalSearch search, const ExternalSize &size,
                                   std::size_t count) {
  const std::vector<double> quantile = quantiles_at(search, size);
  std::vector<float> maxima(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double chance = static_cast<double>(i + 1) / static_cast<double>(count + 1);
    maxima[i] = static_cast<float>(between_levels(quantile, chance));
  }
  return maxima;
}

} // namespace rim
