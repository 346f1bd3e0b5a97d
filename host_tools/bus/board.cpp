// SPDX-License-Identifier: MIT
#include "bus/board.hpp"

#include "bus/sentence.hpp"
#include "util/table.hpp"

#include <fmt/format.h>

namespace rim {

namespace {

constexpr double kSilent_s = 3.0; // health comes every second

std::string silence(double since_s) {
  return since_s > kSilent_s ? fmt::format(", SILENT for {:.0f} s", since_s) : "";
}

// Those that count something gone wrong: not the sums of what went well.
std::string troubles(const rim_counters &counters) {
  std::string text;
  for (std::uint32_t i = 0; i < RIM_COUNTERS_FIELDS; ++i) {
    const std::string name = rim_counters_name(i);
    const std::uint32_t value = rim_counters_value(&counters, i);
    if (value > 0 && name != "sequence" && name != "rows" && name != "step_us" &&
        name != "commands" && name != "can_frames")
      text += fmt::format(" {} {}", name, value);
  }
  return text;
}

} // namespace

void Board::take(const rim_model_message &model) {
  Names &names = heard_[model.model_id];
  names.features.resize(model.features);
  names.outcomes.resize(model.outcomes);
  for (std::uint32_t i = 0; i < model.count; ++i) {
    const std::uint32_t at = model.first + i;
    Quantity &to = at < model.features ? names.features[at] : names.outcomes[at - model.features];
    to = quantity_of(model.quantity[i].name);
    to.unit = model.quantity[i].unit;
  }
}

const Names &Board::names(std::uint32_t model_id) const {
  const auto heard = heard_.find(model_id);
  return names_.outcomes.empty() && heard != heard_.end() ? heard->second : names_;
}

void Board::take(const rim_alarm &alarm) {
  const int channel = alarm.channels > 0 ? alarm.channel[0] : -1;
  alarms_[{alarm.model_id, alarm.detector, channel}] = alarm;
}

void Board::take(const rim_health_message &health, double now_s) {
  heard_last_ = health.model_id;
  monitors_[health.model_id].health = health;
  monitors_[health.model_id].heard_s = now_s;
}

void Board::take(const rim_counters &counters) {
  const auto monitor = monitors_.find(heard_last_);
  if (monitor != monitors_.end())
    monitor->second.counters = counters;
}

void Board::take(const rim_can_heartbeat &heartbeat, double now_s) {
  nodes_[heartbeat.node] = {heartbeat, now_s};
}

void Board::take(const rim_entry &entry, const std::string &from) { entries_[from] = entry; }

std::string Board::text(double now_s) const {
  std::string text;
  for (const auto &[model, m] : monitors_) {
    text += fmt::format("model {} on LCM: {}, {} observations, {} rejected, {} dropped, t = {:.2f} "
                        "s{}\n",
                        model, level_text(m.health.level), m.health.observations, m.health.rejected,
                        m.health.dropped, m.health.t_s, silence(now_s - m.heard_s));
    if (m.counters.step_us > 0)
      text += fmt::format("  longest step {} us{}{}\n", m.counters.step_us,
                          troubles(m.counters).empty() ? "" : "; counted:", troubles(m.counters));
  }
  for (const auto &[number, node] : nodes_) {
    const rim_can_heartbeat &h = node.heartbeat;
    text += fmt::format("node {} on CAN: {}{}{}, {} observations (low bits), {} rejected, {} "
                        "dropped{}\n",
                        number, level_text(h.level),
                        (h.flags & RIM_ALARM_FLAG_LATCHED) != 0 ? ", latched" : "",
                        h.acknowledged ? ", acknowledged" : "", h.observations, h.rejected,
                        h.dropped, silence(now_s - node.heard_s));
  }
  for (const auto &[from, entry] : entries_)
    text += fmt::format("{}: {}\n", from, entry_sentence(entry));
  Table table({{"t", "s"},
               {"level", ""},
               {"state", ""},
               {"seq", ""},
               {"ln anom", ""},
               {"threshold", ""},
               {"from", ""},
               {"finding", ""}});
  for (const auto &[key, a] : alarms_)
    table.add({cell(a.t_s, 6), level_text(a.level), state_text(a.state), std::to_string(a.seq),
               cell(a.ln_anom, 3), cell(a.threshold, 3),
               (a.flags & RIM_ALARM_FLAG_REPLAY) != 0 ? "replay" : "live",
               alarm_sentence(a, names(a.model_id))});
  return text + (text.empty() ? "" : "\n") + table.text();
}

} // namespace rim
