// SPDX-License-Identifier: MIT
// The program that computes external_table_data.cpp.
#include "train/external_table.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "base/rng.h"
#include "train/calibrate_external.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim {

namespace {

constexpr const char *kNames[kExternalSearches] = {"thorough", "standard", "flight",
                                                   "flight_wide"};
constexpr std::uint64_t kContextSeed = 4207; // of contexts; outcomes have the plan's

FlightPlan uniform_plan(ExternalSearch search, std::size_t features, std::size_t outcomes) {
  FlightPlan plan;
  plan.layout.external = true;
  for (std::size_t f = 0; f < features; ++f)
    plan.layout.feature_names.push_back(fmt::format("x.{}", f));
  for (std::size_t o = 0; o < outcomes; ++o)
    plan.layout.outcome_names.push_back(fmt::format("z.{}", o));
  plan.layout.feature_units.resize(features);
  plan.layout.outcome_units.resize(outcomes);
  plan.layout.command.assign(features, 0);
  const bool flight =
      search == ExternalSearch::flight || search == ExternalSearch::flight_wide;
  prepare_external(&plan, flight, search == ExternalSearch::thorough ? kFewRows : kFewRows + 1);
  plan.low.assign(features, 0.0F);
  plan.high.assign(features, 1.0F);
  return plan;
}

ExternalRows uniform_rows(std::size_t features, std::size_t outcomes, std::size_t rows,
                          std::uint64_t stream) {
  ExternalRows log;
  const auto n = static_cast<Eigen::Index>(rows);
  log.context.resize(n, static_cast<Eigen::Index>(features));
  log.mean = Matrix::Zero(n, static_cast<Eigen::Index>(outcomes));
  log.sd = Matrix::Ones(n, static_cast<Eigen::Index>(outcomes));
  rim_rng rng;
  rimi_rng_seed(&rng, kContextSeed, stream);
  for (Eigen::Index t = 0; t < n; ++t) { // by rows: a shorter run is the beginning of a longer one
    log.t_s.push_back(static_cast<double>(t));
    for (Eigen::Index f = 0; f < log.context.cols(); ++f)
      log.context(t, f) = rimi_rng_uniform(&rng);
  }
  return log;
}

std::string table_text(ExternalSearch search, const std::vector<float> &table) {
  std::string text = fmt::format("const float k_{}[] = {{\n", kNames[static_cast<int>(search)]);
  const std::size_t levels = external_levels().size();
  for (std::size_t i = 0; i < table.size(); ++i) {
    text += fmt::format("{}{:.3f}F,", i % levels == 0 ? "    " : " ",
                        static_cast<double>(table[i]));
    if (i % levels == levels - 1)
      text += "\n";
  }
  return text + "};\n\n";
}

std::string made_table(ExternalSearch search, Progress *progress) {
  const ExternalKnots &knots = external_knots(search);
  std::vector<float> table;
  for (const std::size_t features : knots.features) {
    for (const std::size_t outcomes : knots.outcomes) {
      for (const auto &scores : draw_external(search, features, outcomes, knots.rows, knots.runs)) {
        for (const double level : external_levels())
          table.push_back(quantile_of(scores, level));
      }
      progress->add();
    }
  }
  return table_text(search, table);
}

} // namespace

std::vector<std::vector<float>> draw_external(ExternalSearch search, std::size_t features,
                                              std::size_t outcomes,
                                              const std::vector<std::size_t> &at,
                                              std::size_t runs) {
  const FlightPlan plan = uniform_plan(search, features, outcomes);
  std::vector<std::vector<float>> by_run(runs);
  parallel_for(runs, [&](std::size_t r) {
    by_run[r] =
        nominal_maxima(plan, uniform_rows(features, outcomes, at.back(), r + 1), r + 1, at);
  });
  std::vector<std::vector<float>> out(at.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    for (const std::vector<float> &run : by_run)
      out[k].push_back(run[k]);
    std::sort(out[k].begin(), out[k].end());
  }
  return out;
}

float quantile_of(const std::vector<float> &ascending, double chance) {
  const auto n = static_cast<double>(ascending.size());
  const double rank = std::ceil((n + 1.0) * chance + std::sqrt(n * chance * (1.0 - chance)));
  return ascending[static_cast<std::size_t>(std::clamp(rank, 1.0, n)) - 1];
}

std::string make_external_table() {
  std::size_t cells = 0;
  for (std::size_t s = 0; s < kExternalSearches; ++s) {
    const ExternalKnots &knots = external_knots(static_cast<ExternalSearch>(s));
    cells += knots.features.size() * knots.outcomes.size();
  }
  Progress progress("table", cells);
  std::string text = "// SPDX-License-Identifier: MIT\n"
                     "// Made by `rim bench --external-table "
                     "host_tools/train/external_table_data.cpp`: do not edit.\n"
                     "#include \"train/external_table.hpp\"\n\nnamespace rim {\n\nnamespace {\n\n"
                     "// A line a size: quantiles at the levels of external_levels().\n";
  std::string cases;
  for (std::size_t s = 0; s < kExternalSearches; ++s) {
    text += made_table(static_cast<ExternalSearch>(s), &progress);
    cases += fmt::format("{}k_{}", s == 0 ? "" : ", ", kNames[s]);
  }
  return text + "const float *const kTables[kExternalSearches] = {" + cases +
         "};\n\n} // namespace\n\nconst float *external_quantiles(ExternalSearch search) {\n"
         "  return kTables[static_cast<std::size_t>(search)];\n}\n\n} // namespace rim\n";
}

} // namespace rim
