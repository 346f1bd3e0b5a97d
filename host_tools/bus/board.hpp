// SPDX-License-Identifier: MIT
// bus/board.hpp - the newest of everything that monitors say, as a text to look at.
#pragma once

#include "image/names.hpp"

#include "rim/can.h"

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

namespace rim {

// now_s: any steady clock, of all calls the same one.
class Board {
public:
  explicit Board(Names names) : names_(std::move(names)) {}

  // Names of a model whose messages carry them; of no use where names were given.
  void take(const rim_model_message &model);
  // Those given, else those heard for this model, else none.
  const Names &names(std::uint32_t model_id) const;

  void take(const rim_alarm &alarm); // a row by model, detector and first channel
  void take(const rim_health_message &health, double now_s);
  void take(const rim_counters &counters); // of the monitor whose health came last
  void take(const rim_can_heartbeat &heartbeat, double now_s);
  // from: "model 77" or "node 5"
  void take(const rim_entry &entry, const std::string &from);

  // Lines with line ends. A monitor whose health has not come for 3 s is said to be silent: no
  // alarm from it means nothing then.
  std::string text(double now_s) const;

private:
  struct Monitor {
    rim_health_message health{};
    rim_counters counters{};
    double heard_s = 0.0;
  };
  struct CanNode {
    rim_can_heartbeat heartbeat{};
    double heard_s = 0.0;
  };
  using Key = std::tuple<std::uint32_t, int, int>;

  Names names_; // given; empty: none were
  std::map<std::uint32_t, Names> heard_;
  std::map<Key, rim_alarm> alarms_;
  std::map<std::uint32_t, Monitor> monitors_; // by model_id
  std::uint32_t heard_last_ = 0;
  std::map<int, CanNode> nodes_;
  std::map<std::string, rim_entry> entries_;
};

} // namespace rim
