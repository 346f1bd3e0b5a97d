// SPDX-License-Identifier: MIT
// log/schema.hpp - maps a foreign log to roles, units and rates; read from TOML.
//
//   schema = "rim-schema/1"
//   delimiter = ";"            # default: the one that splits the header best
//   decimal = ","              # numbers with a decimal comma; default "."
//   missing = ["---", "-"]     # texts that stand for no value, beside empty fields and NA
//   leave_out = ["s.note"]     # columns not used although their own name carries a role
//   units_line = true          # the line below the header holds units, no values
//   resample_hz = 20           # optional: rows on a regular grid
//   resample = "hold"          # "hold" (default: causal) or "linear"
//   max_gap_s = 1.0            # no grid rows inside a longer gap (default: 10 periods)
//   observation = ["s.a_m"]    # names of the values of RIM_OBSERVATION in an LCM event log
//   [reader]                   # what readers of other formats need; files beside the schema
//   dbc = "bus.dbc" ; packets = "packets.csv" ; types = ["state.lcm"] ; rows = "/imu"
//   [time]                     # default: t_s
//   column = "TIME" ; scale = 1e-6 ; offset = 0
//   date = "DATE"              # where the date stands in a column of its own
//   day_first = true           # dates such as 13/04/2025; default: 04/13/2025
//   not_increasing = "skip"    # rows whose time repeats or runs backwards; default "refuse"
//   [[column]]                 # value = scale * field + offset
//   from = "ALT" ; name = "s.altitude_m" ; scale = 0.3048 ; unit = "m"
//   [[column]]                 # texts as numbers: OFF is 0, ON is 1
//   from = "HEATER" ; name = "u.heater" ; words = ["OFF", "ON"]
//   [[keep]]                   # a row is kept when every [[keep]] holds; before all other checks
//   column = "phase" ; values = ["aero", "landing_burn"]
//   [[keep]]
//   column = "ALT" ; min = 0 ; max = 60000       # in the file's own unit
//   [[derive]]                 # trailing rate of change; rows before a full window are left out
//   name = "s.climb_mps" ; from = "ALT" ; kind = "rate" ; window_s = 5 ; order = 2 ; scale = 1
//   [[friction]]               # of a diagnosis: the velocity that an outcome's friction acts on
//   outcome = "z.force_N" ; velocity = "x.rod_mps"        # default: inferred from the logs
//
// Columns of the file that already carry a role prefix are kept as they are, unless leave_out names
// them.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

namespace rim {

struct ColumnMap {
  std::string from, name, unit;
  double scale = 1.0, offset = 0.0;
  std::vector<std::string> words; // read as 0, 1, 2, ...; empty: the fields are numbers
};

struct KeepRule {
  std::string column;
  std::vector<std::string> values; // empty: any
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool bounded = false; // min or max was given
};

// Slope of the least-squares polynomial (order 1 or 2) over the rows of the last window_s, at the
// newest of them.
struct DeriveRule {
  std::string name, from, unit;
  double window_s = 1.0, scale = 1.0;
  int order = 1;
};

// For formats whose files do not say everything; see host_tools/python/src/rimwatch/readers.
struct ReaderOptions {
  std::string dbc;                // what the frames of a candump log mean
  std::string packets;            // the fields of CCSDS packets, as the package ccsdspy reads them
  std::string rows;               // the topic whose messages make the rows
  std::vector<std::string> types; // .lcm files: the types in an LCM event log
};

struct Schema {
  std::string path;
  char delimiter = '\0'; // 0: the one that splits the header best
  char decimal = '.';
  double resample_hz = 0.0; // 0: rows as they come
  bool resample_linear = false;
  double max_gap_s = 0.0;           // 0: ten periods
  std::vector<std::string> missing; // texts that stand for no value
  std::vector<std::string>
      leave_out;           // columns whose own name carries a role, and that are not used
  bool units_line = false; // the line below the header is none of the rows
  ColumnMap time{"t_s", "t_s", "s", 1.0, 0.0, {}};
  std::string date;           // the column of the date; empty: it stands with the time, or nowhere
  bool day_first = false;     // of dates with slashes
  bool skip_bad_time = false; // skip and count rows whose time repeats or runs backwards
  std::vector<ColumnMap> columns;
  std::vector<KeepRule> keep;
  std::vector<DeriveRule> derive;
  std::vector<std::string> observation;
  ReaderOptions reader;
  std::map<std::string, std::string> velocity_of; // [[friction]]: outcome -> feature
};

// DataError names the file, the line where TOML is broken, or the key that is wrong; an unknown key
// is an error.
Schema read_schema(const std::string &path);

} // namespace rim
