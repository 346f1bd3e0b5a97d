// SPDX-License-Identifier: MIT
// bus/can_bus.hpp - alarms, heartbeats and entry warnings from a CAN interface, frames onto it.
#pragma once

#include "rim/can.h"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace rim {

// Puts frames of any number of nodes together to records. A record whose detail does not come
// within a second is described from its summary alone. No system call: frames come from a bus or a
// log.
class CanRecords {
public:
  // from_summary: only level, state, detector, kind, flags, the low bits of seq and model_id, dims
  // (without a region), observations and ln_anom are known; t_s is the time of reception.
  std::function<void(const rim_alarm &, bool from_summary)> on_alarm;
  std::function<void(const rim_can_heartbeat &)> on_heartbeat;
  // Low bits alone; t_s is the time of reception.
  std::function<void(const rim_entry &, std::uint32_t node)> on_entry;

  void take(const rim_can_frame &frame, double now_s);
  void tick(double now_s); // tells summaries that have waited long enough
  std::uint64_t refused() const { return refused_; }

private:
  struct Node {
    rim_can_assembly assembly{};
    rim_can_summary newest{};
    double since_s = 0.0;
    int told = -1; // low bits of seq of the newest detail
    bool heard = false, waits = false;
  };
  void take_summary(const rim_can_frame &frame, double now_s);
  void take_detail(const rim_can_frame &frame);
  void take_entry(const rim_can_frame &frame, double now_s);
  void tell(const rim_alarm &alarm, std::uint32_t node);
  void tell_summary(Node &node);

  std::map<std::uint32_t, Node> nodes_;
  std::uint64_t refused_ = 0;
};

// A SocketCAN interface, classic and FD. Throws DataError when there is no such interface or
// kernel.
class CanBus {
public:
  explicit CanBus(const std::string &interface);
  ~CanBus();
  CanBus(const CanBus &) = delete;
  CanBus &operator=(const CanBus &) = delete;

  CanRecords records;
  // Waits at most so long and hands what has come to `records`. An interface that is down stays
  // silent until it is up again; one that is gone throws.
  void receive(int timeout_ms);
  // Waits while the interface's queue is full, at most a second. DataError when it does not take
  // the frame.
  void send(const rim_can_frame &frame);

private:
  std::string interface_;
  int descriptor_ = -1;
};

} // namespace rim
