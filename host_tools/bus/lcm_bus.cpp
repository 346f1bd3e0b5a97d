// SPDX-License-Identifier: MIT
#include "bus/lcm_bus.hpp"

#include "bus/packed.hpp"
#include "util/error.hpp"

#include <cerrno>
#include <lcm/lcm.h>
#include <stdexcept>

namespace rim {

namespace {

bool is_of(const std::string &url, const char *scheme) { return url.rfind(scheme, 0) == 0; }

} // namespace

// liblcm calls C functions: no exception may leave them.
struct LcmBus::Receiver {
  static void handle(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    auto *bus = static_cast<LcmBus *>(user);
    bus->take(channel, static_cast<const std::uint8_t *>(buffer->data), buffer->data_size);
  }
};

LcmBus::LcmBus(const std::string &url) : url_(url), lcm_(lcm_create(url.c_str())) {
  if (lcm_ == nullptr)
    throw DataError(url + ": LCM cannot open it" +
                    (is_of(url, "udpm:") ? " (udpm needs a multicast route: "
                                           "ip route add 224.0.0.0/4 dev lo)"
                                         : ""));
}

LcmBus::~LcmBus() { lcm_destroy(lcm_); }

void LcmBus::send(const char *channel, const std::uint8_t *bytes, std::size_t count) {
  if (lcm_publish(lcm_, channel, bytes, static_cast<unsigned>(count)) != 0)
    throw DataError(url_ + ": LCM could not send " + channel);
}

void LcmBus::publish(const rim_alarm &alarm) {
  std::uint8_t bytes[RIM_LCM_ALARM_SIZE];
  check_packed(rim_lcm_pack_alarm(bytes, sizeof bytes, &alarm), "over LCM");
  send(RIM_LCM_CHANNEL_ALARM, bytes, sizeof bytes);
}

void LcmBus::publish(const rim_observation_message &observation) {
  std::uint8_t bytes[RIM_LCM_OBSERVATION_SIZE];
  check_packed(rim_lcm_pack_observation(bytes, sizeof bytes, &observation), "over LCM");
  send(RIM_LCM_CHANNEL_OBSERVATION, bytes, sizeof bytes);
}

void LcmBus::publish(const rim_health_message &health) {
  std::uint8_t bytes[RIM_LCM_HEALTH_SIZE];
  check_packed(rim_lcm_pack_health(bytes, sizeof bytes, &health), "over LCM");
  send(RIM_LCM_CHANNEL_HEALTH, bytes, sizeof bytes);
}

void LcmBus::subscribe() {
  const auto one = [&](const char *channel, bool wanted) {
    if (wanted && lcm_subscribe(lcm_, channel, &Receiver::handle, this) == nullptr)
      throw DataError(url_ + ": LCM could not subscribe to " + channel);
  };
  one(RIM_LCM_CHANNEL_ALARM, static_cast<bool>(on_alarm));
  one(RIM_LCM_CHANNEL_HEALTH, static_cast<bool>(on_health));
  one(RIM_LCM_CHANNEL_OBSERVATION, static_cast<bool>(on_observation));
  one(RIM_LCM_CHANNEL_COUNTERS, static_cast<bool>(on_counters));
  one(RIM_LCM_CHANNEL_ENTRY, static_cast<bool>(on_entry));
  one(RIM_LCM_CHANNEL_MODEL, static_cast<bool>(on_model));
  subscribed_ = true;
}

void LcmBus::take(const std::string &channel, const std::uint8_t *bytes, std::size_t count) {
  // Hands a message on; whether it decoded.
  const auto decoded = [&](auto message, auto unpack, const auto &tell) {
    if (unpack(&message, bytes, count) != RIM_OK)
      return false;
    tell(message);
    return true;
  };
  const bool good =
      channel == RIM_LCM_CHANNEL_ALARM ? decoded(rim_alarm{}, rim_lcm_unpack_alarm, on_alarm)
      : channel == RIM_LCM_CHANNEL_HEALTH
          ? decoded(rim_health_message{}, rim_lcm_unpack_health, on_health)
      : channel == RIM_LCM_CHANNEL_OBSERVATION
          ? decoded(rim_observation_message{}, rim_lcm_unpack_observation, on_observation)
      : channel == RIM_LCM_CHANNEL_COUNTERS
          ? decoded(rim_counters{}, rim_lcm_unpack_counters, on_counters)
      : channel == RIM_LCM_CHANNEL_MODEL
          ? decoded(rim_model_message{}, rim_lcm_unpack_model, on_model)
          : decoded(rim_entry{}, rim_lcm_unpack_entry, on_entry);
  refused_ += good ? 0 : 1;
}

bool LcmBus::receive(int timeout_ms) {
  if (!subscribed_)
    subscribe();
  if (ended_)
    return false;
  errno = 0;
  const int handled = lcm_handle_timeout(lcm_, timeout_ms);
  if (handled < 0 && errno == EINTR) // a signal: the caller looks whether it is to stop
    return false;
  ended_ = handled < 0 && is_of(url_, "file:");
  if (handled < 0 && !ended_)
    throw DataError(url_ + ": LCM stopped receiving");
  return handled > 0;
}

} // namespace rim
