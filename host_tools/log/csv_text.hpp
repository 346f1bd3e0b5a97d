// SPDX-License-Identifier: MIT
// log/csv_text.hpp - lines, fields and numbers of CSV text.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace rim {

// Without blanks and the quotation marks around a field.
inline std::string_view trimmed(std::string_view s) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!s.empty() && blank(s.front()))
    s.remove_prefix(1);
  while (!s.empty() && blank(s.back()))
    s.remove_suffix(1);
  if (s.size() >= 2 && s.front() == '"' && s.back() == '"')
    s = s.substr(1, s.size() - 2);
  return s;
}

// Whether the text is a number with a decimal comma, and that number.
inline bool parse_number(std::string_view s, double &value);
inline bool parse_comma_number(std::string_view s, double &value) {
  std::string pointed(s);
  const auto comma = std::find(pointed.begin(), pointed.end(), ',');
  if (comma == pointed.end() || s.find('.') != std::string_view::npos)
    return false;
  *comma = '.';
  return parse_number(pointed, value);
}

// What spreadsheets and libraries write where there is no value; "NaN" is a number.
inline bool is_no_value(std::string_view s) {
  return s.empty() || s == "NA" || s == "N/A" || s == "n/a" || s == "#N/A" || s == "null" ||
         s == "None";
}

// False when the text is no number. What is_no_value() reads as NaN; what overflows as infinite.
inline bool parse_number(std::string_view s, double &value) {
  s = trimmed(s);
  if (is_no_value(s)) {
    value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (s.front() == '+' && s.size() > 1 && s[1] != '-')
    s.remove_prefix(1);
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (end != s.data() + s.size())
    return false;
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(s).c_str(), nullptr);
  return error != std::errc::invalid_argument;
}

// The line that begins at `at`, without its end; `at` moves behind it. False after the last.
inline bool take_line(std::string_view text, std::size_t &at, std::string_view &line) {
  if (at >= text.size())
    return false;
  const char *begin = text.data() + at;
  const void *end = std::memchr(begin, '\n', text.size() - at);
  const std::size_t length = end != nullptr
                                 ? static_cast<std::size_t>(static_cast<const char *>(end) - begin)
                                 : text.size() - at;
  line = std::string_view(begin, length);
  if (!line.empty() && line.back() == '\r')
    line.remove_suffix(1);
  at += length + 1;
  return true;
}

// The line, from 1, that ends before byte `at`: the one that an editor shows.
inline std::size_t line_of(std::string_view text, std::size_t at) {
  const auto end = text.begin() + static_cast<long>(std::min(at, text.size()));
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), end, '\n'));
  return lines + (at > text.size() ? 1 : 0);
}

// The fields of a line, with their quotation marks, of which two in a row within a field stand for
// one (RFC 4180). Of a blank as the delimiter several count as one, and those at the ends as none.
inline void split_fields(std::string_view line, char delimiter,
                         std::vector<std::string_view> &fields) {
  fields.clear();
  if (delimiter == ' ') {
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t'))
      line.remove_prefix(1);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t'))
      line.remove_suffix(1);
  }
  const char *at = line.data(), *const end = line.data() + line.size();
  for (;;) {
    const char *begin = at;
    while (at < end && *at == '"') { // once more behind two in a row
      at++;
      while (at < end && *at != '"')
        at++;
      at += at < end ? 1 : 0;
    }
    while (at < end && *at != delimiter)
      at++;
    fields.emplace_back(begin, static_cast<std::size_t>(at - begin));
    if (at == end)
      return;
    at++;
    while (delimiter == ' ' && *at == ' ') // the last character is none
      at++;
  }
}

} // namespace rim
