// SPDX-License-Identifier: MIT
// predict/columns.hpp - what the predictors share: columns by name, a log of predictions,
// a robust scatter.
#pragma once

#include <string>
#include <vector>

#include "log/log.hpp"

namespace rim::world {

// Index of a column; DataError "path: column 'name' is missing; world W needs REASON".
int needed_column(const Log &log, const std::string &name, const std::string &who);

// Outcome columns z. m. sd. of one name.
struct OutcomeColumns {
  int z, m, sd;
};

// Collects rows of predictions.
class PredictionRows {
public:
  PredictionRows(const Log &source, const std::vector<std::string> &features,
                 const std::vector<std::string> &outcomes);
  // Values: features, then z m sd of every outcome, in the order of columns().
  void add(double t_s, std::uint32_t row, const std::vector<double> &values);
  std::size_t rows() const { return log_.t_s.size(); }
  Log finish() &&;

private:
  Log log_;
  std::vector<double> values_;
};

// Columns of an outcome in a log of predictions ("speed_mps"). DataError where one is missing.
OutcomeColumns outcome_columns(const Log &log, const std::string &name);

// Median of the absolute values over that of a standard normal variable; 0 for none.
double robust_sd(std::vector<double> values);

} // namespace rim::world
