// SPDX-License-Identifier: MIT
#include "log/labels.hpp"

#include <cmath>
#include <fmt/format.h>

namespace rim {

LabelledLog unlabelled(const Log &log) {
  LabelledLog out{log.path, std::vector<double>(log.rows_in_file, std::nan("")),
                  std::vector<std::uint32_t>(log.rows_in_file, 0)};
  for (std::size_t i = 0; i < log.row.size(); ++i) {
    if (log.row[i] >= 1 && log.row[i] <= log.rows_in_file && std::isnan(out.t_s[log.row[i] - 1]))
      out.t_s[log.row[i] - 1] = log.t_s[i];
  }
  return out;
}

std::string labels_header() { return "log,row,t_s,finding\n"; }

std::string labels_text(const LabelledLog &log) {
  const std::string name = csv_field(log.path);
  std::string text;
  for (std::size_t i = 0; i < log.finding.size(); ++i) {
    const std::string time = std::isnan(log.t_s[i]) ? "" : fmt::format("{:.12g}", log.t_s[i]);
    text += fmt::format("{},{},{},{}\n", name, i + 1, time, log.finding[i]);
  }
  return text;
}

std::string csv_field(const std::string &text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos)
    return text;
  std::string out = "\"";
  for (const char letter : text)
    out += letter == '"' ? std::string("\"\"") : std::string(1, letter);
  return out + "\"";
}

} // namespace rim
