// SPDX-License-Identifier: MIT
#include "log/csv_read.hpp"
#include "log/csv_text.hpp"
#include "log/date_time.hpp"
#include "log/derive.hpp"
#include "log/raw_table.hpp"
#include "log/schema.hpp"
#include "util/error.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

namespace rim {

namespace {

// One value of a row: where it comes from in the file and what it becomes.
struct Slot {
  std::size_t field;
  double scale, offset;
  const std::vector<std::string> *words; // null: a number
};

struct Filter {
  const KeepRule *rule;
  std::size_t field;
};

class CsvReader {
public:
  CsvReader(const std::string &path, LogSource source, const Schema *schema,
            const ReadOptions &options);

  Log read() {
    read_header();
    plan();
    check_outcomes();
    read_rows();
    warn();
    return std::move(log_);
  }
  // What the schema's derived columns are made from: a row for each of the log's, a column for each
  // [[derive]].
  Matrix sources() { return std::move(sources_); }

private:
  [[noreturn]] void fail(const std::string &reason) const {
    throw DataError(log_.path + ": " + reason);
  }
  [[noreturn]] void fail_row(const std::string &column, const std::string &reason) const {
    throw DataError(log_.path + ":row " + std::to_string(log_.rows_in_file) +
                    (column.empty() ? "" : ": column '" + column + "'") + ": " + reason +
                    at_line());
  }

  // Rows count from 1 after the header; an editor shows lines.
  std::string at_line() const {
    return source_.converted ? ""
                             : " (line " + std::to_string(line_of(text_, at_)) + " of the file)";
  }
  bool number(std::string_view field, double &value) const {
    if (decimal_ == '.' ? parse_number(field, value)
                        : parse_comma_number(field, value) || parse_number(field, value))
      return true;
    value = std::numeric_limits<double>::quiet_NaN();
    return schema_ != nullptr && std::find(schema_->missing.begin(), schema_->missing.end(),
                                           trimmed(field)) != schema_->missing.end();
  }
  std::string not_a_number(std::size_t field) const;
  bool word(const Slot &slot, double &value) const;

  bool next_line(std::string_view &line) { return take_line(text_, at_, line); }
  void split(std::string_view line) { split_fields(line, delimiter_, fields_); }
  bool take_header(bool any);
  void read_header();
  std::string columns_found() const;
  std::size_t file_column(const std::string &name, const char *what) const;
  void add_column(const std::string &name, const std::string &unit, const Slot &slot, Role role);
  void plan();
  void plan_mapped();
  void plan_native();
  void plan_sources();
  void check_outcomes() const;
  bool kept() const;
  bool time_of(std::string_view field, double &t_s);
  bool parse_row(double &t_s, double *values);
  bool time_moves_on(double t_s);
  void read_rows();
  void shrink(std::size_t rows);
  void warn() const;

  const Schema *schema_;
  const ReadOptions &options_;
  LogSource source_;
  const std::string &text_;
  char delimiter_ = '\0', decimal_ = '.';
  std::size_t at_ = 0;
  Log log_;
  Matrix sources_;
  std::vector<std::string> header_;
  std::vector<std::string_view> fields_;
  std::vector<Slot> slots_;
  Slot time_{0, 1.0, 0.0, nullptr};
  std::size_t date_ = 0; // the field of the date, where the schema names one
  DateReading dates_;
  double first_date_s_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<Filter> filters_;
  std::vector<bool> used_;
  std::string ignored_;
  std::string first_skipped_;
};

CsvReader::CsvReader(const std::string &path, LogSource source, const Schema *schema,
                     const ReadOptions &options)
    : schema_(schema), options_(options), source_(std::move(source)), text_(source_.text) {
  log_.path = path;
  if (schema != nullptr && !source_.converted) {
    delimiter_ = schema->delimiter;
    decimal_ = schema->decimal;
    dates_.day_first = schema->day_first;
  }
  if (source_.converted)
    delimiter_ = ',';
}

void CsvReader::read_header() {
  if (text_.empty())
    fail("is empty");
  if (text_.compare(0, 3, "\xEF\xBB\xBF") == 0)
    at_ = 3;
  const std::size_t start = at_;
  if (take_header(false))
    return;
  at_ = start;
  log_.comments.clear();
  if (!take_header(true))
    fail("has no header");
}

// The first line that names the time's column: what stands above it is not of the table. Any: the
// first that is no comment, whose names an error can show.
bool CsvReader::take_header(bool any) {
  const std::string time = schema_ != nullptr ? schema_->time.from : "t_s";
  const char given = delimiter_;
  std::string_view line;
  for (int tried = 0; tried < 60 && next_line(line);) {
    if (!line.empty() && line.front() == '#') {
      line.remove_prefix(line.size() > 1 && line[1] == ' ' ? 2 : 1);
      log_.comments.emplace_back(line);
    } else if (!trimmed(line).empty()) {
      tried++;
      delimiter_ = given == '\0' ? guess_delimiter(std::string(line)) : given;
      split(line);
      header_.clear();
      for (const auto &f : fields_)
        header_.emplace_back(trimmed(f));
      used_.assign(header_.size(), false);
      if (any || std::find(header_.begin(), header_.end(), time) != header_.end())
        return true;
    }
  }
  delimiter_ = given;
  return false;
}

// What a person needs who gave a file of other names or of another delimiter.
std::string CsvReader::columns_found() const {
  std::string text;
  for (std::size_t i = 0; i < header_.size() && i < 12; ++i)
    text += (i == 0 ? "; the file has '" : "', '") + header_[i];
  text += header_.size() > 12 ? "' and " + std::to_string(header_.size() - 12) + " more" : "'";
  if (header_.size() == 1)
    text += ", one column when separated by '" + std::string(1, delimiter_) + "'";
  return schema_ == nullptr ? text + "; `rim schema` proposes a --schema for it" : text;
}

std::size_t CsvReader::file_column(const std::string &name, const char *what) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end())
    fail("column '" + name + "': missing" + what + columns_found());
  if (std::find(found + 1, header_.end(), name) != header_.end())
    fail("column '" + name + "': stands twice in the header; which one is meant?");
  return static_cast<std::size_t>(found - header_.begin());
}

void CsvReader::add_column(const std::string &name, const std::string &unit, const Slot &slot,
                           Role role) {
  log_.columns.push_back({name, unit.empty() ? unit_of_name(name) : unit, role});
  slots_.push_back(slot);
  used_[slot.field] = true;
}

void CsvReader::plan_mapped() {
  for (const auto &map : schema_->columns) {
    Role role = Role::context;
    role_of_name(map.name, role); // checked when the schema was read
    const std::size_t field =
        file_column(map.from, (" (asked for by " + schema_->path + ")").c_str());
    add_column(map.name, map.unit,
               {field, map.scale, map.offset, map.words.empty() ? nullptr : &map.words}, role);
  }
  // A column that rows are chosen by is not used up by that: its prefix still says its role.
  for (const auto &rule : schema_->keep)
    filters_.push_back({&rule, file_column(rule.column, " (a [[keep]] of the schema)")});
  for (const std::string &name : schema_->leave_out)
    used_[file_column(name, " (a leave_out of the schema)")] = true;
}

// Columns whose own name carries a role, unless the schema already made one of that name.
void CsvReader::plan_native() {
  for (std::size_t field = 0; field < header_.size(); ++field) {
    const std::string &name = header_[field];
    Role role = Role::context;
    const bool made = find_column(log_, name) >= 0; // by the schema
    if (!used_[field] && !made && role_of_name(name, role))
      add_column(name, "", {file_column(name, ""), 1.0, 0.0, nullptr}, role);
  }
}

void CsvReader::plan() {
  const ColumnMap time =
      schema_ != nullptr ? schema_->time : ColumnMap{"t_s", "t_s", "s", 1.0, 0.0, {}};
  time_ = {file_column(time.from, " (the time)"), time.scale, time.offset, nullptr};
  used_[time_.field] = true;
  if (schema_ != nullptr && !schema_->date.empty()) {
    date_ = file_column(schema_->date, " (the date)");
    used_[date_] = true;
  }
  if (schema_ != nullptr)
    plan_mapped();
  plan_native();
  for (const char *optional : {"m.", "sd."}) {
    for (std::size_t c = log_.columns.size(); c-- > 0;) {
      const std::string name = log_.columns[c].name, prefix = optional;
      if (name.rfind(prefix, 0) == 0 && find_column(log_, "z." + name.substr(prefix.size())) < 0) {
        used_[slots_[c].field] = false;
        log_.columns.erase(log_.columns.begin() + static_cast<long>(c));
        slots_.erase(slots_.begin() + static_cast<long>(c));
      }
    }
  }
  plan_sources();
  for (std::size_t field = 0; field < header_.size(); ++field)
    if (!used_[field] && schema_ == nullptr)
      ignored_ += (ignored_.empty() ? "'" : ", '") + header_[field] + "'";
  if (slots_.empty())
    fail("no column has a role (x. u. s. z. m. sd.); a schema can give them one");
}

// Sources of derived columns are read behind the columns.
void CsvReader::plan_sources() {
  if (schema_ == nullptr)
    return;
  for (const auto &rule : schema_->derive) {
    const std::size_t field = file_column(rule.from, " (a [[derive]] of the schema)");
    slots_.push_back({field, 1.0, 0.0, nullptr});
    used_[field] = true;
  }
}

void CsvReader::check_outcomes() const {
  for (const auto &column : log_.columns)
    if (column.role == Role::outcome && find_column(log_, "m." + column.name.substr(2)) < 0)
      fail("column '" + column.name + "': needs 'm." + column.name.substr(2) +
           "', the mean that the simulation predicted");
}

bool CsvReader::kept() const {
  for (const auto &filter : filters_) {
    const std::string_view field = trimmed(fields_[filter.field]);
    const auto &values = filter.rule->values;
    if (!values.empty() && std::find(values.begin(), values.end(), field) == values.end())
      return false;
    double value = 0.0;
    if (filter.rule->bounded &&
        (!number(field, value) || !(value >= filter.rule->min && value <= filter.rule->max)))
      return false;
  }
  return true;
}

std::string CsvReader::not_a_number(std::size_t field) const {
  const std::string shown(trimmed(fields_[field]));
  double ignored = 0.0;
  std::string hint;
  if (parse_comma_number(shown, ignored))
    hint = ": has it a decimal comma? decimal = \",\" in a schema says so";
  else if (is_date(shown, !dates_.day_first))
    hint = std::string(": is its ") + (dates_.day_first ? "month" : "day") +
           " first? day_first = " + (dates_.day_first ? "false" : "true") + " in a schema says so";
  else if (log_.rows_in_file == 1 && field == time_.field)
    hint = ": is this a line of units? units_line = true in a schema says so";
  else if (field != time_.field)
    hint = "; if it stands for no value, missing = [\"" + shown + "\"] in a schema says so";
  return "'" + shown + "' is not a number" + hint;
}

// The place of the field's text among the slot's words; NaN where it stands for no value.
bool CsvReader::word(const Slot &slot, double &value) const {
  const std::string_view field = trimmed(fields_[slot.field]);
  const auto found = std::find(slot.words->begin(), slot.words->end(), field);
  if (found != slot.words->end()) {
    value = static_cast<double>(found - slot.words->begin());
    return true;
  }
  return number(field, value) && std::isnan(value);
}

// A number, or a date and time of day: those count from the file's first.
bool CsvReader::time_of(std::string_view field, double &t_s) {
  if (number(field, t_s))
    return true;
  double date_s = 0.0;
  const bool apart = schema_ != nullptr && !schema_->date.empty();
  if (!(apart ? parse_date_time(std::string(trimmed(fields_[date_])) + " " +
                                    std::string(trimmed(field)),
                                dates_, date_s)
              : parse_date_time(field, dates_, date_s)))
    return false;
  if (std::isnan(first_date_s_))
    first_date_s_ = date_s;
  t_s = std::round(1e6 * (date_s - first_date_s_)) * 1e-6;
  return true;
}

// False when a value is missing or not finite.
bool CsvReader::parse_row(double &t_s, double *values) {
  std::size_t bad = header_.size();
  const auto one = [&](const Slot &slot, double &value) {
    const std::string_view field = fields_[slot.field];
    if (slot.words != nullptr && !word(slot, value))
      fail_row(header_[slot.field],
               "'" + std::string(trimmed(field)) + "' is none of the words that the schema names");
    if (slot.words == nullptr && !(&slot == &time_ ? time_of(field, value) : number(field, value)))
      fail_row(header_[slot.field], not_a_number(slot.field));
    value = slot.scale * value + slot.offset;
    if (!std::isfinite(value) && bad == header_.size())
      bad = slot.field;
  };
  one(time_, t_s);
  for (std::size_t i = 0; i < slots_.size(); ++i)
    one(slots_[i], values[i]);
  if (bad == header_.size())
    return true;
  if (first_skipped_.empty()) {
    const std::string shown(trimmed(fields_[bad]));
    first_skipped_ = "row " + std::to_string(log_.rows_in_file) + ": column '" + header_[bad] +
                     "': " + (shown.empty() ? "empty" : "'" + shown + "'") + at_line();
  }
  return false;
}

bool CsvReader::time_moves_on(double t_s) {
  if (log_.t_s.empty() || t_s > log_.t_s.back())
    return true;
  const std::string reason =
      std::string("time ") + (t_s < log_.t_s.back() ? "runs backwards (" : "repeats (") +
      std::to_string(t_s) + " s after " + std::to_string(log_.t_s.back()) + " s)";
  if (!options_.skip_bad_time && !(schema_ != nullptr && schema_->skip_bad_time))
    fail_row(header_[time_.field],
             reason + "; a schema with not_increasing = \"skip\" under [time] skips such rows");
  if (first_skipped_.empty())
    first_skipped_ = "row " + std::to_string(log_.rows_in_file) + ": column '" +
                     header_[time_.field] + "': " + reason + at_line();
  return false;
}

// To the rows used, and the sources of derived columns apart.
void CsvReader::shrink(std::size_t rows) {
  const auto n = static_cast<Eigen::Index>(rows);
  const auto columns = static_cast<Eigen::Index>(log_.columns.size());
  const Eigen::Index sources = log_.values.cols() - columns;
  sources_ = log_.values.topRightCorner(n, sources);
  if (sources > 0)
    log_.values = Matrix(log_.values.topLeftCorner(n, columns));
  else
    log_.values.conservativeResize(n, Eigen::NoChange);
}

void CsvReader::read_rows() {
  const std::size_t room =
      static_cast<std::size_t>(std::count(
          text_.begin() + static_cast<long>(std::min(at_, text_.size())), text_.end(), '\n')) +
      1;
  log_.values.resize(static_cast<Eigen::Index>(room), static_cast<Eigen::Index>(slots_.size()));
  log_.t_s.reserve(room);
  log_.row.reserve(room);
  fields_.reserve(header_.size());
  std::string_view line;
  std::size_t rows = 0;
  bool units = schema_ != nullptr && schema_->units_line;
  while (next_line(line)) {
    if (line.empty() || line.front() == '#' || std::exchange(units, false))
      continue;
    log_.rows_in_file++;
    split(line);
    if (fields_.size() != header_.size())
      fail_row("", std::to_string(fields_.size()) + " fields where the header has " +
                       std::to_string(header_.size()) +
                       (at_ > text_.size() ? " (is the file cut off?)" : ""));
    if (!kept()) {
      log_.rows_filtered++;
      log_.filtered.push_back(log_.rows_in_file);
      continue;
    }
    double t_s = 0.0;
    const bool whole = parse_row(t_s, log_.values.row(static_cast<Eigen::Index>(rows)).data());
    note_time(&log_, t_s);
    if (!whole || !time_moves_on(t_s)) {
      log_.rows_skipped++;
      continue;
    }
    log_.t_s.push_back(t_s);
    log_.row.push_back(log_.rows_in_file);
    rows++;
  }
  if (log_.rows_in_file == 0)
    fail("has a header but no rows");
  if (rows == 0)
    fail("none of its " + std::to_string(log_.rows_in_file) + " rows can be used" +
         (first_skipped_.empty() ? "" : " (" + first_skipped_ + ")"));
  shrink(rows);
}

void CsvReader::warn() const {
  if (options_.warnings == nullptr)
    return;
  if (!ignored_.empty())
    std::fprintf(options_.warnings, "rim: warning: %s: ignored: %s\n", log_.path.c_str(),
                 ignored_.c_str());
  if (log_.rows_skipped > 0)
    std::fprintf(options_.warnings, "rim: warning: %s: %u of %u rows skipped, the first: %s\n",
                 log_.path.c_str(), log_.rows_skipped, log_.rows_in_file, first_skipped_.c_str());
}

} // namespace

Log read_csv_log(const std::string &path, LogSource source, const Schema *schema,
                 const ReadOptions &options) {
  CsvReader reader(path, std::move(source), schema, options);
  Log log = reader.read();
  if (schema != nullptr)
    derive_columns(log, reader.sources(), *schema);
  return log;
}

} // namespace rim
