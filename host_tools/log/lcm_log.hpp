// SPDX-License-Identifier: MIT
// log/lcm_log.hpp - LCM event logs, with a reader of our own: liblcm's crashes on a corrupt length
// and stops silently at a bad sync word.
#pragma once

#include "log/log.hpp"
#include "log/schema.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace rim {

// Whether the bytes begin like an event log.
bool is_lcm_log(std::string_view bytes);

struct LcmEvent {
  std::int64_t number = 0, t_us = 0; // t_us: when the logger heard it
  std::string_view channel, data;    // into the caller's bytes
};

// Walks the events; a damaged header or length is skipped up to the next sync word that begins a
// whole event, and counted.
class LcmEventReader {
public:
  explicit LcmEventReader(std::string_view bytes) : bytes_(bytes) {}
  bool next(LcmEvent &event);
  std::size_t bytes_skipped() const { return skipped_; }
  std::size_t resyncs() const { return resyncs_; }

private:
  bool parse(std::size_t at, LcmEvent &event, std::size_t &end) const;

  std::string_view bytes_;
  std::size_t at_ = 0, skipped_ = 0, resyncs_ = 0;
};

// The RIM_OBSERVATION events of a log as rows; rows count those events from 1. A message that does
// not decode, has another count than there are names, or a value that is not finite is skipped and
// counted. Names come from schema->observation, else options.observation_names.
Log read_lcm_log(const std::string &path, std::string_view bytes, const Schema *schema,
                 const ReadOptions &options);

// One event in a log file's form, for writing logs.
std::string lcm_event_bytes(const LcmEvent &event);

} // namespace rim
