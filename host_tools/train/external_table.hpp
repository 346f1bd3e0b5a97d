// SPDX-License-Identifier: MIT
// The largest scores of runs in which predictions are right, computed once (`rim bench
// --external-table FILE` makes external_table_data.cpp): what an alarm threshold for a log with its
// own predictions is made of, without a simulation.
//
// Contexts are drawn uniformly over their range and independently: of all kinds tried (clustered,
// discrete, trajectories, heavy-tailed) they offer chance the most different regions, so that
// others alarm less often than promised. Knots are a few numbers of features, outcomes and rows;
// between them quantiles are linear in the logarithms of the three.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rim {

// The searches that use_profile() sets, one table each.
enum class ExternalSearch { thorough, standard, flight, flight_wide };
inline constexpr std::size_t kExternalSearches = 4;
ExternalSearch external_search(std::size_t features, std::size_t rows, bool flight);

struct ExternalSize {
  std::size_t features = 0, outcomes = 0, rows = 0;
};

// Knots of one search, ascending, and how many runs were drawn for each.
struct ExternalKnots {
  std::vector<std::size_t> features, outcomes, rows;
  std::size_t runs = 0;
};
const ExternalKnots &external_knots(ExternalSearch search);

// Chances of which the table holds the quantiles, ascending.
const std::vector<double> &external_levels();

// [features][outcomes][rows][levels] in the order of external_knots: the table's numbers.
const float *external_quantiles(ExternalSearch search);

// Score that a healthy run's largest stays below with at least this chance. Beyond the last level
// by the slowest fall that a likelihood ratio has; beyond the last knot as between the last two.
double external_quantile(ExternalSearch search, const ExternalSize &size, double chance);

// What `count` runs' largest scores would be: quantiles at 1 / (count + 1), ..., ascending.
std::vector<float> external_maxima(ExternalSearch search, const ExternalSize &size,
                                   std::size_t count);

// Largest scores of the runs of one number of features and outcomes, [rows][runs] in the order of
// at, each ascending. Stream r + 1 of a run depends on nothing else: at may be a part of the knots.
std::vector<std::vector<float>> draw_external(ExternalSearch search, std::size_t features,
                                              std::size_t outcomes,
                                              const std::vector<std::size_t> &at,
                                              std::size_t runs);

// The table's quantile: conformal and a standard error of the rank above, so that the promise also
// holds where chance drew too low.
float quantile_of(const std::vector<float> &ascending, double chance);

// Draws every knot (an hour of one core) and writes the table as a C++ file.
std::string make_external_table();

} // namespace rim
