// SPDX-License-Identifier: MIT
#include "report/outputs.hpp"

#include <cmath>

#include <fmt/format.h>

#include "diagnose/extension.hpp"
#include "log/labels.hpp"
#include "report/output_folder.hpp"
#include "util/json.hpp"
#include "util/version.hpp"

namespace rim::diagnose {

namespace {

// JSON has no NaN or infinity: null says that there is no number.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json numbers(const std::vector<double> &values) {
  Json list = Json::array();
  for (const double value : values)
    list.push_back(number(value));
  return list;
}

Json interval(const Interval95 &i) { return {number(i.low), number(i.high)}; }

const char *kind_name(TermKind kind) {
  switch (kind) {
  case TermKind::mean:
    return "mean";
  case TermKind::variance:
    return "variance";
  case TermKind::stuck:
    return "stuck";
  case TermKind::dropout:
    return "dropout";
  }
  return "";
}

// Sizes, then shape parameters; a name that comes twice is numbered.
Json parameters_json(const Term &term) {
  Json all = Json::object();
  const auto add = [&all](const Parameter &p) {
    std::string name = p.name;
    for (int i = 2; all.contains(name); ++i)
      name = p.name + "_" + std::to_string(i);
    all[name] = {{"value", number(p.value)},
                 {"stderr", number(p.stderror)},
                 {"unit", p.unit},
                 {"between_logs_sd", number(p.between_logs_sd)},
                 {"per_log", numbers(p.per_log)}};
    if (!p.per_log.empty())
      all[name]["new_log"] = number(p.new_log);
    if (p.unrefined != 0.0)
      all[name]["unrefined"] = number(p.unrefined);
    if (p.near_rest != 0.0)
      all[name]["near_rest"] = number(p.near_rest);
  };
  for (const Parameter &p : term.sizes)
    add(p);
  for (const Parameter &p : term.shape)
    add(p);
  return all;
}

// An ungated term: every list empty.
Json region_json(const Gate &gate) {
  const std::size_t dims = gate.features.size();
  Json shape = Json::array(), bounds = Json::array(), open = Json::array();
  for (std::size_t i = 0; i < dims; ++i) {
    Json row = Json::array();
    for (std::size_t j = 0; j < dims && gate.inverse_shape.size() == dims * dims; ++j)
      row.push_back(number(gate.inverse_shape[i * dims + j]));
    shape.push_back(row);
    bounds.push_back({number(gate.lower.at(i)), number(gate.upper.at(i))});
    open.push_back({gate.is_open(i, false), gate.is_open(i, true)});
  }
  return {{"features", gate.features},
          {"units", gate.units},
          {"center", numbers(gate.center)},
          {"inverse_shape", shape},
          {"bounds", bounds},
          {"open", open},
          {"shape", gate.everywhere() ? "everywhere" : (gate.is_ellipse ? "ellipse" : "box")}};
}

Json form_json(const Term &term) {
  Json response = Json::object(), ridges = Json::array();
  for (const Ridge &ridge : term.ridges)
    ridges.push_back({{"weights", ridge.weights},
                      {"knots", numbers(ridge.knots)},
                      {"values", numbers(ridge.values)}});
  for (const auto &[product, coefficient] : term.response)
    response[product] = number(coefficient);
  return {{"name", term.form},
          {"kind", kind_name(term.kind)},
          {"basis", term.basis},
          {"arguments", term.arguments},
          {"knots", numbers(term.knots)},
          {"values", numbers(term.values)},
          {"response", response},
          {"ridges", ridges}};
}

Json finding_json(const Finding &finding) {
  Json alternatives = Json::array();
  for (const Alternative &a : finding.alternatives) {
    alternatives.push_back({{"cause", a.cause},
                            {"delta_bic", number(a.delta_bic)},
                            {"heldout_r2", number(a.heldout_r2)},
                            {"expression", a.expression}});
  }
  Json learnt = Json::array();
  for (const Learnt &range : finding.learnt)
    learnt.push_back({{"feature", range.feature},
                      {"unit", range.unit},
                      {"range", {number(range.low), number(range.high)}},
                      {"heldout_beyond", number(range.beyond)}});
  std::size_t acting = 0;
  for (const std::uint8_t acts : finding.acts)
    acting += acts != 0;
  return {{"channel", finding.term.channel},
          {"cause", finding.term.cause},
          {"sentence", finding.sentence},
          {"expression", expression_text(finding.term)},
          {"parameters", parameters_json(finding.term)},
          {"region", region_json(finding.term.gate)},
          {"inside_fraction", number(finding.inside_fraction)},
          {"ln_anom", number(finding.ln_anom)},
          {"p_value", number(finding.p_value)},
          {"alternatives", alternatives},
          {"separable", finding.separable},
          {"learnt", learnt},
          {"number", finding.number},
          {"heldout_r2", number(finding.heldout_r2)},
          {"rows_acting", acting},
          {"given", finding.given},
          {"form", form_json(finding.term)}};
}

Json residual_region_json(const ResidualRegion &r) {
  return {{"channel", r.channel},
          {"region", region_json(r.gate)},
          {"shift_sd", number(r.shift_sd)},
          {"ln_anom", number(r.ln_anom)},
          {"rows", r.rows},
          {"text", gate_text(r.gate)}};
}

Json gain_json(const Gain &g) {
  return {{"rmse_before", number(g.rmse_before)},
          {"rmse_after", number(g.rmse_after)},
          {"nll_before", number(g.nll_before)},
          {"nll_after", number(g.nll_after)},
          {"ratio", number(g.ratio)},
          {"ratio_ci95", interval(g.ratio_ci95)},
          {"unit", g.unit},
          {"data", g.data},
          {"rows", g.rows},
          {"mpa_before", number(g.mpa_before)},
          {"mpa_after", number(g.mpa_after)},
          {"nll_gain_ci95", interval(g.nll_gain_ci95)},
          {"worse", g.worse}};
}

// By channel the one-step gain over all rows, of logs held out where there are such; beside it the
// table of every set of rows and horizon.
Json gains_json(const std::vector<Gain> &gains) {
  Json channels = Json::object(), table = Json::array();
  for (const Gain &g : gains) {
    Json row = {{"channel", g.channel}, {"where", g.where}, {"horizon_s", number(g.horizon_s)}};
    row.update(gain_json(g));
    table.push_back(row);
    if (g.where != "all" || g.horizon_s > 0.0)
      continue;
    if (!channels.contains(g.channel) || g.data == "held-out logs")
      channels[g.channel] = gain_json(g);
  }
  return {{"channels", channels}, {"table", table}};
}

Json channels_json(const Diagnosis &diagnosis, const Measured &measured) {
  Json list = Json::array();
  for (const ChannelState &state : diagnosis.channels) {
    const int index = measured.find_channel(state.channel);
    const Channel *channel =
        index < 0 ? nullptr : &measured.channels[static_cast<std::size_t>(index)];
    list.push_back({{"name", state.channel},
                    {"unit", channel != nullptr ? channel->unit : ""},
                    {"sd_estimated", channel != nullptr && channel->sd_estimated},
                    {"autocorrelation", number(state.autocorrelation)},
                    {"scale", number(state.scale)},
                    {"threshold", number(state.threshold)},
                    {"rows_flagged", state.rows_flagged}});
  }
  return list;
}

std::uint32_t label_of(const Diagnosis &diagnosis, std::size_t row) {
  for (const Finding &finding : diagnosis.findings) {
    if (row < finding.acts.size() && finding.acts[row] != 0)
      return static_cast<std::uint32_t>(finding.number);
  }
  return 0;
}

} // namespace

std::string diagnosis_json(const Diagnosis &diagnosis, const Measured &measured) {
  Json findings = Json::array(), logs = Json::array(), regions = Json::array(),
       unconfirmed = Json::array();
  for (const Finding &seen : diagnosis.unconfirmed)
    unconfirmed.push_back({{"channel", seen.term.channel},
                           {"cause", seen.term.cause},
                           {"sentence", seen.sentence},
                           {"expression", expression_text(seen.term)},
                           {"region", region_json(seen.term.gate)}});
  for (const Finding &finding : diagnosis.findings)
    findings.push_back(finding_json(finding));
  for (const ResidualRegion &region : diagnosis.regions)
    regions.push_back(residual_region_json(region));
  for (const LogSpan &log : measured.logs)
    logs.push_back({{"path", log.path}, {"rows", log.rows_in_file}, {"rows_used", log.rows}});
  const Json all = {{"schema", "rim-diagnosis/1"},
                    {"verdict", diagnosis.adequate() ? "adequate" : "inadequate"},
                    {"sentence", diagnosis.sentence},
                    {"findings", findings},
                    {"unconfirmed", unconfirmed},
                    {"regions", regions},
                    {"gain", gains_json(diagnosis.gains)},
                    {"channels", channels_json(diagnosis, measured)},
                    {"notes", diagnosis.notes},
                    {"model", diagnosis.model},
                    {"logs", logs},
                    {"version", RIM_VERSION},
                    {"seed", diagnosis.seed},
                    {"command", diagnosis.command}};
  // Bytes that are no UTF-8 (a path may hold any) become U+FFFD.
  return json_text(all, 2, true) + "\n";
}

std::string labels_csv(const Diagnosis &diagnosis, const Measured &measured) {
  std::string text = labels_header();
  for (const LogSpan &log : measured.logs) {
    LabelledLog labels{log.path, std::vector<double>(log.rows_in_file, std::nan("")),
                       std::vector<std::uint32_t>(log.rows_in_file, 0)};
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const std::uint32_t row = measured.row[i];
      if (row < 1 || row > log.rows_in_file)
        continue;
      labels.t_s[row - 1] = measured.t_s[i];
      labels.finding[row - 1] = label_of(diagnosis, i);
    }
    text += labels_text(labels);
  }
  return text;
}

void write_outputs(const Diagnosis &diagnosis, const Measured &measured,
                   const std::string &folder) {
  std::vector<Term> terms;
  for (const Finding &finding : diagnosis.findings)
    terms.push_back(finding.term);
  const std::string made_by = fmt::format("rim diagnose, rimwatch {}, seed {}\n{}", RIM_VERSION,
                                          diagnosis.seed, diagnosis.command);
  // Everything is made before the disk is touched.
  write_output_folder({{"diagnosis.json", diagnosis_json(diagnosis, measured)},
                       {"labels.csv", labels_csv(diagnosis, measured)},
                       {"extension.toml", extension_toml(terms, made_by)},
                       {"report.html", report_html(diagnosis, measured)}},
                      folder);
}

} // namespace rim::diagnose
