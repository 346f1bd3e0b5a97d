// SPDX-License-Identifier: MIT
// predict/columns.hpp - what the predictors share: columns by name, a log of predictions,
// a robust scatter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "log/log.hpp"

namespace rim::world {

// Index of a column; DataError "path: column 'name' is missing; world W needs REASON".
int needed_column(const Log &log, const std::string &name, const std::string &who);

// Of the windows that follow one another from the log's first row, the first from the i-th on that
// begins less than two steps before a row: a gap, which lasts years where a clock was set, is
// passed over at once. None where no row follows, or only one beyond what can be counted.
std::optional<std::size_t> next_window(const Log &log, std::size_t i, double step_s);

// Outcome columns z. m. sd. of one name.
struct OutcomeColumns {
  int z, m, sd;
};

// "run1.speed_mps": by how much a healthy run of its own may be off along the k-th of its effects
// (from 0), as one standard deviation, row by row; the runs' sizes are independent.
inline std::string run_column(std::size_t k, const std::string &outcome) {
  return "run" + std::to_string(k + 1) + "." + outcome;
}

// Collects rows of predictions.
class PredictionRows {
public:
  // run_effects: of every outcome, how many effects of the run it has; empty: none.
  PredictionRows(const Log &source, const std::vector<std::string> &features,
                 const std::vector<std::string> &outcomes,
                 const std::vector<std::size_t> &run_effects = {});
  // Values: features, then z m sd of every outcome, in the order of columns(), each followed by its
  // run's effects.
  void add(double t_s, std::uint32_t row, const std::vector<double> &values);
  std::size_t rows() const { return log_.t_s.size(); }
  Log finish() &&;

private:
  Log log_;
  std::vector<double> values_;
};

// Columns of an outcome in a log of predictions ("speed_mps"). DataError where one is missing.
OutcomeColumns outcome_columns(const Log &log, const std::string &name);

} // namespace rim::world
