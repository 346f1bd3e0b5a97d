// SPDX-License-Identifier: MIT
#include "bus/sentence.hpp"

#include "util/table.hpp"

#include <algorithm>
#include <cmath>

namespace rim {

namespace {

std::string with_unit(const std::string &number, const std::string &unit) {
  return unit.empty() ? number : number + " " + unit;
}

std::string amount(double value, const std::string &unit) {
  return with_unit(cell(value, 3), unit);
}

// A bound of an interval, with as many decimals as show the interval's width to two digits.
std::string bound(double value, double width) {
  if (!(width > 0.0) || !std::isfinite(width))
    return cell(value, 4);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(width))), 0, 9);
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string error_words(double sd, const std::string &unit) {
  return sd > 0.0 ? " (standard error " + amount(sd, unit) + ")" : "";
}

// What the most anomalous channel does.
std::string deviation(const rim_alarm &a, const Quantity &outcome) {
  const double shift = a.shift[0], size = std::fabs(shift);
  const bool high = shift >= 0.0;
  switch (a.kind) {
  case RIM_KIND_GAIN:
    return outcome.words + " reads " + cell(100.0 * size, 3) + " % " + (high ? "high" : "low") +
           error_words(100.0 * a.shift_sd[0], "%");
  case RIM_KIND_VARIANCE:
    return outcome.words + " scatters " + cell(std::sqrt(std::max(shift, 0.0)), 3) +
           " times as much as predicted";
  case RIM_KIND_DRIFT:
    return outcome.words + " drifts and by now reads " + amount(size, outcome.unit) +
           (high ? " high" : " low") + error_words(a.shift_sd[0], outcome.unit);
  case RIM_KIND_REPEAT:
    return outcome.words + " repeats its last reading, or reads 0, in " + cell(100.0 * size, 3) +
           " % " + (high ? "more" : "less") + " of the rows than it should";
  default:
    return outcome.words + " reads " + amount(size, outcome.unit) + (high ? " high" : " low") +
           error_words(a.shift_sd[0], outcome.unit);
  }
}

std::string others(const rim_alarm &a, const Names &names) {
  std::string text;
  const int count = std::min<int>(a.channels, RIM_ALARM_MAX_CHANNELS);
  for (int i = 1; i < count; ++i)
    text += (i == 1 ? " (also " : ", ") + names.outcome(a.channel[i]).words;
  return text.empty() ? text : text + ")";
}

std::string interference(const rim_alarm &a, const Quantity &speed) {
  return speed.words + (a.kind == RIM_KIND_PUSHED ? " is pushed, " : " is blocked, ") +
         amount(std::fabs(a.shift[0]), speed.unit) +
         " off what was commanded, since t = " + bound(a.since_s, 1.0) + " s (for " +
         bound(a.t_s - a.since_s, 0.1) + " s)";
}

std::string sureness(const rim_alarm &a) {
  if (!(a.p_value > 0.0 && a.p_value < 1.0))
    return "ln anom " + cell(a.ln_anom, 3) + ", threshold " + cell(a.threshold, 3);
  // Rounded down: what is promised must hold.
  const double runs = std::floor(1.0 / a.p_value + 1e-9);
  return runs < 2.0
             ? "many healthy runs show as much"
             : "at most 1 healthy run in " +
                   std::to_string(static_cast<long long>(std::fmin(runs, 1e15))) + " shows as much";
}

} // namespace

std::string region_words(const rim_region &region, const Names &names) {
  std::string text;
  rim_region box = region;
  for (int d = 0; d < std::min<int>(region.dims, RIM_REGION_MAX_DIMS); ++d)
    if (!(region.lower[d] < region.upper[d]))
      rim_region_bounds(&box); // on failure the bounds stay as they were
  for (int d = 0; d < std::min<int>(box.dims, RIM_REGION_MAX_DIMS); ++d) {
    const Quantity feature = names.feature(box.feature[d]);
    const double width = box.upper[d] - box.lower[d];
    text += (text.empty() ? "" : " and ") + feature.words + " is " + bound(box.lower[d], width) +
            " to " + with_unit(bound(box.upper[d], width), feature.unit);
  }
  return text;
}

std::string alarm_sentence(const rim_alarm &a, const Names &names) {
  if (a.level == RIM_LEVEL_STALE)
    return "no valid input lately: nothing can be said about the vehicle";
  if (a.state == RIM_ALARM_NONE)
    return "no finding";
  const Quantity outcome =
      a.channels > 0 ? names.outcome(a.channel[0]) : Quantity{"", "motion", ""};
  const std::string where = region_words(a.region, names);
  std::string text = a.state == RIM_ALARM_CLEARED ? "over: " : "";
  if (a.detector == RIM_DETECTOR_INTERFERENCE)
    return text + interference(a, outcome);
  text += deviation(a, outcome) + others(a, names);
  text += where.empty() ? " everywhere" : " where " + where;
  text += ", since t = " + bound(a.since_s, 10.0) + " s (" + std::to_string(a.observations) +
          (a.observations == 1 ? " observation): " : " observations): ") + sureness(a);
  return text;
}

std::string entry_sentence(const rim_entry &e) {
  const std::string plan = "plan " + std::to_string(e.plan_sequence);
  if (e.to_entry_s < 0.0)
    return plan + " does not enter an alarmed region";
  const std::string region = "the region of alarm " + std::to_string(e.alarm_sequence);
  return e.to_entry_s > 0.0 ? plan + " enters " + region + " in " + amount(e.to_entry_s, "s")
                            : plan + " is inside " + region;
}

const char *level_text(int level) {
  static const char *const text[] = {"OK", "WARN", "ERROR", "STALE", "OUT_OF_RANGE"};
  return level >= 0 && level < 5 ? text[level] : "unknown";
}

const char *state_text(int state) {
  static const char *const text[] = {"none", "raised", "updated", "cleared"};
  return state >= 0 && state < 4 ? text[state] : "unknown";
}

const char *detector_text(int detector) {
  return detector == RIM_DETECTOR_INTERFERENCE ? "interference" : "rim";
}

const char *kind_text(int kind) {
  static const char *const text[] = {"shift",  "gain",    "variance", "drift",
                                     "repeat", "blocked", "pushed"};
  return kind >= 0 && kind < 7 ? text[kind] : "unknown";
}

} // namespace rim
