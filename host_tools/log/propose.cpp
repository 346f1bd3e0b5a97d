// SPDX-License-Identifier: MIT
#include "log/propose.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <set>

#include "log/date_time.hpp"
#include "log/log.hpp"
#include "log/units.hpp"
#include "stats/robust.hpp"
#include "util/error.hpp"
#include "util/utf8.hpp"

namespace rim {

namespace {

using Words = std::vector<std::string>;

bool is_one_of(const std::string &word, std::initializer_list<const char *> list) {
  return std::any_of(list.begin(), list.end(), [&](const char *w) { return word == w; });
}

bool is_command_word(const std::string &w) {
  return is_one_of(w,
                   {"cmd",       "command", "commanded", "cmds",     "setpoint",  "sp",       "ref",
                    "reference", "target",  "desired",   "des",      "demand",    "throttle", "pwm",
                    "u",         "set",     "soll",      "sollwert", "stellwert", "consigne"});
}
bool is_prediction_word(const std::string &w) {
  return is_one_of(w, {"sim", "simulated", "model", "pred", "predicted", "prediction", "expected"});
}
bool is_sd_word(const std::string &w) {
  return is_one_of(w, {"sd", "std", "stddev", "sigma", "stdev"});
}
bool is_place_word(const std::string &w) {
  return is_one_of(w, {"pos", "position", "lat", "latitude", "lon", "lng", "longitude", "heading",
                       "odometer", "distance", "easting", "northing", "pose"});
}
bool is_angle_word(const std::string &w) {
  return is_one_of(w, {"heading", "yaw", "roll", "pitch", "bearing", "angle", "azimuth", "phi",
                       "psi", "theta", "course"});
}
bool is_rate_word(const std::string &w) {
  return is_one_of(w, {"rate", "speed", "velocity", "vel", "gyro", "omega", "dot"});
}
bool is_time_word(const std::string &w) {
  return is_one_of(w, {"t", "time", "timestamp", "stamp", "clock", "tstamp", "seconds", "secs",
                       "zeit", "zeitstempel", "datum"});
}
// Says where a reading comes from, not what is read.
bool is_source_word(const std::string &w) {
  return is_one_of(w, {"odo", "odom", "meas", "measured", "enc", "encoder", "imu", "gps", "actual",
                       "act", "sensor", "obs", "observed", "raw"});
}

// What a log in a unit without a suffix is converted to; NULL: it has a suffix, or is not known.
const Unit *unit_instead(const std::string &unit) {
  const Unit *own = suffix_of_unit(unit).empty() ? find_unit(unit) : nullptr;
  return own != nullptr ? find_unit(own->instead) : nullptr;
}

bool is_known_unit(const std::string &unit) {
  return !suffix_of_unit(unit).empty() || unit_instead(unit) != nullptr;
}

// A name in lower-case words, and the unit that it ends in: in brackets, behind a stroke or "in",
// or its last word or words.
struct Parts {
  Words words;
  std::string unit;
};

Words words_of(const std::string &name) {
  Words words;
  const std::string bare = without_accents(name);
  std::string word;
  for (std::size_t i = 0; i <= bare.size(); ++i) {
    const auto letter = static_cast<unsigned char>(i < bare.size() ? bare[i] : ' ');
    const bool hump = std::isupper(letter) != 0 && i > 0 &&
                      std::islower(static_cast<unsigned char>(bare[i - 1])) != 0;
    if ((std::isalnum(letter) == 0 || hump) && !word.empty()) {
      words.push_back(word);
      word.clear();
    }
    if (std::isalnum(letter) != 0)
      word += static_cast<char>(std::tolower(letter));
  }
  return words;
}

// "Current / mA", "height in mm", "speed, m/s": only what is known as a unit.
bool take_written_unit(std::string *name, std::string *unit) {
  for (const std::string mark : {" / ", " in ", ", ", " /"}) {
    const std::size_t at = name->rfind(mark);
    if (at == std::string::npos || at == 0 || !is_known_unit(name->substr(at + mark.size())))
      continue;
    *unit = name->substr(at + mark.size());
    name->resize(at);
    return true;
  }
  return false;
}

// "speed_m_s", "acceleration_m_s2": a quotient whose stroke a name cannot hold.
bool take_quotient(std::string *name, std::string *unit) {
  const std::size_t second = name->rfind('_');
  const std::size_t first =
      second == std::string::npos || second == 0 ? second : name->rfind('_', second - 1);
  if (first == std::string::npos || first == 0 || second == 0)
    return false;
  const std::string made =
      name->substr(first + 1, second - first - 1) + "/" + name->substr(second + 1);
  if (!is_known_unit(made))
    return false;
  *unit = made;
  name->resize(first);
  return true;
}

Parts parts_of(const std::string &name) {
  Parts parts;
  std::string bare = name;
  const std::size_t open = bare.find_last_of("[(");
  const std::size_t close = open == std::string::npos ? open : bare.find_first_of("])", open);
  if (close != std::string::npos) {
    parts.unit = bare.substr(open + 1, close - open - 1);
    bare.resize(open);
  } else if (!take_written_unit(&bare, &parts.unit) && !take_quotient(&bare, &parts.unit) &&
             !unit_of_name("s." + bare).empty()) {
    parts.unit = unit_of_name("s." + bare);
    bare.resize(bare.rfind('_'));
  }
  parts.words = words_of(bare);
  return parts;
}

template <class Test> bool any_word(const Words &words, Test test) {
  return std::any_of(words.begin(), words.end(), test);
}
template <class Test> Words without(Words words, Test test) {
  words.erase(std::remove_if(words.begin(), words.end(), test), words.end());
  return words;
}

std::string joined(const Words &words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) // "pose.pose.x": said once
    if (i == 0 || words[i] != words[i - 1])
      text += (i == 0 ? "" : "_") + words[i];
  return text;
}

// Between rows of increasing time.
void add_steps(const std::vector<double> &times, std::vector<double> *steps) {
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] > times[i - 1])
      steps->push_back(times[i] - times[i - 1]);
}

std::string columns_of(const RawTable &table) {
  std::string text;
  for (std::size_t c = 0; c < table.columns.size() && c < 12; ++c)
    text += (c == 0 ? "'" : "', '") + table.columns[c].name;
  return text + (table.columns.size() > 12 ? "', ..." : "'");
}

class Proposer {
public:
  Proposer(const std::vector<std::string> &paths, const ReaderOptions &reader);
  Proposal make();

private:
  [[noreturn]] static void fail(const std::string &path, const std::string &reason) {
    throw DataError(path + ": " + reason);
  }
  const RawColumn &raw(std::size_t table, std::size_t c) const { return tables_[table].columns[c]; }
  bool increases(std::size_t c) const;
  bool holds_dates(std::size_t c) const;
  double median_step(std::size_t c) const;
  static double median_step(const RawTable &table, std::size_t c);
  void find_time();
  double time_scale(std::size_t c);
  void find_date();
  void measure_time();
  void range(std::size_t c);
  bool is_equal(std::size_t a, std::size_t b) const;
  bool is_counter(std::size_t c) const;
  bool settles(std::size_t c);
  bool is_nearly_numbers(std::size_t c);
  void find_states(std::size_t c);
  void role(std::size_t c);
  void pair_predictions();
  int measured_of(std::size_t c, const Words &words) const;
  void unit(std::size_t c);
  void angle(std::size_t c);
  void name(std::size_t c);

  Proposal out_;
  std::vector<RawTable> tables_;
  std::vector<Parts> parts_;
  std::set<std::string> taken_;
};

Proposer::Proposer(const std::vector<std::string> &paths, const ReaderOptions &reader) {
  out_.paths = paths;
  out_.reader = reader;
  for (const auto &path : paths) {
    tables_.push_back(read_raw_table(path, reader));
    const RawTable &first = tables_.front(), &table = tables_.back();
    if (table.columns.size() != first.columns.size())
      fail(path, std::to_string(table.columns.size()) + " columns where " + first.path + " has " +
                     std::to_string(first.columns.size()));
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      if (table.columns[c].name != first.columns[c].name)
        fail(path, "column '" + table.columns[c].name + "' where " + first.path + " has '" +
                       first.columns[c].name + "'");
    out_.rows += table.rows;
  }
  out_.delimiter = tables_.front().delimiter;
  out_.units_line = tables_.front().units_line;
  std::set<std::string> names;
  for (const auto &column : tables_.front().columns) {
    if (!names.insert(column.name).second)
      fail(paths.front(), "column '" + column.name + "': stands twice; give one another name");
    parts_.push_back(parts_of(column.name));
    if (parts_.back().unit.empty() && column.unit != "-")
      parts_.back().unit = column.unit;
    out_.columns.emplace_back();
    out_.columns.back().from = column.name;
  }
  bool slashed = false, decided = false;
  for (const auto &table : tables_) {
    out_.day_first = out_.day_first || table.day_first;
    for (const auto &column : table.columns) {
      out_.decimal_comma = out_.decimal_comma || column.decimal_comma;
      slashed = slashed || column.slashed > 0;
      decided = decided || column.one_order > 0;
    }
  }
  out_.guesses_order = slashed && !decided;
}

// All but one row in fifty, in every log: clocks of real logs repeat.
bool Proposer::increases(std::size_t c) const {
  for (const auto &table : tables_) {
    const auto &v = table.columns[c].values;
    std::size_t steps = 0;
    for (std::size_t i = 1; i < v.size(); ++i)
      steps += v[i] > v[i - 1];
    if (v.size() < 2 || 50 * (v.size() - 1 - steps) > v.size())
      return false;
  }
  return true;
}

bool Proposer::holds_dates(std::size_t c) const {
  return std::any_of(tables_.begin(), tables_.end(),
                     [c](const RawTable &table) { return table.columns[c].dates > 0; });
}

double Proposer::median_step(std::size_t c) const {
  std::vector<double> steps;
  for (const auto &table : tables_)
    add_steps(table.columns[c].values, &steps);
  return steps.empty() ? 0.0 : median(std::move(steps));
}

double Proposer::median_step(const RawTable &table, std::size_t c) {
  std::vector<double> steps;
  add_steps(table.columns[c].values, &steps);
  return steps.empty() ? 0.0 : median(std::move(steps));
}

void Proposer::find_time() {
  int best = -1, merit = 0;
  for (std::size_t c = 0; c < out_.columns.size(); ++c) {
    if (!increases(c))
      continue;
    const bool named = holds_dates(c) || any_word(parts_[c].words, is_time_word);
    const int points = out_.columns[c].from == "t_s" ? 4 : named ? 3 : is_counter(c) ? 1 : 2;
    if (points > merit) {
      merit = points;
      best = static_cast<int>(c);
    }
  }
  if (best < 0)
    fail(out_.paths.front(), "no column can be the time: none increases from row to row in every "
                             "log (but for one row in fifty). The columns are " +
                                 columns_of(tables_.front()));
  out_.time = best;
  ColumnGuess &guess = out_.columns[static_cast<std::size_t>(best)];
  guess.guess = Guess::time;
  guess.certain = merit >= 3;
  out_.time_dates = holds_dates(static_cast<std::size_t>(best));
  out_.time_scale = out_.time_dates ? 1.0 : time_scale(static_cast<std::size_t>(best));
  if (out_.time_dates)
    find_date();
}

// Of times of day, the date may stand in a column of its own.
void Proposer::find_date() {
  const RawColumn &time = raw(0, static_cast<std::size_t>(out_.time));
  DateReading alone;
  double ignored = 0.0;
  if (time.words.empty() || !parse_date_time(time.words.front(), alone, ignored) ||
      std::isnan(alone.last_s))
    return;
  for (std::size_t c = 0; c < out_.columns.size() && out_.date < 0; ++c)
    if (std::all_of(tables_.begin(), tables_.end(),
                    [c](const RawTable &t) { return t.columns[c].days == t.rows; }))
      out_.date = static_cast<int>(c);
}

// By the name's unit; else the unit in which rows come at 0.2 to 2000 Hz, seconds first.
double Proposer::time_scale(std::size_t c) {
  const std::map<std::string, double> units = {{"s", 1.0},     {"sec", 1.0}, {"seconds", 1.0},
                                               {"ms", 1e-3},   {"us", 1e-6}, {"\u00b5s", 1e-6},
                                               {"usec", 1e-6}, {"ns", 1e-9}, {"nsec", 1e-9},
                                               {"msec", 1e-3}, {"min", 60.0}};
  std::string unit = parts_[c].unit;
  if (unit.empty() && !parts_[c].words.empty())
    unit = parts_[c].words.back();
  const auto found = units.find(unit);
  if (found != units.end()) {
    out_.time_named = true;
    out_.columns[c].unit = unit;
    return found->second;
  }
  const double step = median_step(c);
  for (const double scale : {1.0, 1e-3, 1e-6, 1e-9})
    if (scale * step >= 5e-4 && scale * step <= 5.0)
      return scale;
  return 1.0;
}

void Proposer::measure_time() {
  const auto c = static_cast<std::size_t>(out_.time);
  out_.period_s = out_.time_scale * median_step(c);
  std::vector<double> periods;
  out_.shortest_s = std::numeric_limits<double>::infinity();
  for (const auto &table : tables_) {
    const auto &v = table.columns[c].values;
    const double own_s = out_.time_scale * median_step(table, c);
    if (own_s > 1.2 * out_.period_s || (own_s > 0.0 && 1.2 * own_s < out_.period_s))
      out_.other_rates.push_back({table.path, 1.0 / own_s});
    for (std::size_t i = 1; i < v.size(); ++i) {
      const double period = out_.time_scale * (v[i] - v[i - 1]);
      if (!(period > 0.0)) {
        out_.backwards++;
        continue;
      }
      periods.push_back(period);
      out_.gaps += period > 1.5 * out_.period_s;
      out_.longest_gap_s = std::max(out_.longest_gap_s, period);
    }
    const double length = out_.time_scale * (v.back() - v.front());
    out_.shortest_s = std::min(out_.shortest_s, length);
    out_.longest_s = std::max(out_.longest_s, length);
  }
  std::sort(periods.begin(), periods.end());
  if (!periods.empty())
    out_.spread =
        (periods[periods.size() * 95 / 100] - periods[periods.size() * 5 / 100]) / out_.period_s;
}

void Proposer::range(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  guess.low = std::numeric_limits<double>::infinity();
  guess.high = -guess.low;
  for (const auto &table : tables_) {
    for (const double v : table.columns[c].values) {
      guess.missing += !std::isfinite(v);
      if (std::isfinite(v)) {
        guess.low = std::min(guess.low, v);
        guess.high = std::max(guess.high, v);
      }
    }
    for (const auto &word : table.columns[c].words)
      if (std::find(guess.words.begin(), guess.words.end(), word) == guess.words.end())
        guess.words.push_back(word);
  }
}

bool Proposer::is_equal(std::size_t a, std::size_t b) const {
  for (const auto &table : tables_) {
    const auto &x = table.columns[a].values, &y = table.columns[b].values;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (std::abs(x[i] - y[i]) > 1e-8 * std::abs(x[i]) || std::isnan(x[i]) != std::isnan(y[i]))
        return false;
  }
  return true;
}

// Steps of one but for one row in fifty: a logger that loses rows counts on.
bool Proposer::is_counter(std::size_t c) const {
  for (const auto &table : tables_) {
    const auto &v = table.columns[c].values;
    std::size_t others = 0;
    for (std::size_t i = 1; i < v.size(); ++i) {
      others += v[i] != v[i - 1] + 1.0;
      if (!(v[i] > v[i - 1]))
        return false;
    }
    if (50 * others > v.size())
      return false;
  }
  return true;
}

// Numbers but for a few texts, in at most a fifth of the rows, such as "---": they stand for no
// value.
bool Proposer::is_nearly_numbers(std::size_t c) {
  std::size_t texts = 0, rows = 0;
  std::vector<std::string> marks;
  for (const RawTable &t : tables_) {
    const RawColumn &column = t.columns[c];
    if (column.empty + column.text == t.rows || column.dates > 0 || column.texts.size() > 3)
      return false;
    texts += column.text;
    rows += t.rows;
    marks.insert(marks.end(), column.texts.begin(), column.texts.end());
  }
  if (5 * texts > rows)
    return false;
  for (const std::string &mark : marks)
    if (std::find(out_.missing.begin(), out_.missing.end(), mark) == out_.missing.end())
      out_.missing.push_back(mark);
  return true;
}

// Two texts are a switch: the one that says no, or comes first in the alphabet, is 0.
void Proposer::find_states(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  if (guess.words.size() != 2 || guess.missing < out_.rows)
    return;
  guess.states = guess.words;
  std::sort(guess.states.begin(), guess.states.end());
  const Words second = words_of(guess.states.back());
  if (any_word(second, [](const std::string &w) {
        return is_one_of(w, {"off", "false", "no", "closed", "down", "inactive", "disabled", "stop",
                             "stopped", "idle", "aus", "falsch", "nein", "zu", "stopp", "halt"});
      }))
    std::swap(guess.states.front(), guess.states.back());
  guess.certain = any_word(parts_[c].words, is_command_word);
  guess.guess = guess.certain ? Guess::command : Guess::context;
  guess.low = 0.0;
  guess.high = 1.0;
  guess.missing = 0;
}

// What is no reading: true when that decides the column.
bool Proposer::settles(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  Role role = Role::context;
  const bool numbers = is_nearly_numbers(c);
  const bool nothing = guess.words.empty() && guess.missing == out_.rows;
  const bool one_word = guess.words.size() == 1 && guess.missing == out_.rows;
  if (nothing || static_cast<int>(c) == out_.date)
    guess.guess = Guess::blank;
  else if ((!numbers || holds_dates(c)) && !one_word) {
    guess.guess = Guess::text;
    find_states(c);
  } else if (one_word || guess.low == guess.high)
    guess.guess = Guess::constant;
  else if (is_counter(c))
    guess.guess = Guess::counter;
  else if (role_of_name(guess.from, role))
    guess.guess = Guess::native;
  else
    return false;
  return true;
}

void Proposer::role(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  const Words &words = parts_[c].words;
  if (settles(c))
    return;
  for (std::size_t b = 0; b < c && guess.twin.empty(); ++b) {
    const Guess other = out_.columns[b].guess;
    if (other != Guess::text && other != Guess::constant && is_equal(c, b))
      guess.twin = out_.columns[b].from;
  }
  if (guess.twin.empty() && out_.time > static_cast<int>(c) &&
      is_equal(c, static_cast<std::size_t>(out_.time)))
    guess.twin = out_.columns[static_cast<std::size_t>(out_.time)].from;
  const bool whole = std::all_of(guess.words.begin(), guess.words.end(), [](const auto &w) {
    return w.find_first_not_of("-0123456789") == std::string::npos;
  });
  guess.certain = true;
  if (!guess.twin.empty())
    guess.guess = Guess::duplicate;
  else if (any_word(words, is_sd_word))
    guess.guess = Guess::sd;
  else if (any_word(words, is_prediction_word))
    guess.guess = Guess::mean;
  else if (any_word(words, is_command_word))
    guess.guess = Guess::command;
  else {
    guess.certain = false;
    const bool mode = whole && guess.words.size() < 9;
    const bool place = any_word(words, is_place_word) && !any_word(words, is_rate_word);
    guess.guess = mode || place ? Guess::context : Guess::sensor;
  }
}

// The column that a prediction is of: the one whose words, without those of its source, are the
// prediction's; -1 where none or several are.
int Proposer::measured_of(std::size_t c, const Words &words) const {
  int found = -1;
  const Words wanted = without(words, is_source_word);
  for (std::size_t m = 0; m < out_.columns.size(); ++m) {
    const Guess guess = out_.columns[m].guess;
    if (m == c || (guess != Guess::sensor && guess != Guess::outcome && guess != Guess::context))
      continue;
    if (without(parts_[m].words, is_source_word) != wanted)
      continue;
    if (found >= 0)
      return -1;
    found = static_cast<int>(m);
  }
  return found;
}

void Proposer::pair_predictions() {
  for (const Guess kind : {Guess::mean, Guess::sd}) {
    for (std::size_t c = 0; c < out_.columns.size(); ++c) {
      ColumnGuess &guess = out_.columns[c];
      if (guess.guess != kind)
        continue;
      const Words words = without(without(parts_[c].words, is_sd_word), is_prediction_word);
      const int m = measured_of(c, words);
      if (m < 0)
        continue;
      ColumnGuess &measured = out_.columns[static_cast<std::size_t>(m)];
      if (kind == Guess::sd && measured.guess != Guess::outcome)
        continue; // no mean
      measured.guess = Guess::outcome;
      measured.certain = true;
      guess.twin = measured.from;
      parts_[c].words = parts_[static_cast<std::size_t>(m)].words;
      if (parts_[c].unit.empty())
        parts_[c].unit = parts_[static_cast<std::size_t>(m)].unit;
    }
  }
}

void Proposer::unit(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  guess.unit = parts_[c].unit;
  guess.has_unit = !guess.unit.empty();
  if (guess.unit.empty() || !suffix_of_unit(guess.unit).empty())
    return;
  const Unit *instead = unit_instead(guess.unit);
  if (instead == nullptr) {
    guess.unit_key = guess.unit;
    return;
  }
  guess.scale = find_unit(guess.unit)->value / instead->value;
  guess.unit = instead->text;
}

// A unit for what is called an angle and has none; and whether it jumps by a turn.
void Proposer::angle(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  const double most = std::max(std::abs(guess.low), std::abs(guess.high));
  const Words &words = parts_[c].words;
  if (guess.unit.empty() && any_word(words, is_angle_word) && !any_word(words, is_rate_word))
    guess.unit = most < 6.3 ? "rad" : most <= 360.0 ? "deg" : "";
  const std::string suffix = suffix_of_unit(guess.unit);
  if (suffix != "rad" && suffix != "deg")
    return;
  const double turn = suffix == "rad" ? 2.0 * 3.14159265358979323846 : 360.0;
  for (const auto &table : tables_) {
    const auto &v = table.columns[c].values;
    for (std::size_t i = 1; i < v.size(); ++i)
      guess.wraps = guess.wraps || guess.scale * std::abs(v[i] - v[i - 1]) > 0.75 * turn;
  }
}

void Proposer::name(std::size_t c) {
  ColumnGuess &guess = out_.columns[c];
  const char *prefix = nullptr;
  switch (guess.guess) {
  case Guess::command:
    prefix = "u.";
    break;
  case Guess::sensor:
    prefix = "s.";
    break;
  case Guess::context:
    prefix = "x.";
    break;
  case Guess::outcome:
    prefix = "z.";
    break;
  case Guess::mean:
    prefix = "m.";
    break;
  case Guess::sd:
    prefix = "sd.";
    break;
  default:
    return;
  }
  if ((guess.guess == Guess::mean || guess.guess == Guess::sd) && guess.twin.empty())
    return;
  Words words = without(parts_[c].words, is_command_word);
  if (words.empty())
    words = parts_[c].words;
  if (words.empty())
    words = {"column", std::to_string(c + 1)};
  const std::string suffix = suffix_of_unit(guess.unit);
  std::string made = prefix + joined(words);
  if (suffix.empty() && !unit_of_name(made).empty())
    made += "_value"; // a last word that happens to be a suffix
  std::string whole = made + (suffix.empty() ? "" : "_" + suffix);
  for (int n = 2; !taken_.insert(whole).second; ++n)
    whole = made + "_" + std::to_string(n) + (suffix.empty() ? "" : "_" + suffix);
  guess.name = whole;
}

Proposal Proposer::make() {
  find_time();
  measure_time();
  for (std::size_t c = 0; c < out_.columns.size(); ++c) {
    range(c);
    if (static_cast<int>(c) != out_.time)
      role(c);
  }
  pair_predictions();
  for (std::size_t c = 0; c < out_.columns.size(); ++c) {
    if (static_cast<int>(c) == out_.time)
      continue;
    unit(c);
    angle(c);
    name(c);
  }
  return std::move(out_);
}

} // namespace

Proposal propose_schema(const std::vector<std::string> &paths, const ReaderOptions &reader) {
  return Proposer(paths, reader).make();
}

} // namespace rim
