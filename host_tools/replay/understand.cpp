// SPDX-License-Identifier: MIT
#include "replay/understand.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "util/table.hpp"

namespace rim {

namespace {

std::vector<std::string> needed_columns(const Layout &layout) {
  std::vector<std::string> names = layout.feature_names;
  if (layout.external) {
    for (const std::string &outcome : layout.outcome_names) {
      names.push_back(outcome);
      names.push_back("m." + outcome.substr(2));
    }
  }
  return names;
}

ComparedColumn compare(const Log &log, int column, const ImageFacts &facts, std::size_t feature) {
  ComparedColumn c;
  c.name = facts.layout.feature_names[feature];
  c.unit = facts.layout.feature_units[feature];
  const auto values = log.values.col(column);
  c.low = values.minCoeff();
  c.high = values.maxCoeff();
  c.trained_low = facts.low[feature];
  c.trained_high = facts.high[feature];
  const double margin = range_margin(facts, feature);
  std::size_t outside = 0;
  for (Eigen::Index t = 0; t < values.size(); ++t)
    outside += values(t) < c.trained_low - margin || values(t) > c.trained_high + margin;
  c.outside = static_cast<double>(outside) / static_cast<double>(values.size());
  return c;
}

std::string listed(const std::vector<std::string> &names) {
  std::string text;
  for (const std::string &name : names)
    text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

} // namespace

Understanding understand(Replayer *replayer, const ImageFacts &facts, const Log &log) {
  Understanding u;
  const std::vector<std::string> needed = needed_columns(facts.layout);
  for (const std::string &name : needed)
    if (find_column(log, name) < 0)
      u.missing.push_back(name);
  for (const int c : feature_columns(log)) {
    const std::string &name = log.columns[static_cast<std::size_t>(c)].name;
    if (std::find(needed.begin(), needed.end(), name) == needed.end())
      u.unused.push_back(name);
  }
  for (std::size_t f = 0; f < facts.layout.features() && f < facts.low.size(); ++f)
    if (const int c = find_column(log, facts.layout.feature_names[f]); c >= 0)
      u.columns.push_back(compare(log, c, facts, f));
  if (!u.missing.empty()) {
    u.why_not = "column " + listed(u.missing) + " is missing; the model needs it";
    return u;
  }
  u.replayed = replayer->replay(log, ReplayOptions());
  u.why_not = doubt(u.replayed, replayer->names());
  return u;
}

std::string understanding_text(const Understanding &u, const Log &log, bool all) {
  std::string text = log.path + ": ";
  if (u.why_not.empty())
    text += fmt::format("understood: {} of {} rows used, {} gaps, {} blocks examined",
                        u.replayed.health.rows.rows_used, log.rows_in_file,
                        u.replayed.health.rows.gaps, u.replayed.blocks);
  else
    text += u.why_not;
  text += "\n";
  if (u.missing.empty() && log.rows_skipped > 0)
    text +=
        fmt::format("  {} rows skipped for a missing or infinite value, or a time that does not "
                    "increase\n",
                    log.rows_skipped);
  if (!u.unused.empty())
    text += "  not used, since the model does not know them: " + listed(u.unused) + "\n";
  Table table({{"column", ""},
               {"unit", ""},
               {"in the log", ""},
               {"as trained", ""},
               {"out of range", "% of rows"}});
  bool any = false;
  for (const ComparedColumn &c : u.columns) {
    if (!all && !(c.outside > 0.0))
      continue;
    any = true;
    table.add({c.name, c.unit, fmt::format("{:.4g} to {:.4g}", c.low, c.high),
               fmt::format("{:.4g} to {:.4g}", c.trained_low, c.trained_high),
               cell(100.0 * c.outside, 3)});
  }
  return any ? text + table.text() : text;
}

} // namespace rim
