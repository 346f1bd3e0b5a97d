// SPDX-License-Identifier: MIT
// Every reader of a file on the ground on good files, and on a short run of damaged copies of them.
// `make fuzz-ground` searches for longer, guided by coverage. FUZZ_SEEDS=FOLDER: the good ones.
#include "../fuzz/fuzz_ground.hpp"

#include "bus/candump.hpp"
#include "image/image_writer.hpp"
#include "log/lcm_log.hpp"
#include "rim/lcm.h"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"

#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstring>
#include <map>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

constexpr std::uint32_t kSeed = 20261122;
constexpr int kCopies = 400; // of each file; `make fuzz-ground` tries millions

// What takes part in a file's meaning: words that damage puts in.
const char *const kWords[] = {"nan",
                              "-inf",
                              "1e999",
                              "-1",
                              "0",
                              "\"",
                              "[[",
                              "]]",
                              ",",
                              "\n",
                              "=",
                              "\xff",
                              "{",
                              "99999999999999999999",
                              "s.",
                              "u.",
                              "t_s",
                              "z.a_m",
                              "m.a_m",
                              "sd.a_m",
                              "#",
                              "\t",
                              ";",
                              "\r\n",
                              "\xef\xbb\xbf",
                              "SG_",
                              "BO_"};

std::uint32_t next(std::uint32_t &state) {
  state = state * 1664525u + 1013904223u;
  return state >> 8;
}

std::string damaged(std::string text, std::uint32_t &random) {
  for (std::uint32_t k = next(random) % 6 + 1; k > 0 && text.size() > 1; --k) {
    const std::size_t at = 1 + next(random) % (text.size() - 1);
    switch (next(random) % 5) {
    case 0:
      text[at] = static_cast<char>(next(random));
      break;
    case 1:
      text.erase(at, next(random) % 16);
      break;
    case 2:
      text.insert(at, kWords[next(random) % (sizeof kWords / sizeof kWords[0])]);
      break;
    case 3:
      text.insert(at, text.substr(1 + next(random) % (text.size() - 1), next(random) % 64));
      break;
    default:
      text.resize(std::max<std::size_t>(at, 1));
    }
  }
  return text;
}

std::string csv() {
  return "# a comment\nt_s,u.push,s.speed_mps,z.force_N,m.force_N,sd.force_N\n0.00,1,2,3,3.5,0.5\n"
         "0.05,1.5,2.25,3,3.5,0.5\n0.10,-1,nan,3,3.5,0.5\n0.15,1e3,2,3,3.5,0.5\n";
}

std::string lcm_log() {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    rim_observation_message o{};
    o.t_us = 50000 * i;
    o.sequence = static_cast<std::uint32_t>(i);
    o.count = 2;
    o.value[0] = i;
    std::string data(RIM_LCM_OBSERVATION_SIZE, '\0');
    assert_int_equal(
        rim_lcm_pack_observation(reinterpret_cast<std::uint8_t *>(data.data()), data.size(), &o),
        RIM_OK);
    rim::LcmEvent event;
    event.number = i;
    event.t_us = o.t_us;
    event.channel = RIM_LCM_CHANNEL_OBSERVATION;
    event.data = data;
    text += rim::lcm_event_bytes(event);
  }
  return text;
}

std::string candump() {
  rim_alarm alarm{};
  alarm.seq = 1;
  alarm.p_value = 0.05;
  std::string text;
  for (const auto &frame : rim::alarm_frames(alarm, 5, true))
    text += rim::candump_line(frame, 12.5, "can0");
  return text;
}

std::string image() {
  rim::ImageWriter writer(7);
  rim::SectionBytes config, names;
  for (int i = 0; i < RIM_CONFIG_WORDS; ++i)
    config.u32(i == RIM_CONFIG_FEATURES ? 2 : i == RIM_CONFIG_OUTCOMES ? 1 : 0);
  for (const char c : std::string("u.push\ns.speed_mps\ns.speed_mps\n"))
    names.u8(static_cast<std::uint8_t>(c));
  writer.add_section(RIM_SECTION_CONFIG, config);
  writer.add_section(RIM_SECTION_NAMES, names);
  const auto bytes = writer.finish();
  return {bytes.begin(), bytes.end()};
}

// By name: the reader's number, then a file that it takes.
std::map<std::string, std::string> good() {
  const auto shipped = [](char reader, const char *name) {
    return reader + rim::read_file(rim::data_path(name));
  };
  const std::string map = "schema = \"rim-can/1\"\ntrigger = \"Drive\"\n[[signal]]\nname = "
                          "\"u.push\"\nfrom = \"Drive.Push\"\n";
  const std::string dbc =
      "VERSION \"\"\nBU_: A\nBO_ 291 Drive: 8 A\n SG_ Push : 0|16@1- (0.5,1) [-10|10] \"m/s\" A\n"
      " SG_ Mode M : 16|4@0+ (1,0) [0|0] \"\" A\n";
  const std::string extension = "schema = \"rim-extension/1\"\n";
  const std::string pixels = image();
  return {{"log_csv", '\0' + csv()},
          {"log_lcm", '\0' + lcm_log()},
          {"log_candump", '\0' + candump()},
          {"schema_falcon9", shipped('\1', "falcon9.toml")},
          {"schema_skab", shipped('\1', "skab.toml")},
          {"dbc", '\2' + dbc},
          {"map", '\3' + map},
          {"causes", shipped('\4', "causes.toml")},
          {"extension", '\5' + extension},
          {"effect_thrust", shipped('\6', "effects/02_thrust_loss.toml")},
          {"effect_delay", shipped('\6', "effects/07_velocity_delay.toml")},
          {"image", '\7' + pixels},
          {"image_repaired", '\10' + pixels}};
}

void good_files_are_taken(void **) {
  for (const auto &[name, text] : good()) {
    const bool taken =
        rim::fuzz::one_file(reinterpret_cast<const std::uint8_t *>(text.data()), text.size());
    // A map without its DBC and frames without a table are refused.
    const bool expected = name != "map" && name != "log_candump";
    if (taken != expected)
      fail_msg("%s: %d", name.c_str(), taken);
    if (const char *folder = std::getenv("FUZZ_SEEDS")) {
      rim::AtomicFile file(std::string(folder) + "/" + name);
      file.write(text);
      file.commit();
    }
  }
}

void damaged_files_are_taken_or_refused(void **) {
  std::uint32_t random = kSeed;
  unsigned taken = 0, refused = 0;
  print_message("seed %u\n", kSeed);
  for (const auto &[name, text] : good())
    for (int i = 0; i < kCopies; ++i) {
      std::string copy = damaged(text, random);
      copy[0] = text[0];
      ++(rim::fuzz::one_file(reinterpret_cast<const std::uint8_t *>(copy.data()), copy.size())
             ? taken
             : refused);
    }
  print_message("%u taken, %u refused\n", taken, refused);
  assert_true(taken > 0 && refused > taken / 10); // damage is seen, and not all of it hurts
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {cmocka_unit_test(good_files_are_taken),
                                     cmocka_unit_test(damaged_files_are_taken_or_refused)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
