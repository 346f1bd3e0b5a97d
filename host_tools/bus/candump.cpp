#include "bus/candump.hpp"

#include "util/error.hpp"

#include <cmath>
#include <cstdio>

namespace rim {

namespace {

void check(rim_status status) {
  if (status != RIM_OK)
    throw std::runtime_error(std::string("an alarm record cannot be sent on CAN: ") +
                             rim_status_text(status));
}

} // namespace

std::string candump_line(const rim_can_frame &frame, double t_s, const std::string &interface) {
  char text[200];
  // candump's own form: seconds padded to ten digits, six decimals, never negative.
  std::snprintf(text, sizeof text, "(%017.6f) %s %03X%s", std::fmax(t_s, 0.0), interface.c_str(),
                static_cast<unsigned>(frame.id), frame.fd ? "##1" : "#");
  std::string line = text;
  for (int i = 0; i < frame.length; i++) {
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

void CandumpFile::write(const rim_alarm &alarm) {
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  check(rim_can_pack_summary(frame, node_, &alarm));
  file_.write(candump_line(frame[0], alarm.t_s, interface_));
  if (fd_) {
    check(rim_can_pack_detail_fd(frame, node_, &alarm));
    file_.write(candump_line(frame[0], alarm.t_s, interface_));
    return;
  }
  check(rim_can_pack_detail(frame, node_, &alarm));
  for (const auto &segment : frame)
    file_.write(candump_line(segment, alarm.t_s, interface_));
}

} // namespace rim
