// SPDX-License-Identifier: MIT
#include "train/calibrate_external.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/rng.h"
#include "image/threshold.h"
#include "stats/robust.hpp"
#include "train/external_table.hpp"
#include "train/healthy_runs.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim {

namespace {

Eigen::VectorXd column_of(const Log &log, const std::string &name) {
  const int c = find_column(log, name);
  if (c < 0)
    throw DataError(log.path + ": column '" + name + "' is missing");
  return log.values.col(c);
}

void set_ranges(FlightPlan *plan, const std::vector<ExternalRows> &logs) {
  const std::size_t features = plan->layout.features();
  plan->low.assign(features, 0.0F);
  plan->high.assign(features, 0.0F);
  for (std::size_t f = 0; f < features; ++f) {
    double low = 1e300, high = -1e300;
    for (const ExternalRows &log : logs) {
      low = std::min(low, log.context.col(static_cast<Eigen::Index>(f)).minCoeff());
      high = std::max(high, log.context.col(static_cast<Eigen::Index>(f)).maxCoeff());
    }
    const double margin = range_margin(low, high, 1e-3);
    plan->low[f] = static_cast<float>(low - margin);
    plan->high[f] = static_cast<float>(high + margin);
  }
}

// The best score of chance grows with the number of observations as its logarithm does; never as if
// there were fewer than a dozen, or the first one alone could alarm.
std::vector<float> growth() {
  std::vector<float> knots(32);
  for (std::size_t k = 0; k < knots.size(); ++k) {
    knots[k] = static_cast<float>(std::max(kLeastGrowth, static_cast<double>(k) * std::log(2.0)));
  }
  return knots;
}

} // namespace

ExternalRows external_rows(const Log &log, const Layout &layout) {
  ExternalRows rows;
  const auto n = static_cast<Eigen::Index>(log.t_s.size());
  rows.t_s = log.t_s;
  rows.context.resize(n, static_cast<Eigen::Index>(layout.features()));
  for (std::size_t f = 0; f < layout.features(); ++f) {
    rows.context.col(static_cast<Eigen::Index>(f)) = column_of(log, layout.feature_names[f]);
  }
  const auto outcomes = static_cast<Eigen::Index>(layout.outcomes());
  rows.outcome.resize(n, outcomes);
  rows.mean.resize(n, outcomes);
  rows.sd.resize(n, outcomes);
  for (Eigen::Index o = 0; o < outcomes; ++o) {
    const std::string &name = layout.outcome_names[static_cast<std::size_t>(o)]; // "z.NAME"
    rows.outcome.col(o) = column_of(log, name);
    rows.mean.col(o) = column_of(log, "m." + name.substr(2));
    const bool estimated = find_column(log, "sd." + name.substr(2)) < 0;
    rows.sd_estimated.push_back(estimated);
    if (!estimated) {
      rows.sd.col(o) = column_of(log, "sd." + name.substr(2));
      if (!(rows.sd.col(o).minCoeff() > 0.0)) {
        Eigen::Index bad = 0;
        rows.sd.col(o).minCoeff(&bad);
        throw DataError(log.path + ":row " +
                        std::to_string(log.row[static_cast<std::size_t>(bad)]) + ": column 'sd." +
                        name.substr(2) + "': a standard deviation must be above 0");
      }
      continue;
    }
    const Eigen::VectorXd residual = rows.outcome.col(o) - rows.mean.col(o);
    const double sd = mad_sd({residual.data(), residual.data() + residual.size()}, 0.0);
    if (!(sd > 0.0)) {
      throw DataError(log.path + ": column '" + name +
                      "': its standard deviation cannot be estimated: half of the residuals are 0; "
                      "give a column 'sd." +
                      name.substr(2) + "'");
    }
    rows.sd.col(o).setConstant(sd);
  }
  return rows;
}

void use_profile(FlightPlan *plan, bool flight, bool few_rows) {
  if (flight) {
    // Many features: which two is the question, so edges; few: which ellipse, so a finer grid.
    const bool wide = plan->layout.features() > kManyFeatures;
    plan->small = true;
    plan->scans = 4;
    plan->edges = wide ? 40 : 11;
    plan->moves = wide ? 46 : 42;
    plan->grid = 32;
    plan->ring = wide ? 392 : 368;
    plan->pairs = wide ? 2 : 4;
  } else if (plan->layout.external && few_rows) {
    plan->edges = 288;
    plan->moves = 600;
  }
}

void prepare_external(FlightPlan *plan, bool flight, std::size_t rows) {
  plan->region.resize(plan->layout.features());
  std::iota(plan->region.begin(), plan->region.end(), std::uint16_t{0});
  plan->block_rows = 1;
  plan->persistence = 1;
  plan->inhibit_s = 0.0;
  use_profile(plan, flight, rows <= kFewRows);
  plan->inverse_sd.assign(plan->channels(), 1.0F);
  plan->thresholds = Thresholds{};
  plan->thresholds.offset.assign(plan->channels(), 0.0F);
  plan->thresholds.scale.assign(plan->channels(), 1.0F);
  plan->thresholds.growth = growth();
}

std::vector<float> nominal_maxima(const FlightPlan &plan, const ExternalRows &log,
                                  std::uint64_t stream, const std::vector<std::size_t> &at) {
  Monitor monitor(make_image(plan), "calibration");
  rim_rng rng;
  rimi_rng_seed(&rng, plan.seed, stream);
  std::vector<double> z(static_cast<std::size_t>(log.mean.cols()));
  std::vector<float> maxima;
  double largest = -1e30;
  for (std::size_t t = 0; maxima.size() < at.size(); ++t) {
    const auto r = static_cast<Eigen::Index>(t);
    for (std::size_t o = 0; o < z.size(); ++o) {
      const auto i = static_cast<Eigen::Index>(o);
      z[o] = log.mean(r, i) + log.sd(r, i) * rimi_rng_normal(&rng);
    }
    const rim_observation row = {log.t_s[t], log.context.row(r).data(), z.data(),
                                 log.mean.row(r).data(), log.sd.row(r).data()};
    rim_verdict verdict;
    (void)rim_monitor_step(monitor.get(), &row, &verdict);
    if (verdict.valid)
      largest = std::max(largest, verdict.score);
    if (t + 1 == at[maxima.size()])
      maxima.push_back(static_cast<float>(largest));
  }
  return maxima;
}

namespace {

std::vector<float> drawn_maxima(const FlightPlan &plan, const std::vector<ExternalRows> &logs,
                                std::size_t runs) {
  std::vector<float> maxima(runs);
  Progress progress("calibrate", runs);
  parallel_for(runs, [&](std::size_t r) {
    const ExternalRows &log = logs[r % logs.size()];
    maxima[r] = nominal_maxima(plan, log, r + 1, {log.t_s.size()}).front();
    progress.add();
  });
  return maxima;
}

// As many of the table's quantiles as the promise needs.
std::vector<float> table_maxima(const FlightPlan &plan, std::size_t rows,
                                const CalibrationOptions &options) {
  constexpr double least = 199.0;
  const double wanted = std::ceil(1.0 / options.false_alarm - 1e-9) - 1.0;
  const double count = std::clamp(wanted, least, static_cast<double>(RIM_THRESHOLD_MAX_RUNS - 1));
  const ExternalSize size{plan.layout.features(), plan.layout.outcomes(), rows};
  return external_maxima(external_search(size.features, rows, options.flight), size,
                         static_cast<std::size_t>(count));
}

} // namespace

void calibrate_external(FlightPlan *plan, const std::vector<ExternalRows> &logs, std::size_t runs,
                        const CalibrationOptions &options) {
  if (logs.empty())
    throw DataError("no log to calibrate on");
  std::size_t rows = 0;
  for (const ExternalRows &log : logs)
    rows = std::max(rows, log.t_s.size());
  set_ranges(plan, logs);
  prepare_external(plan, options.flight, rows);
  set_alarm(&plan->thresholds,
            runs > 0 ? drawn_maxima(*plan, logs, runs) : table_maxima(*plan, rows, options),
            options);
}

} // namespace rim
