// SPDX-License-Identifier: MIT
// bus/jsonl.hpp - alarms, and what else a monitor says, as JSON, one object per line. Of an alarm:
//
// t_s, seq, detector, state, level, channels, features, region {center, inverse_shape, bounds},
// ln_anom, threshold, p_value, observations, shift {channel: value}, sentence; and kind, since_s,
// shift_sd, model_id, replay. Names where they are known, "outcome 3" where not.
#pragma once

#include "image/names.hpp"

#include "rim/alarm.h"
#include "rim/can.h"
#include "rim/lcm.h"

namespace rim {

// Without a line end. Numbers that are not finite become null.
std::string alarm_json(const rim_alarm &alarm, const Names &names);

// What else a monitor says; each begins with "message": "entry", "health", "counters" or
// "heartbeat". to_entry_s is null where the plan does not enter.
std::string message_json(const rim_entry &entry);
std::string message_json(const rim_health_message &health);
std::string message_json(const rim_counters &counters);
std::string message_json(const rim_can_heartbeat &heartbeat);

} // namespace rim
