// SPDX-License-Identifier: MIT
// log/date_time.hpp - dates and times of day as loggers write them.
#pragma once

#include <limits>
#include <string_view>

namespace rim {

// How the times of one column of one file are read, from its first row to its last.
struct DateReading {
  bool day_first = false;                                   // 13/04/2025; otherwise 04/13/2025
  double last_s = std::numeric_limits<double>::quiet_NaN(); // of a time of day alone
  int midnights = 0;                                        // that these have passed
};

// Seconds since 1970-01-01T00:00:00, without leap seconds, of ISO 8601 (2025-03-02T08:00:00.250;
// with a blank for the T, / for -, a comma for the point, no seconds, Z or +01:00 behind it), of
// 02.03.2025 08:00:00, 03/02/2025 8:00:00 AM or 2-Mar-2025 08:00:00; of a time of day alone
// (08:00:00.250) seconds since the midnight before the file's first row: one that lies more than
// half a day before the last is of the next day. Years of two digits are 1970 to 2069. Without a
// zone the text is taken as it stands. False where it is none of these.
bool parse_date_time(std::string_view text, DateReading &reading, double &seconds);

// Whether the text is a date alone, in one of those forms.
bool parse_date(std::string_view text, bool day_first);

// Whether the text is any of these, by this order of day and month.
bool is_date(std::string_view text, bool day_first);

} // namespace rim
