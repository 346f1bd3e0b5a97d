// SPDX-License-Identifier: MIT
// log/propose.hpp - proposes a schema (log/schema.hpp) for logs of foreign columns.
#pragma once

#include <string>
#include <vector>

#include "log/raw_table.hpp"

namespace rim {

enum class Guess {
  time,
  command,
  sensor,
  context,
  outcome, // measured, and another column predicts it
  mean,
  sd,
  native,    // its name carries a role already
  text,      // no numbers: can select rows
  blank,     // a name and values of nothing: a delimiter at the end of each line
  constant,  // one value in every row
  duplicate, // equals another column, row by row
  counter    // counts the rows
};

// What is thought of one column of the file.
struct ColumnGuess {
  std::string from;     // as in the file
  std::string name;     // with role prefix and unit suffix: "s.speed_mps"; empty: left out
  std::string unit;     // as the file writes it; empty: not named
  std::string unit_key; // of the schema, where no suffix says the unit
  double scale = 1.0;   // to a unit that a suffix can say
  Guess guess = Guess::sensor;
  bool certain = false;  // the name says the role
  bool has_unit = false; // the file names it
  bool wraps = false;    // an angle that jumps by a turn
  double low = 0.0, high = 0.0;
  std::size_t missing = 0; // rows without a value
  std::string twin;        // of a duplicate or a prediction: the column that it belongs to
  std::vector<std::string> words;
  std::vector<std::string> states; // of two texts, what is 0 and what is 1; else empty
};

struct Proposal {
  std::vector<std::string> paths;
  char delimiter = ',';
  std::size_t rows = 0;
  int time = -1;                       // its column
  double time_scale = 1.0;             // to seconds
  bool time_named = false;             // the unit stands in the name
  bool time_dates = false;             // it holds dates and times of day
  double period_s = 0.0;               // median
  double spread = 0.0;                 // of the middle nine tenths of the periods, per period
  std::size_t gaps = 0, backwards = 0; // longer than 1.5 periods; rows whose time does not increase
  double longest_gap_s = 0.0;
  std::vector<std::pair<std::string, double>> other_rates; // logs of another rate, in Hz
  double shortest_s = 0.0, longest_s = 0.0;                // runs
  bool decimal_comma = false, units_line = false, day_first = false;
  bool guesses_order = false;       // of day and month: no date says it
  int date = -1;                    // the column of the date; -1: none of its own
  std::vector<std::string> missing; // texts among numbers
  ReaderOptions reader;             // as given
  std::vector<ColumnGuess> columns;
};

// What the columns of these logs seem to be. DataError: a file that cannot be read, columns that
// differ between files, a name twice, no column that can be the time. O(values).
Proposal propose_schema(const std::vector<std::string> &paths, const ReaderOptions &reader = {});

// The proposal as TOML that read_schema() takes, every guess and every decision left marked.
std::string proposal_text(const Proposal &proposal);

} // namespace rim
