// SPDX-License-Identifier: MIT
#include "log/log.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <charconv>

namespace rim {

namespace {

// A double in %.*g form; 32 bytes hold any.
char *put_number(char *at, double value, int digits) {
  return std::to_chars(at, at + 32, value, std::chars_format::general, digits).ptr;
}

} // namespace

void write_log(const Log &log, const std::string &path) {
  const auto columns = static_cast<Eigen::Index>(log.columns.size());
  if (log.values.cols() != columns ||
      log.values.rows() != static_cast<Eigen::Index>(log.t_s.size()))
    throw std::logic_error("write_log: sizes of columns, t_s and values differ");
  AtomicFile out(path);
  for (const auto &comment : log.comments)
    out.write("# " + comment + "\n");
  std::string line = "t_s";
  for (const auto &column : log.columns)
    line += "," + column.name;
  out.write(line + "\n");
  std::string buffer(32 * (log.columns.size() + 1), '\0');
  for (Eigen::Index r = 0; r < log.values.rows(); ++r) {
    char *at = put_number(buffer.data(), log.t_s[static_cast<std::size_t>(r)], 12);
    for (Eigen::Index c = 0; c < columns; ++c) {
      *at++ = ',';
      at = put_number(at, log.values(r, c), 9);
    }
    *at++ = '\n';
    out.write(buffer.data(), static_cast<std::size_t>(at - buffer.data()));
  }
  out.commit();
}

} // namespace rim
