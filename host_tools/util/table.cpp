// SPDX-License-Identifier: MIT
#include "util/table.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace rim {

namespace {

// Columns on a screen, not bytes: continuation bytes of UTF-8 do not count.
std::size_t width_of(const std::string &s) {
  return static_cast<std::size_t>(
      std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

bool is_number(const std::string &s) {
  const std::size_t i = s.find_first_not_of("+-<>= ");
  return i != std::string::npos && s[i] >= '0' && s[i] <= '9';
}

std::string padded(const std::string &s, std::size_t width, bool right) {
  const std::string blank(width - std::min(width, width_of(s)), ' ');
  return right ? blank + s : s + blank;
}

} // namespace

void Table::add(std::vector<std::string> cells) {
  if (cells.size() > columns_.size())
    throw std::logic_error("table: more cells than columns");
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::text() const {
  const std::size_t n = columns_.size();
  std::vector<std::size_t> width(n);
  std::vector<bool> right(n, false);
  bool units = false;
  for (std::size_t c = 0; c < n; ++c) {
    width[c] = std::max(width_of(columns_[c].name), width_of(columns_[c].unit));
    units = units || !columns_[c].unit.empty();
    for (const auto &row : rows_) {
      width[c] = std::max(width[c], width_of(row[c]));
      right[c] = right[c] || is_number(row[c]);
    }
  }
  std::string out;
  const auto line = [&](const auto &cell_of) {
    std::string s;
    for (std::size_t c = 0; c < n; ++c)
      s += (c ? "  " : "") + padded(cell_of(c), width[c], right[c]);
    s.erase(s.find_last_not_of(' ') + 1);
    out += s + "\n";
  };
  line([&](std::size_t c) { return columns_[c].name; });
  if (units)
    line([&](std::size_t c) { return columns_[c].unit; });
  line([&](std::size_t c) { return std::string(width[c], '-'); });
  for (const auto &row : rows_)
    line([&](std::size_t c) { return row[c]; });
  return out;
}

void Table::print(std::FILE *to) const {
  const std::string s = text();
  std::fwrite(s.data(), 1, s.size(), to);
}

std::string cell(double value, int digits) {
  char buffer[64];
  const double magnitude = std::fabs(value);
  if (!std::isfinite(value) || value == 0.0 || magnitude < 1e-4 || magnitude >= 1e7) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  } else {
    const int before = static_cast<int>(std::floor(std::log10(magnitude))) + 1;
    std::snprintf(buffer, sizeof buffer, "%.*f", std::max(0, digits - before), value);
  }
  return buffer;
}

} // namespace rim
