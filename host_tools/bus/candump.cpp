// SPDX-License-Identifier: MIT
#include "bus/candump.hpp"

#include "bus/packed.hpp"
#include "util/error.hpp"

#include <cmath>
#include <cstdio>

namespace rim {

std::string candump_line(const rim_can_frame &frame, double t_s, const std::string &interface) {
  char text[200];
  // candump's own form: seconds padded to ten digits, six decimals, never negative.
  std::snprintf(text, sizeof text, "(%017.6f) %s %03X%s", std::fmax(t_s, 0.0), interface.c_str(),
                static_cast<unsigned>(frame.id), frame.fd ? "##1" : "#");
  std::string line = text;
  for (int i = 0; i < frame.length; ++i) {
    std::snprintf(text, sizeof text, "%02X", static_cast<unsigned>(frame.data[i]));
    line += text;
  }
  return line + "\n";
}

CandumpFile::CandumpFile(const std::string &path, std::uint32_t node, bool fd,
                         std::string interface)
    : file_(path), node_(node), fd_(fd), interface_(std::move(interface)) {
  if (node > RIM_CAN_MAX_NODE || interface_.empty() || interface_.size() > 15)
    throw UsageError("CAN: node 0 to 127, interface name of 1 to 15 characters");
}

std::vector<rim_can_frame> alarm_frames(const rim_alarm &alarm, std::uint32_t node, bool fd) {
  std::vector<rim_can_frame> frames(1 + RIM_CAN_FINDING_FRAMES + RIM_CAN_DETAIL_FRAMES);
  std::uint32_t pages = 0;
  check_packed(rim_can_pack_summary(&frames[0], node, &alarm), "on CAN");
  check_packed(rim_can_pack_finding(&frames[1], &pages, node, &alarm), "on CAN");
  check_packed(fd ? rim_can_pack_detail_fd(&frames[1 + pages], node, &alarm)
                  : rim_can_pack_detail(&frames[1 + pages], node, &alarm),
               "on CAN");
  frames.resize(1 + pages + (fd ? 1 : RIM_CAN_DETAIL_FRAMES));
  return frames;
}

void CandumpFile::write(const rim_alarm &alarm) {
  for (const rim_can_frame &frame : alarm_frames(alarm, node_, fd_))
    file_.write(candump_line(frame, alarm.t_s, interface_));
}

} // namespace rim
