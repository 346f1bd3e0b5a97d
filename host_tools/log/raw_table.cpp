// SPDX-License-Identifier: MIT
#include "log/raw_table.hpp"

#include <algorithm>
#include <limits>

#include "log/candump_log.hpp"
#include "log/csv_text.hpp"
#include "log/date_time.hpp"
#include "log/lcm_log.hpp"
#include "log/source.hpp"
#include "util/error.hpp"

namespace rim {

namespace {

constexpr std::size_t kWords = 9; // more values than a mode or a flag has

void add_word(RawColumn &column, std::string_view word) {
  if (column.words.size() < kWords &&
      std::find(column.words.begin(), column.words.end(), word) == column.words.end())
    column.words.emplace_back(word);
}

void add_field(RawColumn &column, std::string_view field) {
  double value = 0.0;
  if (!parse_number(field, value)) {
    if (parse_comma_number(field, value)) {
      column.decimal_comma = true;
    } else if (parse_date_time(field, value)) {
      column.dates++;
    } else {
      value = std::numeric_limits<double>::quiet_NaN();
      column.text++;
    }
  } else if (value != value) {
    column.empty++;
  }
  if (column.words.size() < kWords && !field.empty())
    add_word(column, field);
  column.values.push_back(value);
}

// The first line that is neither blank nor a comment.
bool take_content(std::string_view text, std::size_t &at, std::string_view &line) {
  while (take_line(text, at, line))
    if (!trimmed(line).empty() && line.front() != '#')
      return true;
  return false;
}

} // namespace

char guess_delimiter(const std::string &header) {
  char best = ',';
  std::size_t most = 0;
  std::vector<std::string_view> fields;
  for (const char delimiter : {',', ';', '\t', '|'}) {
    split_fields(header, delimiter, fields);
    if (fields.size() > most) {
      most = fields.size();
      best = delimiter;
    }
  }
  return best;
}

RawTable read_raw_table(const std::string &path, const ReaderOptions &reader) {
  Schema schema;
  schema.reader = reader;
  const LogSource source = read_log_source(path, &schema);
  const std::string &text = source.text;
  const auto fail = [&](const std::string &reason) { throw DataError(path + ": " + reason); };
  if (text.empty())
    fail("is empty");
  if (is_candump_log(text))
    fail("holds CAN frames; the DBC of the bus says what they are: give it with --dbc, or put the "
         "columns into a model by rim can-table");
  if (is_lcm_log(text))
    fail(
        "is an LCM event log, which carries no names: give the types with --types, or the names of "
        "the values of RIM_OBSERVATION in a schema, observation = [\"s.NAME\", ...]");
  std::size_t at = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0;
  std::string_view line;
  if (!take_content(text, at, line))
    fail("has no header");
  RawTable table;
  table.path = path;
  table.delimiter = source.converted ? ',' : guess_delimiter(std::string(line));
  std::vector<std::string_view> fields;
  split_fields(line, table.delimiter, fields);
  for (const auto &field : fields) {
    table.columns.emplace_back();
    table.columns.back().name = trimmed(field);
  }
  while (take_line(text, at, line)) {
    if (line.empty() || line.front() == '#')
      continue;
    table.rows++;
    split_fields(line, table.delimiter, fields);
    if (fields.size() != table.columns.size())
      fail("row " + std::to_string(table.rows) + ": " + std::to_string(fields.size()) +
           " fields where the header has " + std::to_string(table.columns.size()) + " (line " +
           std::to_string(line_of(text, at)) + " of the file)");
    for (std::size_t c = 0; c < fields.size(); ++c)
      add_field(table.columns[c], trimmed(fields[c]));
  }
  if (table.rows == 0)
    fail("has a header but no rows");
  return table;
}

} // namespace rim
