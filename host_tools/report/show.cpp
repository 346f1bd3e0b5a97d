// SPDX-License-Identifier: MIT
#include "report/show.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>

#include "diagnose/extension.hpp"
#include "image/facts.hpp"
#include "rim/image.h"
#include "stats/robust.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/json.hpp"
#include "util/table.hpp"

namespace rim {

namespace {

struct Draft {
  Json json;
  std::string text;

  operator Shown() const { return {json_text(json, 1) + "\n", text}; }
};

// "1 row", "2 rows"
std::string counted(std::size_t n, const std::string &what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

Draft begin(const char *kind, const std::string &path) {
  Draft shown;
  shown.json["kind"] = kind;
  shown.json["path"] = path;
  return shown;
}

// Of an object in a file; nothing where it has no such key or another type.
template <class T> T value_of(const Json &object, const char *key, T otherwise) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || found == object.end())
    return otherwise;
  try {
    return found->get<T>();
  } catch (const Json::exception &) {
    return otherwise;
  }
}

std::string role_text(const Layout &layout, std::size_t f) {
  const std::uint8_t bits = f < layout.command.size() ? layout.command[f] : 0;
  const auto &watched = layout.outcome_feature;
  const bool sensor = std::find(watched.begin(), watched.end(), f) != watched.end();
  std::string text = (bits & 1U) != 0 ? "command" : sensor ? "sensor" : "context";
  return text + ((bits & 6U) != 0 ? ", angle" : "");
}

Json image_json(const ImageFacts &facts) {
  Json features = Json::array(), outcomes = Json::array(), sections = Json::array();
  for (std::size_t f = 0; f < facts.layout.features(); ++f) {
    const bool region =
        std::find(facts.region.begin(), facts.region.end(), f) != facts.region.end();
    features.push_back({{"index", f},
                        {"name", facts.layout.feature_names[f]},
                        {"unit", facts.layout.feature_units[f]},
                        {"role", role_text(facts.layout, f)},
                        {"low", facts.low.at(f)},
                        {"high", facts.high.at(f)},
                        {"describes_regions", region}});
  }
  for (std::size_t o = 0; o < facts.layout.outcomes(); ++o)
    outcomes.push_back({{"index", o},
                        {"name", facts.layout.outcome_names[o]},
                        {"unit", facts.layout.outcome_units[o]}});
  for (const ImageSectionSize &section : facts.sections)
    sections.push_back({{"name", section.name}, {"bytes", section.bytes}});
  return {{"model_id", facts.model_id},
          {"version", fmt::format("{}.{}", facts.major, facts.minor)},
          {"own_predictions", facts.layout.external},
          {"period_s", facts.period_s},
          {"block_rows", facts.block_rows},
          {"stale_s", facts.stale_s},
          {"persistence_blocks", facts.persistence},
          {"calibration_runs", facts.runs},
          {"promised_rate", facts.promised_rate},
          {"alarm_score", facts.alarm_score},
          {"warn_score", facts.warn_score},
          {"features", features},
          {"outcomes", outcomes},
          {"sections", sections},
          {"bytes", facts.bytes},
          {"monitor_bytes", facts.monitor_bytes}};
}

std::string facts_text(const ImageFacts &facts) {
  std::string text =
      facts.period_s > 0.0
          ? fmt::format("Rows come at {:.4g} Hz. A block is {} rows ({:.3g} s). Without a usable "
                        "row for {:.3g} s the monitor is STALE.\n",
                        1.0 / facts.period_s, facts.block_rows, facts.block_rows * facts.period_s,
                        facts.stale_s)
          : std::string("Rows have no rate: each is an observation of its own.\n");
  text += fmt::format(
      "At most {:.3g} % of healthy runs raise any alarm ({}).\n", 100.0 * facts.promised_rate,
      facts.runs > 0 ? fmt::format("from {} runs", facts.runs) : std::string("from a table"));
  text += fmt::format("An alarm is raised at score {:.4g}, held for {}; below {:.4g} it ends.\n",
                      facts.alarm_score, counted(facts.persistence, "block"), facts.warn_score);
  if (facts.layout.external)
    text += "Every row brings its own predictions: for each outcome z. also m., and sd. where "
            "there is one.\n";
  return text;
}

std::string columns_text(const ImageFacts &facts) {
  Table features({{"", ""}, {"feature", ""}, {"unit", ""}, {"role", ""}, {"trained range", ""}});
  for (std::size_t f = 0; f < facts.layout.features(); ++f)
    features.add({cell(f), facts.layout.feature_names[f], facts.layout.feature_units[f],
                  role_text(facts.layout, f),
                  fmt::format("{:.4g} to {:.4g}", facts.low.at(f), facts.high.at(f))});
  Table outcomes({{"", ""}, {"outcome", ""}, {"unit", ""}});
  for (std::size_t o = 0; o < facts.layout.outcomes(); ++o)
    outcomes.add({cell(o), facts.layout.outcome_names[o], facts.layout.outcome_units[o]});
  Table sections({{"section", ""}, {"size", "bytes"}});
  for (const ImageSectionSize &section : facts.sections)
    sections.add({section.name, cell(section.bytes)});
  sections.add({"whole image", cell(facts.bytes)});
  sections.add({"RAM of one monitor", cell(facts.monitor_bytes)});
  return "\nA row, in this order:\n" + features.text() + "\nWatched:\n" + outcomes.text() + "\n" +
         sections.text();
}

bool is_alarm(const Json &record) {
  return record.is_object() && (record.contains("sentence") || record.contains("message"));
}

// Lines of JSON are records of alarms, or a log that has its time. Anything else is told of the
// former.
bool is_log_of_json(const std::string &text) {
  std::istringstream lines(text);
  std::string line;
  while (line.find_first_not_of(" \t\r") == std::string::npos && std::getline(lines, line)) {
  }
  const Json first = parse_json(line);
  return first.is_object() && first.contains("t_s") && !is_alarm(first);
}

} // namespace

FileKind kind_of_file(const std::string &path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored) && std::filesystem::exists(path, ignored))
    return FileKind::log; // a pipe can be read once; a folder may be a bag
  if (path == "-")
    return FileKind::log;
  const std::string text = read_file(path);
  if (text.rfind(RIM_IMAGE_MAGIC, 0) == 0)
    return FileKind::image;
  const std::string head = text.substr(0, 4096);
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && head[first] == '{') {
    if (head.find("rim-diagnosis/1") != std::string::npos)
      return FileKind::diagnosis;
    return is_log_of_json(text) ? FileKind::log : FileKind::alarms;
  }
  if (head.find("\"rim-extension/1\"") != std::string::npos)
    return FileKind::extension;
  if (head.find("\"rim-schema/1\"") != std::string::npos)
    throw DataError(path + ": is a schema, a text to be read in an editor; give it with --schema "
                           "beside a log");
  // No alarm was raised: the file is there, without a line.
  const bool jsonl = path.size() > 6 && path.compare(path.size() - 6, 6, ".jsonl") == 0;
  return jsonl ? FileKind::alarms : FileKind::log;
}

Shown show_image_bytes(const std::vector<std::uint8_t> &image, const std::string &name) {
  const ImageFacts facts = facts_of_image(image, name);
  Draft shown = begin("image", name);
  shown.json.update(image_json(facts));
  shown.text = fmt::format("{}: flight image {:08x}, {}, {}\n", name, facts.model_id,
                           counted(facts.layout.features(), "feature"),
                           counted(facts.layout.outcomes(), "outcome")) +
               facts_text(facts) + columns_text(facts);
  return shown;
}

Shown show_image(const std::string &path) {
  const std::string text = read_file(path);
  return show_image_bytes({text.begin(), text.end()}, path);
}

Shown show_alarms(const std::string &path) {
  std::istringstream file(read_file(path));
  Draft shown = begin("alarms", path);
  Json records = Json::array();
  std::size_t raised = 0, line_number = 0;
  for (std::string line; std::getline(file, line);) {
    ++line_number;
    if (line.find_first_not_of(" \t\r") == std::string::npos)
      continue;
    const Json record = parse_json(line);
    if (!is_alarm(record))
      throw DataError(fmt::format("{}:line {}: is no record of an alarm (rim replay --alarms, rim "
                                  "listen)",
                                  path, line_number));
    raised += value_of<std::string>(record, "state", "") == "raised";
    shown.text += fmt::format(
        "t = {:.2f} s: {} {}: {}\n", value_of(record, "t_s", 0.0),
        value_of<std::string>(record, "detector", ""),
        value_of<std::string>(record, "state", value_of<std::string>(record, "message", "")),
        value_of<std::string>(record, "sentence", ""));
    records.push_back(record);
  }
  shown.text =
      fmt::format("{}: {}, {} raised\n", path, counted(records.size(), "record"),
                           counted(raised, "alarm")) +
               shown.text;
  shown.json["raised"] = raised;
  shown.json["records"] = records;
  return shown;
}

Shown show_diagnosis(const std::string &path) {
  const Json file = parse_json(read_file(path));
  if (!file.is_object() || value_of<std::string>(file, "schema", "") != "rim-diagnosis/1")
    throw DataError(path + ": is no diagnosis (schema rim-diagnosis/1)");
  Draft shown = begin("diagnosis", path);
  shown.json.update(file);
  const Json findings = value_of(file, "findings", Json(Json::array()));
  shown.text = fmt::format("{}: the simulation is {}; {}\n", path,
                           value_of<std::string>(file, "verdict", "not judged"),
                           counted(findings.size(), "finding"));
  std::size_t number = 0;
  for (const Json &finding : findings)
    shown.text += fmt::format("{}. {}\n   ln anom {:.1f}, p {:.2g}\n", ++number,
                              value_of<std::string>(finding, "sentence", ""),
                              value_of(finding, "ln_anom", 0.0), value_of(finding, "p_value", 1.0));
  const Json gain = value_of(file, "gain", Json(Json::object()));
  const Json channels = value_of(gain, "channels", Json(Json::object()));
  Table table({{"outcome", ""}, {"RMSE before", ""}, {"RMSE after", ""}, {"ratio", ""}});
  for (const auto &[name, g] : channels.items())
    table.add({name, cell(value_of(g, "rmse_before", 0.0)), cell(value_of(g, "rmse_after", 0.0)),
               cell(value_of(g, "ratio", 1.0), 3)});
  if (!channels.empty())
    shown.text += "\n" + table.text();
  return shown;
}

Shown show_extension(const std::string &path) {
  Draft shown = begin("extension", path);
  Json terms = Json::array();
  for (const diagnose::Term &term : diagnose::read_extension(path)) {
    const std::string where = diagnose::gate_text(term.gate);
    const std::string what = diagnose::expression_text(term);
    Json sizes = Json::array();
    for (const auto *list : {&term.sizes, &term.shape})
      for (const diagnose::Parameter &p : *list)
        sizes.push_back(
            {{"name", p.name}, {"value", p.value}, {"stderr", p.stderror}, {"unit", p.unit}});
    terms.push_back({{"channel", term.channel},
                     {"cause", term.cause},
                     {"form", term.form},
                     {"expression", what},
                     {"where", where},
                     {"parameters", sizes}});
    shown.text += fmt::format("{}: {}: {}{}\n", term.channel, term.cause, what,
                              where.empty() ? "" : ", where " + where);
    for (const Json &p : sizes)
      shown.text +=
          fmt::format("  {} = {:.4g}{}{} (standard error {:.2g})\n", p["name"].get<std::string>(),
                      p["value"].get<double>(), p["unit"].get<std::string>().empty() ? "" : " ",
                      p["unit"].get<std::string>(), p["stderr"].get<double>());
  }
  shown.text = fmt::format("{}: {}\n", path, counted(terms.size(), "term")) + shown.text;
  shown.json["terms"] = terms;
  return shown;
}

Shown show_log(const Log &log) {
  Draft shown = begin("log", log.path);
  std::vector<double> periods;
  for (std::size_t t = 1; t < log.t_s.size(); ++t)
    periods.push_back(log.t_s[t] - log.t_s[t - 1]);
  const double period = periods.empty() ? 0.0 : median(periods);
  const auto gaps = static_cast<std::size_t>(std::count_if(
      periods.begin(), periods.end(), [period](double p) { return p > 1.5 * period; }));
  Json columns = Json::array();
  Table table({{"column", ""}, {"unit", ""}, {"least", ""}, {"median", ""}, {"most", ""}});
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    const auto column = log.values.col(static_cast<Eigen::Index>(c));
    std::vector<double> values(column.begin(), column.end());
    const double least = column.minCoeff(), most = column.maxCoeff();
    const double middle = median(std::move(values));
    table.add({log.columns[c].name, log.columns[c].unit, cell(least), cell(middle), cell(most)});
    columns.push_back({{"name", log.columns[c].name},
                       {"unit", log.columns[c].unit},
                       {"min", least},
                       {"median", middle},
                       {"max", most}});
  }
  shown.json["rows"] = log.rows_in_file;
  shown.json["rows_skipped"] = log.rows_skipped;
  shown.json["rows_left_out"] = log.rows_filtered;
  shown.json["begin_s"] = log.t_s.front();
  shown.json["end_s"] = log.t_s.back();
  shown.json["period_s"] = period;
  shown.json["gaps"] = gaps;
  shown.json["columns"] = columns;
  const double begin_s = log.t_s.front(), end_s = log.t_s.back();
  const std::string span =
      std::abs(end_s) < 1e6 ? fmt::format("t = {:.6g} to {:.6g} s", begin_s, end_s)
                            : fmt::format("{:.6g} s from t = {:.3f} s", end_s - begin_s, begin_s);
  shown.text = fmt::format("{}: {}, {} skipped, {} left out by the schema, {}, {:.4g} Hz, {}\n",
                           log.path, counted(log.rows_in_file, "row"), log.rows_skipped,
                           log.rows_filtered, span, period > 0.0 ? 1.0 / period : 0.0,
                           counted(gaps, "gap")) +
               table.text();
  return shown;
}

} // namespace rim
