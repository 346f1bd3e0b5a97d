// SPDX-License-Identifier: MIT
// A fault in some of the logs only: said of those, with its own size, and never called adequate;
// nothing is said of single logs where the fault is in all of them, or in none. Seeds are fixed.
#include "diagnose/diagnose.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "diagnose/extension.hpp"
#include "diagnose/sentence.hpp"
#include "diagnose_case.hpp"
#include "log/log.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::Role;
using rim::diagnose::Diagnosis;
using rim::diagnose::Finding;
using rim::diagnose::Options;

const int kRows = std::getenv("RIM_LONG") ? 600 : 400; // `make test-long`: more
constexpr double kSd = 0.2; // L/min

// A pump whose flow follows steps of its duty; from row `from` on the meter reads `gain` times it.
rim::Log pump(std::uint64_t seed, double gain, int from = kRows / 2) {
  Random random(seed);
  rim::Log log;
  log.path = (gain == 1.0 ? "good" : "bad") + std::to_string(seed);
  log.columns = {{"u.duty_pct", "%", Role::command},
                 {"s.press_kPa", "kPa", Role::sensor},
                 {"z.flow_Lpm", "L/min", Role::outcome},
                 {"m.flow_Lpm", "L/min", Role::mean},
                 {"sd.flow_Lpm", "L/min", Role::sd}};
  log.values.resize(kRows, 5);
  double duty = 0.0, flow = 0.0;
  for (int i = 0; i < kRows; ++i) {
    if (i % 50 == 0)
      duty = 10.0 + 90.0 * random.uniform();
    flow += 0.15 * (0.4 * duty - flow);
    const double press = 20.0 + 0.05 * flow * flow + 0.5 * random.normal();
    log.values.row(i) << duty, press, flow * (i < from ? 1.0 : gain) + kSd * random.normal(), flow,
        kSd;
    log.t_s.push_back(0.1 * i);
    log.row.push_back(static_cast<std::uint32_t>(i + 1));
  }
  log.rows_in_file = kRows;
  return log;
}

Diagnosis diagnosis(const std::vector<rim::Log> &logs,
                    const std::vector<rim::diagnose::Term> &given = {}) {
  Options options;
  options.catalogue = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  options.null_runs = 12;
  options.given = given;
  const Diagnosis d = rim::diagnose::diagnose(logs, options, nullptr);
  print_message("%s\n", d.sentence.c_str());
  return d;
}

// The gain of one log, its rows and no other's, and what it is worth in that log.
void assert_gain_in(const Diagnosis &d, const rim::Log &log, std::size_t at) {
  const auto found = std::find_if(d.findings.begin(), d.findings.end(), [&](const Finding &f) {
    return f.term.logs == std::vector<std::string>{log.path};
  });
  assert_true(found != d.findings.end());
  assert_string_equal(found->term.cause.c_str(), "gain");
  assert_near(found->term.sizes[0].value, 0.1, 4.0 * found->term.sizes[0].stderror);
  assert_true(has(found->sentence, ("In " + log.path + ", one of ").c_str()));
  for (std::size_t i = 0; i < found->acts.size(); ++i) {
    if (i < at * kRows || i >= (at + 1) * kRows)
      assert_int_equal(found->acts[i], 0);
  }
  const auto acting =
      static_cast<int>(std::count(found->acts.begin(), found->acts.end(), std::uint8_t{1}));
  assert_in_range(acting, kRows * 2 / 5, kRows * 11 / 20);
  assert_true(found->p_value < 0.05);
}

bool is_of_all(const Finding &f) { return f.term.logs.empty(); }

const std::vector<rim::Log> &three() {
  static const std::vector<rim::Log> logs = {pump(8, 1.0), pump(1, 1.1), pump(9, 1.0)};
  return logs;
}

// Made once, for two tests.
const Diagnosis &of_three() {
  static const Diagnosis d = diagnosis(three());
  return d;
}

void one_of_three(void **) {
  const std::vector<rim::Log> &logs = three();
  const Diagnosis &d = of_three();
  assert_false(d.adequate());
  assert_true(std::none_of(d.findings.begin(), d.findings.end(), is_of_all));
  assert_gain_in(d, logs[1], 1);
  assert_true(has(d.sentence, "In bad1, one of 3 logs: measured flow is 1."));
  assert_true(has(d.sentence, "Correcting it leaves"));
  assert_true(d.sentence.find("not borne out") == std::string::npos);
  assert_true(d.gains[0].data == "cross-validated within bad1" && d.gains[0].ratio_ci95.high < 1.0);
  // The prediction of that log is corrected, and no other's.
  const rim::diagnose::Measured table = rim::diagnose::make_measured(logs);
  const Vector off = d.channels[0].m_after - table.channels[0].m;
  assert_true(off.head(kRows).isZero() && off.tail(kRows).isZero());
  assert_true(off.segment(kRows, kRows).norm() > 0.0);
}

void one_of_two(void **) {
  const std::vector<rim::Log> logs = {pump(1, 1.1), pump(9, 1.0)};
  const Diagnosis d = diagnosis(logs);
  assert_true(std::none_of(d.findings.begin(), d.findings.end(), is_of_all));
  assert_gain_in(d, logs[0], 0);
}

// Throughout one of two: no law whose size differs between both.
void one_of_two_throughout(void **) {
  const std::vector<rim::Log> logs = {pump(9, 1.0), pump(1, 1.1, 0)};
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  assert_string_equal(d.findings[0].term.cause.c_str(), "gain");
  assert_true(d.findings[0].term.logs == std::vector<std::string>{"bad1"});
  assert_true(d.sentence.find("on data it was not fitted to") != std::string::npos);
}

void two_of_three(void **) {
  const std::vector<rim::Log> logs = {pump(1, 1.1), pump(9, 1.0), pump(2, 1.1)};
  const Diagnosis d = diagnosis(logs);
  assert_false(d.adequate());
  if (std::none_of(d.findings.begin(), d.findings.end(), is_of_all)) {
    assert_gain_in(d, logs[0], 0);
    assert_gain_in(d, logs[2], 2);
  }
}

// A fault among many good logs is a small part of all rows: of five, of ten with RIM_LONG (`make
// test-long`).
void one_of_many(void **) {
  const std::size_t good = std::getenv("RIM_LONG") != nullptr ? 9 : 4;
  std::vector<rim::Log> logs;
  for (std::uint64_t seed = 11; seed < 11 + good; ++seed)
    logs.push_back(pump(seed, 1.0));
  logs.push_back(pump(1, 1.1));
  assert_gain_in(diagnosis(logs), logs.back(), good);
}

void in_all_logs_or_in_none(void **) {
  const Diagnosis all = diagnosis({pump(1, 1.1), pump(2, 1.1), pump(3, 1.1)});
  assert_false(all.adequate());
  assert_true(std::all_of(all.findings.begin(), all.findings.end(), is_of_all));
  for (std::uint64_t seed = 21; seed < 30; seed += 3) {
    const Diagnosis none = diagnosis({pump(seed, 1.0), pump(seed + 1, 1.0), pump(seed + 2, 1.0)});
    assert_true(none.adequate());
  }
}

// Given back from a file it explains that log, and acts in no other.
void given_back(void **) {
  const std::vector<rim::Log> &logs = three();
  std::vector<rim::diagnose::Term> terms;
  for (const Finding &f : of_three().findings)
    terms.push_back(f.term);
  const std::string path = "single_logs_extension.toml";
  {
    rim::AtomicFile file(path);
    file.write(rim::diagnose::extension_toml(terms, "a test"));
    file.commit();
  }
  const std::vector<rim::diagnose::Term> read = rim::diagnose::read_extension(path);
  std::remove(path.c_str());
  assert_true(read.size() == terms.size() && read[0].logs == terms[0].logs);
  assert_true(diagnosis(logs, read).adequate());
}

// What was seen, and does not hold in all parts of the logs, leaves open whether they are as
// predicted: it is no claim, and they are not called so either.
void what_is_not_confirmed_is_no_adequacy(void **) {
  Diagnosis d;
  assert_true(has(rim::diagnose::diagnosis_sentence(d), "is adequate"));
  d.unconfirmed.resize(1);
  assert_true(has(rim::diagnose::diagnosis_sentence(d), "is adequate")); // as healthy runs do
  d.doubts = 1;
  assert_true(has(rim::diagnose::diagnosis_sentence(d), "does not show the simulation to be"));
  assert_true(d.adequate()); // nothing is claimed
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(one_of_three),
      cmocka_unit_test(one_of_two),
      cmocka_unit_test(one_of_two_throughout),
      cmocka_unit_test(two_of_three),
      cmocka_unit_test(one_of_many),
      cmocka_unit_test(in_all_logs_or_in_none),
      cmocka_unit_test(given_back),
      cmocka_unit_test(what_is_not_confirmed_is_no_adequacy),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
