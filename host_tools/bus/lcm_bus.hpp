// SPDX-License-Identifier: MIT
// bus/lcm_bus.hpp - alarms, observations, health, counters and entry warnings over LCM.
#pragma once

#include "rim/alarm.h"
#include "rim/can.h"
#include "rim/lcm.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

typedef struct _lcm_t lcm_t;

namespace rim {

// ttl 0: stays on this machine.
constexpr const char *kLcmUrl = "udpm://239.255.76.67:7667?ttl=0";

// One connection. Throws DataError when the URL cannot be opened or a message cannot be sent.
// Also "file://NAME?mode=w" to record and "file://NAME?speed=0" to play.
class LcmBus {
public:
  explicit LcmBus(const std::string &url);
  ~LcmBus();
  LcmBus(const LcmBus &) = delete;
  LcmBus &operator=(const LcmBus &) = delete;

  void publish(const rim_alarm &alarm);
  void publish(const rim_observation_message &observation);
  void publish(const rim_health_message &health);

  // Set before the first receive().
  std::function<void(const rim_alarm &)> on_alarm;
  std::function<void(const rim_health_message &)> on_health;
  std::function<void(const rim_observation_message &)> on_observation;
  std::function<void(const rim_counters &)> on_counters;
  std::function<void(const rim_entry &)> on_entry;
  std::function<void(const rim_model_message &)> on_model;

  // Waits at most so long, handles what has come and returns whether anything has. Messages that do
  // not decode are counted in refused().
  bool receive(int timeout_ms);
  // Whether a recording ("file:") that is played has come to its end: nothing comes any more.
  bool ended() const { return ended_; }
  std::uint64_t refused() const { return refused_; }

private:
  void send(const char *channel, const std::uint8_t *bytes, std::size_t count);
  void subscribe();
  void take(const std::string &channel, const std::uint8_t *bytes, std::size_t count);

  struct Receiver;
  std::string url_;
  lcm_t *lcm_ = nullptr;
  bool subscribed_ = false, ended_ = false;
  std::uint64_t refused_ = 0;
};

} // namespace rim
