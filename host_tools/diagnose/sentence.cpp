// SPDX-License-Identifier: MIT
#include "diagnose/sentence.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "diagnose/roles.hpp"
#include "log/log.hpp"

namespace rim::diagnose {

std::string cause_words(const std::string &cause) {
  std::string words = cause;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

namespace {

std::string with_unit(double value, const std::string &unit) {
  return fmt::format("{:.4g}{}", value, unit.empty() ? "" : " " + unit);
}

// What the term means, beside its formula; empty: the formula says it.
std::string meaning(const Term &term, const Channel &channel) {
  const double size = term.sizes.empty() ? 0.0 : term.sizes[0].value;
  const std::string unit = term.sizes.empty() ? "" : term.sizes[0].unit;
  const bool adds = opposes(term, channel);
  if (term.cause == "load_friction")
    return adds ? "friction opposes the motion with a share of the load that is predicted" : "";
  if (term.form == "coulomb_by_direction" && adds && term.sizes.size() > 1 &&
      std::abs(term.sizes[1].value) < size) {
    // -sign(v) and -1, or with both signs turned: either way their sum acts where v is above none.
    const double other = term.sizes[1].value;
    return "friction opposes the motion with " + with_unit(size + other, unit) +
           " forwards and with " + with_unit(size - other, unit) + " backwards";
  }
  if (term.form == "coulomb_stick")
    return "friction opposes the motion whatever the speed, and sticks";
  if (term.cause == "coulomb_friction")
    return adds ? "friction opposes the motion with " + with_unit(size, unit) +
                      (term.form.rfind("stribeck", 0) == 0 ? ", and otherwise near rest"
                                                           : " whatever the speed")
           : sense_of(term, channel) != 0 ? "less friction than is predicted"
                                          : "it goes with the direction of the motion";
  if (term.cause == "viscous_friction" && adds)
    return "friction opposes the motion with " + with_unit(size, unit) +
           (term.form == "viscous_by_speed" ? ", less where it is fast"
            : term.sizes.size() > 1         ? ", by direction more or less"
                                            : "");
  const auto stream = term.arguments.find("w");
  if (term.cause == "quadratic_drag" && stream != term.arguments.end())
    return adds ? "drag opposes the motion through what moves by " + plain_name(stream->second)
                : "";
  if (term.cause == "quadratic_drag")
    return adds ? "drag opposes the motion with the square of the speed"
                : "it goes with the square of the speed";
  if (term.form == kBacklash)
    return "after every turn it stays until the play is taken up";
  if (term.form == kHysteresis)
    return "it depends on the way it came; after every turn a part follows, and slips gradually";
  if (moves_prediction(term) && term.form.rfind("delay", 0) == 0)
    return "what is asked acts late";
  if (remembers(term))
    return "a change is followed gradually, 63 % of it within the lag";
  if (term.form == "gain_of_change")
    return "as an inertia or a drive that is not as simulated";
  return "";
}

std::string differing_text(const Term &term) {
  if (term.sizes.empty() || term.sizes[0].per_log.empty() || is_swing(term))
    return "";
  const Parameter &size = term.sizes[0];
  std::string each;
  for (const double value : size.per_log)
    each += (each.empty() ? "" : ", ") + fmt::format("{:.4g}", value);
  const double share = size.value != 0.0 ? size.new_log / size.value : 1.0;
  std::string other;
  if (share == 0.0)
    other = ": too much for another log to be predicted";
  else if (share < 1.0)
    other = fmt::format("; another log is predicted with {:.4g}, lest it be worse off than without",
                        size.new_log);
  return fmt::format("; its size differs between the logs, of which there are {}: {} (mean "
                     "{:.4g}, spread {:.2g}{}){}",
                     size.per_log.size(), each, size.value, size.between_logs_sd,
                     size.unit.empty() ? "" : " " + size.unit, other);
}

// Of a limit that moves with a speed: " less 0.8 N m per (rad/s) of wheel".
std::string by_speed_text(const Term &term) {
  const auto v = term.arguments.find("v");
  if (term.shape.size() < 2 || v == term.arguments.end())
    return "";
  const Parameter &by = term.shape[1];
  return std::string(by.value < 0.0 ? " and " : " less ") + with_unit(std::abs(by.value), by.unit) +
         " of " + plain_name(v->second) + (by.value < 0.0 ? " more" : "");
}

// "0.30 +- 0.01 A": as many decimals as the error has that mean something.
std::string with_error(const Parameter &p) {
  const std::string unit = p.unit.empty() ? "" : " " + p.unit;
  if (!(p.stderror > 0.0))
    return with_unit(p.value, p.unit);
  const double decimals = std::max(0.0, -std::floor(std::log10(p.stderror)));
  if (decimals > 6.0 || p.value >= 1e7)
    return fmt::format("{:.4g} +- {:.1g}{}", p.value, p.stderror, unit);
  return fmt::format("{0:.{2}f} +- {1:.{2}f}{3}", p.value, p.stderror, static_cast<int>(decimals),
                     unit);
}

const char *ordinal_end(int n) { return n == 2 ? "nd" : n == 3 ? "rd" : "th"; }

// What swings: by how much, how fast, and for which logs its phase is known.
std::string swing_text(const Finding &finding) {
  const Term &term = finding.term;
  const Parameter &size = term.sizes.at(0), &period = term.shape.at(0);
  std::string text = "swings by " + with_error(size) + " with a period of " + with_error(period) +
                     ", which the simulation does not";
  if (finding.harmonic > 1)
    text += fmt::format(" (the {}{} harmonic of another finding)", finding.harmonic,
                        ordinal_end(finding.harmonic));
  if (!size.per_log.empty() && size.between_logs_sd > size.stderror) {
    const auto [least, most] = std::minmax_element(size.per_log.begin(), size.per_log.end());
    text += fmt::format("; by {:.3g} to {} in the logs", *least, with_unit(*most, size.unit));
  }
  if (term.logs.empty())
    return text + "; every log begins it in the same phase";
  return text +
         (term.logs.size() > 1 ? "; the phase is each log's own"
                               : "; the phase is that of this log") +
         ", and is not known in another";
}

std::string effect_text(const Finding &finding, const Channel &channel) {
  const Term &term = finding.term;
  const std::string unit = channel.unit.empty() ? "" : " " + channel.unit;
  switch (term.kind) {
  case TermKind::stuck:
    return "repeats itself now and then while what it should show changes";
  case TermKind::dropout:
    return "is exactly 0 now and then";
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
  if (term.form == "gain_of_change" && !term.sizes.empty())
    return fmt::format("changes by {:.4g} times what is predicted (standard error {:.2g})",
                       1.0 + term.sizes[0].value, term.sizes[0].stderror);
  if (term.cause == "gain" && !term.sizes.empty())
    return fmt::format("is {:.4g} times what is predicted (standard error {:.2g})",
                       1.0 + term.sizes[0].value, term.sizes[0].stderror);
  const bool is_below = term.form == "saturation_below";
  if (term.cause == "saturation" && !term.shape.empty())
    return fmt::format("does not go {} {:.4g}{}{} where {} is predicted{}",
                       is_below                          ? "below"
                       : term.form == "saturation_above" ? "above"
                                                         : "beyond",
                       term.shape[0].value, unit, by_speed_text(term), is_below ? "less" : "more",
                       term.form == kSaturationBefore ? ", before it comes late" : "");
  if (term.form == "coulomb_stick" && !term.shape.empty())
    return fmt::format("loses {:.4g}{} to friction within a row, and stays at rest where no more "
                       "is predicted",
                       term.shape[0].value, unit);
  if (term.cause == "dead_zone" && !term.shape.empty())
    return fmt::format("does not answer until {:.4g}{} are predicted, and then by that much less{}",
                       term.shape[0].value, unit,
                       term.form == kDeadZoneBefore ? ", before it comes late" : "");
  if (is_swing(term) && !term.sizes.empty() && !term.shape.empty())
    return swing_text(finding);
  if (term.form == "table")
    return "departs smoothly with " + plain_name(term.arguments.begin()->second) +
           " in a way that no cause of the catalogue explains";
  if (remembers(term))
    return "shows " + expression_text(term);
  std::string text = "differs by " + expression_text(term) + unit;
  if (!term.sizes.empty() && term.sizes[0].stderror > 0.0) {
    const Parameter &size = term.sizes[0];
    text += fmt::format(" (standard error {:.2g}", size.stderror);
    if (size.unrefined != 0.0)
      text += fmt::format("; {:.4g} without the terms that refine it", size.unrefined);
    if (size.near_rest != 0.0)
      text += fmt::format("; {:.4g} near rest", size.near_rest);
    text += ")";
  }
  return text;
}

std::string where_text(const Finding &finding, const Channel &channel) {
  const Term &term = finding.term;
  std::string text =
      "measured " + plain_name("z." + channel.name) + " " + effect_text(finding, channel);
  const std::string means = meaning(term, channel);
  if (!means.empty())
    text += ": " + means;
  if (!term.gate.everywhere())
    text += ", where " + gate_text(term.gate);
  return text + differing_text(term);
}

// Where a term adds next to nothing it does not act, though it may hold everywhere.
std::string rows_text(const Finding &finding) {
  double acting = 0.0;
  for (const std::uint8_t acts : finding.acts)
    acting += acts != 0 ? 1.0 : 0.0;
  const double share = finding.acts.empty() ? finding.inside_fraction
                                            : acting / static_cast<double>(finding.acts.size());
  const double percent = 100.0 * share;
  return percent > 0.0 && percent < 1.0 ? fmt::format(" ({:.2g} % of the rows)", percent)
                                        : fmt::format(" ({:.0f} % of the rows)", percent);
}

// Of what swings in a phase that is known in the fitted logs alone others say nothing.
std::string not_borne_out(const Diagnosis &diagnosis, const Gain &gain) {
  const bool is_unknown =
      gain.data == "held-out logs" &&
      std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(), [&gain](const Finding &f) {
        return f.term.channel == gain.channel && is_swing(f.term) && !f.term.logs.empty();
      });
  return is_unknown ? " Its phase in the held-out logs is not known, so that they are not "
                      "corrected for it."
                    : fmt::format(" On data that it was not fitted to ({}) this is not borne out.",
                                  gain.data);
}

} // namespace

std::string finding_sentence(const Finding &finding, const Channel &channel) {
  const Term &term = finding.term;
  std::string text = where_text(finding, channel);
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  text += rows_text(finding);
  text += term.cause == "unknown" ? ". Cause: unknown" : ". Cause: " + cause_words(term.cause);
  if (!finding.separable && !finding.alternatives.empty()) {
    text += "; the data cannot tell it from ";
    std::vector<std::string> others;
    for (const Alternative &a : finding.alternatives) {
      const std::string name = a.cause == "unknown" ? "other formulas" : cause_words(a.cause);
      if (a.delta_bic <= kSeparableBic &&
          std::find(others.begin(), others.end(), name) == others.end())
        others.push_back(name);
    }
    text += fmt::format("{}", fmt::join(others, " or "));
  }
  return text + ".";
}

std::string unconfirmed_sentence(const Finding &finding, const Channel &channel,
                                 const std::string &reason) {
  return "Seen, not confirmed (" + cause_words(finding.term.cause) +
         "): " + where_text(finding, channel) + "; " + reason + ".";
}

std::string diagnosis_sentence(const Diagnosis &diagnosis) {
  std::size_t found = 0;
  for (const Finding &f : diagnosis.findings)
    found += f.given ? 0 : 1;
  if (found == 0 && diagnosis.doubts > 0)
    return "No cause is claimed, but that does not show the simulation to be adequate: what was "
           "seen does not hold in all parts of the logs.";
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
        g.channel == diagnosis.findings.front().term.channel &&
        diagnosis.findings.front().term.kind == TermKind::mean) {
      const bool differs =
          std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(), [&g](const Finding &f) {
            return f.term.channel == g.channel && !is_swing(f.term) && !f.term.sizes.empty() &&
                   !f.term.sizes[0].per_log.empty();
          });
      if (differs && g.ratio >= 1.0) {
        text += fmt::format(" Its size differs so much between logs that the mean of those that "
                            "were fitted does not serve others ({}): fit it to each.",
                            g.data);
        break;
      }
      if (!is_borne_out(g)) {
        text += not_borne_out(diagnosis, g);
        break;
      }
      text +=
          fmt::format(" Correcting it leaves {:.0f} % of the error ({:.0f} to {:.0f} %) on data it "
                      "was not fitted to.",
                      100.0 * g.ratio, 100.0 * g.ratio_ci95.low, 100.0 * g.ratio_ci95.high);
      break;
    }
  }
  return text;
}

} // namespace rim::diagnose
