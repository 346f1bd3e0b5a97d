// SPDX-License-Identifier: MIT
#include "util/toml_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "util/atomic_file.hpp"

namespace rim::world {
namespace {

const char *range_text(Range range) {
  switch (range) {
  case Range::not_negative:
    return "must not be negative";
  case Range::positive:
    return "must be positive";
  case Range::fraction:
    return "must lie between 0 and 1";
  case Range::any:
    break;
  }
  return "must be finite";
}

bool is_in(Range range, double value) {
  if (!std::isfinite(value))
    return false;
  if (range == Range::not_negative)
    return value >= 0.0;
  if (range == Range::positive)
    return value > 0.0;
  if (range == Range::fraction)
    return value >= 0.0 && value <= 1.0;
  return true;
}

} // namespace

toml::table parse_toml(const std::string &path) {
  try {
    return toml::parse(read_file(path), path);
  } catch (const toml::parse_error &error) {
    std::ostringstream message;
    message << path << ":line " << error.source().begin.line << ": " << error.description();
    throw DataError(message.str());
  }
}

std::string where(const std::string &path, const toml::node &node) {
  const auto line = node.source().begin.line;
  return line == 0 ? path + ": " : path + ":line " + std::to_string(line) + ": ";
}

void fail(const std::string &path, const toml::node &node, const std::string &reason) {
  throw DataError(where(path, node) + reason);
}

double read_number(const std::string &path, const toml::node &node, const std::string &key,
                   Range range) {
  if (!node.is_number())
    fail(path, node, "key '" + key + "': must be a number");
  const double value = *node.value<double>();
  if (!is_in(range, value))
    fail(path, node, "key '" + key + "': " + range_text(range));
  return value;
}

std::string read_string(const std::string &path, const toml::node &node, const std::string &key) {
  if (!node.is_string())
    fail(path, node, "key '" + key + "': must be a string");
  return *node.value<std::string>();
}

std::string table_toml(const std::string &header, const std::vector<NumberKey> &keys) {
  std::string text = header + "\n";
  for (const NumberKey &key : keys) {
    char number[32];
    char *const end = std::to_chars(number, number + sizeof number, *key.value).ptr;
    text += std::string(key.name) + " = " + std::string(number, end) + "\n";
  }
  return text;
}

void read_numbers(const std::string &path, const toml::table &table, const std::string &name,
                  const std::vector<NumberKey> &keys, bool complete,
                  const std::vector<std::string> &others) {
  for (const auto &[key_node, node] : table) {
    const std::string key(key_node.str());
    const std::string full = name.empty() ? key : name + "." + key;
    const auto found = std::find_if(keys.begin(), keys.end(),
                                    [&key](const NumberKey &k) { return key == k.name; });
    if (found != keys.end()) {
      *found->value = read_number(path, node, full, found->range);
    } else if (std::find(others.begin(), others.end(), key) == others.end()) {
      fail(path, node, "unknown key '" + full + "'");
    }
  }
  if (!complete)
    return;
  for (const NumberKey &key : keys) {
    if (!table.contains(key.name)) {
      fail(path, table, "key '" + name + "." + key.name + "' is missing");
    }
  }
}

} // namespace rim::world
