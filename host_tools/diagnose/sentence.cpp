#include "diagnose/sentence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "log/log.hpp"

namespace rim::diagnose {

std::string cause_words(const std::string &cause) {
  std::string words = cause;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

namespace {

std::string effect_text(const Finding &finding, const Channel &channel) {
  const Term &term = finding.term;
  const std::string unit = channel.unit.empty() ? "" : " " + channel.unit;
  switch (term.kind) {
  case TermKind::stuck:
    return "the reading repeats itself while what it should show changes";
  case TermKind::dropout:
    return "the reading is exactly 0";
  case TermKind::variance: {
    const double ratio = term.sizes.empty() ? 1.0 : term.sizes[0].value;
    return fmt::format("scatters with {:.2f} times the standard deviation {}", std::sqrt(ratio),
                       term.gate.everywhere() ? "stated" : "of elsewhere");
  }
  case TermKind::mean:
    break;
  }
  if (term.cause == "bias" && !term.sizes.empty())
    return fmt::format("is off by {:+.4g}{} (standard error {:.2g})", term.sizes[0].value, unit,
                       term.sizes[0].stderror);
  if (term.cause == "gain" && !term.sizes.empty())
    return fmt::format("is {:.4g} times what is predicted (standard error {:.2g})",
                       1.0 + term.sizes[0].value, term.sizes[0].stderror);
  if (term.cause == "saturation" && !term.shape.empty())
    return fmt::format("does not go beyond {:.4g}{} where more is predicted", term.shape[0].value,
                       unit);
  if (term.form == "table")
    return "departs smoothly with " + plain_name(term.arguments.begin()->second) +
           " in a way that no cause of the catalogue explains";
  std::string text = "differs by " + expression_text(term) + unit;
  if (!term.sizes.empty() && term.sizes[0].stderror > 0.0)
    text += fmt::format(" (standard error {:.2g})", term.sizes[0].stderror);
  return text;
}

} // namespace

std::string finding_sentence(const Finding &finding, const Channel &channel) {
  const Term &term = finding.term;
  std::string text = fmt::format(
      "{}: {} {}", plain_name("z." + channel.name),
      term.kind == TermKind::mean || term.kind == TermKind::variance ? "it" : "now and then",
      effect_text(finding, channel));
  if (!term.gate.everywhere())
    text += ", where " + gate_text(term.gate);
  text += fmt::format(" ({:.0f} % of the rows)", 100.0 * finding.inside_fraction);
  text += term.cause == "unknown" ? ". Cause: unknown" : ". Cause: " + cause_words(term.cause);
  if (!finding.separable && !finding.alternatives.empty()) {
    text += "; the data cannot tell it from ";
    std::string others;
    for (const Alternative &a : finding.alternatives) {
      if (a.delta_bic <= kSeparableBic)
        others += (others.empty() ? "" : " or ") + cause_words(a.cause);
    }
    text += others;
  }
  return text + ".";
}

std::string diagnosis_sentence(const Diagnosis &diagnosis) {
  std::size_t found = 0;
  for (const Finding &f : diagnosis.findings)
    found += f.given ? 0 : 1;
  if (found == 0)
    return diagnosis.findings.empty()
               ? "The simulation is adequate: nothing in the logs contradicts it."
               : "With its extension the simulation is adequate: nothing more was found.";
  std::string text;
  for (const Finding &f : diagnosis.findings) {
    if (!f.given) {
      text = f.sentence;
      break;
    }
  }
  if (found > 1)
    text += fmt::format(" {} more finding{}.", found - 1, found > 2 ? "s" : "");
  for (const Gain &g : diagnosis.gains) {
    if (!diagnosis.findings.empty() && g.where == "all" && g.horizon_s == 0.0 &&
        g.channel == diagnosis.findings.front().term.channel) {
      text +=
          fmt::format(" Mending it leaves {:.0f} % of the error ({:.0f} to {:.0f} %) on data it "
                      "was not fitted to.",
                      100.0 * g.ratio, 100.0 * g.ratio_ci95.low, 100.0 * g.ratio_ci95.high);
      break;
    }
  }
  return text;
}

} // namespace rim::diagnose
