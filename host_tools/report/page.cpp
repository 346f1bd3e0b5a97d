// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "log/log.hpp"
#include "report/explore.hpp"
#include "report/outputs.hpp"
#include "report/parts.hpp"
#include "report/pictures.hpp"
#include "util/version.hpp"

namespace rim::diagnose {

namespace {

using namespace report;
constexpr std::size_t kMostChannels = 8;

Eigen::Index at(std::size_t i) { return static_cast<Eigen::Index>(i); }

std::string fact(const std::string &name, const std::string &value) {
  return "<div><dt>" + escape(name) + "</dt><dd>" + escape(value) + "</dd></div>\n";
}

std::string count_of(std::size_t n, const std::string &what) {
  return count_text(n) + " " + what + (n == 1 ? "" : "s");
}

std::string heading(const Finding &f) {
  return fmt::format("{}: {} in {}", f.number, plain_cause(f.term.cause),
                     plain_name(f.term.channel));
}

std::string head(const Diagnosis &d, const Measured &t) {
  double seconds = 0.0;
  for (const LogSpan &log : t.logs)
    seconds += log.rows > 0 ? t.elapsed_s[log.first + log.rows - 1] : 0.0;
  std::string text = "<header>\n<p class=\"top\"><span>rim diagnose</span>";
  text += d.adequate() ? "<span class=\"verdict fine\">\u2713 adequate</span>"
                       : "<span class=\"verdict bad\">\u2717 inadequate: " +
                             escape(count_of(d.findings.size(), "finding")) + "</span>";
  text += "</p>\n<h1 id=\"sentence\"" +
          std::string(letters(d.sentence) > 170 ? " class=\"long\"" : "") + ">" +
          escape(d.sentence.empty()
                     ? (d.adequate() ? "The simulation is adequate." : "The simulation is wrong.")
                     : d.sentence) +
          "</h1>\n<div class=\"overview\">\n" + gain_tiles(d);
  if (!d.adequate()) {
    text += std::string("<ol class=\"contents") + (d.findings.size() > 5 ? " many" : "") + "\">\n";
    for (const Finding &f : d.findings) {
      const std::string where = where_text(f.term.gate);
      text += fmt::format("<li><a href=\"#finding-{}\">{} in {}</a>{}</li>\n", f.number,
                          escape(plain_cause(f.term.cause)), escape(plain_name(f.term.channel)),
                          where.empty() ? "" : ": " + escape(where));
    }
    text += "</ol>\n";
  }
  text += "</div>\n";
  std::vector<std::pair<std::string, std::string>> sections;
  if (!d.findings.empty())
    sections = {{"gain", "How much better"}, {"when", "When"}};
  if (!d.regions.empty())
    sections.emplace_back("regions", "Where");
  sections.emplace_back("remains", "What remains");
  if (!d.notes.empty())
    sections.emplace_back("notes", "Notes");
  sections.emplace_back("again", "How to make this again");
  return text + "<dl class=\"facts\">\n" +
         fact("measured", count_of(t.logs.size(), "log") + ", " + count_of(t.rows(), "row") + ", " +
                              number_text(seconds, 4) + " s") +
         fact("simulated by", d.model) +
         fact("searched", count_of(t.channels.size(), "channel") + ", " +
                              count_of(t.features.size(), "feature")) +
         "</dl>\n" + rim::report::jump_list(sections) + "</header>\n";
}

std::string numbers_of(const Finding &f) {
  const std::size_t acting = static_cast<std::size_t>(
      std::count_if(f.acts.begin(), f.acts.end(), [](std::uint8_t acts) { return acts != 0; }));
  std::string text = "<dl class=\"facts\">\n";
  text += fact("acts on",
               count_of(acting, "row") +
                   (f.acts.empty()
                        ? ""
                        : fmt::format(" ({} %)", number_text(100.0 * static_cast<double>(acting) /
                                                                 static_cast<double>(f.acts.size()),
                                                             3))));
  text += fact("ln likelihood ratio", number_text(f.ln_anom, 4));
  text +=
      fact("p, whole search", f.p_value < 1e-6 ? "< 10\u207b\u2076" : number_text(f.p_value, 2));
  if (f.term.kind == TermKind::mean)
    text += fact("held-out R\u00b2", number_text(100.0 * f.heldout_r2, 3) + "\u202f%");
  for (const Learnt &range : f.learnt) {
    const std::string unit = range.unit.empty() ? "" : " " + range.unit;
    std::string words = feature_text(range.feature) + " " + short_text(range.low) + " to " +
                        short_text(range.high) + unit;
    if (range.beyond > 0.0)
      words += "; extrapolated on " + number_text(100.0 * range.beyond, 2) +
               "\u202f% of the held-out rows (" + short_text(range.least) + " to " +
               short_text(range.most) + unit + ")";
    text += fact("learnt from", words);
  }
  return text + "</dl>\n";
}

// The pictures that suit the finding's kind.
std::string pictures(const Finding &f, const View &view) {
  const Gate &gate = f.term.gate;
  const bool is_mean = f.term.kind == TermKind::mean;
  const bool is_sensor = f.term.kind == TermKind::stuck || f.term.kind == TermKind::dropout;
  std::string text = time_picture(f, view);
  if (is_sensor)
    return text;
  if (gate.features.size() > 1)
    text += map_picture(f, view);
  std::vector<std::string> profiles;
  if (gate.features.size() == 1)
    profiles.push_back(gate.features.front());
  else if (gate.everywhere() && !is_mean)
    profiles.push_back(kTime);
  const bool has_curve =
      is_mean && (f.term.form == "table" || !f.term.arguments.empty() || gate.everywhere() ||
                  f.term.basis != std::vector<std::string>{"1"});
  const bool both = has_curve && !profiles.empty();
  text += both ? "<div class=\"pair\">\n" : "";
  for (const std::string &feature : profiles)
    text += profile_picture(f, view, feature, both ? kHalf : kWide);
  if (has_curve)
    text += argument_picture(f, view, both ? kHalf : kWide);
  return text + (both ? "</div>\n" : "");
}

std::string card(const Finding &f, const Diagnosis &d, const Measured &t) {
  const int c = t.find_channel(f.term.channel);
  std::string text = fmt::format("<section class=\"finding f{}\" id=\"finding-{}\">\n<h2>{}</h2>\n",
                                 (f.number - 1) % 7, f.number, escape(heading(f)));
  if (!f.separable)
    text += "<span class=\"badge doubt\">not separable from other causes</span>";
  if (f.given)
    text += "<span class=\"badge\">given with --extension</span>";
  if (f.term.cause == "unknown")
    text += "<span class=\"badge doubt\">no cause of the catalogue is supported</span>";
  text += "<p class=\"lead\">" + escape(f.sentence) + "</p>\n<p class=\"expression\">" +
          escape(expression_text(f.term)) + "</p>\n";
  if (c < 0)
    return text + causes_table(f) + "</section>\n";
  const View view = view_of(d, t, t.channels[static_cast<std::size_t>(c)]);
  const std::string parameters = parameter_table(f.term);
  text += "<div class=\"pair\">\n<div><h3>Where</h3>\n" + where_table(f, view) + "</div>\n";
  if (!parameters.empty())
    text += "<div><h3>How much</h3>\n" + parameters + "</div>\n";
  const std::string problem = effect_problem(f, view);
  if (!problem.empty())
    text += "<p>The effect of this finding alone cannot be computed (" + escape(problem) +
            "): the pictures show what all findings of the channel add.</p>\n";
  return text + "</div>\n" + numbers_of(f) + pictures(f, view) +
         (f.term.kind == TermKind::mean || !f.alternatives.empty() || !f.separable
              ? "<h3>Causes, ranked</h3>\n" + causes_table(f)
              : "") +
         "</section>\n";
}

// The least constant shift that would have been claimed, in sd, on a share of the rows: the claim's
// least score plus what a region costs, against the n/2 delta^2 that a shift of delta earns.
double least_shift(const ChannelState &state, double rows, double inflation, double share) {
  const double cost = (share < 1.0 ? 3.0 : 1.0) * 0.5 * std::log(std::max(2.0, rows));
  return std::sqrt(2.0 * inflation * (state.threshold + cost) / std::max(1.0, share * rows));
}

std::string would_have_been_seen(const Diagnosis &d, const Measured &t) {
  std::string text = "<p>A deviation of about this size would have been found:</p>\n"
                     "<div class=\"scroll\"><table class=\"channels\"><thead><tr><th>channel</th>"
                     "<th class=\"number\">a shift everywhere</th><th class=\"number\">on a tenth "
                     "of the rows</th></tr></thead><tbody>\n";
  for (const ChannelState &state : d.channels) {
    const int c = t.find_channel(state.channel);
    if (c < 0)
      continue;
    const Channel &channel = t.channels[static_cast<std::size_t>(c)];
    const View view = view_of(d, t, channel);
    const double sd = channel.sd.size() > 0 ? channel.sd.mean() * state.scale : 0.0;
    const auto cell = [&](double share) {
      const double delta =
          least_shift(state, static_cast<double>(view.usable.size()), view.inflation, share);
      return "<td class=\"number\">" +
             escape(number_text(delta, 2) + " sd = " + number_text(delta * sd, 2) + " " +
                    channel.unit) +
             "</td>";
    };
    text += "<tr><th scope=\"row\">" + escape(plain_name(state.channel)) + "</th>" + cell(1.0) +
            cell(0.1) + "</tr>\n";
  }
  return text +
         "</tbody></table></div>\n<p class=\"note\">These are estimates: the shift whose "
         "likelihood "
         "ratio, for the effective sample size, reaches the least score of a claim and the cost "
         "of a region.</p>\n";
}

std::string remains(const Diagnosis &d, const Measured &t) {
  std::string text = "<section id=\"remains\">\n<h2>";
  text += d.adequate() ? "The residuals show nothing" : "What remains";
  text += "</h2>\n";
  if (d.adequate())
    text += would_have_been_seen(d, t);
  text +=
      "<div class=\"scroll\"><table class=\"channels\"><thead><tr><th>channel</th>"
      "<th class=\"number\">scatter that remains / stated sd</th>"
      "<th class=\"number\">autocorrelation</th><th class=\"number\">least score of a claim</th>"
      "<th class=\"number\">rows flagged stuck or dropped out</th></tr></thead><tbody>\n";
  for (const ChannelState &s : d.channels) {
    const int c = t.find_channel(s.channel);
    const bool is_estimated = c >= 0 && t.channels[static_cast<std::size_t>(c)].sd_estimated;
    text += fmt::format("<tr><th scope=\"row\">{}</th><td class=\"number\">{}{}</td>"
                        "<td class=\"number\">{}</td><td class=\"number\">{}</td>"
                        "<td class=\"number\">{}</td></tr>\n",
                        escape(plain_name(s.channel)), escape(number_text(s.scale, 3)),
                        is_estimated ? " (sd estimated)" : "",
                        escape(number_text(s.autocorrelation, 2)),
                        escape(number_text(s.threshold, 3)), escape(count_text(s.rows_flagged)));
  }
  text += "</tbody></table></div>\n";
  for (std::size_t c = 0; c < std::min(kMostChannels, t.channels.size()); ++c)
    text += channel_pictures(view_of(d, t, t.channels[c]));
  if (t.channels.size() > kMostChannels)
    text += fmt::format("<p class=\"note\">The first {} of {} channels.</p>\n", kMostChannels,
                        t.channels.size());
  return text + "</section>\n";
}

std::string again(const Diagnosis &d, const Measured &t) {
  std::string text = "<section id=\"again\">\n<h2>How to make this again</h2>\n<pre>" +
                     escape(d.command) + "</pre>\n<dl class=\"facts\">\n" +
                     fact("rimwatch", RIM_VERSION) + fact("seed", std::to_string(d.seed)) +
                     fact("simulated by", d.model) +
                     "</dl>\n<h3>Logs</h3>\n<div class=\"scroll\"><table><tbody>\n";
  for (const LogSpan &log : t.logs) {
    text += "<tr><td class=\"code\">" + escape(log.path) + "</td><td class=\"number\">" +
            escape(count_of(log.rows, "row")) +
            (log.rows_in_file != log.rows ? escape(" of " + count_text(log.rows_in_file)) : "") +
            "</td></tr>\n";
  }
  return text +
         "</tbody></table></div>\n<p class=\"note\">Beside this page: diagnosis.json (every number "
         "here), labels.csv (one finding per row), extension.toml (the terms; simulate, replay and "
         "the next diagnose take it with --extension).</p>\n</section>\n";
}

std::string regions(const Diagnosis &d) {
  if (d.regions.empty())
    return "";
  std::string text =
      "<section id=\"regions\">\n<h2>Where, before asking why</h2>\n<div class=\"scroll\">"
      "<table class=\"channels\"><thead><tr><th>channel</th><th>region</th><th>shift, sd</th>"
      "<th>rows</th><th>ln anom</th></tr></thead><tbody>\n";
  for (const ResidualRegion &r : d.regions) {
    text += "<tr><td>" + escape(r.channel) + "</td><td>" + escape(where_text(r.gate)) +
            "</td><td class=\"number\">" + escape(fmt::format("{:+.2f}", r.shift_sd)) +
            "</td><td class=\"number\">" + escape(count_text(r.rows)) +
            "</td><td class=\"number\">" + escape(fmt::format("{:.0f}", r.ln_anom)) +
            "</td></tr>\n";
  }
  return text +
         "</tbody></table></div>\n<p class=\"note\">These are regions in which the residuals of "
         "the "
         "simulation as it was given shift together (thesis, algorithm 3). Each row is in one of "
         "them at most. A region is an ellipsoid, given by the interval of each feature.</p>\n"
         "</section>\n";
}

std::string notes(const Diagnosis &d) {
  if (d.notes.empty())
    return "";
  std::string text = "<section id=\"notes\">\n<h2>Notes</h2>\n<ul>\n";
  for (const std::string &note : d.notes)
    text += "<li>" + escape(note) + "</li>\n";
  return text + "</ul>\n</section>\n";
}

std::vector<double> list_of(const Vector &values) {
  return {values.data(), values.data() + values.size()};
}

rim::report::ExploreRegion explore_region(const Gate &gate) {
  rim::report::ExploreRegion region{gate.features,      gate.lower, gate.upper,     gate.center,
                                    gate.inverse_shape, {},         gate.is_ellipse};
  for (std::size_t k = 0; k < gate.features.size(); ++k)
    region.open.emplace_back(gate.is_open(k, false), gate.is_open(k, true));
  return region;
}

// What can be touched: the channels with findings first, and the features that findings name.
rim::report::Explore explore_data(const Diagnosis &d, const Measured &t) {
  rim::report::Explore data;
  data.time = t.t_s;
  for (const LogSpan &log : t.logs)
    data.logs.push_back({std::filesystem::path(log.path).filename().string(), log.first, log.rows});
  std::vector<const Channel *> channels;
  for (const bool found : {true, false})
    for (const Channel &c : t.channels)
      if (found == std::any_of(d.findings.begin(), d.findings.end(),
                               [&](const Finding &f) { return f.term.channel == c.name; }))
        channels.push_back(&c);
  channels.resize(std::min(kMostChannels, channels.size()));
  for (const Channel *c : channels) {
    const View view = view_of(d, t, *c);
    data.channels.push_back({plain_name(c->name), c->unit, c->name, list_of(c->z), list_of(c->m),
                             d.findings.empty() ? std::vector<double>() : list_of(view.m_after),
                             list_of(view.sd_after)});
  }
  for (std::size_t f = 0; f < std::min<std::size_t>(12, t.features.size()); ++f)
    data.features.push_back({feature_text(t.features[f].name), t.features[f].unit,
                             t.features[f].name, list_of(t.x.col(at(f)))});
  data.acts.assign(t.rows(), 0);
  for (std::size_t i = 0; i < std::min<std::size_t>(16, d.findings.size()); ++i) {
    const Finding &f = d.findings[i];
    const auto of = std::find_if(channels.begin(), channels.end(),
                                 [&](const Channel *c) { return c->name == f.term.channel; });
    const int channel = of == channels.end() ? -1 : static_cast<int>(of - channels.begin());
    data.findings.push_back(
        {f.number, heading(f), -1, channel, static_cast<unsigned>(i), explore_region(f.term.gate)});
    for (std::size_t r = 0; r < std::min(t.rows(), f.acts.size()); ++r)
      data.acts[r] = static_cast<std::uint16_t>(data.acts[r] | (f.acts[r] != 0 ? 1u << i : 0u));
  }
  if (!data.findings.empty()) // opens with the first finding
    data.first_channel = static_cast<std::size_t>(std::max(0, data.findings.front().channel));
  return data;
}

} // namespace

std::string report_html(const Diagnosis &diagnosis, const Measured &measured) {
  std::string text = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                     "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
                     "<link rel=\"icon\" href=\"data:,\">\n"
                     "<title>rim diagnose: " +
                     std::string(diagnosis.adequate() ? "adequate" : "inadequate") +
                     "</title>\n<style>\n" + style_sheet() + "</style>\n</head>\n<body>\n<main>\n" +
                     head(diagnosis, measured);
  const rim::report::ExploreParts explore =
      rim::report::explore_parts(explore_data(diagnosis, measured));
  text += explore.section;
  for (const Finding &finding : diagnosis.findings)
    text += card(finding, diagnosis, measured);
  if (!diagnosis.findings.empty()) {
    text += "<section id=\"gain\">\n<h2>How much the extension improves the prediction</h2>\n" +
            gain_table(diagnosis) +
            "<p class=\"note\">RMSE of what is measured against what is simulated, on data that "
            "were not fitted to; intervals from resampling. Inside and outside the findings' "
            "regions. Mean density: eq. 3.38, greater is better. Worse: the ratio is more than 2 % "
            "above 1, or its interval is.</p>\n</section>\n<section id=\"when\">\n"
            "<h2>When</h2>\n" +
            logs_picture(diagnosis, measured) + "</section>\n";
  }
  return text + regions(diagnosis) + remains(diagnosis, measured) + notes(diagnosis) +
         again(diagnosis, measured) + "<footer>rimwatch " RIM_VERSION "</footer>\n</main>\n" +
         explore.scripts + "</body>\n</html>\n";
}

} // namespace rim::diagnose
