// bus/jsonl.hpp - alarms as JSON, one object a line.
//
// t_s, seq, detector, state, level, channels, features, region {center, inverse_shape, bounds},
// ln_anom, threshold, p_value, observations, shift {channel: value}, sentence; and kind, since_s,
// shift_sd, model_id, replay. Names where they are known, "outcome 3" where not.
#pragma once

#include "bus/names.hpp"

#include "rim/alarm.h"

namespace rim {

// Without a line end. Numbers that are not finite become null.
std::string alarm_json(const rim_alarm &alarm, const Names &names);

} // namespace rim
