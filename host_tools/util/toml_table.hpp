// SPDX-License-Identifier: MIT
// util/toml_table.hpp - strict TOML: every key known, of the right type, finite and in range.
#pragma once

#include <string>
#include <vector>

#include "util/error.hpp"

#include <toml++/toml.h>

namespace rim {

enum class Range { any, not_negative, positive, fraction };

struct NumberKey {
  const char *name;
  double *value;
  Range range;
};

// A parsed file. Throws DataError where it cannot be read or is no TOML.
toml::table parse_toml(const std::string &path);

// "file:line 3: " of a node; just "file: " for a node without a place.
std::string where(const std::string &path, const toml::node &node);

[[noreturn]] void fail(const std::string &path, const toml::node &node, const std::string &reason);

double read_number(const std::string &path, const toml::node &node, const std::string &key,
                   Range range);
std::string read_string(const std::string &path, const toml::node &node, const std::string &key);
// A list of strings; a whole number stands for its text.
std::vector<std::string> read_strings(const std::string &path, const toml::node &node,
                                      const std::string &key);

// The tables [[key]] of a file, in its order; none where it has no such key.
std::vector<const toml::table *> read_tables(const std::string &path, const toml::table &root,
                                             const std::string &key);

// Refuses a key that is not known. name: of the table, empty for the file itself.
void check_keys(const std::string &path, const toml::table &table, const std::string &name,
                const std::vector<std::string> &known);

// Fills the values of the keys present in `table`; a key not in `keys` (nor in `others`, which the
// caller reads) is an error, and with `complete` so is a missing one.
void read_numbers(const std::string &path, const toml::table &table, const std::string &name,
                  const std::vector<NumberKey> &keys, bool complete,
                  const std::vector<std::string> &others = {});

// Parameters from a file that must hold all of them and, unless its path is empty, from a second
// one that replaces some: read(path, params, whether every key must be there) for each.
template <class Params>
Params read_overlaid(const std::string &base, const std::string &overlay,
                     void (*read)(const std::string &, Params &, bool)) {
  Params params{};
  read(base, params, true);
  if (!overlay.empty())
    read(overlay, params, false);
  return params;
}

// "HEADER\nkey = value\n..." with doubles that read back to the same bits.
std::string table_toml(const std::string &header, const std::vector<NumberKey> &keys);

} // namespace rim
