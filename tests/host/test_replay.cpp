// SPDX-License-Identifier: MIT
// The replay: one log after another, digests, labels, outputs, the figure.
#include "check.hpp"
#include "replay/outputs.hpp"
#include "replay/replay.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"

#include "base/crc.h"
#include "toy_log.hpp"

#include <cstdlib>
#include <unistd.h>

namespace {

const std::vector<std::uint8_t> &image() {
  static const std::vector<std::uint8_t> bytes = [] {
    std::vector<rim::Log> logs;
    for (std::uint64_t seed = 1; seed <= 12; ++seed)
      logs.push_back(toy_log(seed));
    return rim::make_image(rim::train(logs, rim::TrainOptions{}).plan);
  }();
  return bytes;
}

void digest_is_over_every_verdict(void **) {
  rim::Replayer replayer(image(), "toy");
  assert_int_equal(replayer.digest(), RIM_DIGEST_START);
  std::uint64_t digest = RIM_DIGEST_START;
  std::size_t rows = 0;
  const auto watch = [&](std::size_t row, const rim_verdict &verdict) {
    assert_int_equal(row, rows % 600);
    ++rows;
    rim_verdict own = verdict; // the watcher's record carries the replay flag besides
    digest = rim_verdict_digest(digest, &own);
  };
  replayer.replay(toy_log(50), {}, watch);
  replayer.replay(toy_log(51, 600, 0.5), {}, watch);
  assert_int_equal(rows, 1200);
  assert_true(replayer.digest() == digest);

  rim::Replayer reversed(image(), "toy");
  reversed.replay(toy_log(51, 600, 0.5), {});
  reversed.replay(toy_log(50), {});
  assert_true(reversed.digest() != digest);
}

void logs_do_not_know_each_other(void **) {
  std::vector<double> alone, after;
  rim::Replayer first(image(), "toy"), second(image(), "toy");
  first.replay(toy_log(52, 600, 0.4), {},
               [&](std::size_t, const rim_verdict &v) { alone.push_back(v.score); });
  second.replay(toy_log(53, 600, 0.6), {});
  const rim::ReplayedLog result =
      second.replay(toy_log(52, 600, 0.4), {},
                    [&](std::size_t, const rim_verdict &v) { after.push_back(v.score); });
  assert_true(alone == after);
  assert_int_equal(result.health.rows.rows_used, 600);
}

void alarms_carry_the_replay_flag(void **) {
  rim::Replayer replayer(image(), "toy");
  unsigned records = 0;
  rim::ReplayOptions options;
  options.record = [&](const rim_alarm &record) {
    assert_int_equal(record.seq, ++records);
    assert_true((record.flags & RIM_ALARM_FLAG_REPLAY) != 0);
  };
  const rim::ReplayedLog result = replayer.replay(toy_log(54, 600, 1.0), options);
  assert_int_equal(result.raised, 1);
  assert_int_equal(result.records, records);
  assert_int_equal(result.first.state, RIM_ALARM_RAISED);
  const std::string text = rim::replay_text(result, replayer.names());
  assert_true(has(text, "toy54: FOUND at t = "));
  assert_true(has(text, "rows: 600 used, 0 skipped, 0 gaps"));
  const rim::ReplayedLog healthy = replayer.replay(toy_log(55), {});
  assert_true(has(rim::replay_text(healthy, replayer.names()), "toy55: healthy: nothing found"));
}

// As rimd would have told it: when it began, and when rows came again.
void a_silence_in_the_log_is_told(void **) {
  rim::Replayer replayer(image(), "toy");
  rim::Log log = toy_log(55);
  const double before_s = log.t_s[299];
  for (std::size_t i = 300; i < log.t_s.size(); ++i)
    log.t_s[i] += 3.0;
  std::vector<rim_alarm> records;
  rim::ReplayOptions options;
  options.record = [&](const rim_alarm &record) { records.push_back(record); };
  const rim::ReplayedLog result = replayer.replay(log, options);
  assert_true(records.size() >= 2); // what the rows after it say of the cart is another matter
  for (std::uint32_t i = 0; i < 2; ++i) {
    assert_int_equal(records[i].seq, i + 1);
    assert_int_equal(records[i].state, RIM_ALARM_NONE);
  }
  assert_int_equal(records[0].level, RIM_LEVEL_STALE);
  assert_true(records[0].t_s > before_s && records[0].t_s < before_s + 3.0);
  assert_int_equal(records[1].level, RIM_LEVEL_OK);
  assert_true(records[1].t_s == log.t_s[300]);
  assert_int_equal(result.health.stale, 1);
  assert_int_equal(result.health.rows.gaps, 1);
}

// Silence is no health: what was not examined is not called healthy.
void doubts_are_said(void **) {
  rim::Replayer replayer(image(), "toy");
  const auto said = [&](const rim::Log &log) {
    return rim::replay_text(replayer.replay(log, {}), replayer.names());
  };
  rim::Log slow = toy_log(55);
  for (double &t : slow.t_s)
    t *= 1.8;
  const std::string rate = said(slow);
  assert_true(has(rate, "STALE: rows come at 11.11 Hz, the model wants 20 Hz"));
  assert_true(rate.find("healthy: nothing") == std::string::npos);
  rim::Log far = toy_log(55);
  far.values(77, 3) = 1e300;
  const std::string range = said(far);
  assert_true(has(range, "OUT OF RANGE: speed is 1e+300 m/s at t = 3.85 s"));
  assert_true(has(range, "column s.speed_mps; rows in which any reading is out of range: 1)"));
  assert_true(range.find("healthy: nothing") == std::string::npos);
  rim::Log fast = toy_log(55);
  fast.values.col(3) *= 1.944;
  assert_true(has(said(fast), "UNIT: speed reads 1.9"));
  assert_true(has(said(fast), "as it would in kn instead of m/s (column s.speed_mps)"));
  assert_true(said(toy_log(55)).find("UNIT") == std::string::npos);
  const std::string brief = said(toy_log(55, 12));
  assert_true(has(brief, "too few to say anything"));
  assert_true(brief.find("healthy: nothing") == std::string::npos);
  assert_true(has(said(toy_log(55)), "healthy: nothing found in 600 rows (30 s)"));
}

// Readings that are what is expected of them times a factor between two units, and nearly such.
void another_unit_is_told(void **) {
  rim::Names names;
  names.outcomes = {{"s.shaft_rpm", "shaft", "rpm"}, {"s.level", "level", ""}};
  const auto found = [&](double factor, double scatter, int blocks) {
    rim::UnitCheck check(2);
    for (int i = 0; i < blocks; ++i) {
      const double expected = 500.0 + 100.0 * i, off = i % 2 == 0 ? scatter : -scatter;
      check.add(Eigen::VectorXd::Constant(2, factor * expected * (1.0 + off)),
                Eigen::VectorXd::Constant(2, expected));
    }
    return check.found(names);
  };
  const std::vector<rim::OtherUnit> in_radians = found(0.105, 0.0, 10);
  assert_int_equal(in_radians.size(), 1); // of what has a unit
  assert_int_equal(in_radians[0].outcome, 0);
  assert_string_equal(in_radians[0].looks_like.c_str(), "rad/s");
  assert_true(std::abs(in_radians[0].factor - 0.105) < 1e-9);
  assert_string_equal(found(6.1, 0.0, 10).at(0).looks_like.c_str(), "deg/s");
  assert_true(found(0.105, 0.0, 9).empty());    // too few blocks
  assert_true(found(0.13, 0.0, 10).empty());    // no unit
  assert_true(found(1.0, 0.0, 10).empty());     // its own
  assert_false(found(0.105, 0.32, 10).empty()); // 9 % of the squares are something else
  assert_true(found(0.105, 0.36, 10).empty());  // 11 %
  names.outcomes[0] = {"s.speed_kmph", "speed", "km/h"};
  assert_true(found(1.0, 0.0, 10).empty()); // feet per second are 1.097 km/h
  assert_true(found(0.91, 0.0, 10).empty());
  assert_string_equal(found(0.62, 0.0, 10).at(0).looks_like.c_str(), "mph");
  names.outcomes[0] = {"s.gap_mm", "gap", "mm"};
  assert_string_equal(found(0.04, 0.0, 10).at(0).looks_like.c_str(), "in");
}

// Readings of scales that begin elsewhere, and nearly such.
void another_zero_is_told(void **) {
  rim::Names names;
  names.outcomes = {{"s.top_degC", "top", "degC"}};
  const auto found = [&](double factor, double more, double scatter) {
    rim::UnitCheck check(1);
    for (int i = 0; i < 10; ++i) {
      const double expected = 20.0 + 90.0 * i, off = i % 2 == 0 ? scatter : -scatter;
      check.add(Eigen::VectorXd::Constant(1, factor * expected + more + off),
                Eigen::VectorXd::Constant(1, expected));
    }
    return check.found(names);
  };
  const rim::OtherUnit in_kelvin = found(1.0, 273.15, 0.0).at(0);
  assert_string_equal(in_kelvin.looks_like.c_str(), "K");
  assert_true(in_kelvin.factor == 1.0 && std::abs(in_kelvin.more - 273.15) < 1e-9);
  assert_string_equal(found(1.8, 32.0, 0.0).at(0).looks_like.c_str(), "degF");
  assert_int_equal(found(1.0, 261.0, 26.0).size(), 1);
  assert_true(found(1.0, 258.0, 0.0).empty());   // 15 of 273 off
  assert_true(found(1.0, 273.15, 28.0).empty()); // scatters too much
  assert_true(found(1.0, -273.15, 0.0).empty());
  assert_true(found(1.0, 0.0, 1.0).empty());
  names.outcomes[0] = {"s.top_K", "top", "K"};
  assert_string_equal(found(1.0, -273.15, 0.0).at(0).looks_like.c_str(), "degC");
}

// Every data row of the file has a label: those that were skipped, and those between grid rows.
void labels_cover_the_file(void **) {
  rim::Log log = toy_external(5, 400, 3.0);
  for (std::size_t i = 0; i < log.row.size(); ++i)
    log.row[i] = static_cast<std::uint32_t>(3 * (i + 1)); // every third row of the file was used
  log.rows_in_file = 1201;
  rim::CalibrationOptions calibration;
  const rim::ExternalImage made = rim::external_image({log}, 39, calibration);
  assert_true(made.sd_estimated.empty());
  rim::Replayer replayer(made.image, "own");
  rim::ReplayOptions options;
  assert_true(replayer.replay(log, options).labels.finding.empty());
  options.label = true;
  const rim::ReplayedLog sparse = replayer.replay(log, options);
  assert_int_equal(sparse.labels.finding.size(), 1201);
  unsigned right = 0, inside = 0;
  for (std::size_t i = 0; i < log.row.size(); ++i) {
    const bool truth = log.values(static_cast<Eigen::Index>(i), 0) > 0.5;
    const bool label = sparse.labels.finding[log.row[i] - 1] == 1;
    right += truth == label ? 1 : 0;
    inside += label ? 1 : 0;
    assert_int_equal(sparse.labels.finding[log.row[i] - 2], 0); // not used: 0
  }
  assert_true(right >= 380 && inside > 100);
  options.hold_s = 1.5;
  const rim::ReplayedLog held = replayer.replay(log, options);
  for (std::size_t i = 1; i < log.row.size(); ++i) {
    assert_int_equal(held.labels.finding[log.row[i] - 1], held.labels.finding[log.row[i] - 2]);
    assert_int_equal(held.labels.finding[log.row[i] - 1], held.labels.finding[log.row[i] - 3]);
  }
  assert_int_equal(held.labels.finding[1200], 0);
}

// A bias raises the alarm and goes; while the alarm stands, the sensor sticks, which explains more
// in the end. That began after the alarm was raised: the rows of the bias remain labelled.
void what_raised_the_alarm_remains_labelled(void **) {
  rim::Log log = toy_log(57, 900);
  constexpr Eigen::Index speed = 3, from = 300, to = 420, stuck = 500;
  log.values.block(from, speed, to - from, 1).array() += 0.2;
  log.values.block(stuck, speed, log.values.rows() - stuck, 1).array() = 0.1;
  rim::Replayer replayer(image(), "toy");
  rim::ReplayOptions options;
  options.label = true;
  const rim::ReplayedLog result = replayer.replay(log, options);
  print_message("raised at %.1f s; in the end, since %.1f s\n", result.first.t_s,
                result.last.since_s);
  assert_int_equal(result.raised, 1);
  assert_int_equal(result.last.kind, RIM_KIND_REPEAT);
  assert_true(result.first.t_s < 0.05 * stuck && result.last.since_s > result.first.t_s);
  const auto labelled = [&](Eigen::Index first, Eigen::Index last) {
    const auto begin = result.labels.finding.begin();
    return static_cast<double>(std::count(begin + first, begin + last, 1u)) /
           static_cast<double>(last - first);
  };
  assert_true(labelled(0, from - 40) < 0.1);
  assert_true(labelled(from, to) > 0.8);
  assert_true(labelled(stuck + 20, log.values.rows()) > 0.9);
}

void sd_is_estimated_and_said(void **) {
  rim::Log log = toy_external(6, 400, 0.0);
  log.columns.pop_back();
  log.values.conservativeResize(Eigen::NoChange, 3);
  const rim::ExternalImage made = rim::external_image({log}, 39, rim::CalibrationOptions{});
  assert_int_equal(made.sd_estimated.size(), 1);
  assert_string_equal(made.sd_estimated[0].c_str(), "z.force_N");
  assert_true(made.promised_rate <= 0.05 + 1e-6);
}

void columns_are_found_by_name(void **) {
  rim::Log log = toy_log(56, 600, 0.5);
  rim::Replayer replayer(image(), "toy"), turned(image(), "toy");
  replayer.replay(log, {});
  rim::Log other = log;
  std::swap(other.columns[0], other.columns[3]);
  other.values.col(0) = log.values.col(3);
  other.values.col(3) = log.values.col(0);
  turned.replay(other, {});
  assert_true(replayer.digest() == turned.digest());
  other.columns[0].name = "s.something";
  assert_true(
      has(refusal([&] { turned.replay(other, {}); }), "toy56: column 's.speed_mps' is missing"));
  assert_true(has(refusal([&] { rim::external_image({log}, 9, {}); }), "needs a model"));
}

void bad_images_are_refused(void **) {
  std::vector<std::uint8_t> bytes = image();
  for (std::size_t at = 0; at < bytes.size(); at += 97) {
    std::vector<std::uint8_t> flipped = bytes;
    flipped[at] = static_cast<std::uint8_t>(flipped[at] ^ 4u);
    assert_true(has(refusal([&] { rim::Replayer(flipped, "flipped.rim"); }), "flipped.rim: "));
  }
  for (std::size_t cut = 1; cut < bytes.size(); cut += 1 + cut / 3) {
    const std::vector<std::uint8_t> part(bytes.begin(),
                                         bytes.begin() + static_cast<std::ptrdiff_t>(cut));
    assert_true(has(refusal([&] { rim::Replayer(part, "cut.rim"); }), "cut.rim: "));
  }
}

// Nothing appears before commit(), everything after.
void outputs_appear_whole(void **) {
  char name[] = "/tmp/rim_test_replay_XXXXXX";
  const std::string folder = mkdtemp(name);
  rim::OutputPaths paths;
  paths.alarms = folder + "/a.jsonl";
  paths.labels = folder + "/l.csv";
  paths.trace = folder + "/t.csv";
  paths.candump = folder + "/c.log";
  paths.plot = folder + "/p'.svg"; // a quote in the name must not end gnuplot's string
  rim::Replayer replayer(image(), "toy");
  {
    rim::ReplayOutputs outputs(paths, replayer);
    rim::ReplayOptions options;
    options.label = true;
    const rim::Log log = toy_log(57, 600, 1.0);
    options.record = [&](const rim_alarm &record) { outputs.record(record); };
    outputs.begin(log);
    outputs.end(replayer.replay(log, options,
                                [&](std::size_t, const rim_verdict &v) { outputs.verdict(v); }));
    assert_int_not_equal(access(paths.alarms.c_str(), F_OK), 0);
    outputs.commit();
  }
  for (const std::string &path :
       {paths.alarms, paths.labels, paths.trace, paths.candump, paths.plot}) {
    assert_int_equal(access(path.c_str(), F_OK), 0);
    assert_false(rim::read_file(path).empty());
    assert_int_equal(unlink(path.c_str()), 0);
  }
  assert_int_equal(rmdir(folder.c_str()), 0); // and nothing else was left
  assert_true(has(refusal([] { rim::check_plot_path("figure.gif"); }), "figure.gif"));
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(digest_is_over_every_verdict),
      cmocka_unit_test(logs_do_not_know_each_other),
      cmocka_unit_test(alarms_carry_the_replay_flag),
      cmocka_unit_test(a_silence_in_the_log_is_told),
      cmocka_unit_test(doubts_are_said),
      cmocka_unit_test(another_unit_is_told),
      cmocka_unit_test(another_zero_is_told),
      cmocka_unit_test(labels_cover_the_file),
      cmocka_unit_test(what_raised_the_alarm_remains_labelled),
      cmocka_unit_test(sd_is_estimated_and_said),
      cmocka_unit_test(columns_are_found_by_name),
      cmocka_unit_test(bad_images_are_refused),
      cmocka_unit_test(outputs_appear_whole),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
