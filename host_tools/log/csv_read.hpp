// SPDX-License-Identifier: MIT
// log/csv_read.hpp - a log as CSV text.
#pragma once

#include <string>

#include "log/log.hpp"
#include "log/source.hpp"

namespace rim {

// The rows of a CSV text, with the columns that the schema derives; not resampled. Errors as
// read_log().
Log read_csv_log(const std::string &path, LogSource source, const Schema *schema,
                 const ReadOptions &options);

} // namespace rim
