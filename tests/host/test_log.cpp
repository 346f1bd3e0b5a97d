// SPDX-License-Identifier: MIT
// Logs: what is read, what is refused and with which words, and what a schema makes of it.
#include "check.hpp"
#include "log/lcm_log.hpp"
#include "log/log.hpp"
#include "log/schema.hpp"
#include "rim/lcm.h"
#include "temporary.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <unistd.h>

namespace {

std::string write(const std::string &name, const std::string &text) {
  const std::string path = temporary_path(name);
  rim::AtomicFile out(path);
  out.write(text);
  out.commit();
  return path;
}

// The warnings that reading gave.
rim::Log read(const std::string &path, std::string *warnings = nullptr,
              const rim::Schema *schema = nullptr, bool skip_bad_time = false) {
  char *text = nullptr;
  std::size_t size = 0;
  std::FILE *stream = open_memstream(&text, &size);
  rim::ReadOptions options;
  options.warnings = stream;
  options.skip_bad_time = skip_bad_time;
  rim::Log log;
  try {
    log = rim::read_log(path, schema, options);
  } catch (...) {
    std::fclose(stream);
    std::free(text);
    throw;
  }
  std::fclose(stream);
  if (warnings != nullptr)
    *warnings = text;
  std::free(text);
  return log;
}

void assert_contains(const std::string &text, const char *part) {
  if (text.find(part) == std::string::npos)
    fail_msg("'%s' does not contain '%s'", text.c_str(), part);
}

// Reading must throw DataError, and say all of these.
void assert_refused(const std::string &path, std::initializer_list<const char *> parts,
                    const rim::Schema *schema = nullptr) {
  try {
    read(path, nullptr, schema);
  } catch (const rim::DataError &e) {
    assert_contains(e.what(), path.c_str());
    for (const char *part : parts)
      assert_contains(e.what(), part);
    return;
  }
  fail_msg("%s was read", path.c_str());
}

void reads_a_plain_log(void **) {
  std::string warnings;
  const auto log = read(write("a.csv", "\xEF\xBB\xBF# made by a test\r\n"
                                       "t_s,x.c,\"u.thrust_n\", s.alt_m ,s.speed_mps\r\n"
                                       "0,1,2,3.5,-4e-3\r\n0.05,+5, 6 ,\"7\",8\r\n\r\n"),
                        &warnings);
  assert_string_equal(warnings.c_str(), "");
  assert_int_equal(log.columns.size(), 4);
  assert_string_equal(log.columns[1].name.c_str(), "u.thrust_n");
  assert_true(log.columns[0].role == rim::Role::context);
  assert_true(log.columns[1].role == rim::Role::command);
  assert_true(log.columns[2].role == rim::Role::sensor);
  assert_string_equal(log.columns[3].unit.c_str(), "m/s");
  assert_string_equal(log.columns[0].unit.c_str(), "");
  assert_int_equal(log.rows_in_file, 2);
  assert_true(log.t_s[1] == 0.05 && log.values(0, 3) == -4e-3 && log.values(1, 0) == 5.0);
  assert_true(log.values(1, 1) == 6.0 && log.values(1, 2) == 7.0);
  assert_int_equal(log.row[1], 2);
  assert_int_equal(log.comments.size(), 1);
  assert_string_equal(rim::plain_name("s.lidar_altitude_m").c_str(), "lidar altitude");
  assert_int_equal(rim::feature_columns(log).size(), 4);
  assert_int_equal(rim::role_columns(log, rim::Role::sensor)[0], 2);
}

// RFC 4180: two quotation marks in a row within a field stand for one, and a comma there parts
// nothing.
void quoted_fields_may_hold_quotation_marks_and_commas(void **) {
  const auto log = read(write("q.csv", "t_s,\"note \"\"a\"\", b\",s.alt_m\n"
                                       "0,\"he said \"\"stop\"\", then\",3\n"
                                       "1,\"\",4\n"
                                       "2,\"\"\"\",5\n"));
  assert_int_equal(log.columns.size(), 1);
  assert_int_equal(log.t_s.size(), 3);
  assert_true(log.values(0, 0) == 3.0 && log.values(1, 0) == 4.0 && log.values(2, 0) == 5.0);
}

void writing_then_reading_gives_the_same(void **) {
  rim::Log log;
  log.comments = {"seed 7"};
  log.columns = {{"s.a_m", "m", rim::Role::sensor}, {"u.b", "", rim::Role::command}};
  log.values.resize(200, 2);
  for (int r = 0; r < 200; ++r) {
    log.t_s.push_back(1e5 + 0.05 * r);
    log.values(r, 0) = std::ldexp(1.0 + r, r - 100) * (r % 2 ? -1 : 1);
    log.values(r, 1) = r;
  }
  const std::string path = temporary_path("w.csv");
  rim::write_log(log, path);
  const auto again = read(path);
  assert_int_equal(again.t_s.size(), 200);
  assert_string_equal(again.comments[0].c_str(), "seed 7");
  for (int r = 0; r < 200; ++r) {
    assert_true(std::fabs(again.t_s[(std::size_t)r] - log.t_s[(std::size_t)r]) < 1e-6);
    assert_true(std::fabs(again.values(r, 0) / log.values(r, 0) - 1.0) < 1e-8);
    assert_true(again.values(r, 1) == r);
  }
  // Nine digits read back and written again are the same nine digits.
  rim::write_log(again, temporary_path("w2.csv"));
  assert_true(rim::read_file(path) == rim::read_file(temporary_path("w2.csv")));
}

void incomplete_rows_are_skipped_counted_and_named(void **) {
  std::string warnings;
  const auto log = read(
      write("b.csv", "t_s,s.a\n0,1\n1,nan\n2,\n3,-inf\nnan,1\n4,1e999\n5,NA\n6,2\n"), &warnings);
  assert_int_equal(log.rows_in_file, 8);
  assert_int_equal(log.rows_skipped, 6);
  assert_int_equal(log.t_s.size(), 2);
  assert_int_equal(log.values.rows(), 2);
  assert_int_equal(log.row[1], 8);
  assert_contains(warnings, "6 of 8 rows skipped");
  assert_true(log.first_s == 0.0 && log.last_s == 6.0); // of skipped rows as well
  assert_contains(warnings, "row 2: column 's.a': 'nan'");
}

void columns_without_a_role_are_named_once(void **) {
  std::string warnings;
  const auto log =
      read(write("c.csv", "t_s,foo,s.a,s.,m.q,sd.q\n0,text,1,3,4,5\n1,text,6,8,9,10\n"), &warnings);
  assert_int_equal(log.columns.size(), 1);
  assert_true(log.values(1, 0) == 6.0);
  assert_contains(warnings, "ignored: 'foo', 's.', 'm.q', 'sd.q'\n");
  assert_true(warnings.find("warning") == warnings.rfind("warning"));
}

void outcomes_need_their_prediction(void **) {
  const auto log = read(write("d.csv", "t_s,x.a,z.o,m.o,sd.o\n0,1,2,3,4\n"));
  assert_int_equal(rim::role_columns(log, rim::Role::outcome).size(), 1);
  assert_int_equal(rim::role_columns(log, rim::Role::sd).size(), 1);
  assert_refused(write("e.csv", "t_s,z.o,sd.o\n0,1,2\n"), {"column 'z.o'", "needs 'm.o'"});
}

void bad_files_are_refused(void **) {
  assert_refused(temporary_path("none.csv"), {"cannot read", "No such file"});
  assert_refused(temporary_folder().string(), {"is a folder"});
  assert_refused(write("empty.csv", ""), {"is empty"});
  assert_refused(write("comments.csv", "# only\n"), {"no header"});
  assert_refused(write("header.csv", "t_s,s.a\n"), {"no rows"});
  assert_refused(write("nul.csv", std::string("t_s\0s.a\n", 8)), {"is of no format that is known"});
  assert_refused(write("not.csv", "s.a\n1\n"), {"column 't_s'", "missing"});
  assert_refused(write("twice.csv", "t_s,s.a,s.b,s.a\n0,1,2,3\n"), {"'s.a'", "stands twice"});
  assert_refused(write("clock.csv", "t_s,s.a,t_s\n0,1,2\n"), {"'t_s'", "stands twice"});
  assert_refused(write("norole.csv", "t_s,a\n0,1\n"), {"no column has a role"});
  assert_refused(write("few.csv", "t_s,s.a,s.b\n0,1,2\n1,2\n"),
                 {":row 2:", "2 fields where the header has 3"});
  assert_refused(write("many.csv", "t_s,s.a\n0,1,9\n"), {":row 1:", "3 fields"});
  assert_refused(write("cut.csv", "t_s,s.a,s.b\n0,1,2\n1,2"), {":row 2:", "cut off"});
  assert_refused(write("word.csv", "t_s,s.a\n0,1\n1,1.5x\n"),
                 {":row 2: column 's.a': '1.5x' is not a number"});
  assert_refused(write("dash.csv", "t_s,s.a\n0,-\n"),
                 {":row 1: column 's.a': '-' is not a number"});
  assert_refused(write("allnan.csv", "t_s,s.a\n0,nan\n"), {"none of its 1 rows", "'nan'"});
}

void time_must_run_forwards(void **) {
  const std::string back = write("back.csv", "t_s,s.a\n0,1\n1,2\n0.5,3\n2,4\n");
  const std::string again = write("again.csv", "t_s,s.a\n0,1\n0,2\n");
  assert_refused(back, {":row 3: column 't_s'", "runs backwards"});
  assert_refused(again, {":row 2: column 't_s'", "repeats"});
  std::string warnings;
  const auto log = read(back, &warnings, nullptr, true);
  assert_int_equal(log.t_s.size(), 3);
  assert_int_equal(log.rows_skipped, 1);
  assert_contains(warnings, "row 3: column 't_s': time runs backwards");
}

const char *const kSchema =
    "schema = 'rim-schema/1'\ndelimiter = ';'\n"
    "[time]\ncolumn = 'MS'\nscale = 1e-3\n"
    "[[column]]\nfrom = 'ALT'\nname = 's.altitude_m'\nscale = 0.5\noffset = 1\n"
    "[[keep]]\ncolumn = 'PHASE'\nvalues = ['fly']\n"
    "[[keep]]\ncolumn = 'ALT'\nmax = 100\n";

void a_schema_maps_scales_and_filters(void **) {
  const auto schema = rim::read_schema(write("s.toml", kSchema));
  std::string warnings;
  const auto log = read(
      write("f.csv",
            "MS;PHASE;ALT;JUNK\n5;pad;;x\n1;pad;no;x\n10;fly;8;x\n20;fly;200;x\n30;fly;10;x\n"),
      &warnings, &schema);
  assert_string_equal(warnings.c_str(), "");
  assert_int_equal(log.t_s.size(), 2);
  assert_int_equal(log.rows_filtered, 3);
  assert_int_equal(log.rows_in_file, 5);
  assert_true(std::fabs(log.t_s[1] - 0.03) < 1e-15 && log.values(0, 0) == 5.0);
  assert_string_equal(log.columns[0].unit.c_str(), "m");
  assert_int_equal(log.row[0], 3);
  assert_refused(write("g.csv", "MS;PHASE\n1;fly\n"), {"column 'ALT': missing"}, &schema);
}

// The prefix of a column says its role, also where a [[keep]] chooses rows by it.
void a_filter_takes_rows_and_no_column(void **) {
  const auto schema = rim::read_schema(
      write("k.toml", "schema='rim-schema/1'\n[[keep]]\ncolumn='u.duty_pct'\nmin=15\n"));
  const auto log =
      read(write("k.csv", "t_s,u.duty_pct,s.a\n0,20,1\n1,10,2\n2,30,3\n"), nullptr, &schema);
  assert_int_equal(log.columns.size(), 2);
  assert_string_equal(log.columns[0].name.c_str(), "u.duty_pct");
  assert_int_equal(log.rows_filtered, 1);
  assert_true(log.values(0, 0) == 20.0 && log.values(1, 0) == 30.0);
}

void a_rate_is_derived_from_the_past(void **) {
  const auto schema = rim::read_schema(write(
      "d.toml", "schema='rim-schema/1'\n[[column]]\nfrom='h'\nname='s.h_m'\n"
                "[[derive]]\nname='x.climb_mps'\nfrom='h'\nkind='rate'\nwindow_s=2\norder=2\n"));
  std::string text = "t_s,h\n";
  for (int i = 0; i < 100; ++i)
    text += std::to_string(0.1 * i) + "," + std::to_string(3.0 * 0.01 * i * i - 0.2 * i) + "\n";
  const auto log = read(write("h.csv", text), nullptr, &schema);
  assert_int_equal(log.columns.size(), 2);
  assert_string_equal(log.columns[1].name.c_str(), "x.climb_mps");
  assert_int_equal(log.rows_filtered + log.t_s.size(), 100);
  assert_in_range(log.rows_filtered, 14, 18);
  for (std::size_t r = 0; r < log.t_s.size(); ++r)
    assert_true(std::fabs(log.values((long)r, 1) - (6.0 * log.t_s[r] - 2.0)) < 1e-3);
}

void rows_are_put_on_a_grid_but_not_into_gaps(void **) {
  const std::string head = "schema='rim-schema/1'\nresample_hz=10\nmax_gap_s=0.5\n";
  const auto hold = rim::read_schema(write("h.toml", head));
  const auto linear = rim::read_schema(write("l.toml", head + "resample='linear'\n"));
  const std::string path = write("i.csv", "t_s,s.a\n1,0\n1.16,16\n1.3,30\n3.05,100\n3.2,115\n");
  const auto held = read(path, nullptr, &hold), line = read(path, nullptr, &linear);
  assert_int_equal(held.t_s.size(), 6); // 1 1.1 1.2 1.3 | 3.1 3.2
  assert_true(std::fabs(held.t_s[4] - 3.1) < 1e-12);
  assert_true(held.values(1, 0) == 0.0 && held.values(2, 0) == 16.0 && held.values(4, 0) == 100.0);
  assert_true(std::fabs(line.values(1, 0) - 10.0) < 1e-9 &&
              std::fabs(line.values(4, 0) - 105.0) < 1e-9);
  assert_int_equal(held.row[4], 4);
  // Years in which the clock was set cost no time, and a grid without end is refused.
  const auto set =
      read(write("i.csv", "t_s,s.a\n1,0\n1.16,16\n1700000001.04,30\n1700000001.17,40\n"), nullptr,
           &hold);
  assert_int_equal(set.t_s.size(), 3); // 1 1.1 | 1700000001.1
  assert_true(set.values(2, 0) == 30.0 && std::fabs(set.t_s[2] - 1700000001.1) < 1e-6);
  try {
    read(write("i.csv", "t_s,s.a\n1,0\n1e300,16\n"), nullptr, &hold);
    fail_msg("a grid of 1e301 rows");
  } catch (const rim::DataError &e) {
    assert_contains(e.what(), "i.csv: its time goes over 1e+300 s: too long for a grid of 10 Hz");
  }
}

void a_wrong_schema_is_refused_with_its_line(void **) {
  const auto refused = [](const std::string &text, const char *part) {
    const std::string path = write("bad.toml", text);
    try {
      rim::read_schema(path);
    } catch (const rim::DataError &e) {
      assert_contains(e.what(), path.c_str());
      assert_contains(e.what(), part);
      return;
    }
    fail_msg("read: %s", text.c_str());
  };
  refused("schema = 'rim-schema/1'\nx = [\n", ":line ");
  refused("schema = 'other'\n", "rim-schema/1");
  refused("delimiter=','\n", "'schema' is missing");
  refused("schema='rim-schema/1'\nresampel_hz=1\n", ":line 2: unknown key 'resampel_hz'");
  refused("schema='rim-schema/1'\n[[column]]\nfrom='a'\n", "'name' is missing");
  refused("schema='rim-schema/1'\n[[column]]\nfrom='a'\nname='a'\n", "must begin with a role");
  refused("schema='rim-schema/1'\n[[column]]\nfrom='a'\nname=\"s.a\\nb\"\n", "must be one line");
  refused(
      "schema='rim-schema/1'\n[[column]]\nfrom='a'\nname='s.a'\n[[column]]\nfrom='b'\nname='s.a'\n",
      "given twice");
  refused("schema='rim-schema/1'\n[[keep]]\ncolumn='a'\n", "needs values");
  refused("schema='rim-schema/1'\n[[derive]]\nname='s.a'\nfrom='b'\nkind='rate'\n", "window_s");
  refused("schema='rim-schema/1'\nresample_hz=-1\n", "negative");
  refused("schema='rim-schema/1'\nresample_hz=nan\n", "finite");
}

std::string observation_event(int i, std::uint32_t count, double value) {
  rim_observation_message sample{};
  sample.t_us = 100000 * i;
  sample.sequence = static_cast<std::uint32_t>(i);
  sample.count = count;
  for (std::uint32_t c = 0; c < count; ++c)
    sample.value[c] = value + c;
  std::string data(RIM_LCM_OBSERVATION_SIZE, '\0');
  assert_int_equal(
      rim_lcm_pack_observation(reinterpret_cast<std::uint8_t *>(&data[0]), data.size(), &sample),
      RIM_OK);
  rim::LcmEvent event;
  event.number = i;
  event.t_us = 5;
  event.channel = RIM_LCM_CHANNEL_OBSERVATION;
  event.data = data;
  return rim::lcm_event_bytes(event);
}

void an_lcm_log_survives_damage(void **) {
  const auto schema =
      rim::read_schema(write("o.toml", "schema='rim-schema/1'\nobservation=['s.a_m','u.b']\n"));
  std::vector<std::string> events;
  for (int i = 0; i < 20; ++i)
    events.push_back(observation_event(i, 2, i));
  events[3][0] ^= 1;                        // no sync word
  events[7][24] = '\x7f';                   // absurd length
  events[9][27] = static_cast<char>(0xff);  // wrong length, reaching into the next event
  events[12] = observation_event(12, 3, 1); // another count
  events[14] = observation_event(14, 2, std::numeric_limits<double>::quiet_NaN());
  std::string bytes;
  for (const auto &event : events)
    bytes += event;
  bytes.resize(bytes.size() - 10); // cut off in the last event
  const std::string path = write("o.log", bytes);
  std::string warnings;
  const auto log = read(path, &warnings, &schema);
  assert_int_equal(log.columns.size(), 2);
  // Lost: 3, 7, 19; refused: 9 (or lost), 12, 14.
  assert_int_equal(log.t_s.size(), 14);
  assert_true(log.rows_skipped >= 2 && log.rows_skipped <= 3);
  assert_true(log.first_s == log.t_s.front() && log.last_s >= log.t_s.back());
  assert_contains(warnings, "damaged in");
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    const double i = log.t_s[r] * 10.0;
    assert_true(std::fabs(log.values((long)r, 0) - i) < 1e-9 &&
                std::fabs(log.values((long)r, 1) - i - 1) < 1e-9);
  }
  assert_refused(path, {"carries no names"});
}

// What cannot be applied to messages is refused, not ignored.
void a_schema_of_columns_is_refused_for_an_lcm_log(void **) {
  const std::string path = write("c.log", observation_event(1, 2, 1.0));
  const std::string head = "schema='rim-schema/1'\nobservation=['s.a_m','u.b']\n";
  const auto refused = [&](const std::string &part, const char *name) {
    const auto schema = rim::read_schema(write("c.toml", head + part));
    assert_refused(path, {"c.toml", name}, &schema);
  };
  refused("[[column]]\nfrom='a'\nname='x.a'\n", "[[column]]");
  refused("[[keep]]\ncolumn='s.a_m'\nmin=0\n", "[[keep]]");
  refused("[[derive]]\nname='x.rate'\nfrom='s.a_m'\nkind='rate'\nwindow_s=1\n", "[[derive]]");
  refused("[time]\ncolumn='ms'\nscale=0.001\n", "[time]");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(reads_a_plain_log),
      cmocka_unit_test(quoted_fields_may_hold_quotation_marks_and_commas),
      cmocka_unit_test(writing_then_reading_gives_the_same),
      cmocka_unit_test(incomplete_rows_are_skipped_counted_and_named),
      cmocka_unit_test(columns_without_a_role_are_named_once),
      cmocka_unit_test(outcomes_need_their_prediction),
      cmocka_unit_test(bad_files_are_refused),
      cmocka_unit_test(time_must_run_forwards),
      cmocka_unit_test(a_schema_maps_scales_and_filters),
      cmocka_unit_test(a_filter_takes_rows_and_no_column),
      cmocka_unit_test(a_rate_is_derived_from_the_past),
      cmocka_unit_test(rows_are_put_on_a_grid_but_not_into_gaps),
      cmocka_unit_test(a_wrong_schema_is_refused_with_its_line),
      cmocka_unit_test(an_lcm_log_survives_damage),
      cmocka_unit_test(a_schema_of_columns_is_refused_for_an_lcm_log),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
