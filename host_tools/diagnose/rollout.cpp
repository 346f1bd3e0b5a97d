// SPDX-License-Identifier: MIT
#include "diagnose/rollout.hpp"

#include <algorithm>
#include <cmath>

namespace rim::diagnose {

using Index = Eigen::Index;

namespace {

constexpr std::size_t kBlocks = 20;

// For every row the row one step later; -1 where there is none.
std::vector<Index> rows_one_step_later(const Log &log, double step_s) {
  std::vector<Index> later(log.t_s.size(), -1);
  std::size_t next = 0;
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    while (next < log.t_s.size() && log.t_s[next] < log.t_s[r] + (1.0 - 1e-3) * step_s)
      ++next;
    if (next < log.t_s.size() && log.t_s[next] < log.t_s[r] + (1.0 + 1e-3) * step_s)
      later[r] = static_cast<Index>(next);
  }
  return later;
}

Log rows_of(const Log &log, const std::vector<Index> &rows) {
  Log some;
  some.path = log.path;
  some.columns = log.columns;
  some.rows_in_file = log.rows_in_file;
  some.values = log.values(rows, Eigen::all);
  for (const Index row : rows) {
    some.t_s.push_back(log.t_s[static_cast<std::size_t>(row)]);
    some.row.push_back(log.row[static_cast<std::size_t>(row)]);
  }
  return some;
}

// The whole log's table with the values of `some` in its `rows`: delays look back into the others.
Measured table_with(const Measured &whole, const Log &some, const std::vector<Index> &rows) {
  Measured table = whole;
  for (std::size_t f = 0; f < table.features.size(); ++f) {
    const int column = find_column(some, table.features[f].name);
    if (column < 0)
      continue;
    for (std::size_t i = 0; i < rows.size(); ++i)
      table.x(rows[i], static_cast<Index>(f)) = some.values(static_cast<Index>(i), column);
  }
  for (Channel &channel : table.channels) {
    const int mean = find_column(some, "m." + channel.name);
    for (std::size_t i = 0; i < rows.size(); ++i)
      channel.m(rows[i]) = some.values(static_cast<Index>(i), mean);
  }
  return table;
}

// Predictions of all channels for `now`, which stands in `rows` of the log.
Matrix outcomes_of(const std::vector<Term> &terms, const Measured &whole, const Log &now,
                   const std::vector<Index> &rows) {
  const Measured table = table_with(whole, now, rows);
  Matrix outcome(static_cast<Index>(rows.size()), static_cast<Index>(table.channels.size()));
  for (std::size_t c = 0; c < table.channels.size(); ++c) {
    const auto predicted = extended_prediction(terms, table.channels[c], table);
    outcome.col(static_cast<Index>(c)) = predicted.m(rows);
  }
  return outcome;
}

// What one channel came to: without and with the terms, from the rows of the start.
void append_ends(const Measured &whole, std::size_t channel,
                 const std::vector<std::uint8_t> &inside, const std::vector<Index> &start,
                 const std::vector<Index> &at_horizon, const Matrix &ends, Judged *judged) {
  const std::size_t base =
      judged->unit.empty() ? 0 : 1 + *std::max_element(judged->unit.begin(), judged->unit.end());
  const Channel &held = whole.channels.at(channel);
  for (std::size_t i = 0; i < start.size(); ++i) {
    const auto k = static_cast<Index>(i);
    judged->z.push_back(held.z(at_horizon[i]));
    judged->before.push_back(ends(k, 0));
    judged->after.push_back(ends(k, 1));
    judged->sd_before.push_back(held.sd(at_horizon[i]));
    judged->sd_after.push_back(held.sd(at_horizon[i]));
    judged->inside.push_back(inside[static_cast<std::size_t>(start[i])]);
    judged->unit.push_back(base + static_cast<std::size_t>(start[i]) * kBlocks / whole.rows());
  }
}

} // namespace

bool append_rolled(const std::vector<Term> &terms, const Log &log, double horizon_s,
                   const world::Predictor &predictor, std::vector<Judged> *judged) {
  const Measured whole = make_measured({log}, Constants::keep);
  const auto steps =
      static_cast<std::size_t>(std::max(1L, std::lround(horizon_s / predictor.step_s())));
  const std::vector<Index> later = rows_one_step_later(log, predictor.step_s());
  std::vector<std::vector<Index>> rows(steps); // of every start, at every step
  for (Index start = 0; start < log.values.rows(); ++start) {
    std::vector<Index> chain{start};
    while (chain.size() < steps && later[static_cast<std::size_t>(chain.back())] >= 0)
      chain.push_back(later[static_cast<std::size_t>(chain.back())]);
    for (std::size_t k = 0; k < steps && chain.size() == steps; ++k)
      rows[k].push_back(chain[k]);
  }
  if (rows[0].empty())
    return true;
  Matrix end[2]; // without and with the terms
  for (int with = 0; with < 2; ++with) {
    const std::vector<Term> &used = with == 1 ? terms : std::vector<Term>{};
    Log now = rows_of(log, rows[0]);
    for (std::size_t k = 0;; ++k) {
      end[with] = outcomes_of(used, whole, now, rows[k]);
      if (k + 1 == steps)
        break;
      Log next = rows_of(log, rows[k + 1]);
      if (!predictor.advance(now, end[with], &next))
        return false;
      now = std::move(next);
    }
  }
  for (std::size_t c = 0; c < whole.channels.size(); ++c) {
    const Matrix ends = (Matrix(end[0].rows(), 2) << end[0].col(static_cast<Index>(c)),
                         end[1].col(static_cast<Index>(c)))
                            .finished();
    append_ends(whole, c, acting(terms, whole, whole.channels[c]), rows.front(), rows.back(), ends,
                &judged->at(c));
  }
  return true;
}

} // namespace rim::diagnose
