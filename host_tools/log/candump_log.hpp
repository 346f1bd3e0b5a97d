// SPDX-License-Identifier: MIT
// log/candump_log.hpp - logs of `candump -L` as rows, by the CAN table of a flight image.
#pragma once

#include "log/log.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rim {

// Whether the text begins as candump -L does: "(1700000000.000000) can0 123#".
bool is_candump_log(std::string_view text);

// The rows that the frames of a log make, as rimd would have made them of the same frames. Times
// count from the first frame that the table reads, unless a signal carries the time. table: bytes
// of the image's section; names: of its values. Frames that the table refuses, lines that are no
// frame, rows that lack a signal and times that do not increase are counted and skipped; the first
// is named in a warning. DataError: no table, a table that is not good, no row at all.
Log read_candump_log(const std::string &path, std::string_view text,
                     const std::vector<std::uint8_t> &table, const std::vector<std::string> &names,
                     double signal_age_s, std::FILE *warnings);

} // namespace rim
