// SPDX-License-Identifier: MIT
#include "log/log_set.hpp"

#include <utility>

namespace rim {

namespace {

std::size_t bytes_of(const Log &log) {
  return sizeof(double) * (static_cast<std::size_t>(log.values.size()) + log.t_s.size()) +
         sizeof(std::uint32_t) * log.row.size();
}

} // namespace

LogSet::LogSet(const std::vector<Log> &logs) : was_read_(logs.size(), 1) {
  for (const Log &log : logs) {
    paths_.push_back(log.path);
    kept_.emplace_back(std::shared_ptr<const Log>(), &log); // owned by the caller
  }
}

LogSet::LogSet(std::vector<std::string> paths, std::optional<Schema> schema, std::size_t kept_bytes)
    : paths_(std::move(paths)), schema_(std::move(schema)), kept_(paths_.size()),
      was_read_(paths_.size(), 0), room_(kept_bytes) {}

std::shared_ptr<const Log> LogSet::get(std::size_t i) {
  ReadOptions options;
  {
    const std::lock_guard<std::mutex> lock(guard_);
    if (kept_[i] != nullptr)
      return kept_[i];
    if (was_read_[i] != 0)
      options.warnings = nullptr;
    was_read_[i] = 1;
  }
  auto log =
      std::make_shared<const Log>(read_log(paths_[i], schema_ ? &*schema_ : nullptr, options));
  const std::lock_guard<std::mutex> lock(guard_);
  if (bytes_of(*log) <= room_) {
    room_ -= bytes_of(*log);
    kept_[i] = log;
  }
  return log;
}

std::shared_ptr<const Log> LogSet::take(std::size_t i) {
  std::shared_ptr<const Log> log = get(i);
  const std::lock_guard<std::mutex> lock(guard_);
  if (kept_[i] != nullptr && kept_[i].use_count() > 0) {
    room_ += bytes_of(*log);
    kept_[i].reset();
  }
  return log;
}

} // namespace rim
