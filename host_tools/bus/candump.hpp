// SPDX-License-Identifier: MIT
// bus/candump.hpp - CAN frames as the text of `candump -L`, for canplayer, cantools and python-can.
#pragma once

#include "rim/can.h"
#include "util/atomic_file.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace rim {

// "(0000000012.500000) can0 185#0001020304050607\n"; FD frames with "##1" (bit-rate switch).
std::string candump_line(const rim_can_frame &frame, double t_s, const std::string &interface);

// The frames of one record: the summary, the pages of the finding, then the detail: segments, or
// one frame where FD.
std::vector<rim_can_frame> alarm_frames(const rim_alarm &alarm, std::uint32_t node, bool fd);

// Writes the frames of alarms to a file that appears on commit(). Time stamps are the log's.
class CandumpFile {
public:
  CandumpFile(const std::string &path, std::uint32_t node, bool fd, std::string interface = "can0");
  void write(const rim_alarm &alarm);
  void commit() { file_.commit(); }

private:
  AtomicFile file_;
  std::uint32_t node_;
  bool fd_;
  std::string interface_;
};

} // namespace rim
