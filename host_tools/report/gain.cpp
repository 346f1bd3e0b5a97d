// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "log/log.hpp"
#include "report/parts.hpp"

namespace rim::diagnose::report {

namespace {

constexpr double kWidth = 220.0, kRow = 46.0, kEdge = 10.0;

// Of the ratios and their intervals; 1 is always in it.
Range ratio_range(const std::vector<Gain> &gains) {
  Range r{0.8, 1.25};
  for (const Gain &g : gains) {
    for (const double v : {g.ratio, g.ratio_ci95.low, g.ratio_ci95.high}) {
      if (std::isfinite(v) && v > 0.0) {
        r.low = std::min(r.low, v / 1.06);
        r.high = std::max(r.high, v * 1.06);
      }
    }
  }
  return {std::max(0.01, r.low), std::min(20.0, r.high)};
}

Scale scale_of(const Range &range) { return {range, kEdge, kWidth - kEdge, true}; }

std::string forest_row(const Gain &g, const Range &range) {
  const Scale x = scale_of(range);
  Svg svg(kWidth, kRow, fmt::format("ratio {}", number_text(g.ratio, 3)));
  const Ticks ticks = log_ticks(range);
  for (const double tick : ticks.at)
    svg.line(x.at(tick), 0.0, x.at(tick), kRow, "grid");
  svg.line(x.at(1.0), 0.0, x.at(1.0), kRow, "one");
  const std::string style = g.worse ? "warn" : "after";
  const double middle = kRow / 2.0;
  if (std::isfinite(g.ratio_ci95.low) && std::isfinite(g.ratio_ci95.high)) {
    const double a = std::clamp(x.at(std::max(1e-9, g.ratio_ci95.low)), 1.0, kWidth - 1.0);
    const double b = std::clamp(x.at(std::max(1e-9, g.ratio_ci95.high)), 1.0, kWidth - 1.0);
    svg.line(a, middle, b, middle, ("whisker " + style).c_str());
    svg.line(a, middle - 4.0, a, middle + 4.0, ("bar " + style).c_str());
    svg.line(b, middle - 4.0, b, middle + 4.0, ("bar " + style).c_str());
  }
  if (std::isfinite(g.ratio))
    svg.dots({{x.at(std::max(1e-9, g.ratio)), middle}}, ("bead big " + style).c_str());
  return svg.markup();
}

std::string forest_axis(const Range &range) {
  const Scale x = scale_of(range);
  Svg svg(kWidth, 38.0, "scale of the ratio");
  const Ticks ticks = log_ticks(range);
  double taken = -100.0;
  for (std::size_t i = 0; i < ticks.at.size(); ++i) {
    const double at = x.at(ticks.at[i]);
    const double half = 3.5 * static_cast<double>(letters(ticks.text[i])) + 4.0;
    svg.line(at, 32.0, at, 38.0, "axis");
    if (at - half < taken || std::fabs(at - kWidth / 2.0) > kWidth / 2.0 - 4.0)
      continue;
    svg.text(at, 29.0, "tick middle", ticks.text[i]);
    taken = at + half;
  }
  const double one = x.at(1.0);
  if (one > 70.0)
    svg.text(one - 6.0, 12.0, "tick end", "\u2190 better");
  if (one < kWidth - 62.0)
    svg.text(one + 6.0, 12.0, "tick", "worse \u2192");
  return svg.markup();
}

std::string change(double before, double after, int digits) {
  return number_text(before, digits) + " \u2192 " + number_text(after, digits);
}

std::string interval_text(const Interval95 &i, int digits) {
  return "[" + number_text(i.low, digits) + ", " + number_text(i.high, digits) + "]";
}

std::string percents(const Interval95 &i) {
  if (!std::isfinite(i.low) || !std::isfinite(i.high))
    return "no interval";
  return number_text(100.0 * i.low, 3) + " to " + number_text(100.0 * i.high, 3) + "\u202f%";
}

std::string horizon_text(double seconds) {
  return seconds > 0.0 ? short_text(seconds, 3) + " s ahead" : "one step";
}

// A number with its interval below it.
std::string cell(const std::string &number, const std::string &below) {
  return "<td class=\"number\">" + escape(number) + "<br><span class=\"ci\">" + escape(below) +
         "</span></td>";
}

std::string gain_row(const Gain &g, const Range &range, bool is_first) {
  const std::string unit = g.unit.empty() ? "" : " " + g.unit;
  const std::string mark = g.worse ? "<span class=\"worse\">\u25b2 worse</span> " : "";
  std::string text = is_first ? "<tr class=\"first\">" : "<tr>";
  text +=
      "<th scope=\"row\">" + (is_first ? escape(plain_name(g.channel)) : std::string()) + "</th>";
  text += "<td>" + escape(horizon_text(g.horizon_s)) + ",<br>" +
          escape(g.where == "all"            ? "all rows"
                 : g.where == "with flagged" ? "with rows that are stuck or dropped out"
                                             : g.where) +
          "</td>";
  text += cell(change(g.rmse_before, g.rmse_after, 3) + unit, count_text(g.rows) + " rows");
  text += "<td class=\"forest\">" + forest_row(g, range) + "</td>";
  text += "<td class=\"number\">" + mark + "<b>" + escape(number_text(g.ratio, 3)) +
          "</b><br><span class=\"ci\">" + escape(interval_text(g.ratio_ci95, 3)) + "</span></td>";
  text += cell(number_text(g.nll_before - g.nll_after, 3), interval_text(g.nll_gain_ci95, 2));
  return text + "<td class=\"number\">" + escape(change(g.mpa_before, g.mpa_after, 2)) +
         "</td></tr>\n";
}

const Gain *one_step(const Diagnosis &diagnosis, const std::string &channel) {
  const Gain *best = nullptr;
  for (const Gain &g : diagnosis.gains) {
    if (g.channel == channel && g.where == "all" && !(g.horizon_s > 0.0) &&
        (best == nullptr || g.data == "held-out logs"))
      best = &g;
  }
  return best;
}

} // namespace

std::string gain_table(const Diagnosis &diagnosis) {
  if (diagnosis.gains.empty())
    return "<p>No gain was measured.</p>\n";
  std::vector<Gain> gains = diagnosis.gains;
  std::map<std::string, std::size_t> order; // channels as they came
  for (const Gain &g : gains)
    order.emplace(g.data + "\n" + g.channel, order.size());
  std::stable_sort(gains.begin(), gains.end(), [&order](const Gain &a, const Gain &b) {
    const std::size_t i = order[a.data + "\n" + a.channel], j = order[b.data + "\n" + b.channel];
    return i != j ? i < j : a.horizon_s < b.horizon_s;
  });
  const Range range = ratio_range(gains);
  std::string text, data;
  std::string key;
  for (const Gain &g : gains) {
    if (g.data != data) {
      if (!data.empty())
        text += "</tbody></table></div>\n";
      text += "<h3>Measured on " +
              escape(g.data == "cross-validated" ? "blocks left out in turn (cross-validated)"
                                                 : g.data) +
              "</h3>\n<div class=\"scroll\"><table class=\"gain\"><thead><tr><th>channel</th>"
              "<th>over</th><th class=\"number\">RMSE,<br>before \u2192 after</th><th>" +
              forest_axis(range) +
              "</th><th class=\"number\">after / before<br>[95 %]</th>"
              "<th class=\"number\">nats gained<br>a row [95 %]</th>"
              "<th class=\"number\">mean density,<br>before \u2192 after</th></tr></thead>"
              "<tbody>\n";
      data = g.data;
      key.clear();
    }
    text += gain_row(g, range, key != g.channel);
    key = g.channel;
  }
  return text + "</tbody></table></div>\n";
}

std::string gain_tiles(const Diagnosis &diagnosis) {
  std::string text;
  std::size_t count = 0;
  for (const ChannelState &state : diagnosis.channels) {
    const Gain *g = one_step(diagnosis, state.channel);
    const bool is_claimed =
        std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                    [&state](const Finding &f) { return f.term.channel == state.channel; });
    if (g == nullptr || !is_claimed || ++count > 6)
      continue;
    text += fmt::format(
        "<div class=\"tile{}\"><span class=\"big\">{}</span><span>of the error of "
        "<b>{}</b> remains</span><span class=\"ci\">{}, one step, {}</span></div>\n",
        g->worse ? " bad" : "",
        std::isfinite(g->ratio) ? number_text(100.0 * g->ratio, 2) + "\u202f%" : "n/a",
        escape(plain_name(g->channel)), escape(percents(g->ratio_ci95)), escape(g->data));
  }
  return text.empty() ? "" : "<div class=\"tiles\">" + text + "</div>\n";
}

} // namespace rim::diagnose::report
