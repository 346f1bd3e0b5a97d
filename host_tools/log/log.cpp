// SPDX-License-Identifier: MIT
#include "log/log.hpp"

#include <algorithm>
#include <cmath>

#include "image/names.h"

namespace rim {

namespace {

struct Prefix {
  const char *text;
  Role role;
};
constexpr Prefix kPrefixes[] = {{"x.", Role::context}, {"u.", Role::command}, {"s.", Role::sensor},
                                {"z.", Role::outcome}, {"m.", Role::mean},    {"sd.", Role::sd}};

struct Spelling {
  const char *text, *suffix;
};
// How logs of others write the same units.
constexpr Spelling kSpellings[] = {
    {"m/s2", "mps2"},      {"m/s/s", "mps2"},   {"m/s**2", "mps2"}, {"\u00b0", "deg"},
    {"degree", "deg"},     {"degrees", "deg"},  {"radians", "rad"}, {"rad/s2", "radps2"},
    {"\u00b0/s", "degps"}, {"kph", "kmph"},     {"C", "degC"},      {"deg C", "degC"},
    {"\u00b0C", "degC"},   {"celsius", "degC"}, {"percent", "pct"}, {"sec", "s"},
    {"seconds", "s"},      {"Nm", "Nm"},        {"volt", "V"},      {"amp", "A"},
    {"metres", "m"},       {"meters", "m"},     {"1/min", "rpm"},   {"U/min", "rpm"},
    {"r/min", "rpm"},      {"N\u00b7m", "Nm"},  {"N*m", "Nm"},      {"l", "L"},
    {"l/min", "Lpm"},      {"lpm", "Lpm"},      {"m3/h", "m3ph"},   {"m\u00b3/h", "m3ph"},
    {"\u03a9", "ohm"},     {"Ohm", "ohm"},      {"\u00b5T", "uT"},  {"m/s\u00b2", "mps2"},
    {"RPM", "rpm"},        {"kgm3", "kgpm3"},   {"kg/m3", "kgpm3"}};

std::string without_prefix(const std::string &name) {
  for (const auto &p : kPrefixes)
    if (name.rfind(p.text, 0) == 0)
      return name.substr(std::string(p.text).size());
  return name;
}

const rimi_unit *unit_suffix(const std::string &name) {
  const std::string bare = without_prefix(name);
  const std::size_t cut = bare.rfind('_');
  if (cut == std::string::npos || cut == 0)
    return nullptr;
  const std::string suffix = bare.substr(cut + 1);
  for (std::size_t i = 0; i < RIMI_UNITS; ++i)
    if (suffix == rimi_unit_at(i)->suffix)
      return rimi_unit_at(i);
  return nullptr;
}

} // namespace

bool role_of_name(const std::string &name, Role &role) {
  for (const auto &p : kPrefixes) {
    if (name.rfind(p.text, 0) == 0 && name.size() > std::string(p.text).size()) {
      role = p.role;
      return true;
    }
  }
  return false;
}

std::string unit_of_name(const std::string &name) {
  const rimi_unit *unit = unit_suffix(name);
  return unit != nullptr ? unit->text : "";
}

std::string suffix_of_unit(const std::string &unit) {
  for (std::size_t i = RIMI_UNITS;
       i-- > 0;) // the documented spelling comes last: "degC", not "degc"
    if (unit == rimi_unit_at(i)->text)
      return rimi_unit_at(i)->suffix;
  for (const auto &[other, suffix] : kSpellings)
    if (unit == other)
      return suffix;
  return "";
}

std::string plain_name(const std::string &name) {
  std::string bare = without_prefix(name);
  if (unit_suffix(name) != nullptr)
    bare.erase(bare.rfind('_'));
  std::replace(bare.begin(), bare.end(), '_', ' ');
  return bare;
}

void note_time(Log *log, double t_s) {
  if (!std::isfinite(t_s))
    return;
  log->first_s = std::fmin(log->first_s, t_s); // the number, where the other is none
  log->last_s = std::fmax(log->last_s, t_s);
}

int find_column(const Log &log, const std::string &name) {
  for (std::size_t c = 0; c < log.columns.size(); ++c)
    if (log.columns[c].name == name)
      return static_cast<int>(c);
  return -1;
}

std::vector<int> feature_columns(const Log &log) {
  std::vector<int> list;
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    const Role role = log.columns[c].role;
    if (role == Role::context || role == Role::command || role == Role::sensor)
      list.push_back(static_cast<int>(c));
  }
  return list;
}

std::vector<int> role_columns(const Log &log, Role role) {
  std::vector<int> list;
  for (std::size_t c = 0; c < log.columns.size(); ++c)
    if (log.columns[c].role == role)
      list.push_back(static_cast<int>(c));
  return list;
}

} // namespace rim
