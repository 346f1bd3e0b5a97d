// SPDX-License-Identifier: MIT
// log/log.hpp - a log: time, columns with a role, values by row; CSV in and out.
//
// The prefix of a column's name is its role, a known suffix its unit ("s.altitude_m"):
//   t_s  time;  x. context;  u. command (context);  s. sensor (context now, outcome at the next
//   row); z. measured outcome with m. predicted mean and sd. predicted standard deviation of the
//   same name.
// Any other column is ignored, with one warning that names them. Lines that begin with '#' are
// comments. Rows count from 1 after the header.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace rim {

enum class Role { context, command, sensor, outcome, mean, sd };

struct Column {
  std::string name; // with prefix, e.g. "s.altitude_m"
  std::string unit; // "m/s"; empty: none or not known
  Role role;
};

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Log {
  std::string path;
  std::vector<Column> columns;
  std::vector<double> t_s;        // strictly increasing
  Matrix values;                  // rows x columns.size(), all finite
  std::vector<std::uint32_t> row; // data row in the file, from 1
  std::uint32_t rows_in_file = 0;
  std::uint32_t rows_skipped = 0;  // a value missing or not finite, or a bad time where tolerated
  std::uint32_t rows_filtered = 0; // left out on purpose by the schema
  std::vector<std::uint32_t> filtered; // those rows, as `row`, where the reader knows them
  // First and last time of the rows that the file holds, used or skipped; NaN: those of t_s.
  double first_s = std::numeric_limits<double>::quiet_NaN(), last_s = first_s;
  std::vector<std::string> comments; // written and read as '# ...' lines before the header
};

struct Schema; // log/schema.hpp

// What a log of CAN frames is read by: the table of signals in a flight image.
struct CanReading {
  std::vector<std::uint8_t> table; // bytes of the image's section
  std::vector<std::string> names;  // of its values, with prefix
  double signal_age_s = 1.0;       // an older signal makes the row incomplete
};

struct ReadOptions {
  bool skip_bad_time = false; // skip and count rows whose time repeats or runs backwards
  std::FILE *warnings = stderr;
  // Names, with prefix, of the values of RIM_OBSERVATION in an LCM event log, which carries none.
  std::vector<std::string> observation_names;
  std::optional<CanReading> can; // none: a log of CAN frames is refused
};

// Reads a log: CSV, LCM event log, candump text, packed or of another format (log/source.hpp), told
// by its first bytes. The delimiter of CSV is the schema's, else the one that splits the header
// best. Throws DataError naming file, row, line, column and reason: missing file, folder, empty,
// header only, no t_s, wrong number of fields, text in a number, z. without m., time that repeats
// or runs backwards. A row with an empty or infinite value is skipped, counted and warned of.
Log read_log(const std::string &path, const Schema *schema = nullptr);
Log read_log(const std::string &path, const Schema *schema, const ReadOptions &options);

// Writes CSV atomically: times with 12, values with 9 significant digits.
void write_log(const Log &log, const std::string &path);

// The unit that a name's suffix says ("s.climb_mps": "m/s"); empty when none is known.
std::string unit_of_name(const std::string &name);
// The suffix that says this unit ("m/s": "mps"), also of some of its other spellings ("deg C",
// "m/s2"); empty when no suffix does.
std::string suffix_of_unit(const std::string &unit);
// False for an unknown prefix or an empty name.
bool role_of_name(const std::string &name, Role &role);
// "s.altitude_m" with its prefix and unit suffix taken off, in words: "altitude".
std::string plain_name(const std::string &name);

// Of every row that is read, skipped or not: the vehicle runs on while a sensor is silent.
void note_time(Log *log, double t_s);

// Index into columns; -1 when there is none.
int find_column(const Log &log, const std::string &name);
// Columns of role context, command and sensor, in file order.
std::vector<int> feature_columns(const Log &log);
// Columns of one role, in file order.
std::vector<int> role_columns(const Log &log, Role role);

} // namespace rim
