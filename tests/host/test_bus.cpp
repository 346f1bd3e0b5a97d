// SPDX-License-Identifier: MIT
// Alarms on their way out: sentences, JSON lines, candump text, LCM through a file and to `rim
// listen`.
#include "bus/candump.hpp"
#include "bus/jsonl.hpp"
#include "bus/lcm_bus.hpp"
#include "bus/model_lcm.hpp"
#include "bus/sentence.hpp"
#include "check.hpp"
#include "image/image_writer.hpp"
#include "log/lcm_log.hpp"
#include "temporary.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"

#include "base/ellipsoid.h"
#include "rim/image.h"
#include "rim/monitor.h"

#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {

rim::Names sample_names() {
  rim::Names names;
  for (const char *name : {"s.speed_mps", "s.radar_altitude_m", "u.throttle"})
    names.features.push_back(rim::quantity_of(name));
  names.outcomes = {names.features[0], names.features[1]};
  return names;
}

rim_alarm sample_alarm() {
  rim_alarm a;
  std::memset(&a, 0, sizeof a);
  a.t_s = 312.25;
  a.since_s = 310.2;
  a.seq = 3;
  a.model_id = 77;
  a.observations = 84;
  a.state = RIM_ALARM_RAISED;
  a.level = RIM_LEVEL_ERROR;
  a.kind = RIM_KIND_SHIFT;
  a.channels = 2;
  a.channel[0] = 1;
  a.shift[0] = 12.4;
  a.shift[1] = -0.1;
  a.shift_sd[0] = 1.1;
  a.shift_sd[1] = 0.02;
  const std::uint16_t feature[2] = {0, 2};
  const double lower[2] = {100.0, 0.25}, upper[2] = {180.0, 0.5};
  assert_int_equal(rimi_region_from_box(&a.region, 2, feature, lower, upper), RIM_OK);
  a.ln_anom = 21.5;
  a.threshold = 12.0;
  a.p_value = 1.0 / 51.0;
  return a;
}

void assert_sentence(const rim_alarm &a, const char *want) {
  assert_string_equal(rim::alarm_sentence(a, sample_names()).c_str(), want);
}

void sentences_say_what_where_when_and_how_sure(void **) {
  rim_alarm a = sample_alarm();
  assert_sentence(a, "radar altitude reads 12.4 m high (standard error 1.10 m) (also speed) where "
                     "speed is 100 to 180 m/s and throttle is 0.25 to 0.50, since t = 310 s (84 "
                     "observations): at most 1 healthy run in 51 shows as much");
  a.channels = 1;
  a.shift[0] = -0.5;
  a.shift_sd[0] = 0.0;
  a.region.dims = 0;
  a.observations = 1;
  a.state = RIM_ALARM_CLEARED;
  assert_sentence(a, "over: radar altitude reads 0.500 m low everywhere, since t = 310 s (1 "
                     "observation): at most 1 healthy run in 51 shows as much");
  a.state = RIM_ALARM_UPDATED;
  a.kind = RIM_KIND_GAIN;
  a.p_value = 0.9;
  a.shift[0] = -0.08;
  a.shift_sd[0] = 0.01;
  assert_sentence(a, "radar altitude reads 8.00 % low (standard error 1.00 %) everywhere, since t "
                     "= 310 s (1 observation): many healthy runs show as much");
  a.kind = RIM_KIND_DRIFT;
  a.shift[0] = 2.5;
  a.shift_sd[0] = 0.0;
  assert_sentence(a, "radar altitude drifts and by now reads 2.50 m high everywhere, since t = 310 "
                     "s (1 observation): many healthy runs show as much");
  a.kind = RIM_KIND_REPEAT;
  a.shift[0] = 0.35;
  assert_sentence(
      a, "radar altitude repeats its last reading, or reads 0, in 35.0 % more of the rows than it "
         "should everywhere, since t = 310 s (1 observation): many healthy "
         "runs show as much");
  a.kind = RIM_KIND_VARIANCE;
  a.shift[0] = 9.0;
  a.p_value = 0.0;
  assert_sentence(a,
                  "radar altitude scatters 3.00 times as much as predicted everywhere, since t = "
                  "310 s (1 observation): ln anom 21.5, threshold 12.0");
  a.level = RIM_LEVEL_STALE;
  assert_sentence(a, "no valid input lately: nothing can be said about the vehicle");
}

void interference_is_told_with_its_kind_and_since_when(void **) {
  rim_alarm a = {};
  a.detector = RIM_DETECTOR_INTERFERENCE;
  a.state = RIM_ALARM_RAISED;
  a.level = RIM_LEVEL_ERROR;
  a.kind = RIM_KIND_BLOCKED;
  a.channels = 1;
  a.channel[0] = 0;
  a.shift[0] = -0.41;
  a.since_s = 12.34;
  a.t_s = 12.5;
  assert_sentence(a, "speed is blocked, 0.410 m/s off what was commanded, since t = 12.3 s (for "
                     "0.16 s)");
  const auto j = nlohmann::json::parse(rim::alarm_json(a, sample_names()));
  assert_true(j.at("detector") == "interference" && j.at("kind") == "blocked");
  assert_true(j.at("since_s") == 12.34 && j.at("shift").at("s.speed_mps") == -0.41);
  a.state = RIM_ALARM_CLEARED;
  a.kind = RIM_KIND_PUSHED;
  assert_sentence(a, "over: speed is pushed, 0.410 m/s off what was commanded, since t = 12.3 s "
                     "(for 0.16 s)");
}

void an_alarm_can_be_told_without_its_model(void **) {
  const std::string text = rim::alarm_sentence(sample_alarm(), rim::Names());
  assert_non_null(std::strstr(text.c_str(), "outcome 1 reads 12.4 high"));
  assert_non_null(std::strstr(text.c_str(), "feature 2 is 0.25 to 0.50"));
}

void json_has_every_key_of_the_contract(void **) {
  rim_alarm a = sample_alarm();
  const auto line = rim::alarm_json(a, sample_names());
  assert_true(line.find('\n') == std::string::npos);
  const auto j = nlohmann::json::parse(line);
  assert_true(j.at("t_s") == 312.25 && j.at("seq") == 3 && j.at("detector") == "rim");
  assert_true(j.at("state") == "raised" && j.at("level") == "ERROR");
  assert_true(j.at("channels") == nlohmann::json({"s.radar_altitude_m", "s.speed_mps"}));
  assert_true(j.at("features") == nlohmann::json({"s.speed_mps", "u.throttle"}));
  assert_true(j.at("region").at("center")[0] == 140.0);
  assert_true(j.at("region").at("inverse_shape")[1][1] == a.region.inverse_shape[3]);
  assert_true(j.at("region").at("bounds")[0] ==
              nlohmann::json({a.region.lower[0], a.region.upper[0]}));
  assert_true(j.at("ln_anom") == 21.5 && j.at("threshold") == 12.0 && j.at("observations") == 84);
  assert_true(j.at("p_value").get<double>() == a.p_value);
  assert_true(j.at("shift").at("s.radar_altitude_m") == 12.4);
  assert_true(j.at("sentence") == rim::alarm_sentence(a, sample_names()));
  a.detector = RIM_DETECTOR_INTERFERENCE;
  assert_true(nlohmann::json::parse(rim::alarm_json(a, {})).at("detector") == "interference");
}

void names_come_from_the_image(void **) {
  rim::SectionBytes config, names;
  for (std::uint32_t i = 0; i < RIM_CONFIG_WORDS; ++i)
    config.u32(i == RIM_CONFIG_FEATURES ? 2 : i == RIM_CONFIG_OUTCOMES ? 1 : 0);
  const auto image = [&](const char *text) {
    rim::ImageWriter writer(1);
    rim::SectionBytes section;
    for (const char *c = text; *c != '\0'; ++c)
      section.u8(static_cast<std::uint8_t>(*c));
    writer.add_section(RIM_SECTION_CONFIG, config);
    writer.add_section(RIM_SECTION_NAMES, section);
    const auto bytes = writer.finish();
    return rim::LoadedImage(
        std::string_view(reinterpret_cast<const char *>(bytes.data()), bytes.size()), "test.rim");
  };
  const auto found = rim::names_of_image(image("s.a_m\nu.b\ns.a_m\n").view(), "test.rim");
  assert_int_equal(found.features.size(), 2);
  assert_int_equal(found.outcomes.size(), 1);
  assert_string_equal(found.outcome(0).words.c_str(), "a");
  assert_string_equal(found.feature(0).unit.c_str(), "m");
  try {
    rim::names_of_image(image("s.a_m\nu.b\n").view(), "test.rim");
    fail_msg("nothing was thrown");
  } catch (const rim::DataError &e) {
    assert_non_null(std::strstr(e.what(), "test.rim: holds 2 names"));
  }
}

// candump -L text back into a frame, written against can-utils' description of it.
rim_can_frame parse_line(const std::string &line, double &t_s, std::string &interface) {
  rim_can_frame frame;
  std::memset(&frame, 0, sizeof frame);
  char name[32], rest[300];
  unsigned id = 0;
  assert_int_equal(std::sscanf(line.c_str(), "(%lf) %31s %3x%299s", &t_s, name, &id, rest), 4);
  interface = name;
  frame.id = id;
  frame.fd = std::strncmp(rest, "##1", 3) == 0;
  const char *hex = rest + (frame.fd ? 3 : 1);
  assert_true(rest[0] == '#' && std::strlen(hex) % 2 == 0);
  for (; *hex != '\0'; hex += 2) {
    unsigned byte = 0;
    assert_int_equal(std::sscanf(hex, "%2x", &byte), 1);
    frame.data[frame.length++] = static_cast<std::uint8_t>(byte);
  }
  return frame;
}

void candump_text_carries_the_alarm(void **) {
  const rim_alarm a = sample_alarm();
  const std::string path = temporary_path("a.candump");
  rim::CandumpFile file(path, 5, false, "vcan0");
  file.write(a);
  assert_int_equal(access(path.c_str(), F_OK), -1);
  file.commit();
  std::istringstream text(rim::read_file(path));
  std::string line, interface;
  rim_can_assembly assembly{};
  assembly.node = 5;
  rim_alarm back;
  bool complete = false;
  double t_s = 0.0;
  assert_true(static_cast<bool>(std::getline(text, line)));
  assert_int_equal(line.find("(0000000312.250000) vcan0 185#"), 0);
  rim_can_summary summary;
  const rim_can_frame first = parse_line(line, t_s, interface);
  assert_int_equal(rim_can_unpack_summary(&summary, &first), RIM_OK);
  assert_int_equal(summary.observations, 84);
  unsigned pages = 0;
  while (std::getline(text, line)) {
    const rim_can_frame frame = parse_line(line, t_s, interface);
    rim_can_finding page;
    if (rim_can_unpack_finding(&page, &frame) == RIM_OK) {
      assert_int_equal(page.page, pages++);
      continue;
    }
    assert_int_equal(rim_can_take_detail(&assembly, &frame, &back, &complete), RIM_OK);
  }
  assert_true(complete && back.t_s == a.t_s && back.observations == 84);
  assert_int_equal(pages, 5 + 3 * a.region.dims);
  rim_can_frame fd;
  assert_int_equal(rim_can_pack_detail_fd(&fd, 5, &a), RIM_OK);
  const rim_can_frame again = parse_line(rim::candump_line(fd, 1.0, "can0"), t_s, interface);
  assert_int_equal(rim_can_unpack_detail_fd(&back, &again), RIM_OK);
  assert_int_equal(again.length, 64);
}

void lcm_records_what_was_published(void **) {
  const std::string path = temporary_path("events.log");
  const rim_alarm a = sample_alarm();
  rim_observation_message o{};
  o.t_us = 5;
  o.count = 3;
  o.value[2] = 1.5;
  const rim_health_message h = {1.0, 1, 77, 10, 1, 0, 1, 0, RIM_LEVEL_OK, 0};
  {
    rim::LcmBus bus("file://" + path + "?mode=w");
    bus.publish(o);
    bus.publish(a);
    bus.publish(h);
  }
  const std::string bytes = rim::read_file(path);
  rim::LcmEventReader events(bytes);
  rim::LcmEvent event;
  rim_alarm alarm;
  assert_true(events.next(event) && event.channel == "RIM_OBSERVATION");
  assert_true(events.next(event) && event.channel == "RIM_ALARM");
  assert_int_equal(rim_lcm_unpack_alarm(&alarm,
                                        reinterpret_cast<const std::uint8_t *>(event.data.data()),
                                        event.data.size()),
                   RIM_OK);
  assert_true(alarm.ln_anom == a.ln_anom && alarm.region.center[0] == a.region.center[0]);
  assert_true(events.next(event) && event.channel == "RIM_HEALTH");
  assert_false(events.next(event));
  assert_int_equal(events.bytes_skipped(), 0);
  int alarms = 0, healths = 0;
  rim::LcmBus player("file://" + path + "?speed=0");
  player.on_alarm = [&](const rim_alarm &got) { alarms += got.seq == 3; };
  player.on_health = [&](const rim_health_message &got) { healths += got.observations == 10; };
  for (int i = 0; i < 10 && healths == 0; ++i)
    player.receive(100);
  assert_int_equal(alarms, 1);
  assert_int_equal(healths, 1);
}

// lcm-gen's Python types, another implementation than the one the messages are made with.
void python_reads_what_was_published(void **) {
  const std::string log = temporary_path("python.log"), types = temporary_path("types");
  {
    rim::LcmBus bus("file://" + log + "?mode=w");
    rim_observation_message o{};
    o.count = 3;
    o.value[2] = 1.5;
    bus.publish(o);
    bus.publish(sample_alarm());
    bus.publish(rim_health_message{1.0, 1, 77, 10, 1, 0, 1, 0, RIM_LEVEL_OK, 0});
  }
  rim::make_folder(types);
  const std::string source =
      std::filesystem::path(rim::data_path("lander.toml")).parent_path().parent_path().string() +
      "/";
  const std::string generate = "lcm-gen -p --ppath " + types + " " + source + "lib/wire/*.lcm";
  const std::string decode =
      "python3 -B " + source + "tests/host/decode_lcm.py " + types + " " + log;
  assert_int_equal(std::system(generate.c_str()), 0);
  assert_int_equal(std::system(decode.c_str()), 0);
}

void a_url_that_does_not_open_is_a_data_error(void **) {
  try {
    rim::LcmBus bus("file:///nonexistent/folder/x.log?mode=r");
    fail_msg("nothing was thrown");
  } catch (const rim::DataError &e) {
    assert_non_null(std::strstr(e.what(), "/nonexistent/folder/x.log"));
  }
}

// `rim listen` in a process of its own hears what is published here.
void a_separate_subscriber_hears_the_alarms(void **) {
  const char *program = std::getenv("RIM");
  if (program == nullptr)
    skip();
  // A port by process, so that two test runs on one machine do not hear each other.
  const std::string url =
      "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 20000) + "?ttl=0";
  bool has_multicast = true;
  try {
    rim::LcmBus probe(url);
  } catch (const rim::DataError &error) {
    std::printf("skipped: %s\n", error.what());
    has_multicast = false;
  }
  if (!has_multicast)
    skip();
  const std::string out = temporary_path("heard.jsonl"), err = temporary_path("listen.err");
  const pid_t child = fork();
  if (child == 0) {
    dup2(open(out.c_str(), O_WRONLY | O_CREAT, 0600), 1);
    dup2(open(err.c_str(), O_WRONLY | O_CREAT, 0600), 2);
    execl(program, program, "listen", "--lcm", url.c_str(), "--count", "3", "--seconds", "60",
          static_cast<char *>(nullptr));
    _exit(99);
  }
  for (int i = 0; i < 600; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (access(err.c_str(), F_OK) == 0 &&
        rim::read_file(err).find("listening") != std::string::npos)
      break;
  }
  rim::LcmBus bus(url);
  rim_alarm a = sample_alarm();
  for (a.seq = 1; a.seq <= 3; a.seq++)
    bus.publish(a);
  int status = 0;
  waitpid(child, &status, 0);
  assert_true(WIFEXITED(status));
  assert_int_equal(WEXITSTATUS(status), 0);
  std::istringstream heard(rim::read_file(out));
  std::string line;
  int count = 0;
  while (std::getline(heard, line))
    assert_true(nlohmann::json::parse(line).at("seq") == ++count);
  assert_int_equal(count, 3);
}

// Names that differ only in what a constant cannot hold, and one like what is put behind them.
void constants_have_names_of_their_own(void **) {
  rim::ImageFacts facts;
  for (const char *name : {"s.a.b", "s.a_b_2", "s.a-b", "s.a b"})
    facts.names.features.push_back(rim::quantity_of(name));
  std::istringstream lines(rim::model_lcm(facts));
  std::set<std::string> seen;
  std::size_t features = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find(" = "));
    if (name == line)
      continue;
    assert_true(seen.insert(name).second);
    features += name.find(" FEATURE_") != std::string::npos ? 1 : 0;
  }
  assert_int_equal(features, 4);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(sentences_say_what_where_when_and_how_sure),
      cmocka_unit_test(interference_is_told_with_its_kind_and_since_when),
      cmocka_unit_test(an_alarm_can_be_told_without_its_model),
      cmocka_unit_test(json_has_every_key_of_the_contract),
      cmocka_unit_test(names_come_from_the_image),
      cmocka_unit_test(candump_text_carries_the_alarm),
      cmocka_unit_test(lcm_records_what_was_published),
      cmocka_unit_test(python_reads_what_was_published),
      cmocka_unit_test(a_url_that_does_not_open_is_a_data_error),
      cmocka_unit_test(constants_have_names_of_their_own),
      cmocka_unit_test(a_separate_subscriber_hears_the_alarms),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
