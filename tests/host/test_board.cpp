// SPDX-License-Identifier: MIT
// What rim listen shows of everything that monitors say: on a terminal, and as lines.
#include "bus/board.hpp"
#include "bus/can_bus.hpp"
#include "bus/jsonl.hpp"
#include "check.hpp"

#include <cstring>
#include <nlohmann/json.hpp>

namespace {

void assert_has(const std::string &text, const char *part) {
  if (text.find(part) == std::string::npos)
    fail_msg("'%s' is not in:\n%s", part, text.c_str());
}

void assert_lacks(const std::string &text, const char *part) {
  if (text.find(part) != std::string::npos)
    fail_msg("'%s' is in:\n%s", part, text.c_str());
}

rim_health_message health_of(std::uint32_t model, std::uint8_t level) {
  rim_health_message h{};
  h.t_s = 12.5;
  h.sequence = 4;
  h.model_id = model;
  h.observations = 250;
  h.rejected = 3;
  h.level = level;
  return h;
}

void every_monitor_has_its_line(void **) {
  rim::Board board({});
  board.take(health_of(7, RIM_LEVEL_ERROR), 100.0);
  rim_counters counters{};
  counters.rows = 250;
  counters.step_us = 81;
  counters.can_bus_off = 2;
  board.take(counters);
  board.take(health_of(9, RIM_LEVEL_OK), 101.0);
  const std::string text = board.text(101.5);
  assert_has(text, "model 7 on LCM: ERROR, 250 observations, 3 rejected, 0 dropped, t = 12.50 s\n");
  assert_has(text, "  longest step 81 us; counted: can_bus_off 2\n");
  assert_has(text, "model 9 on LCM: OK");
  assert_lacks(text, "rows 250");
  assert_lacks(text, "SILENT");
}

void silence_is_not_health(void **) {
  rim::Board board({});
  board.take(health_of(7, RIM_LEVEL_OK), 100.0);
  rim_can_heartbeat beat{};
  beat.node = 5;
  beat.level = RIM_LEVEL_WARN;
  beat.flags = RIM_ALARM_FLAG_LATCHED;
  board.take(beat, 108.0);
  const std::string text = board.text(110.0);
  assert_has(text, "t = 12.50 s, SILENT for 10 s\n");
  assert_has(text,
             "node 5 on CAN: WARN, latched, 0 observations (low bits), 0 rejected, 0 dropped\n");
  assert_has(board.text(112.0), "0 dropped, SILENT for 4 s\n");
}

rim_entry entry_in(double to_entry_s) {
  rim_entry e{};
  e.t_s = 3.0;
  e.to_entry_s = to_entry_s;
  e.sequence = 2;
  e.alarm_sequence = 12;
  e.plan_sequence = 3;
  e.model_id = 77;
  e.pose = 4;
  return e;
}

void an_entry_is_told(void **) {
  rim::Board board({});
  board.take(entry_in(4.5), "model 77");
  assert_has(board.text(0.0), "model 77: plan 3 enters the region of alarm 12 in 4.50 s\n");
  board.take(entry_in(0.0), "model 77");
  assert_has(board.text(0.0), "model 77: plan 3 is inside the region of alarm 12\n");
  board.take(entry_in(RIM_ENTRY_NEVER), "model 77");
  assert_has(board.text(0.0), "model 77: plan 3 does not enter an alarmed region\n");
}

void the_newest_record_of_an_alarm_stands(void **) {
  rim::Board board({});
  rim_alarm a{};
  a.seq = 1;
  a.model_id = 7;
  a.channels = 1;
  a.state = RIM_ALARM_RAISED;
  a.level = RIM_LEVEL_ERROR;
  board.take(a);
  a.seq = 2;
  a.state = RIM_ALARM_CLEARED;
  a.flags = RIM_ALARM_FLAG_REPLAY;
  board.take(a);
  const std::string text = board.text(0.0);
  assert_has(text, "cleared");
  assert_has(text, "replay");
  assert_lacks(text, "raised");
}

void messages_are_json(void **) {
  using nlohmann::json;
  json j = json::parse(rim::message_json(entry_in(4.5)));
  assert_true(j.at("message") == "entry" && j.at("to_entry_s") == 4.5 && j.at("pose") == 4);
  assert_true(j.at("alarm_sequence") == 12 && j.at("replay") == false);
  j = json::parse(rim::message_json(entry_in(RIM_ENTRY_NEVER)));
  assert_true(j.at("to_entry_s").is_null());
  j = json::parse(rim::message_json(health_of(7, RIM_LEVEL_STALE)));
  assert_true(j.at("message") == "health" && j.at("level") == "STALE" && j.at("model_id") == 7);
  rim_counters counters{};
  counters.can_full = 6;
  j = json::parse(rim::message_json(counters));
  assert_true(j.at("message") == "counters" && j.at("can_full") == 6 && j.at("restarts") == 0);
  assert_int_equal(j.size(), 1 + RIM_COUNTERS_FIELDS);
  rim_can_heartbeat beat{};
  beat.node = 5;
  beat.acknowledged = true;
  j = json::parse(rim::message_json(beat));
  assert_true(j.at("message") == "heartbeat" && j.at("node") == 5 && j.at("acknowledged") == true);
}

void entries_come_over_can(void **) {
  rim::CanRecords records;
  int told = 0;
  records.on_entry = [&](const rim_entry &e, std::uint32_t node) {
    told++;
    assert_true(node == 5 && e.to_entry_s == 4.5 && e.t_s == 50.0 && e.alarm_sequence == 12);
  };
  rim_can_frame frame;
  const rim_entry entry = entry_in(4.5);
  assert_int_equal(rim_can_pack_entry(&frame, 5, &entry), RIM_OK);
  records.take(frame, 50.0);
  assert_int_equal(told, 1);
  frame.data[0] ^= 1u;
  records.take(frame, 50.0);
  assert_int_equal(told, 1);
  assert_int_equal(records.refused(), 1);
}

} // namespace

void names_come_over_the_bus(void **) {
  rim_alarm a{};
  a.model_id = 77;
  a.state = RIM_ALARM_RAISED;
  a.channels = 1;
  a.channel[0] = 0;
  a.shift[0] = 0.5;
  a.shift_sd[0] = 0.01;
  rim_model_message model{};
  model.model_id = 77;
  model.features = 1;
  model.outcomes = 1;
  model.first = 1;
  model.count = 1;
  std::strcpy(model.quantity[0].name, "s.speed_mps");
  std::strcpy(model.quantity[0].unit, "m/s");
  rim::Board board({});
  board.take(a);
  assert_has(board.text(0.0), "outcome 0 reads");
  board.take(model);
  assert_has(board.text(0.0), "speed reads 0.500 m/s high");
  assert_string_equal(board.names(77).outcome(0).name.c_str(), "s.speed_mps");
  assert_true(board.names(78).outcomes.empty()); // another model's
  rim::Names given;
  given.outcomes = {rim::quantity_of("s.climb_mps")};
  rim::Board told(given);
  told.take(model);
  assert_string_equal(told.names(77).outcome(0).name.c_str(), "s.climb_mps");
}

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(every_monitor_has_its_line),
      cmocka_unit_test(silence_is_not_health),
      cmocka_unit_test(an_entry_is_told),
      cmocka_unit_test(the_newest_record_of_an_alarm_stands),
      cmocka_unit_test(messages_are_json),
      cmocka_unit_test(entries_come_over_can),
      cmocka_unit_test(names_come_over_the_bus),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
