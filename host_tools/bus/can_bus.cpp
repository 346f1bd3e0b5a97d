// SPDX-License-Identifier: MIT
#include "bus/can_bus.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "util/error.hpp"

namespace rim {

namespace {

constexpr double kDetailPatience_s = 1.0;
constexpr int kSendTries = 1000;
constexpr useconds_t kSendPause_us = 1000;

double now_s() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

bool is_in(std::uint32_t id, std::uint32_t first) {
  return id >= first && id - first <= RIM_CAN_MAX_NODE;
}

} // namespace

void CanRecords::tell(const rim_alarm &alarm, std::uint32_t node) {
  Node &from = nodes_[node];
  from.told = static_cast<std::uint8_t>(alarm.seq);
  if (from.waits && from.newest.seq == static_cast<std::uint8_t>(alarm.seq))
    from.waits = false;
  on_alarm(alarm, false);
}

void CanRecords::tell_summary(Node &node) {
  node.waits = false;
  const rim_can_summary &s = node.newest;
  rim_alarm alarm{};
  alarm.t_s = alarm.since_s = node.since_s;
  alarm.seq = s.seq;
  alarm.model_id = s.model_id;
  alarm.observations = s.observations;
  alarm.detector = s.detector;
  alarm.state = s.state;
  alarm.level = s.level;
  alarm.kind = s.kind;
  alarm.flags = s.flags;
  alarm.ln_anom = s.ln_anom;
  on_alarm(alarm, true);
}

void CanRecords::take_summary(const rim_can_frame &frame, double now_s) {
  rim_can_summary summary;
  if (rim_can_unpack_summary(&summary, &frame) != RIM_OK) {
    refused_++;
    return;
  }
  Node &node = nodes_[summary.node];
  const rim_can_summary before = node.newest;
  const bool is_new = !node.heard || before.seq != summary.seq || before.state != summary.state ||
                      before.level != summary.level;
  if (!is_new)
    return; // the cyclic repetition
  if (node.waits)
    tell_summary(node);
  // A summary repeats what was sent before this program started; "nothing yet" is no record.
  const bool empty =
      !node.heard && summary.state == RIM_ALARM_NONE && summary.level == RIM_LEVEL_OK;
  node.newest = summary;
  node.since_s = now_s;
  node.waits = !empty && node.told != summary.seq; // detail may come first: summaries are inhibited
  node.heard = true;
}

void CanRecords::take_detail(const rim_can_frame &frame) {
  const std::uint32_t number = frame.id - RIM_CAN_DETAIL_ID;
  rim_alarm alarm;
  if (frame.fd) {
    if (rim_can_unpack_detail_fd(&alarm, &frame) == RIM_OK)
      tell(alarm, number);
    else
      refused_++;
    return;
  }
  Node &node = nodes_[number];
  node.assembly.node = static_cast<std::uint8_t>(number);
  bool complete = false;
  const rim_status status = rim_can_take_detail(&node.assembly, &frame, &alarm, &complete);
  if (complete)
    tell(alarm, number);
  else if (status != RIM_OK)
    refused_++;
}

void CanRecords::take_entry(const rim_can_frame &frame, double now_s) {
  rim_entry entry;
  if (rim_can_unpack_entry(&entry, &frame) != RIM_OK) {
    refused_++;
    return;
  }
  entry.t_s = now_s;
  if (on_entry)
    on_entry(entry, frame.id - RIM_CAN_ENTRY_ID);
}

void CanRecords::take(const rim_can_frame &frame, double now_s) {
  if (is_in(frame.id, RIM_CAN_SUMMARY_ID)) {
    take_summary(frame, now_s);
  } else if (is_in(frame.id, RIM_CAN_DETAIL_ID)) {
    take_detail(frame);
  } else if (is_in(frame.id, RIM_CAN_ENTRY_ID)) {
    take_entry(frame, now_s);
  } else if (is_in(frame.id, RIM_CAN_HEARTBEAT_ID)) {
    rim_can_heartbeat heartbeat;
    if (rim_can_unpack_heartbeat(&heartbeat, &frame) != RIM_OK)
      refused_++;
    else if (on_heartbeat)
      on_heartbeat(heartbeat);
  }
}

void CanRecords::tick(double now_s) {
  for (auto &[number, node] : nodes_)
    if (node.waits && now_s - node.since_s > kDetailPatience_s)
      tell_summary(node);
}

CanBus::CanBus(const std::string &interface) : interface_(interface) {
  descriptor_ = ::socket(AF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor_ < 0)
    throw DataError(interface + ": this machine's kernel has no CAN (" + std::strerror(errno) +
                    ")");
  const auto refuse = [&](const std::string &reason) {
    ::close(descriptor_);
    throw DataError(interface + ": " + reason);
  };
  const int yes = 1;
  (void)::setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &yes, sizeof yes);
  sockaddr_can name{};
  name.can_family = AF_CAN;
  name.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (name.can_ifindex == 0)
    refuse("no such interface");
  // What monitors send: ranges of 128 identifiers.
  constexpr canid_t kRange = 0x780;
  const can_filter filter[] = {{RIM_CAN_SUMMARY_ID, kRange},
                               {RIM_CAN_DETAIL_ID, kRange},
                               {RIM_CAN_ENTRY_ID, kRange},
                               {RIM_CAN_HEARTBEAT_ID, kRange}};
  if (::setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_FILTER, filter, sizeof filter) != 0 ||
      ::bind(descriptor_, reinterpret_cast<const sockaddr *>(&name), sizeof name) != 0)
    refuse(std::strerror(errno));
}

CanBus::~CanBus() { ::close(descriptor_); }

void CanBus::receive(int timeout_ms) {
  pollfd ready{descriptor_, POLLIN, 0};
  if (::poll(&ready, 1, timeout_ms) > 0) {
    canfd_frame in{};
    ssize_t bytes;
    while ((bytes = ::read(descriptor_, &in, sizeof in)) > 0) {
      if ((bytes != CAN_MTU && bytes != CANFD_MTU) || in.len > CANFD_MAX_DLEN ||
          (in.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0)
        continue;
      rim_can_frame frame{};
      frame.id = in.can_id;
      frame.length = in.len;
      frame.fd = bytes == CANFD_MTU;
      std::memcpy(frame.data, in.data, in.len);
      records.take(frame, now_s());
    }
    if (bytes < 0 && (errno == ENODEV || errno == ENXIO))
      throw DataError(interface_ + ": the interface is gone");
    if (bytes < 0 && errno == ENETDOWN && timeout_ms > 0)
      ::usleep(static_cast<useconds_t>(timeout_ms) * 1000);
  }
  records.tick(now_s());
}

void CanBus::send(const rim_can_frame &frame) {
  canfd_frame out{};
  out.can_id = frame.id;
  out.len = frame.length;
  std::memcpy(out.data, frame.data, frame.length);
  // A full queue says so by ENOBUFS and cannot be waited for by poll().
  for (int i = 0; i < kSendTries; ++i) {
    if (::write(descriptor_, &out, frame.fd ? CANFD_MTU : CAN_MTU) >= 0)
      return;
    if (errno != ENOBUFS && errno != EAGAIN)
      break;
    ::usleep(kSendPause_us);
  }
  throw DataError(interface_ + ": " + std::strerror(errno));
}

} // namespace rim
