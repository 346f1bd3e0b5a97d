// SPDX-License-Identifier: MIT
// util/table.hpp - aligned text tables with a unit under each heading.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace rim {

struct TableColumn {
  std::string name;
  std::string unit; // empty: none
};

// Text is aligned to the left, anything that begins like a number to the right.
class Table {
public:
  explicit Table(std::vector<TableColumn> columns) : columns_(std::move(columns)) {}
  // Short rows are filled with blanks; more cells than columns throw std::logic_error.
  void add(std::vector<std::string> cells);
  std::string text() const;
  void print(std::FILE *to = stdout) const;

private:
  std::vector<TableColumn> columns_;
  std::vector<std::vector<std::string>> rows_;
};

// A number with `digits` significant digits, never in exponent form between 1e-4 and 1e7.
std::string cell(double value, int digits = 4);
inline std::string cell(std::size_t value) { return std::to_string(value); }

} // namespace rim
