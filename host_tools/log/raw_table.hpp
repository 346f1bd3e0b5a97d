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
  std::size_t days = 0;            // rows with a date alone; they are text
  std::size_t one_order = 0;       // dates of which a number says which is the day: 13/04/2025
  std::size_t slashed = 0;         // dates with slashes, whose day or month may come first
  bool decimal_comma = false;      // of that text some is a number with a comma: 0,25
  std::vector<std::string> words;  // the distinct texts and numbers, the first 9
  std::vector<std::string> texts;  // the distinct texts that are no numbers, the first 9
  std::string unit;                // of the line below the header; empty: there is none
};

struct RawTable {
  std::string path;
  char delimiter = ',';
  std::size_t rows = 0;
  std::size_t header_line = 1; // of the file
  bool units_line = false;     // the line below the header holds units
  bool day_first = false;      // 13/04/2025
  std::vector<RawColumn> columns;
};

// The delimiter that splits the header best: of , ; tab and |; blanks where none of them does.
char guess_delimiter(const std::string &header);

// Reads the whole file, also packed or of another format (log/source.hpp). A number with a decimal
// comma is read as one. The header is the first line of words with as many fields as nearly all of
// the lines below it. DataError: missing, frames or messages that nothing names, empty, no text,
// no header, no rows, or a row with another number of fields than the header (file and row).
RawTable read_raw_table(const std::string &path, const ReaderOptions &reader = {});

} // namespace rim
