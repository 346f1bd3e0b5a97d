// SPDX-License-Identifier: MIT
// log/raw_table.hpp - a CSV file as it stands, before any schema says what its columns are.
#pragma once

#include "log/schema.hpp"

#include <string>
#include <vector>

namespace rim {

struct RawColumn {
  std::string name;
  std::vector<double> values;      // a row each; NaN: empty, or no number
  std::size_t empty = 0, text = 0; // rows without a value; rows with text that is no number
  std::size_t dates = 0;           // rows with a date and time of day; their values are seconds
  bool decimal_comma = false;      // of that text some is a number with a comma: 0,25
  std::vector<std::string> words;  // the distinct texts and whole numbers, the first 9
};

struct RawTable {
  std::string path;
  char delimiter = ',';
  std::size_t rows = 0;
  std::vector<RawColumn> columns;
};

// The delimiter that splits the header best: of , ; tab and |.
char guess_delimiter(const std::string &header);

// Reads the whole file, also packed or of another format (log/source.hpp). A number with a decimal
// comma is read as one. DataError: missing, frames or messages that nothing names, empty, no text,
// no header, no rows, or a row with another number of fields than the header (file and row).
RawTable read_raw_table(const std::string &path, const ReaderOptions &reader = {});

} // namespace rim
