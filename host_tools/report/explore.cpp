// SPDX-License-Identifier: MIT
#include "report/explore.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "util/atomic_file.hpp"
#include "util/json.hpp"

namespace rim::report {

namespace {

constexpr std::size_t kMostBytes = 2600000; // of numbers; base64 adds a third

// The program, as the makefile wraps it.
constexpr const char *kTools =
#include "explore_tools_js.inc"
    ;
constexpr const char *kProgram =
#include "explore_js.inc"
    ;

std::string base64(const std::string &bytes) {
  constexpr const char *digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(4 * (bytes.size() / 3 + 1));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t some = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < some ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= some ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

// Every k-th value as float32, little-endian as every browser has it.
std::string packed(const std::vector<double> &values, const std::vector<std::size_t> &rows) {
  std::string bytes;
  for (const std::size_t row : rows) {
    const auto value = static_cast<float>(values[row]);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    for (int shift = 0; shift < 32; shift += 8)
      bytes += static_cast<char>(bits >> shift & 0xffu);
  }
  return base64(bytes);
}

std::string packed(const std::vector<std::uint16_t> &values, const std::vector<std::size_t> &rows) {
  std::string bytes;
  for (const std::size_t row : rows) {
    bytes += static_cast<char>(values[row] & 0xffu);
    bytes += static_cast<char>(values[row] >> 8);
  }
  return base64(bytes);
}

// So that no text of the data can end the script element.
std::string for_script(std::string text) {
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; at += 6)
    text.replace(at, 1, "\\u003c");
  return text;
}

Json logs_json(const Explore &data, std::size_t every, std::vector<std::size_t> *rows) {
  Json logs = Json::array();
  for (const ExploreLog &log : data.logs) {
    const std::size_t first = rows->size();
    for (std::size_t r = log.first; r < log.first + log.rows; r += every)
      rows->push_back(r);
    logs.push_back({{"name", log.name}, {"first", first}, {"rows", rows->size() - first}});
  }
  return logs;
}

Json finding_json(const ExploreFinding &f) {
  Json one = {{"number", f.number},
              {"text", f.text},
              {"log", f.log},
              {"channel", f.channel},
              {"bit", f.bit}};
  const ExploreRegion &r = f.region;
  if (!r.features.empty())
    one["region"] = {{"features", r.features}, {"lower", r.lower},
                     {"upper", r.upper},       {"open", r.open},
                     {"center", r.center},     {"inverse_shape", r.inverse_shape},
                     {"ellipse", r.is_ellipse}};
  return one;
}

std::string data_json(const Explore &data, std::size_t every) {
  std::vector<std::size_t> rows;
  Json json = {{"kind", data.is_replay ? "replay" : "diagnosis"},
               {"every", every},
               {"log", data.first_log},
               {"channel", data.first_channel}};
  json["logs"] = logs_json(data, every, &rows);
  json["time"] = packed(data.time, rows);
  json["acts"] = packed(data.acts, rows);
  json["channels"] = Json::array();
  for (const ExploreChannel &c : data.channels) {
    Json one = {{"name", c.name},
                {"unit", c.unit},
                {"key", c.key},
                {"z", packed(c.z, rows)},
                {"m", packed(c.m, rows)}};
    if (!c.after.empty())
      one["after"] = packed(c.after, rows);
    if (!c.sd.empty())
      one["sd"] = packed(c.sd, rows);
    json["channels"].push_back(std::move(one));
  }
  json["features"] = Json::array();
  for (const ExploreColumn &f : data.features)
    json["features"].push_back(
        {{"name", f.name}, {"unit", f.unit}, {"key", f.key}, {"v", packed(f.values, rows)}});
  json["findings"] = Json::array();
  for (const ExploreFinding &finding : data.findings)
    json["findings"].push_back(finding_json(finding));
  return json_text(json, -1, true);
}

std::size_t thinning(const Explore &data) {
  std::size_t bytes = 6;
  for (const ExploreChannel &c : data.channels)
    bytes += 8 + (c.after.empty() ? 0 : 4) + (c.sd.empty() ? 0 : 4);
  bytes += 4 * data.features.size();
  return std::max<std::size_t>(1, (bytes * data.time.size() + kMostBytes - 1) / kMostBytes);
}

std::string section_html(std::size_t every) {
  const auto choice = [](const char *id, const char *label) {
    return fmt::format("<label>{} <select id=\"explore-{}\"></select></label>\n", label, id);
  };
  const auto button = [](const char *id, const char *label) {
    return fmt::format("<button type=\"button\" id=\"explore-{}\">{}</button>\n", id, label);
  };
  return "<section id=\"explore\" hidden>\n<h2>Look closer</h2>\n<p class=\"note\">Move over a "
         "plot "
         "for values; drag to zoom, drag with shift to pan, double-click to see all. A rectangle "
         "drawn in the lower plot selects its rows in all plots.</p>\n<p class=\"choices\">" +
         choice("log", "log") + choice("channel", "outcome") + button("reset", "show all") +
         button("rows", "rows as CSV") + button("figure", "figure as PNG") +
         button("svg", "as SVG") +
         "</p>\n<p class=\"choices\" id=\"explore-findings\"></p>\n"
         "<div class=\"legend\" id=\"explore-levels-legend\"></div>"
         "<div id=\"explore-levels\" class=\"dygraph\"></div>\n"
         "<div class=\"legend\" id=\"explore-residual-legend\"></div>"
         "<div id=\"explore-residual\" class=\"dygraph\"></div>\n<p class=\"choices\">" +
         choice("x", "across") + choice("y", "up") +
         "<span id=\"explore-picked\" aria-live=\"polite\"></span></p>\n"
         "<canvas id=\"explore-map\" role=\"img\" aria-label=\"two features against one another\">"
         "</canvas>\n<p class=\"note\">One dot per row, coloured by the residual: blue below and "
         "orange "
         "above what was expected. Behind them, where a finding acts. Frames and ellipses: the "
         "regions that the findings name, where they are of the axes shown; without a line where "
         "only the data end." +
         (every > 1 ? fmt::format(" One row in {} is shown.", every) : "") + "</p>\n</section>\n";
}

constexpr const char *kStyle =
    ".choices{display:flex;flex-wrap:wrap;gap:6px 16px;align-items:center;max-width:none}"
    ".choices label{display:flex;gap:6px;align-items:center;padding-left:4px}"
    ".choices select{min-width:0;max-width:min(22em,60vw)}#explore{overflow:hidden}"
    "#explore .dygraph{width:100%;height:250px;margin:6px 0}"
    "#explore canvas{max-width:100%}#explore-map{display:block;width:100%;height:380px}"
    "#explore-findings button{font-size:12px;padding:0 6px}#explore label[hidden]{display:none}"
    "#explore label.elsewhere{opacity:.55}"
    "#explore .legend{min-height:1.6em;margin-left:64px;font-size:13px}"
    "#explore .dygraph-axis-label,#explore .dygraph-label{color:var(--ink2);font-size:12px}"
    "@media print{#explore{display:none}}";

} // namespace

Library dygraphs() {
  const char *set = std::getenv("RIM_DYGRAPHS");
  const std::filesystem::path folder = set != nullptr ? set : "/usr/share/javascript/dygraphs";
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(folder / "dygraph.min.js", ignored) ||
      !std::filesystem::is_regular_file(folder / "dygraph.min.css", ignored))
    return {};
  Library library{read_file((folder / "dygraph.min.js").string()),
                  read_file((folder / "dygraph.min.css").string())};
  for (std::string *text : {&library.script, &library.style}) {
    const std::size_t map = text->find("# sourceMappingURL="); // a file that the page has not
    if (map != std::string::npos)
      text->replace(map, 18, "# built in         ");
  }
  return library;
}

std::string jump_list(const std::vector<std::pair<std::string, std::string>> &sections) {
  std::string text =
      "<nav class=\"jump\">On this page: <a href=\"#explore\" hidden>Look closer</a>";
  for (const auto &[id, title] : sections)
    text += fmt::format(" <a href=\"#{}\">{}</a>", id, title);
  return text + "</nav>\n";
}

ExploreParts explore_parts(const Explore &data) {
  const Library library = dygraphs();
  if (library.script.empty() || data.channels.empty() || data.time.empty())
    return {};
  const std::size_t every = thinning(data);
  return {"<style>" + library.style + kStyle + "</style>\n" + section_html(every),
          "<script type=\"application/json\" id=\"rim-data\">" +
              for_script(data_json(data, every)) + "</script>\n<script>" + library.script +
              "</script>\n<script>" + kTools + kProgram + "</script>\n"};
}

} // namespace rim::report
