// SPDX-License-Identifier: MIT
#include "log/raw_table.hpp"

#include <algorithm>
#include <cctype>
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

void add_word(std::vector<std::string> &words, std::string_view word) {
  if (words.size() < kWords && std::find(words.begin(), words.end(), word) == words.end())
    words.emplace_back(word);
}

// A date with slashes, and whether it is one with the day and month the other way round too.
void add_order(RawColumn &column, std::string_view field, const DateReading &dates) {
  if (field.find('/') == std::string_view::npos ||
      std::isdigit(static_cast<unsigned char>(field.front())) == 0)
    return;
  column.slashed++;
  column.one_order += !is_date(field, !dates.day_first);
}

void add_field(RawColumn &column, std::string_view field, DateReading &dates) {
  double value = 0.0;
  if (!parse_number(field, value)) {
    if (parse_comma_number(field, value)) {
      column.decimal_comma = true;
    } else if (parse_date_time(field, dates, value)) {
      column.dates++;
      add_order(column, field, dates);
    } else {
      value = std::numeric_limits<double>::quiet_NaN();
      column.text++;
      if (parse_date(field, dates.day_first)) {
        column.days++;
        add_order(column, field, dates);
      }
      add_word(column.texts, field);
    }
  } else if (value != value) {
    column.empty++;
  }
  if (column.words.size() < kWords && !field.empty())
    add_word(column.words, field);
  column.values.push_back(value);
}

bool is_value(std::string_view field) {
  double ignored = 0.0;
  DateReading dates;
  return parse_number(field, ignored) || parse_comma_number(field, ignored) ||
         parse_date_time(field, dates, ignored) || parse_date(field, false) ||
         parse_date(field, true);
}

// A line that is neither blank nor a comment, and where it begins and ends.
struct Line {
  std::string_view text;
  std::size_t begin, end;
};

bool take_content(std::string_view text, std::size_t &at, Line &line) {
  for (line.begin = at; take_line(text, at, line.text); line.begin = at)
    if (!trimmed(line.text).empty() && line.text.front() != '#') {
      line.end = at;
      return true;
    }
  return false;
}

// Where loggers write about themselves before the table begins, the header is the first line of
// words whose number of fields nine tenths of the next 50 lines have; else the first of all.
Line find_header(std::string_view text, std::size_t at) {
  constexpr std::size_t kTried = 60, kBelow = 50;
  std::vector<Line> lines;
  for (Line line{}; lines.size() < kTried + kBelow && take_content(text, at, line);)
    lines.push_back(line);
  std::vector<std::string_view> fields;
  for (std::size_t i = 0; i < std::min(kTried, lines.size()); ++i) {
    const char delimiter = guess_delimiter(std::string(lines[i].text));
    split_fields(lines[i].text, delimiter, fields);
    const std::size_t wanted = fields.size();
    if (wanted < 2 || std::any_of(fields.begin(), fields.end(), [](std::string_view f) {
          return !trimmed(f).empty() && is_value(trimmed(f));
        }))
      continue;
    const std::size_t end = std::min(lines.size(), i + 1 + kBelow);
    std::size_t same = 0;
    for (std::size_t k = i + 1; k < end; ++k) {
      split_fields(lines[k].text, delimiter, fields);
      same += fields.size() == wanted;
    }
    if (same > 0 && 10 * same >= 9 * (end - i - 1))
      return lines[i];
  }
  return lines.empty() ? Line{} : lines.front();
}

// A header of numbers is none; a comment above it may be the one that was meant.
void refuse_numbers(const RawTable &table, std::string_view above) {
  const auto named = [](const RawColumn &c) { return !is_value(c.name); };
  if (std::any_of(table.columns.begin(), table.columns.end(), named))
    return;
  std::vector<std::string_view> fields;
  split_fields(above, table.delimiter, fields);
  throw DataError(table.path + ": line " + std::to_string(table.header_line) +
                  " holds numbers where the columns' names should stand" +
                  (!above.empty() && fields.size() == table.columns.size()
                       ? ": is the comment above it the header? Take its # away"
                       : ": write a line of names above it"));
}

// A line of text below the header whose columns hold numbers from the next row on.
void take_units(RawTable &table) {
  const auto is_text = [](const RawColumn &c) { return c.text > 0 && c.values[0] != c.values[0]; };
  bool clear = table.rows > 2, any = false;
  for (const RawColumn &c : table.columns) {
    const bool first = is_text(c) && c.texts.front() == c.words.front();
    any = any || (first && c.text == 1 && c.values[1] == c.values[1]);
    clear = clear && (first || c.empty > 0) && !is_value(c.words.empty() ? "" : c.words.front());
  }
  if (!clear || !any)
    return;
  table.units_line = true;
  table.rows--;
  for (RawColumn &c : table.columns) {
    if (!c.words.empty() && is_text(c)) {
      c.unit = c.texts.front();
      c.text--;
      c.texts.erase(c.texts.begin());
      c.words.erase(c.words.begin());
    } else {
      c.empty--;
    }
    c.values.erase(c.values.begin());
  }
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
  if (most == 1 && trimmed(header).find(' ') != std::string_view::npos)
    return ' ';
  return best;
}

namespace {

RawTable read_rows(const std::string &path, const LogSource &source, bool day_first) {
  const std::string &text = source.text;
  const auto fail = [&](const std::string &reason) { throw DataError(path + ": " + reason); };
  const std::size_t start = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0;
  const Line header = find_header(text, start);
  if (header.text.empty())
    fail("has no header");
  RawTable table;
  table.path = path;
  table.day_first = day_first;
  table.delimiter = source.converted ? ',' : guess_delimiter(std::string(header.text));
  table.header_line = line_of(text, header.end);
  std::vector<std::string_view> fields;
  split_fields(header.text, table.delimiter, fields);
  for (const auto &field : fields) {
    table.columns.emplace_back();
    table.columns.back().name = trimmed(field);
  }
  std::string_view line, above(text.data() + start, header.begin - start);
  above = trimmed(above.substr(0, above.find_last_not_of("\r\n") + 1));
  above = above.substr(above.find_last_of('\n') + 1);
  refuse_numbers(table, above.substr(0, 1) == "#" ? above : std::string_view());
  std::vector<DateReading> dates(fields.size());
  for (DateReading &reading : dates)
    reading.day_first = day_first;
  for (std::size_t at = header.end; take_line(text, at, line);) {
    if (line.empty() || line.front() == '#')
      continue;
    table.rows++;
    split_fields(line, table.delimiter, fields);
    if (fields.size() != table.columns.size())
      fail("row " + std::to_string(table.rows) + ": " + std::to_string(fields.size()) +
           " fields where the header has " + std::to_string(table.columns.size()) + " (line " +
           std::to_string(line_of(text, at)) + " of the file)");
    for (std::size_t c = 0; c < fields.size(); ++c)
      add_field(table.columns[c], trimmed(fields[c]), dates[c]);
  }
  if (table.rows == 0)
    fail("has a header but no rows");
  take_units(table);
  return table;
}

} // namespace

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
  RawTable table = read_rows(path, source, false);
  // 04/13/2025 as in the USA, unless that leaves days and months that are none.
  const auto slashed = [](const RawColumn &c) {
    return std::any_of(c.texts.begin(), c.texts.end(),
                       [](const std::string &word) { return is_date(word, true); });
  };
  return std::any_of(table.columns.begin(), table.columns.end(),
                     [&](const RawColumn &c) { return c.days < c.text && slashed(c); })
             ? read_rows(path, source, true)
             : table;
}

} // namespace rim
