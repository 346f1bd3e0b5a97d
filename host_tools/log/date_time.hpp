// SPDX-License-Identifier: MIT
// log/date_time.hpp - dates and times of day as loggers write them.
#pragma once

#include <string_view>

namespace rim {

// Seconds since 1970-01-01T00:00:00, without leap seconds, of ISO 8601 (2025-03-02T08:00:00.250;
// with a blank for the T, / for -, a comma for the point, no seconds, Z or +01:00 behind it) or of
// 02.03.2025 08:00:00; of a time of day alone (08:00:00.250) seconds since midnight. Without a zone
// the text is taken as it stands. False where it is none of these.
bool parse_date_time(std::string_view text, double &seconds);

} // namespace rim
