// SPDX-License-Identifier: MIT
#include "log/schema.hpp"

#include "log/log.hpp"
#include "util/error.hpp"
#include "util/toml_table.hpp"

#include <algorithm>
#include <filesystem>

namespace rim {

namespace {

class SchemaReader {
public:
  explicit SchemaReader(std::string path) { schema_.path = std::move(path); }
  Schema read();

private:
  [[noreturn]] void fail(const toml::node &at, const std::string &reason) const {
    rim::fail(schema_.path, at, reason);
  }
  // Empty where there is no such key.
  std::string text(const toml::table &table, const char *key, bool needed) const;
  double number(const toml::table &table, const char *key, double otherwise) const;
  std::vector<std::string> texts(const toml::table &table, const char *key) const;
  bool flag(const toml::table &table, const char *key) const; // false where there is no such key
  void check_name(const toml::table &table, const std::string &name);
  void read_top(const toml::table &root);
  void read_time(const toml::table &table);
  void read_reader(const toml::table &table);
  void read_column(const toml::table &table);
  void read_keep(const toml::table &table);
  void read_derive(const toml::table &table);
  void read_friction(const toml::table &table);

  Schema schema_;
  std::vector<std::string> names_;
};

std::string SchemaReader::text(const toml::table &table, const char *key, bool needed) const {
  const toml::node *node = table.get(key);
  if (node == nullptr && needed)
    fail(table, std::string("key '") + key + "' is missing");
  return node != nullptr ? read_string(schema_.path, *node, key) : "";
}

double SchemaReader::number(const toml::table &table, const char *key, double otherwise) const {
  const toml::node *node = table.get(key);
  return node != nullptr ? read_number(schema_.path, *node, key, Range::any) : otherwise;
}

// Whole numbers stand for the text that a CSV file would hold.
std::vector<std::string> SchemaReader::texts(const toml::table &table, const char *key) const {
  const toml::node *node = table.get(key);
  return node != nullptr ? read_strings(schema_.path, *node, key) : std::vector<std::string>();
}

bool SchemaReader::flag(const toml::table &table, const char *key) const {
  const toml::node *node = table.get(key);
  if (node != nullptr && !node->is_boolean())
    fail(*node, std::string(key) + " must be true or false");
  return node != nullptr && node->value_or(false);
}

void SchemaReader::check_name(const toml::table &table, const std::string &name) {
  Role role = Role::context;
  if (!role_of_name(name, role))
    fail(table, "name '" + name + "': must begin with a role: x. u. s. z. m. sd.");
  if (name.find('\n') != std::string::npos) // an image parts its names by these
    fail(table, "name '" + name + "': must be one line");
  if (std::find(names_.begin(), names_.end(), name) != names_.end())
    fail(table, "name '" + name + "': given twice");
  names_.push_back(name);
}

void SchemaReader::read_column(const toml::table &table) {
  check_keys(schema_.path, table, "", {"from", "name", "unit", "scale", "offset", "words"});
  schema_.columns.push_back({text(table, "from", true), text(table, "name", true),
                             text(table, "unit", false), number(table, "scale", 1.0),
                             number(table, "offset", 0.0), texts(table, "words")});
  std::vector<std::string> words = schema_.columns.back().words;
  std::sort(words.begin(), words.end());
  if (const auto twice = std::adjacent_find(words.begin(), words.end()); twice != words.end())
    fail(table, "words: '" + *twice + "' is given twice");
  check_name(table, schema_.columns.back().name);
}

void SchemaReader::read_keep(const toml::table &table) {
  check_keys(schema_.path, table, "", {"column", "values", "min", "max"});
  KeepRule rule;
  rule.column = text(table, "column", true);
  rule.values = texts(table, "values");
  rule.bounded = table.contains("min") || table.contains("max");
  rule.min = number(table, "min", rule.min);
  rule.max = number(table, "max", rule.max);
  if (rule.values.empty() && !rule.bounded)
    fail(table, "[[keep]] needs values, min or max");
  schema_.keep.push_back(std::move(rule));
}

void SchemaReader::read_derive(const toml::table &table) {
  check_keys(schema_.path, table, "",
             {"name", "from", "unit", "kind", "window_s", "scale", "order"});
  DeriveRule rule;
  rule.name = text(table, "name", true);
  rule.from = text(table, "from", true);
  rule.unit = text(table, "unit", false);
  rule.window_s = number(table, "window_s", 0.0);
  rule.scale = number(table, "scale", 1.0);
  const double order = number(table, "order", 1.0);
  check_name(table, rule.name);
  if (text(table, "kind", true) != "rate")
    fail(table, "kind: only \"rate\" is known");
  if (!(rule.window_s > 0.0))
    fail(table, "window_s must be above zero");
  if (order != 1.0 && order != 2.0)
    fail(table, "order must be 1 or 2");
  rule.order = order == 2.0 ? 2 : 1;
  schema_.derive.push_back(std::move(rule));
}

void SchemaReader::read_friction(const toml::table &table) {
  check_keys(schema_.path, table, "friction", {"outcome", "velocity"});
  const std::string outcome = text(table, "outcome", true);
  Role role = Role::context;
  if (!role_of_name(outcome, role) || role != Role::outcome)
    fail(table, "outcome '" + outcome + "': must begin with z.");
  const std::string velocity = text(table, "velocity", true);
  if (!role_of_name(velocity, role) || role == Role::outcome || role == Role::sd)
    fail(table, "velocity '" + velocity + "': must be a feature: x. u. s. m.");
  if (!schema_.velocity_of.emplace(outcome, velocity).second)
    fail(table, "outcome '" + outcome + "': given twice");
}

void SchemaReader::read_top(const toml::table &root) {
  check_keys(schema_.path, root, "",
             {"schema", "delimiter", "decimal", "missing", "leave_out", "units_line", "resample_hz",
              "resample", "max_gap_s", "observation", "reader", "time", "column", "keep", "derive",
              "friction"});
  if (text(root, "schema", true) != "rim-schema/1")
    fail(*root.get("schema"), "schema must be \"rim-schema/1\"");
  const std::string delimiter = text(root, "delimiter", false);
  if (delimiter.size() > 1)
    fail(*root.get("delimiter"), "delimiter must be one character");
  if (!delimiter.empty())
    schema_.delimiter = delimiter[0];
  const std::string decimal = text(root, "decimal", false);
  if (!decimal.empty() && decimal != "." && decimal != ",")
    fail(*root.get("decimal"), "decimal must be \".\" or \",\"");
  if (!decimal.empty())
    schema_.decimal = decimal[0];
  if (schema_.decimal == ',' && schema_.delimiter == ',')
    fail(*root.get("decimal"), "decimal and delimiter cannot both be a comma");
  schema_.missing = texts(root, "missing");
  schema_.leave_out = texts(root, "leave_out");
  schema_.units_line = flag(root, "units_line");
  schema_.resample_hz = number(root, "resample_hz", 0.0);
  schema_.max_gap_s = number(root, "max_gap_s", 0.0);
  if (schema_.resample_hz < 0.0 || schema_.max_gap_s < 0.0)
    fail(root, "resample_hz and max_gap_s must not be negative");
  const std::string how = text(root, "resample", false);
  if (!how.empty() && how != "hold" && how != "linear")
    fail(*root.get("resample"), "resample must be \"hold\" or \"linear\"");
  schema_.resample_linear = how == "linear";
  schema_.observation = texts(root, "observation");
  for (const auto &name : schema_.observation)
    check_name(root, name);
  names_.clear();
}

void SchemaReader::read_time(const toml::table &table) {
  check_keys(schema_.path, table, "",
             {"column", "date", "day_first", "scale", "offset", "not_increasing"});
  const std::string column = text(table, "column", false);
  // A table that was written with its index has no name above it, and column = "" names that.
  schema_.time = {table.contains("column") ? column : "t_s",
                  "t_s",
                  "s",
                  number(table, "scale", 1.0),
                  number(table, "offset", 0.0),
                  {}};
  schema_.date = text(table, "date", false);
  schema_.day_first = flag(table, "day_first");
  const std::string bad = text(table, "not_increasing", false);
  if (!bad.empty() && bad != "skip" && bad != "refuse")
    fail(*table.get("not_increasing"), "not_increasing must be \"skip\" or \"refuse\"");
  schema_.skip_bad_time = bad == "skip";
}

void SchemaReader::read_reader(const toml::table &table) {
  check_keys(schema_.path, table, "reader", {"dbc", "packets", "rows", "types"});
  const auto beside = [&](const std::string &file) {
    return file.empty() ? file
                        : (std::filesystem::path(schema_.path).parent_path() / file).string();
  };
  schema_.reader.dbc = beside(text(table, "dbc", false));
  schema_.reader.packets = beside(text(table, "packets", false));
  schema_.reader.rows = text(table, "rows", false);
  for (const std::string &file : texts(table, "types"))
    schema_.reader.types.push_back(beside(file));
}

Schema SchemaReader::read() {
  const toml::table root = parse_toml(schema_.path);
  read_top(root);
  if (const toml::node *node = root.get("time")) {
    if (!node->is_table())
      fail(*node, "[time] is not a table");
    read_time(*node->as_table());
  }
  if (const toml::node *node = root.get("reader")) {
    if (!node->is_table())
      fail(*node, "[reader] is not a table");
    read_reader(*node->as_table());
  }
  for (const toml::table *table : read_tables(schema_.path, root, "column"))
    read_column(*table);
  for (const toml::table *table : read_tables(schema_.path, root, "keep"))
    read_keep(*table);
  for (const toml::table *table : read_tables(schema_.path, root, "derive"))
    read_derive(*table);
  for (const toml::table *table : read_tables(schema_.path, root, "friction"))
    read_friction(*table);
  return std::move(schema_);
}

} // namespace

Schema read_schema(const std::string &path) { return SchemaReader(path).read(); }

} // namespace rim
