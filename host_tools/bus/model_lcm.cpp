// SPDX-License-Identifier: MIT
#include "bus/model_lcm.hpp"

#include <cctype>
#include <set>

#include <fmt/format.h>

#include "rim/alarm.h"

namespace rim {

namespace {

struct Code {
  const char *name;
  int value;
  const char *means;
};

constexpr Code kCodes[] = {
    {"LEVEL_OK", RIM_LEVEL_OK, "level"},
    {"LEVEL_WARN", RIM_LEVEL_WARN, "above the warning score; no alarm stands"},
    {"LEVEL_ERROR", RIM_LEVEL_ERROR, "an alarm stands"},
    {"LEVEL_STALE", RIM_LEVEL_STALE, "nothing is known about the vehicle"},
    {"STATE_NONE", RIM_ALARM_NONE, "state: only the level is reported"},
    {"STATE_RAISED", RIM_ALARM_RAISED, "an alarm begins to stand"},
    {"STATE_UPDATED", RIM_ALARM_UPDATED, "it stands and has changed"},
    {"STATE_CLEARED", RIM_ALARM_CLEARED, "it no longer stands"},
    {"DETECTOR_RIM", RIM_DETECTOR_RIM, "detector: the search for regions"},
    {"DETECTOR_INTERFERENCE", RIM_DETECTOR_INTERFERENCE, "motion interference"},
    {"KIND_SHIFT", RIM_KIND_SHIFT, "kind, and the unit of shift: the outcome's"},
    {"KIND_GAIN", RIM_KIND_GAIN, "in proportion to the outcome"},
    {"KIND_VARIANCE", RIM_KIND_VARIANCE, "ratio of variances"},
    {"KIND_DRIFT", RIM_KIND_DRIFT, "the outcome's unit, at t_s"},
    {"KIND_REPEAT", RIM_KIND_REPEAT, "share of readings equal to the one before, or to 0"},
    {"KIND_BLOCKED", RIM_KIND_BLOCKED, "m/s slower than commanded"},
    {"KIND_PUSHED", RIM_KIND_PUSHED, "m/s faster than commanded"},
    {"FLAG_REPLAY", RIM_ALARM_FLAG_REPLAY, "flags: from a recording"},
    {"FLAG_LATCHED", RIM_ALARM_FLAG_LATCHED, "the cause is gone, nobody has acknowledged it"},
    {"FLAG_ACKNOWLEDGED", RIM_ALARM_FLAG_ACKNOWLEDGED, "somebody has"},
    {"COMMAND_ACKNOWLEDGE", RIM_COMMAND_ACKNOWLEDGE, "command"},
    {"COMMAND_CLEAR", RIM_COMMAND_CLEAR, "forget the alarm and its observations"},
    {"COMMAND_DESCRIBE", RIM_COMMAND_DESCRIBE, "send RIM_MODEL now"}};

std::string constant(long long value, const std::string &name, const std::string &comment) {
  return fmt::format("  const int32_t {} = {};{}\n", name, value,
                     comment.empty() ? "" : "  // " + comment);
}

std::string upper(const std::string &text) {
  std::string out;
  for (const char letter : text)
    out += std::isalnum(static_cast<unsigned char>(letter)) != 0
               ? static_cast<char>(std::toupper(static_cast<unsigned char>(letter)))
               : '_';
  return out;
}

std::string indices(const char *what, const std::vector<Quantity> &list) {
  std::set<std::string> used;
  std::string text;
  for (std::size_t i = 0; i < list.size(); ++i) {
    std::string name = std::string(what) + "_" + upper(list[i].name);
    while (!used.insert(name).second)
      name += "_" + std::to_string(i);
    text += constant(static_cast<long long>(i), name,
                     list[i].name + (list[i].unit.empty() ? "" : ", " + list[i].unit));
  }
  return text;
}

} // namespace

std::string model_lcm(const ImageFacts &facts) {
  std::string text =
      fmt::format("// The numbers in the messages of flight image {:08x}, by rim show "
                  "--lcm.\npackage rim;\n\nstruct model_constants_t {{\n",
                  facts.model_id);
  for (const Code &code : kCodes)
    text += constant(code.value, code.name, code.means);
  // As its bits, like the field model_id: large ones are negative.
  text += constant(static_cast<std::int32_t>(facts.model_id), "MODEL_ID", "");
  text += indices("FEATURE", facts.names.features);
  text += indices("OUTCOME", facts.names.outcomes);
  return text + "}\n";
}

} // namespace rim
