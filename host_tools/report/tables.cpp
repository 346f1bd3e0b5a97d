// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "log/log.hpp"
#include "report/parts.hpp"

namespace rim::diagnose::report {

namespace {

// On the scale of the table's bars: differences of a few count and so do hundreds.
double bar_share(double delta_bic, double most) {
  const auto root = [](double v) { return std::sqrt(std::max(0.0, v)); };
  return most > 0.0 && std::isfinite(delta_bic) ? std::min(1.0, root(delta_bic) / root(most)) : 0.0;
}

// Up to this the data do not tell a rival from the claim: odds of 20 to 1 (Kass and Raftery 1995,
// p. 777, call what is beyond strong evidence); as in search.cpp.
constexpr double kBar = 240.0;

std::string bar(double delta_bic, double most) {
  Svg svg(kBar + 12.0, 18.0, "difference of BIC");
  svg.line(6.0, 0.0, 6.0, 18.0, "axis");
  if (most > kSeparableBic) {
    const double x = 6.0 + kBar * bar_share(kSeparableBic, most);
    svg.line(x, 0.0, x, 18.0, "one");
  }
  svg.rectangle(6.0, 4.0, std::max(2.0, kBar * bar_share(delta_bic, most)), 10.0,
                delta_bic < kSeparableBic ? "rival" : "beaten");
  return svg.markup();
}

std::string percent(double share) {
  return std::isfinite(share) ? number_text(100.0 * share, share > 0.9995 ? 4 : 3) + "\u202f%"
                              : "n/a";
}

} // namespace

std::string causes_table(const Finding &finding) {
  const std::string claimed = plain_cause(finding.term.cause);
  std::string text;
  if (!finding.separable) {
    std::string names = escape(claimed);
    for (const Alternative &a : finding.alternatives) {
      if (a.delta_bic <= kSeparableBic)
        names += ", " + escape(plain_cause(a.cause));
    }
    text += "<p class=\"callout\"><b>The data cannot tell these apart:</b> " + names +
            ". Read the name above as any one of them until a log in which they differ has been "
            "measured.</p>\n";
  }
  if (finding.alternatives.empty())
    return text + "<p class=\"note\">No other cause of the catalogue came near.</p>\n";
  double most = 0.0;
  for (const Alternative &a : finding.alternatives) {
    if (std::isfinite(a.delta_bic))
      most = std::max(most, a.delta_bic);
  }
  text += "<div class=\"scroll\"><table class=\"causes\"><thead><tr><th>cause</th>"
          "<th>as fitted</th><th>\u0394BIC: how much worse it explains</th>"
          "<th class=\"number\"></th><th class=\"number\">held-out R\u00b2</th></tr></thead>"
          "<tbody>\n";
  text += fmt::format("<tr class=\"claimed\"><th scope=\"row\">{}</th><td class=\"code\">{}</td>"
                      "<td>claimed</td><td class=\"number\">0</td><td class=\"number\">{}</td>"
                      "</tr>\n",
                      escape(claimed), escape(expression_text(finding.term)),
                      escape(percent(finding.heldout_r2)));
  for (const Alternative &a : finding.alternatives) {
    text += fmt::format("<tr><th scope=\"row\">{}</th><td class=\"code\">{}</td><td>{}</td>"
                        "<td class=\"number\">{}{}</td><td class=\"number\">{}</td></tr>\n",
                        escape(plain_cause(a.cause)), escape(a.expression), bar(a.delta_bic, most),
                        a.delta_bic >= 0.0 ? "+" : "", escape(number_text(a.delta_bic, 3)),
                        escape(percent(a.heldout_r2)));
  }
  return text +
         "</tbody></table></div>\n<p class=\"note\">The bars grow with the root of the "
         "difference" +
         (most > kSeparableBic
              ? std::string("; the line marks 6, up to which the data do not tell a "
                            "rival from the claim")
              : std::string()) +
         ". Held-out R\u00b2: the share of the residual's sum of squares explained on blocks that "
         "were not fitted to.</p>\n";
}

std::string parameter_table(const Term &term) {
  std::vector<Parameter> all = term.sizes;
  all.insert(all.end(), term.shape.begin(), term.shape.end());
  std::string text;
  const std::string head = "<table class=\"parameters\"><tbody>\n";
  for (const Parameter &p : all) {
    if (p.name == "size" && p.value == 1.0 && !(p.stderror > 0.0))
      continue; // not fitted: the form's own
    text += "<tr><th scope=\"row\">" + escape(plain_cause(p.name)) + "</th><td class=\"number\">" +
            escape(value_text(p.value, p.stderror, p.unit)) + "</td></tr>\n";
  }
  return text.empty() ? "" : head + text + "</tbody></table>\n";
}

namespace {

std::string interval_words(const Gate &gate, std::size_t k) {
  const std::string unit =
      k < gate.units.size() && !gate.units[k].empty() ? " " + gate.units[k] : "";
  // A bound that is nothing beside the other is zero but for rounding.
  const double least = 1e-9 * std::max(std::fabs(gate.lower[k]), std::fabs(gate.upper[k]));
  const auto bound = [least](double v) { return short_text(std::fabs(v) < least ? 0.0 : v); };
  const std::string low = bound(gate.lower[k]), high = bound(gate.upper[k]);
  const bool has_low = std::isfinite(gate.lower[k]), has_high = std::isfinite(gate.upper[k]);
  if (gate.lower[k] > gate.upper[k])
    return "above " + low + " or below " + high + unit;
  if (has_low && has_high)
    return low + " to " + high + unit;
  return has_low ? "above " + low + unit : (has_high ? "below " + high + unit : "any");
}

// The interval on the range of the data.
std::string strip(const Gate &gate, std::size_t k, const Range &data) {
  const double width = 290.0;
  Svg svg(width, 20.0, "interval on the range of the data");
  const Scale x{data, 4.0, width - 4.0, false};
  svg.rectangle(4.0, 7.0, width - 8.0, 6.0, "lane");
  const auto part = [&](double low, double high) {
    const double a = std::clamp(std::isfinite(low) ? x.at(low) : 4.0, 4.0, width - 4.0);
    const double b = std::clamp(std::isfinite(high) ? x.at(high) : width, 4.0, width - 4.0);
    svg.rectangle(a, 4.0, std::max(2.0, b - a), 12.0, "gate strong");
  };
  if (gate.lower[k] > gate.upper[k]) {
    part(data.low, gate.upper[k]);
    part(gate.lower[k], data.high);
  } else {
    part(gate.lower[k], gate.upper[k]);
  }
  return svg.markup();
}

} // namespace

std::string where_text(const Gate &gate) {
  std::string text;
  for (std::size_t k = 0; k < gate.features.size(); ++k)
    text += (k > 0 ? ", " : "") + feature_text(gate.features[k]) + " " + interval_words(gate, k);
  return text;
}

std::string where_table(const Finding &finding, const View &view) {
  const Gate &gate = finding.term.gate;
  if (gate.everywhere())
    return finding.term.kind == TermKind::mean || finding.term.kind == TermKind::variance
               ? "<p>Everywhere.</p>\n"
               : "<p>Rows flagged one by one.</p>\n";
  std::string text = "<table class=\"where\"><tbody>\n";
  for (std::size_t k = 0; k < gate.features.size(); ++k) {
    const Range data = range_of(quantity_of(gate.features[k], view).value);
    const std::string name = feature_text(gate.features[k]);
    text += "<tr><th scope=\"row\">" + escape(name) + "</th><td><b>" +
            escape(interval_words(gate, k)) + "</b>" + strip(gate, k, data) +
            "<span class=\"ends\"><span>" + escape(short_text(data.low, 3)) + "</span><span>" +
            escape(short_text(data.high, 3)) + "</span></span></td></tr>\n";
  }
  text += "</tbody></table>\n";
  if (gate.is_ellipse && gate.features.size() > 1)
    text += "<p class=\"note\">An ellipsoid: these are its extents. The grey bar is the range of "
            "the data.</p>\n";
  else
    text += "<p class=\"note\">The grey bar is the range of the data.</p>\n";
  return text;
}

} // namespace rim::diagnose::report
