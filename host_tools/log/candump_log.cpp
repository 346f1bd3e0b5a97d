// SPDX-License-Identifier: MIT
#include "log/candump_log.hpp"

#include <cmath>
#include <cstdlib>

#include "rim/can_table.h"
#include "util/error.hpp"

namespace rim {

namespace {

int hex(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                : -1;
}

// "(SECONDS) IFACE ID#DATA" or "ID##FLAGSDATA"; a remote frame (#R) is no data.
bool parse_frame(const std::string &line, rim_can_frame &frame, double &t_s) {
  if (line.empty() || line[0] != '(')
    return false;
  char *end = nullptr;
  t_s = std::strtod(line.c_str() + 1, &end);
  if (*end != ')' || !std::isfinite(t_s))
    return false;
  const std::size_t name =
      line.find_first_not_of(' ', static_cast<std::size_t>(end - line.c_str()) + 1);
  std::size_t at = name == std::string::npos ? name : line.find(' ', name);
  if (at == std::string::npos)
    return false;
  frame = rim_can_frame{};
  std::size_t digits = 0;
  for (at++; at < line.size() && hex(line[at]) >= 0 && digits <= 8; at++, digits++)
    frame.id = frame.id << 4 | static_cast<std::uint32_t>(hex(line[at]));
  if ((digits != 3 && digits != 8) || at >= line.size() || line[at] != '#')
    return false;
  if (digits == 8)
    frame.id |= RIM_CAN_EXTENDED;
  at++;
  frame.fd = at < line.size() && line[at] == '#';
  if (frame.fd)
    at += 2; // and the digit of the flags
  const std::size_t most = frame.fd ? 64 : 8;
  std::size_t bytes = 0;
  for (; at + 1 < line.size() && hex(line[at]) >= 0 && hex(line[at + 1]) >= 0; at += 2) {
    if (bytes == most)
      return false;
    frame.data[bytes++] = static_cast<std::uint8_t>(hex(line[at]) << 4 | hex(line[at + 1]));
  }
  frame.length = static_cast<std::uint8_t>(bytes);
  return at >= line.size() || line[at] == ' ' || line[at] == '_'; // some append T, R or a length
}

class CandumpReader {
public:
  CandumpReader(const std::string &path, const std::vector<std::uint8_t> &table,
                const std::vector<std::string> &names, double signal_age_s);

  void take(const std::string &line) {
    line_++;
    rim_can_frame frame;
    double t_s = 0.0;
    if (line.empty())
      return;
    if (!parse_frame(line, frame, t_s))
      return skip("no frame of candump -L");
    bool complete = false;
    double row_s = 0.0;
    // Numbers are counted from the first frame: digits of the clock of the day would be lost.
    if (!started_)
      origin_s_ = t_s;
    const rim_status status =
        rim_can_gather_frame(&gather_, &table_, &frame, t_s - origin_s_, age_s_, &complete, &row_s);
    if (status == RIM_E_MAGIC)
      return; // of others
    started_ = true;
    if (status == RIM_E_TRUNCATED)
      skip("a row lacks a signal, or one is too old");
    else if (status != RIM_OK)
      skip(std::string("frame refused: ") + rim_status_text(status));
    if (complete)
      add_row(row_s);
  }

  Log finish(std::FILE *warnings) {
    if (warnings != nullptr && log_.rows_skipped > 0)
      std::fprintf(warnings, "rim: warning: %s: %u frames or rows skipped, the first: %s\n",
                   log_.path.c_str(), log_.rows_skipped, first_skipped_.c_str());
    if (log_.t_s.empty())
      throw DataError(log_.path + ": its frames make no row" +
                      (first_skipped_.empty() ? "" : " (" + first_skipped_ + ")"));
    log_.values = Eigen::Map<const Matrix>(flat_.data(), static_cast<Eigen::Index>(log_.t_s.size()),
                                           static_cast<Eigen::Index>(table_.values));
    return std::move(log_);
  }

private:
  void skip(const std::string &reason) {
    log_.rows_skipped++;
    if (first_skipped_.empty())
      first_skipped_ = "line " + std::to_string(line_) + ": " + reason;
  }

  void add_row(double row_s) {
    log_.rows_in_file++;
    if (!log_.t_s.empty() && !(row_s > log_.t_s.back()))
      return skip("time does not increase");
    log_.t_s.push_back(row_s);
    log_.row.push_back(log_.rows_in_file);
    flat_.insert(flat_.end(), gather_.value, gather_.value + table_.values);
  }

  Log log_;
  rim_can_table table_{};
  rim_can_gather gather_{};
  double age_s_, origin_s_ = 0.0;
  bool started_ = false;
  std::size_t line_ = 0;
  std::vector<double> flat_;
  std::string first_skipped_;
};

CandumpReader::CandumpReader(const std::string &path, const std::vector<std::uint8_t> &table,
                             const std::vector<std::string> &names, double signal_age_s)
    : age_s_(signal_age_s) {
  log_.path = path;
  const rim_status status = rim_can_table_open(&table_, table.data(), table.size());
  if (status != RIM_OK)
    throw DataError(path + ": the model's CAN table: " + rim_status_text(status));
  if (table_.values != names.size())
    throw DataError(path + ": the model's CAN table makes rows of " +
                    std::to_string(table_.values) + " values, the model has " +
                    std::to_string(names.size()));
  for (const std::string &name : names) {
    Role role = Role::context;
    if (!role_of_name(name, role))
      throw DataError(path + ": column '" + name + "': the name must begin with a role");
    log_.columns.push_back({name, unit_of_name(name), role});
  }
}

} // namespace

bool is_candump_log(std::string_view text) {
  return text.size() > 3 && text[0] == '(' && text[1] >= '0' && text[1] <= '9' &&
         text.substr(0, 40).find(") ") != std::string_view::npos;
}

Log read_candump_log(const std::string &path, std::string_view text, const ReadOptions &options) {
  if (!options.can || options.can->table.empty())
    throw DataError(path +
                    ": holds CAN frames: give a model with a CAN table (rim can-table), or a "
                    "schema with [reader] dbc");
  CandumpReader reader(path, options.can->table, options.can->names, options.can->signal_age_s);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    reader.take(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return reader.finish(options.warnings);
}

} // namespace rim
