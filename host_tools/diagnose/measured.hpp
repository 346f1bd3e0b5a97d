// SPDX-License-Identifier: MIT
// diagnose/measured.hpp - what was measured beside what was predicted: all logs of a diagnosis as
// one table.
//
// A row is one moment of one log. A channel is one outcome z.NAME with the simulation's own
// prediction m.NAME and its standard deviation sd.NAME (world/predictor.hpp makes them for logs
// that have none). Features are the context: x., u. and s. columns, and what the
// simulation itself predicts: m. columns that no other column gives already.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "log/log.hpp"

namespace rim::diagnose {

using Vector = Eigen::VectorXd;

struct Feature {
  std::string name; // with prefix: "s.speed_mps"
  std::string unit; // "m/s"; empty: none or not known
  bool is_command = false;
  bool is_angle = false;      // in radians or degrees and wrapped: steps of a turn occur, or could
  bool is_prediction = false; // m. column
};

// A whole turn in this unit of angles; 0 of any other unit.
double turn_in(const std::string &unit);

struct Channel {
  std::string name; // without prefix: "speed_mps"
  std::string unit;
  Vector z, m, sd;        // rows; sd > 0
  std::string velocity{}; // the feature that its friction acts on, where the user says it
  // Of velocities: 1: counts as the channel does, -1: against it; not here: it cannot be told.
  std::map<std::string, int> senses{};
  // By how much a healthy run of its own may be off, along each of a few effects, as one standard
  // deviation: rows x effects. None: not known.
  Eigen::MatrixXd run{};
  bool sd_estimated = false; // there was no sd. column: one value, from the residuals' own scatter
};

struct LogSpan {
  std::string path;
  std::size_t first = 0, rows = 0; // in the table
  std::uint32_t rows_in_file = 0;  // labels.csv has a line for every one of them
};

struct Measured {
  std::vector<LogSpan> logs;
  std::vector<double> t_s;        // as logged
  std::vector<double> elapsed_s;  // since the first row of its log
  std::vector<std::uint32_t> row; // data row in its file, from 1
  Eigen::MatrixXd x;              // rows x features
  std::vector<Feature> features;
  std::vector<Channel> channels;
  // Of a thinned table: the whole one, in which what is late or repeats is looked up, and its rows.
  std::shared_ptr<const Measured> whole;
  std::vector<Eigen::Index> picked;

  std::size_t rows() const { return t_s.size(); }
  int find_feature(const std::string &name) const; // -1: none
  int find_channel(const std::string &name) const;
};

// Every k-th row of each log, so that about `most` are left; few enough: as it is.
Measured thinned(const Measured &measured, std::size_t most);

// Features that never change teach a search nothing; terms found elsewhere may need them.
enum class Constants { leave_out, keep };

// Puts logs that carry z. m. (sd.) columns together. Throws DataError (file, column, reason): no z.
// column (the message says how a prediction is had: m. columns, --world or --model), columns that
// differ between logs, sd zero or negative (file, row, column). Features that never change are
// named in `constant`, and left out or kept as asked. O(rows x columns).
Measured make_measured(const std::vector<Log> &logs, Constants constants = Constants::leave_out,
                       std::vector<std::string> *constant = nullptr);

} // namespace rim::diagnose
