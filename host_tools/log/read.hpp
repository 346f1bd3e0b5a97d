// SPDX-License-Identifier: MIT
// log/read.hpp - which of the three forms a log has. read_log() of log/log.hpp reads any of them.
#pragma once

#include <string_view>

namespace rim {

enum class LogForm { csv, lcm_events, candump };

// By the first bytes; what is nothing else is taken for CSV.
LogForm form_of_log(std::string_view bytes);

} // namespace rim
