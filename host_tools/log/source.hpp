// SPDX-License-Identifier: MIT
// log/source.hpp - the content of a log file as text, whatever it is packed or written in.
#pragma once

#include "log/schema.hpp"

#include <string>

namespace rim {

struct LogSource {
  std::string text;       // CSV, candump -L text, or the bytes of an LCM event log
  bool converted = false; // by a reader of the Python package: CSV with commas and decimal points
};

// Reads the whole of a log. "-" is standard input. gzip and Zstandard are recognised by their first
// bytes and unpacked; text becomes UTF-8; other formats go through the readers of the Python
// package (python/src/rimwatch/readers), which need a file by name. What is no regular file is
// kept, to be asked for again. schema: may be null; its [reader] is handed to the readers.
// DataError: missing, unreadable, cut off, damaged, of no known format, or the reader's own words,
// which name the package that is missing.
LogSource read_log_source(const std::string &path, const Schema *schema);

// Unpacks gzip or Zstandard, also several members one after the other; other bytes come back as
// they are. path is for the messages.
std::string unpacked(const std::string &path, std::string bytes);

} // namespace rim
