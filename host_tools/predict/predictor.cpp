// SPDX-License-Identifier: MIT
#include "predict/predictor.hpp"

#include <algorithm>
#include <cmath>

#include "predict/columns.hpp"
#include "predict/falcon_fall.hpp"
#include "predict/lander_predict.hpp"
#include "predict/unicycle.hpp"
#include "util/error.hpp"

namespace rim::world {

std::unique_ptr<Predictor> make_world_predictor(const std::string &world) {
  if (world == "falcon")
    return std::make_unique<FalconFall>();
  if (world == "unicycle")
    return std::make_unique<Unicycle>();
  if (world == "lander")
    return std::make_unique<LanderPredictor>();
  throw UsageError("--world: unknown world '" + world + "' (lander, falcon, unicycle)");
}

int needed_column(const Log &log, const std::string &name, const std::string &who) {
  const int column = find_column(log, name);
  if (column < 0) {
    throw DataError(log.path + ": column '" + name + "' is missing; " + who +
                    " predicts from it (a schema can map another name to it)");
  }
  return column;
}

std::optional<std::size_t> next_window(const Log &log, std::size_t i, double step_s) {
  if (log.t_s.empty())
    return std::nullopt;
  constexpr double kMostWindows = 1e15;
  const double t_s = log.t_s.front() + static_cast<double>(i) * step_s;
  const auto row = std::lower_bound(log.t_s.begin(), log.t_s.end(), t_s);
  if (row == log.t_s.end())
    return std::nullopt;
  const double ahead = (*row - t_s) / step_s;
  if (!(ahead < kMostWindows))
    return std::nullopt;
  return ahead < 2.0 ? i : i + static_cast<std::size_t>(ahead) - 1;
}

PredictionRows::PredictionRows(const Log &source, const std::vector<std::string> &features,
                               const std::vector<std::string> &outcomes,
                               const std::vector<std::size_t> &run_effects) {
  log_.path = source.path;
  log_.rows_in_file = source.rows_in_file;
  log_.rows_skipped = source.rows_skipped;
  log_.rows_filtered = source.rows_filtered;
  log_.comments = source.comments;
  const auto add_column = [this](const std::string &name) {
    Column column{name, unit_of_name(name), Role::context};
    role_of_name(name, column.role);
    log_.columns.push_back(column);
  };
  for (const std::string &name : features)
    add_column(name);
  for (std::size_t o = 0; o < outcomes.size(); ++o) {
    for (const char *prefix : {"z.", "m.", "sd."})
      add_column(prefix + outcomes[o]);
    for (std::size_t k = 0; o < run_effects.size() && k < run_effects[o]; ++k)
      log_.columns.push_back({run_column(k, outcomes[o]), unit_of_name(outcomes[o]), Role::sd});
  }
}

void PredictionRows::add(double t_s, std::uint32_t row, const std::vector<double> &values) {
  if (values.size() != log_.columns.size())
    throw std::logic_error("PredictionRows: wrong number of values");
  log_.t_s.push_back(t_s);
  log_.row.push_back(row);
  values_.insert(values_.end(), values.begin(), values.end());
}

Log PredictionRows::finish() && {
  log_.values = Eigen::Map<const Matrix>(values_.data(), static_cast<Eigen::Index>(rows()),
                                         static_cast<Eigen::Index>(log_.columns.size()));
  return std::move(log_);
}

OutcomeColumns outcome_columns(const Log &log, const std::string &name) {
  return {needed_column(log, "z." + name, "a roll-out"),
          needed_column(log, "m." + name, "a roll-out"),
          needed_column(log, "sd." + name, "a roll-out")};
}

} // namespace rim::world
