// SPDX-License-Identifier: MIT
#include "util/toml_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "util/atomic_file.hpp"

namespace rim {
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

std::vector<std::string> read_strings(const std::string &path, const toml::node &node,
                                      const std::string &key) {
  const toml::array *array = node.as_array();
  if (array == nullptr)
    fail(path, node, "key '" + key + "': must be a list");
  std::vector<std::string> list;
  for (const toml::node &item : *array) {
    if (const auto text = item.value_exact<std::string>())
      list.push_back(*text);
    else if (const auto whole = item.value_exact<std::int64_t>())
      list.push_back(std::to_string(*whole));
    else
      fail(path, item, "key '" + key + "': must be a list of strings or whole numbers");
  }
  return list;
}

std::vector<const toml::table *> read_tables(const std::string &path, const toml::table &root,
                                             const std::string &key) {
  std::vector<const toml::table *> list;
  const toml::node *node = root.get(key);
  if (node == nullptr)
    return list;
  if (node->as_array() == nullptr)
    fail(path, *node, "write [[" + key + "]], one for each");
  for (const toml::node &item : *node->as_array()) {
    if (!item.is_table())
      fail(path, item, "write [[" + key + "]], one for each");
    list.push_back(item.as_table());
  }
  return list;
}

namespace {

std::string full_key(const std::string &table, const std::string &key) {
  return table.empty() ? key : table + "." + key;
}

} // namespace

void check_keys(const std::string &path, const toml::table &table, const std::string &name,
                const std::vector<std::string> &known) {
  for (const auto &[key_node, node] : table) {
    const std::string key(key_node.str());
    if (std::find(known.begin(), known.end(), key) == known.end())
      fail(path, node, "unknown key '" + full_key(name, key) + "'");
  }
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
  std::vector<std::string> known = others;
  for (const NumberKey &key : keys) {
    known.emplace_back(key.name);
    if (const toml::node *node = table.get(key.name))
      *key.value = read_number(path, *node, full_key(name, key.name), key.range);
  }
  check_keys(path, table, name, known);
  if (!complete)
    return;
  for (const NumberKey &key : keys) {
    if (!table.contains(key.name)) {
      fail(path, table, "key '" + name + "." + key.name + "' is missing");
    }
  }
}

} // namespace rim
