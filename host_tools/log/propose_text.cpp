// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "log/log.hpp"
#include "log/propose.hpp"

namespace rim {

namespace {

// A TOML string.
std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\')
      out += '\\';
    if (static_cast<unsigned char>(letter) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(letter));
    else
      out += letter;
  }
  return out + "\"";
}

// For a comment: nothing in a file's header may end the line.
std::string plain(std::string text) {
  for (char &letter : text)
    if (static_cast<unsigned char>(letter) < 0x20)
      letter = ' ';
  return text;
}

std::string list_of(const std::vector<std::string> &texts) {
  std::string list;
  for (const auto &text : texts)
    list += (list.empty() ? "" : ", ") + quoted(text);
  return list;
}

std::string reader_text(const ReaderOptions &r) {
  std::string text;
  const auto key = [&](const char *name, const std::string &value) {
    if (!value.empty())
      text += fmt::format("{} = {}\n", name, quoted(value));
  };
  key("dbc", r.dbc);
  key("packets", r.packets);
  key("rows", r.rows);
  for (std::size_t i = 0; i < r.types.size(); ++i)
    text +=
        (i == 0 ? "types = [" : ", ") + quoted(r.types[i]) + (i + 1 == r.types.size() ? "]\n" : "");
  return text.empty() ? text : "\n[reader]   # paths are beside this file\n" + text;
}

// Columns that are left out although a reader would take them by their names.
std::vector<std::string> named_and_left_out(const Proposal &p) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < p.columns.size(); ++c) {
    const ColumnGuess &g = p.columns[c];
    Role role = Role::context;
    if (g.name.empty() && g.guess != Guess::native && static_cast<int>(c) != p.time &&
        static_cast<int>(c) != p.date && role_of_name(g.from, role))
      names.push_back(g.from);
  }
  return names;
}

std::string head_text(const Proposal &p) {
  std::string text =
      "# Proposed by `rim schema` from " +
      (p.paths.size() == 1 ? plain(p.paths.front()) : fmt::format("{} logs", p.paths.size())) +
      fmt::format(", {} rows.\n", p.rows);
  text += "# GUESS marks what was guessed, DECIDE what only you can know. data/README.md explains "
          "every key.\n";
  text += "schema = \"rim-schema/1\"\n";
  if (p.delimiter != ',')
    text += fmt::format("delimiter = {}\n",
                        p.delimiter == '\t' ? "\"\\t\"" : quoted(std::string(1, p.delimiter)));
  if (p.decimal_comma)
    text += "decimal = \",\"   # GUESS: numbers such as 0,25\n";
  if (p.units_line)
    text += "units_line = true   # the line below the header holds units\n";
  if (!p.missing.empty())
    text += "missing = [" + list_of(p.missing) + "]   # GUESS: in place of a number: no value\n";
  if (const std::vector<std::string> names = named_and_left_out(p); !names.empty())
    text += "leave_out = [" + list_of(names) + "]   # why: below\n";
  return text + reader_text(p.reader);
}

std::string rate_text(const Proposal &p) {
  const std::string rate = fmt::format("{:.4g}", 1.0 / p.period_s);
  std::string text = fmt::format("\n# Rows come at {} Hz; runs last {:.4g} to {:.4g} s.\n", rate,
                                 p.shortest_s, p.longest_s);
  if (p.gaps > 0)
    text +=
        fmt::format("# {} longer than 1.5 periods; the longest gap lasts {:.4g} s.\n",
                    p.gaps == 1 ? "1 gap is" : fmt::format("{} gaps are", p.gaps), p.longest_gap_s);
  for (const auto &[path, hz] : p.other_rates)
    text += fmt::format("# DECIDE: {} comes at {:.4g} Hz: leave it out, or put all on one grid.\n",
                        plain(path), hz);
  if (p.spread > 0.5)
    text += fmt::format("# DECIDE: the rows are not evenly spaced (nine tenths of the periods "
                        "spread over {:.0f} % of one).\n# These lines put them on a grid:\n",
                        100.0 * p.spread);
  else
    text += "# For another rate, or logs of several rates:\n";
  return text + fmt::format("# resample_hz = {}\n# resample = \"hold\"\n", rate);
}

std::string time_column_text(const Proposal &p) {
  const ColumnGuess &time = p.columns[static_cast<std::size_t>(p.time)];
  if (time.from == "t_s" && p.time_scale == 1.0)
    return "\n# The time is the column t_s, in seconds.\n" +
           std::string(p.backwards > 0 ? "[time]\n" : "");
  std::string text = "\n[time]\ncolumn = " + quoted(time.from);
  if (p.time_dates)
    return text + "   # dates and times of day: seconds from the first row of a file\n" +
           (p.date < 0 ? ""
                       : "date = " + quoted(p.columns[static_cast<std::size_t>(p.date)].from) +
                             "   # the date stands in a column of its own\n") +
           (p.day_first ? "day_first = true   # dates such as 13/04/2025\n"
            : p.guesses_order
                ? "day_first = false   # GUESS: 04/05/2025 is a day in April; true: in "
                  "May\n"
                : "");
  text += time.certain ? "\n" : "   # GUESS: it increases from row to row\n";
  text += fmt::format("scale = {:g}", p.time_scale);
  if (p.time_named)
    return text + fmt::format("   # to seconds, from {}\n", plain(time.unit));
  return text +
         fmt::format("   # GUESS: to seconds; the rate is {:.4g} Hz then\n", 1.0 / p.period_s);
}

std::string time_text(const Proposal &p) {
  return time_column_text(p) +
         (p.backwards == 0
              ? ""
              : fmt::format("not_increasing = \"skip\"   # DECIDE: in {} rows the time repeats or "
                            "runs backwards; without this line such a log is refused\n",
                            p.backwards));
}

const char *role_words(Guess guess) {
  switch (guess) {
  case Guess::command:
    return "a command";
  case Guess::sensor:
    return "a sensor, watched";
  case Guess::context:
    return "context: where or in which mode, not watched. Make it u. if it is a command, s. to "
           "watch it";
  case Guess::outcome:
    return "measured, and predicted by your simulation: watched";
  case Guess::mean:
    return "predicted by your simulation";
  case Guess::sd:
    return "standard deviation of the prediction";
  default:
    return "";
  }
}

std::string range_text(const ColumnGuess &g) {
  if (!g.states.empty())
    return "text";
  std::string text = fmt::format("{:.4g} to {:.4g}", g.low, g.high);
  if (g.missing > 0)
    text += fmt::format(", {} rows empty", g.missing);
  return text;
}

std::string keep_text(const ColumnGuess &g) {
  return "# [[keep]]\n# column = " + quoted(g.from) + "\n# values = [" + list_of(g.words) + "]\n";
}

std::string column_text(const ColumnGuess &g) {
  std::string text = "\n[[column]]\nfrom = " + quoted(g.from) + "   # " + range_text(g) + "\n";
  text += "name = " + quoted(g.name) + "   # " + (g.certain ? "" : "GUESS: ") +
          role_words(g.guess) + (g.twin.empty() ? "" : " (of " + plain(g.twin) + ")") + "\n";
  if (!g.states.empty())
    return text + "words = [" + list_of(g.states) + "]   # read as 0 and 1\n" +
           "# DECIDE: or select rows by it instead\n" + keep_text(g);
  if (!g.unit_key.empty())
    text += "unit = " + quoted(g.unit_key) + "\n";
  if (g.scale != 1.0)
    text += fmt::format("scale = {:.10g}   # to {}\n", g.scale, g.unit);
  if (g.unit.empty())
    text += "# unit = \"\"   # DECIDE: the file names none\n";
  else if (!g.has_unit)
    text += fmt::format("# GUESS: an angle in {}, by its name and range\n", g.unit);
  if (g.wraps)
    text += "# It jumps by a whole turn: taken as an angle.\n";
  return text;
}

std::string left_out_text(const ColumnGuess &g) {
  const std::string from = plain(g.from);
  std::string why;
  switch (g.guess) {
  case Guess::duplicate:
    why = "equals " + plain(g.twin) + " in every row";
    break;
  case Guess::counter:
    why = "counts the rows";
    break;
  case Guess::mean:
    why = "looks like a prediction, but of which column? DECIDE: name that one z.NAME, this m.NAME";
    break;
  case Guess::blank:
    return ""; // the date, or nothing at all
  case Guess::sd:
    why = "looks like a standard deviation, but of which prediction? DECIDE: sd.NAME";
    break;
  default:
    why = "holds text" + (g.words.empty() ? "" : ", such as " + quoted(plain(g.words.back())));
  }
  const bool states = g.guess == Guess::text && g.words.size() < 9 && !g.words.empty();
  if (!states)
    return "# " + from + " " + why + "\n";
  return "# " + from + " holds text. DECIDE: it can select rows\n" + keep_text(g) +
         "# or count as 0, 1, 2 where that order means something\n# [[column]]\n# from = " +
         quoted(g.from) + "\n# name = \"x.NAME\"\n# words = [" + list_of(g.words) + "]\n";
}

// The columns that never change, under the value that they hold.
std::string constant_text(const Proposal &p) {
  std::vector<std::pair<std::string, std::string>> groups; // value, columns
  for (const ColumnGuess &g : p.columns) {
    if (g.guess != Guess::constant)
      continue;
    const std::string value =
        g.low == g.high ? fmt::format("{:.6g}", g.low) : quoted(g.words.front());
    const auto group = std::find_if(groups.begin(), groups.end(),
                                    [&](const auto &known) { return known.first == value; });
    if (group == groups.end())
      groups.emplace_back(value, plain(g.from));
    else
      group->second += ", " + plain(g.from);
  }
  std::string text;
  for (const auto &[value, columns] : groups)
    text += fmt::format("# {} in every row, which teaches nothing: {}\n", value, columns);
  return text;
}

} // namespace

std::string proposal_text(const Proposal &p) {
  std::string text = head_text(p) + rate_text(p) + time_text(p), kept, out;
  std::size_t watched = 0, predicted = 0;
  for (std::size_t c = 0; c < p.columns.size(); ++c) {
    const ColumnGuess &g = p.columns[c];
    Role role = Role::context;
    const Role *native = g.guess == Guess::native && role_of_name(g.from, role) ? &role : nullptr;
    watched += g.guess == Guess::sensor || (native != nullptr && role == Role::sensor);
    predicted += g.guess == Guess::outcome || (native != nullptr && role == Role::outcome);
    if (static_cast<int>(c) == p.time)
      continue;
    if (native != nullptr)
      kept += (kept.empty() ? "" : ", ") + plain(g.from);
    else if (!g.name.empty())
      text += column_text(g);
    else if (g.guess != Guess::constant)
      out += left_out_text(g);
  }
  out += constant_text(p);
  if (!kept.empty())
    text += "\n# Their own names say what they are, they are used as they stand: " + kept + "\n";
  if (!out.empty())
    text += "\n# Left out:\n" + out;
  if (watched + predicted == 0)
    text += "\n# DECIDE: nothing is watched yet. Name at least one column s.NAME or z.NAME.\n";
  else if (predicted > 0 && watched > 0)
    text += "\n# Columns with predictions (z.) are watched; here the sensors (s.) are context.\n";
  return text;
}

} // namespace rim
