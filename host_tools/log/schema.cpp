// SPDX-License-Identifier: MIT
#include "log/schema.hpp"

#include "log/log.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <sstream>
#include <toml++/toml.h>

namespace rim {

namespace {

class SchemaReader {
public:
  explicit SchemaReader(std::string path) { schema_.path = std::move(path); }
  Schema read();

private:
  [[noreturn]] void fail(const toml::node *at, const std::string &reason) const {
    std::string where = schema_.path;
    if (at != nullptr && at->source().begin)
      where += ":line " + std::to_string(at->source().begin.line);
    throw DataError(where + ": " + reason);
  }
  void check_keys(const toml::table &table, std::initializer_list<std::string_view> known) const;
  std::string text(const toml::table &table, const char *key, bool needed) const;
  double number(const toml::table &table, const char *key, double otherwise) const;
  template <class Each> void tables(const toml::table &root, const char *key, Each each) const;
  std::vector<std::string> texts(const toml::table &table, const char *key) const;
  void check_name(const toml::table &table, const std::string &name);
  void read_top(const toml::table &root);
  void read_column(const toml::table &table);
  void read_keep(const toml::table &table);
  void read_derive(const toml::table &table);
  void read_friction(const toml::table &table);

  Schema schema_;
  std::vector<std::string> names_;
};

void SchemaReader::check_keys(const toml::table &table,
                              std::initializer_list<std::string_view> known) const {
  for (const auto &[key, node] : table)
    if (std::find(known.begin(), known.end(), key.str()) == known.end())
      fail(&node, "unknown key '" + std::string(key.str()) + "'");
}

std::string SchemaReader::text(const toml::table &table, const char *key, bool needed) const {
  const toml::node *node = table.get(key);
  if (node == nullptr) {
    if (needed)
      fail(&table, std::string("key '") + key + "' is missing");
    return "";
  }
  const auto value = node->value_exact<std::string>();
  if (!value)
    fail(node, std::string("'") + key + "' is not a text");
  return *value;
}

double SchemaReader::number(const toml::table &table, const char *key, double otherwise) const {
  const toml::node *node = table.get(key);
  if (node == nullptr)
    return otherwise;
  const auto value = node->value<double>();
  if (!value || !node->is_number() || !std::isfinite(*value))
    fail(node, std::string("'") + key + "' is not a finite number");
  return *value;
}

// Integers and truth values stand for the text that a CSV file would hold.
std::vector<std::string> SchemaReader::texts(const toml::table &table, const char *key) const {
  std::vector<std::string> list;
  const toml::node *node = table.get(key);
  if (node == nullptr)
    return list;
  const toml::array *array = node->as_array();
  if (array == nullptr)
    fail(node, std::string("'") + key + "' is not a list");
  for (const auto &item : *array) {
    if (const auto text = item.value_exact<std::string>())
      list.push_back(*text);
    else if (const auto whole = item.value_exact<std::int64_t>())
      list.push_back(std::to_string(*whole));
    else
      fail(&item, std::string("'") + key + "': give texts or whole numbers, or min and max");
  }
  return list;
}

template <class Each>
void SchemaReader::tables(const toml::table &root, const char *key, Each each) const {
  const toml::node *node = root.get(key);
  if (node == nullptr)
    return;
  const toml::array *array = node->as_array();
  if (array == nullptr)
    fail(node, std::string("write [[") + key + "]], one for each");
  for (const auto &item : *array) {
    if (!item.is_table())
      fail(&item, std::string("write [[") + key + "]], one for each");
    each(*item.as_table());
  }
}

void SchemaReader::check_name(const toml::table &table, const std::string &name) {
  Role role = Role::context;
  if (!role_of_name(name, role))
    fail(&table, "name '" + name + "': must begin with a role: x. u. s. z. m. sd.");
  if (std::find(names_.begin(), names_.end(), name) != names_.end())
    fail(&table, "name '" + name + "': given twice");
  names_.push_back(name);
}

void SchemaReader::read_column(const toml::table &table) {
  check_keys(table, {"from", "name", "unit", "scale", "offset"});
  schema_.columns.push_back({text(table, "from", true), text(table, "name", true),
                             text(table, "unit", false), number(table, "scale", 1.0),
                             number(table, "offset", 0.0)});
  check_name(table, schema_.columns.back().name);
}

void SchemaReader::read_keep(const toml::table &table) {
  check_keys(table, {"column", "values", "min", "max"});
  KeepRule rule;
  rule.column = text(table, "column", true);
  rule.values = texts(table, "values");
  rule.bounded = table.contains("min") || table.contains("max");
  rule.min = number(table, "min", rule.min);
  rule.max = number(table, "max", rule.max);
  if (rule.values.empty() && !rule.bounded)
    fail(&table, "[[keep]] needs values, min or max");
  schema_.keep.push_back(std::move(rule));
}

void SchemaReader::read_derive(const toml::table &table) {
  check_keys(table, {"name", "from", "unit", "kind", "window_s", "scale", "order"});
  DeriveRule rule;
  rule.name = text(table, "name", true);
  rule.from = text(table, "from", true);
  rule.unit = text(table, "unit", false);
  rule.window_s = number(table, "window_s", 0.0);
  rule.scale = number(table, "scale", 1.0);
  const double order = number(table, "order", 1.0);
  check_name(table, rule.name);
  if (text(table, "kind", true) != "rate")
    fail(&table, "kind: only \"rate\" is known");
  if (!(rule.window_s > 0.0))
    fail(&table, "window_s must be above zero");
  if (order != 1.0 && order != 2.0)
    fail(&table, "order must be 1 or 2");
  rule.order = order == 2.0 ? 2 : 1;
  schema_.derive.push_back(std::move(rule));
}

void SchemaReader::read_friction(const toml::table &table) {
  check_keys(table, {"outcome", "velocity"});
  const std::string outcome = text(table, "outcome", true);
  Role role = Role::context;
  if (!role_of_name(outcome, role) || role != Role::outcome)
    fail(&table, "outcome '" + outcome + "': must begin with z.");
  const std::string velocity = text(table, "velocity", true);
  if (!role_of_name(velocity, role) || role == Role::outcome || role == Role::sd)
    fail(&table, "velocity '" + velocity + "': must be a feature: x. u. s. m.");
  if (!schema_.velocity_of.emplace(outcome, velocity).second)
    fail(&table, "outcome '" + outcome + "': given twice");
}

void SchemaReader::read_top(const toml::table &root) {
  check_keys(root, {"schema", "delimiter", "resample_hz", "resample", "max_gap_s", "observation",
                    "time", "column", "keep", "derive", "friction"});
  if (text(root, "schema", true) != "rim-schema/1")
    fail(root.get("schema"), "schema must be \"rim-schema/1\"");
  const std::string delimiter = text(root, "delimiter", false);
  if (delimiter.size() > 1)
    fail(root.get("delimiter"), "delimiter must be one character");
  if (!delimiter.empty())
    schema_.delimiter = delimiter[0];
  schema_.resample_hz = number(root, "resample_hz", 0.0);
  schema_.max_gap_s = number(root, "max_gap_s", 0.0);
  if (schema_.resample_hz < 0.0 || schema_.max_gap_s < 0.0)
    fail(&root, "resample_hz and max_gap_s must not be negative");
  const std::string how = text(root, "resample", false);
  if (!how.empty() && how != "hold" && how != "linear")
    fail(root.get("resample"), "resample must be \"hold\" or \"linear\"");
  schema_.resample_linear = how == "linear";
  schema_.observation = texts(root, "observation");
  for (const auto &name : schema_.observation)
    check_name(root, name);
  names_.clear();
}

Schema SchemaReader::read() {
  const std::string source = read_file(schema_.path);
  toml::table root;
  try {
    root = toml::parse(source);
  } catch (const toml::parse_error &e) {
    throw DataError(schema_.path + ":line " + std::to_string(e.source().begin.line) + ": " +
                    std::string(e.description()));
  }
  read_top(root);
  if (const toml::node *node = root.get("time")) {
    if (!node->is_table())
      fail(node, "[time] is not a table");
    const toml::table &time = *node->as_table();
    check_keys(time, {"column", "scale", "offset"});
    schema_.time = {text(time, "column", true), "t_s", "s", number(time, "scale", 1.0),
                    number(time, "offset", 0.0)};
  }
  tables(root, "column", [&](const toml::table &t) { read_column(t); });
  tables(root, "keep", [&](const toml::table &t) { read_keep(t); });
  tables(root, "derive", [&](const toml::table &t) { read_derive(t); });
  tables(root, "friction", [&](const toml::table &t) { read_friction(t); });
  return std::move(schema_);
}

} // namespace

Schema read_schema(const std::string &path) { return SchemaReader(path).read(); }

} // namespace rim
