// SPDX-License-Identifier: MIT
// bus/sentence.hpp - an alarm as a sentence: which sensor, in which region, since when, how sure.
#pragma once

#include "image/names.hpp"

#include "rim/alarm.h"
#include "rim/can.h"

namespace rim {

// One line of plain text without a line end, for example
//   "radar altitude reads 12.4 m high (standard error 1.1 m) where speed is 100 to 180 m/s, since
//   t = 310.2 s (84 observations): at most 1 healthy run in 50 shows as much"
std::string alarm_sentence(const rim_alarm &alarm, const Names &names);

// "plan 3 enters the region of alarm 12 in 4.50 s", "plan 3 does not enter an alarmed region".
std::string entry_sentence(const rim_entry &entry);

// "speed is 100 to 180 m/s and mass is 900 to 950 kg"; empty for everywhere.
std::string region_words(const rim_region &region, const Names &names);

const char *level_text(int level);       // "OK" "WARN" "ERROR" "STALE"
const char *state_text(int state);       // "none" "raised" "updated" "cleared"
const char *detector_text(int detector); // "rim" "interference"
const char *kind_text(int kind);         // "shift" "gain" "variance" "drift" "repeat"

} // namespace rim
