// SPDX-License-Identifier: MIT
// What is periodic in time: a line is found and sized, a red spectrum and a slow wander have none;
// a steady angle stays one; the phase is a log's own, and an extension says so. Seeds are fixed.
#include "diagnose/swing.hpp"

#include <cmath>
#include <cstring>

#include "diagnose/diagnose.hpp"
#include "diagnose/extension.hpp"
#include "diagnose_case.hpp"
#include "log/log.hpp"
#include "temporary.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::Role;
using rim::diagnose::Diagnosis;
using rim::diagnose::Options;
using rim::diagnose::Spectrum;
using rim::diagnose::Swing;
using rim::diagnose::Term;

constexpr double kPi = 3.141592653589793;

Swing strongest(const Measured &m, const Vector &x) {
  return Spectrum(m, x, Vector::Ones(x.size())).strongest();
}

void a_line_in_two_logs(void **) {
  const Measured m = table(2, 600, 0.05, {});
  int within = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Vector x(1200);
    for (Eigen::Index i = 0; i < x.size(); ++i)
      x(i) = std::sin(2.0 * kPi * m.elapsed_s[static_cast<std::size_t>(i)] / 1.7 +
                      (i < 600 ? 0.3 : 2.0)) +
             random.normal();
    const Swing s = strongest(m, x);
    assert_true(s.p_value < 1e-9);
    assert_near(s.background, 1.0, 0.8);
    within += std::abs(s.frequency_hz - 1.0 / 1.7) < 2.0 * s.stderror_hz ? 1 : 0;
  }
  assert_true(within >= 17);
}

void noise_has_no_line(void **) {
  const Measured m = table(3, 400, 1.0, {});
  int seen = 0;
  for (const double phi : {0.0, 0.9, 1.0}) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      Random random(100 + seed);
      Vector x(1200);
      for (Eigen::Index i = 0; i < x.size(); ++i)
        x(i) = (i % 400 > 0 ? phi * x(i - 1) : 0.0) + random.normal();
      seen += strongest(m, x).p_value < 0.01 ? 1 : 0;
    }
  }
  assert_true(seen <= 5); // 1.2 are expected
}

void a_wander_of_less_than_two_periods_is_none(void **) {
  const Measured m = table(1, 800, 0.1, {});
  for (const double periods : {0.5, 1.0, 1.5, 1.9}) {
    Random random(7);
    Vector x(800);
    for (Eigen::Index i = 0; i < x.size(); ++i)
      x(i) = 3.0 * std::sin(2.0 * kPi * periods * static_cast<double>(i) / 800.0 + 1.0) +
             random.normal();
    assert_true(strongest(m, x).p_value > 1e-3);
  }
}

// Gaps, rows at no steady rate and outliers.
void uneven_rows(void **) {
  Measured m = table(1, 900, 0.1, {});
  Random random(11);
  Vector x(900), weight = Vector::Ones(900);
  double t = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    t += i == 400 ? 20.0 : 0.05 + 0.1 * random.uniform();
    m.elapsed_s[static_cast<std::size_t>(i)] = t;
    x(i) = 2.0 * std::sin(2.0 * kPi * t / 0.43) + random.normal() + (i % 97 == 0 ? 50.0 : 0.0);
    weight(i) = i % 50 == 0 ? 0.0 : 1.0;
  }
  const Swing s = Spectrum(m, x, weight).strongest();
  assert_near(1.0 / s.frequency_hz, 0.43, 4.0 * 0.43 * 0.43 * s.stderror_hz);
  assert_true(s.p_value < 1e-9);
}

Term swing_of(const std::vector<std::string> &logs) {
  Term term;
  term.channel = "a_mps2";
  term.cause = "periodic";
  term.form = rim::diagnose::kPeriodicTime;
  term.shape = {{"period", 4.0, 0.1, "s"}, {"phase", 0.5, 0.1, "rad"}};
  term.sizes = {{"amplitude", 3.0, 0.1, "m/s2"}};
  term.logs = logs;
  return term;
}

void phase_is_known_in_its_log_alone(void **) {
  const Measured m = table(2, 40, 0.1, {});
  const Term term = swing_of({"log2"});
  const auto after = rim::diagnose::extended_prediction({term}, m.channels[0], m);
  assert_near(after.m.head(40).cwiseAbs().maxCoeff(), 0.0, 0.0);
  assert_near(after.sd(0), std::sqrt(1.0 + 4.5), 1e-12);
  assert_near(after.m(47), 3.0 * std::sin(2.0 * kPi * 0.7 / 4.0 + 0.5), 1e-12);
  assert_near(after.sd(47), 1.0, 0.0);
  const auto shared = rim::diagnose::extended_prediction({swing_of({})}, m.channels[0], m);
  assert_near(shared.m(7), shared.m(47), 0.0);
  assert_near(shared.m(7), after.m(47), 1e-12);
}

void an_extension_keeps_it(void **) {
  Term term = swing_of({"log1", "log2"});
  term.sizes[0].per_log = {2.0, 4.0};
  term.shape[1].per_log = {0.5, -1.0};
  const std::string path = temporary_path("swing.toml");
  const auto write = [&](const std::vector<Term> &terms) {
    rim::AtomicFile file(path);
    file.write(rim::diagnose::extension_toml(terms, "a test"));
    file.commit();
  };
  write({term});
  const std::vector<Term> back = rim::diagnose::read_extension(path);
  const Measured m = table(2, 40, 0.1, {});
  const Vector once = rim::diagnose::mean_effect(term, m, m.channels[0].m),
               again = rim::diagnose::mean_effect(back.at(0), m, m.channels[0].m);
  assert_near((once - again).cwiseAbs().maxCoeff(), 0.0, 0.0);
  assert_near(again(45), 4.0 * std::sin(2.0 * kPi * 0.5 / 4.0 - 1.0), 1e-12);
  term.shape[0].value = 0.0;
  write({term});
  assert_refused([&] { rim::diagnose::read_extension(path); }, {path, "'period', above 0"});
  term.shape[0].value = 4.0;
  term.shape[1].per_log.pop_back();
  write({term});
  assert_refused([&] { rim::diagnose::read_extension(path); }, {"1 values for 2 logs"});
}

// A motor whose current swings once a turn of a shaft: of an angle that is logged, or of none.
std::vector<rim::Log> motors(std::uint64_t seed, double amplitude, bool has_angle, bool own_phase) {
  std::vector<rim::Log> out;
  for (int n = 0; n < 2; ++n) {
    Random random(10 * seed + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "motor" + std::to_string(n);
    log.columns = {{"u.duty", "", Role::command},
                   {"x.shaft_rad", "rad", Role::context},
                   {"z.current_A", "A", Role::outcome},
                   {"m.current_A", "A", Role::mean},
                   {"sd.current_A", "A", Role::sd}};
    constexpr int kRows = 700;
    log.values.resize(kRows, 5);
    double duty = 0.0, drift = 0.0;
    const double phase = own_phase ? 6.0 * random.uniform() : 1.0;
    for (int i = 0; i < kRows; ++i) {
      if (i % 25 == 0)
        duty = random.uniform();
      drift = 0.99 * drift + 0.1 * random.normal();
      const double turns = 0.1 * i / 4.7;
      const double angle = 2.0 * kPi * (turns - std::floor(turns));
      const double m = 2.0 * duty;
      log.values.row(i) << duty, has_angle ? angle : drift,
          m + amplitude * std::sin(2.0 * kPi * turns + phase) + 0.1 * random.normal(), m, 0.1;
      log.t_s.push_back(0.1 * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = kRows;
    out.push_back(log);
  }
  return out;
}

Diagnosis diagnosis(const std::vector<rim::Log> &logs, const std::vector<Term> &given = {},
                    const std::vector<rim::Log> &holdout = {}) {
  Options options;
  options.holdout = holdout;
  options.catalogue = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  options.null_runs = 12;
  options.given = given;
  return rim::diagnose::diagnose(logs, options, nullptr);
}

void in_whole(void **) {
  for (const bool own_phase : {true, false}) {
    const auto logs = motors(3, 0.15, false, own_phase);
    const Diagnosis d = diagnosis(logs);
    assert_int_equal(d.findings.size(), 1);
    const Term &term = d.findings[0].term;
    assert_string_equal(term.cause.c_str(), "periodic");
    assert_string_equal(term.form.c_str(), rim::diagnose::kPeriodicTime);
    assert_near(term.shape[0].value, 4.7, 3.0 * term.shape[0].stderror);
    assert_near(term.sizes[0].value, 0.15, 3.0 * term.sizes[0].stderror);
    assert_int_equal(term.logs.size(), own_phase ? 2 : 0);
    assert_true(d.findings[0].p_value < 1e-6);
    assert_true(d.gains[0].ratio < 0.75);
    assert_non_null(std::strstr(d.findings[0].sentence.c_str(), " A with a period of 4."));
    assert_non_null(
        std::strstr(d.findings[0].sentence.c_str(), own_phase ? "each log's own" : "same phase"));
    assert_true(diagnosis(logs, {term}).adequate());
  }
}

// The logs share a phase by chance, it may be: one that is held out has another.
void a_phase_that_a_held_log_lacks(void **) {
  const std::vector<rim::Log> logs = motors(3, 0.15, false, false);
  for (const bool has_it : {true, false}) {
    std::vector<rim::Log> held = motors(5, 0.15, false, !has_it);
    for (rim::Log &log : held)
      log.path += "held";
    const Diagnosis d = diagnosis(logs, {}, held);
    assert_int_equal(d.findings.size() + d.unconfirmed.size(), 1);
    const Term &term = d.findings.empty() ? d.unconfirmed[0].term : d.findings[0].term;
    assert_string_equal(term.form.c_str(), rim::diagnose::kPeriodicTime);
    assert_near(term.shape[0].value, 4.7, 3.0 * term.shape[0].stderror);
    assert_int_equal(term.logs.size(), has_it ? 0 : 2);
  }
}

void a_steady_angle_stays_one(void **) {
  const Diagnosis d = diagnosis(motors(4, 0.2, true, false));
  assert_int_equal(d.findings.size(), 1);
  assert_int_equal(d.findings[0].term.basis.size(), 2);
  assert_int_equal(d.findings[0].term.arguments.count("a"), 1);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_line_in_two_logs),
      cmocka_unit_test(noise_has_no_line),
      cmocka_unit_test(a_wander_of_less_than_two_periods_is_none),
      cmocka_unit_test(uneven_rows),
      cmocka_unit_test(phase_is_known_in_its_log_alone),
      cmocka_unit_test(an_extension_keeps_it),
      cmocka_unit_test(in_whole),
      cmocka_unit_test(a_phase_that_a_held_log_lacks),
      cmocka_unit_test(a_steady_angle_stays_one),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
