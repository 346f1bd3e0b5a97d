// SPDX-License-Identifier: MIT
#include "diagnose/measured.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "predict/columns.hpp"
#include "stats/robust.hpp"
#include "util/error.hpp"

namespace rim::diagnose {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kSameAs = 0.99; // correlation of a prediction with a feature that stands for it

// Whether the column of an angle wraps: a step of nearly a turn, or a range of nearly one.
bool is_wrapped(const Eigen::VectorXd &x, double turn) {
  const double range = x.maxCoeff() - x.minCoeff();
  if (turn <= 0.0 || range > 1.008 * turn)
    return false;
  for (Eigen::Index i = 1; i < x.size(); ++i) {
    if (std::abs(x(i) - x(i - 1)) > 0.8 * turn)
      return true;
  }
  return range > 0.9 * turn;
}

double robust_sd(const Vector &r) {
  const std::vector<double> a(r.data(), r.data() + r.size());
  return mad_sd(a, median(a));
}

void check_same_columns(const Log &first, const Log &log) {
  for (const Column &column : first.columns) {
    if (find_column(log, column.name) < 0)
      throw DataError(
          fmt::format("{}: column '{}' is missing; {} has it", log.path, column.name, first.path));
  }
  for (const Column &column : log.columns) {
    if (find_column(first, column.name) < 0)
      throw DataError(
          fmt::format("{}: column '{}' is missing; {} has it", first.path, column.name, log.path));
  }
}

Vector gather(const std::vector<Log> &logs, const std::string &name) {
  Eigen::Index rows = 0;
  for (const Log &log : logs)
    rows += log.values.rows();
  Vector out(rows);
  Eigen::Index at = 0;
  for (const Log &log : logs) {
    out.segment(at, log.values.rows()) = log.values.col(find_column(log, name));
    at += log.values.rows();
  }
  return out;
}

void check_sd(const std::vector<Log> &logs, const std::string &name) {
  for (const Log &log : logs) {
    const auto sd = log.values.col(find_column(log, name));
    for (Eigen::Index i = 0; i < sd.size(); ++i) {
      if (!(sd(i) > 0.0))
        throw DataError(fmt::format("{}:row {}: column '{}': a standard deviation must be above 0, "
                                    "not {:g}",
                                    log.path, log.row[static_cast<std::size_t>(i)], name, sd(i)));
    }
  }
}

Channel make_channel(const std::vector<Log> &logs, const Column &outcome) {
  Channel channel;
  channel.name = outcome.name.substr(2);
  channel.unit = outcome.unit;
  channel.z = gather(logs, outcome.name);
  channel.m = gather(logs, "m." + channel.name);
  std::size_t effects = 0;
  while (find_column(logs.front(), world::run_column(effects, channel.name)) >= 0)
    ++effects;
  channel.run.resize(channel.z.size(), static_cast<Eigen::Index>(effects));
  for (std::size_t k = 0; k < effects; ++k)
    channel.run.col(static_cast<Eigen::Index>(k)) =
        gather(logs, world::run_column(k, channel.name));
  if (find_column(logs.front(), "sd." + channel.name) >= 0) {
    check_sd(logs, "sd." + channel.name);
    channel.sd = gather(logs, "sd." + channel.name);
    return channel;
  }
  const double sd = robust_sd(channel.z - channel.m);
  if (!(sd > 0.0))
    throw DataError(fmt::format("{}: column '{}': has no sd. column, and more than half of its "
                                "residuals are equal: no standard deviation can be estimated",
                                logs.front().path, outcome.name));
  channel.sd = Vector::Constant(channel.z.size(), sd);
  channel.sd_estimated = true;
  return channel;
}

double correlation(const Vector &a, const Vector &b) {
  const Vector da = a.array() - a.mean(), db = b.array() - b.mean();
  const double both = da.norm() * db.norm();
  return both > 0.0 ? std::abs(da.dot(db)) / both : 1.0;
}

// Where a simulation is wrong may depend on what it predicts. A prediction that a feature says
// already (a command that is followed at once, a state that hardly changes in a row) is none anew.
void add_predictions(bool all, Measured *table, std::vector<Vector> *columns) {
  for (const Channel &channel : table->channels) {
    const bool is_new = std::none_of(columns->begin(), columns->end(), [&](const Vector &x) {
      return correlation(x, channel.m) > kSameAs;
    });
    if (!all && (!is_new || !(channel.m.maxCoeff() > channel.m.minCoeff())))
      continue;
    table->features.push_back({"m." + channel.name, channel.unit, false, false, true});
    columns->push_back(channel.m);
  }
}

} // namespace

double turn_in(const std::string &unit) {
  return unit == "rad" ? kTwoPi : unit == "deg" || unit == "degrees" ? 360.0 : 0.0;
}

int Measured::find_feature(const std::string &name) const {
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (features[f].name == name)
      return static_cast<int>(f);
  }
  return -1;
}

int Measured::find_channel(const std::string &name) const {
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].name == name)
      return static_cast<int>(c);
  }
  return -1;
}

Measured thinned(const Measured &measured, std::size_t most) {
  const std::size_t stride = (measured.rows() + most - 1) / most;
  if (stride <= 1)
    return measured;
  Measured out;
  out.features = measured.features;
  out.whole = std::make_shared<const Measured>(measured);
  for (const LogSpan &log : measured.logs) {
    out.logs.push_back({log.path, out.picked.size(), 0, log.rows_in_file});
    for (std::size_t i = log.first; i < log.first + log.rows; i += stride) {
      out.logs.back().rows += 1;
      out.picked.push_back(static_cast<Eigen::Index>(i));
      out.t_s.push_back(measured.t_s[i]);
      out.elapsed_s.push_back(measured.elapsed_s[i]);
      out.row.push_back(measured.row[i]);
    }
  }
  out.x = measured.x(out.picked, Eigen::all);
  for (const Channel &channel : measured.channels) {
    Channel part = channel;
    part.z = channel.z(out.picked);
    part.m = channel.m(out.picked);
    part.sd = channel.sd(out.picked);
    part.run = channel.run(out.picked, Eigen::all);
    out.channels.push_back(std::move(part));
  }
  return out;
}

Measured make_measured(const std::vector<Log> &logs, Constants constants,
                       std::vector<std::string> *constant) {
  const bool keep_constant = constants == Constants::keep;
  if (logs.empty())
    throw DataError("no log given");
  Measured table;
  for (const Log &log : logs) {
    check_same_columns(logs.front(), log);
    if (log.t_s.empty())
      throw DataError(log.path + ": no row can be used");
    table.logs.push_back({log.path, table.t_s.size(), log.t_s.size(), log.rows_in_file});
    for (std::size_t i = 0; i < log.t_s.size(); ++i) {
      table.t_s.push_back(log.t_s[i]);
      table.elapsed_s.push_back(log.t_s[i] - log.t_s.front());
      table.row.push_back(log.row[i]);
    }
  }
  const Log &first = logs.front();
  if (role_columns(first, Role::outcome).empty())
    throw DataError(first.path + ": no z. column: a diagnosis needs predictions: m. columns beside "
                                 "z. columns in the log, or --world NAME, or --model IMAGE");
  for (const int c : role_columns(first, Role::outcome))
    table.channels.push_back(make_channel(logs, first.columns[static_cast<std::size_t>(c)]));
  std::vector<Vector> columns;
  for (const int c : feature_columns(first)) {
    const Column &column = first.columns[static_cast<std::size_t>(c)];
    Vector x = gather(logs, column.name);
    if (x.maxCoeff() - x.minCoeff() <= 1e-12 * std::max(1.0, x.cwiseAbs().maxCoeff())) {
      if (constant != nullptr)
        constant->push_back(column.name);
      if (!keep_constant)
        continue;
    }
    table.features.push_back({column.name, column.unit, column.role == Role::command,
                              is_wrapped(x, turn_in(column.unit))});
    columns.push_back(std::move(x));
  }
  add_predictions(keep_constant, &table, &columns);
  table.x.resize(static_cast<Eigen::Index>(table.rows()),
                 static_cast<Eigen::Index>(columns.size()));
  for (std::size_t f = 0; f < columns.size(); ++f)
    table.x.col(static_cast<Eigen::Index>(f)) = columns[f];
  return table;
}

} // namespace rim::diagnose
