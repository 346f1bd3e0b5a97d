// SPDX-License-Identifier: MIT
// log/log_set.hpp - many logs, one at a time: those that fit are kept, the others read again.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "log/log.hpp"
#include "log/schema.hpp"

namespace rim {

// Logs that are asked for once or twice each. Which are kept in between changes the time that is
// needed and nothing else. Threads may ask at the same time.
class LogSet {
public:
  static constexpr std::size_t kKeptBytes = std::size_t{256} << 20;

  // Of logs that stay where they are.
  explicit LogSet(const std::vector<Log> &logs);
  // Of files. Up to `kept_bytes` of their rows are kept from the first time to the last.
  LogSet(std::vector<std::string> paths, std::optional<Schema> schema,
         std::size_t kept_bytes = kKeptBytes);

  std::size_t size() const { return paths_.size(); }
  const std::string &path(std::size_t i) const { return paths_[i]; }
  // The log; a file is warned of when it is read for the first time alone. DataError as of
  // read_log().
  std::shared_ptr<const Log> get(std::size_t i);
  // The same, and it will not be asked for again.
  std::shared_ptr<const Log> take(std::size_t i);

private:
  std::vector<std::string> paths_;
  std::optional<Schema> schema_;
  std::vector<std::shared_ptr<const Log>> kept_;
  std::vector<char> was_read_;
  std::size_t room_ = 0; // bytes that may still be kept
  std::mutex guard_;
};

} // namespace rim
