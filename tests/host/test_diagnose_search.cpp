// SPDX-License-Identifier: MIT
// The whole search on small logs with one planted effect each: found, named, sized; noise claims
// nothing; what an extension explains is not found again; threads change nothing. Seeds are fixed.
#include "diagnose/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "diagnose/null.hpp"
#include "diagnose_case.hpp"
#include "log/log.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::Role;
using rim::diagnose::Diagnosis;
using rim::diagnose::Options;

// What the simulation does not know, from speed, command and battery.
using Effect = std::function<double(double v, double u, double b)>;

std::vector<rim::Log> drives(std::uint64_t seed, const Effect &effect) {
  std::vector<rim::Log> out;
  for (int n = 0; n < 2; ++n) {
    Random random(10 * seed + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "drive" + std::to_string(n);
    log.columns = {{"u.push", "", Role::command},        {"s.speed_mps", "m/s", Role::sensor},
                   {"x.battery_V", "V", Role::context},  {"z.accel_mps2", "m/s2", Role::outcome},
                   {"m.accel_mps2", "m/s2", Role::mean}, {"sd.accel_mps2", "m/s2", Role::sd}};
    constexpr int kRows = 700;
    log.values.resize(kRows, 6);
    double v = 0.0;
    const double p = random.normal();
    for (int i = 0; i < kRows; ++i) {
      const double u = std::sin(i / 40.0 + p) + 0.5 * std::sin(i / 11.0);
      const double b = 12.0 + 0.6 * std::sin(i / 90.0 - p) + 0.05 * random.normal();
      const double m = u - 0.2 * v;
      log.values.row(i) << u, v, b, m + effect(v, u, b) + 0.1 * random.normal(), m, 0.1;
      log.t_s.push_back(0.1 * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
      v += 0.1 * m;
    }
    log.rows_in_file = kRows;
    out.push_back(log);
  }
  return out;
}

Diagnosis diagnosis(const std::vector<rim::Log> &logs,
                    const std::vector<rim::diagnose::Term> &given = {}) {
  Options options;
  options.catalogue = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  options.given = given;
  options.null_runs = 16;
  options.gains = false;
  return rim::diagnose::diagnose(logs, options, nullptr);
}

void a_constant_in_a_region(void **) {
  const auto logs = drives(1, [](double, double, double b) { return b > 12.3 ? -0.1 : 0.0; });
  const Diagnosis d = diagnosis(logs);
  assert_false(d.adequate());
  const auto &f = d.findings[0];
  assert_string_equal(f.term.cause.c_str(), "bias");
  const auto &names = f.term.gate.features;
  const auto battery = std::find(names.begin(), names.end(), "x.battery_V") - names.begin();
  assert_true(battery < static_cast<std::ptrdiff_t>(names.size()));
  assert_near(f.term.gate.lower[static_cast<std::size_t>(battery)], 12.3, 0.15);
  assert_near(f.term.sizes[0].value, -0.1, 4.0 * f.term.sizes[0].stderror);
  assert_true(f.p_value < 0.05 && f.ln_anom > 20.0);
  // given back it is not found again, and nothing else is
  const Diagnosis again = diagnosis(logs, {f.term});
  assert_int_equal(again.findings.size(), 1);
  assert_true(again.findings[0].given);
  assert_true(again.adequate());
}

// Of the seeds of a test: all with RIM_LONG (`make test-long`), else the first.
std::vector<std::uint64_t> some(const std::vector<std::uint64_t> &seeds) {
  return std::getenv("RIM_LONG") != nullptr ? seeds : std::vector<std::uint64_t>{seeds.front()};
}

// A region of one feature is said with one, and its edge is where the rows say it is.
void a_region_of_one_feature(void **) {
  for (const std::uint64_t seed : some({19, 20, 21})) {
    const auto logs = drives(seed, [](double, double, double b) { return b > 12.3 ? 0.6 : 0.0; });
    const Diagnosis d = diagnosis(logs);
    assert_int_equal(d.findings.size(), 1);
    const rim::diagnose::Gate &gate = d.findings[0].term.gate;
    assert_int_equal(gate.features.size(), 1);
    assert_string_equal(gate.features[0].c_str(), "x.battery_V");
    const double low = std::min(gate.lower[0], 12.3), high = std::max(gate.lower[0], 12.3);
    std::ptrdiff_t between = 0;
    for (const rim::Log &log : logs)
      between += ((log.values.col(2).array() > low) && (log.values.col(2).array() < high)).count();
    assert_true(between <= 1);
  }
}

// A leak goes with a pressure that varies by less than a fifth of its mean.
void a_coupling_of_what_varies_little(void **) {
  auto logs = drives(22, [](double, double, double) { return 0.0; });
  for (rim::Log &log : logs) {
    constexpr Eigen::Index kMeasured = 3;
    log.columns[2] = {"x.pressure_bar", "bar", Role::context};
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      log.values(i, 2) = 120.0 + 25.0 * std::sin(static_cast<double>(i) / 37.0);
      log.values(i, kMeasured) -= 0.01 * log.values(i, 2);
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  assert_string_equal(d.findings[0].term.cause.c_str(), "coupling");
  assert_near(d.findings[0].term.sizes[0].value, -0.01, 0.0002);
}

// A command that does more in one direction: one finding, with the edge at none.
void a_gain_in_one_direction(void **) {
  const Diagnosis d = diagnosis(
      drives(23, [](double v, double u, double) { return u > 0.0 ? 0.3 * (u - 0.2 * v) : 0.0; }));
  assert_int_equal(d.findings.size(), 1);
  const rim::diagnose::Term &term = d.findings[0].term;
  assert_string_equal(term.cause.c_str(), "gain");
  assert_near(term.sizes[0].value, 0.3, 0.02);
  assert_int_equal(term.gate.features.size(), 1);
  assert_near(term.gate.lower[0], 0.0, 0.1);
}

// A speed that hardly varies is no motion that a friction turns with: the constant is one.
void a_constant_beside_a_steady_speed(void **) {
  auto logs = drives(25, [](double, double, double) { return -0.3; });
  Random random(26);
  for (rim::Log &log : logs) {
    log.columns[1] = {"x.rotor_rpm", "rpm", Role::context};
    log.columns[3] = {"z.yaw_acc", "", Role::outcome};
    log.columns[4] = {"m.yaw_acc", "", Role::mean};
    log.columns[5] = {"sd.yaw_acc", "", Role::sd};
    for (Eigen::Index i = 0; i < log.values.rows(); ++i)
      log.values(i, 1) = 400.0 + 3.0 * random.normal();
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  assert_string_equal(d.findings[0].term.cause.c_str(), "bias");
}

// A drive with another limit in either direction.
void a_limit_in_each_direction(void **) {
  const Diagnosis d = diagnosis(drives(27, [](double v, double u, double) {
    const double m = u - 0.2 * v;
    return std::max(-0.5, std::min(0.8, m)) - m;
  }));
  assert_int_equal(d.findings.size(), 2);
  for (const auto &f : d.findings) {
    assert_string_equal(f.term.cause.c_str(), "saturation");
    assert_near(f.term.shape[0].value, f.term.form == "saturation_below" ? -0.5 : 0.8, 0.03);
  }
}

// Readings in whole steps, of an outcome that is as predicted, claim nothing; a constant shows
// through them.
void a_coarse_reading(void **) {
  for (const double off : {0.0, 0.2}) {
    auto logs = drives(24, [off](double, double, double b) { return b > 12.2 ? off : 0.0; });
    for (rim::Log &log : logs) {
      log.columns.pop_back();
      log.values.conservativeResize(Eigen::NoChange, 5);
      for (Eigen::Index i = 0; i < log.values.rows(); ++i)
        log.values(i, 3) = 0.5 * std::round(log.values(i, 3) / 0.5);
    }
    const Diagnosis d = diagnosis(logs);
    assert_int_equal(d.findings.size(), off > 0.0 ? 1 : 0);
    for (const auto &f : d.findings) {
      assert_string_equal(f.term.cause.c_str(), "bias");
      assert_near(f.term.sizes[0].value, off, 0.03);
      assert_string_equal(f.term.gate.features[0].c_str(), "x.battery_V");
    }
  }
}

void drag(void **) {
  const Diagnosis d =
      diagnosis(drives(2, [](double v, double, double) { return -0.02 * v * std::abs(v); }));
  assert_false(d.adequate());
  assert_string_equal(d.findings[0].term.cause.c_str(), "quadratic_drag");
  assert_near(d.findings[0].term.sizes[0].value, 0.02, 0.004);
}

bool is_claimed(const Diagnosis &d, const std::string &cause) {
  return std::any_of(d.findings.begin(), d.findings.end(),
                     [&](const auto &f) { return f.term.cause == cause; });
}

// What holds everywhere holds beyond the rows that it was learnt from: three times as fast.
void a_product_goes_on_beyond(void **) {
  const auto effect = [](double v, double u, double) { return 0.1 * v * u; };
  const Diagnosis d = diagnosis(drives(6, effect));
  const auto product = std::find_if(d.findings.begin(), d.findings.end(),
                                    [](const auto &f) { return f.term.cause == "product"; });
  assert_true(product != d.findings.end());
  auto logs = drives(7, effect);
  for (auto &log : logs)
    log.values.col(1) *= 3.0;
  const auto beyond = rim::diagnose::make_measured(logs);
  const auto &channel = beyond.channels[0];
  const Vector said = mean_effect(product->term, beyond, channel.m),
               wanted = 0.1 * beyond.x.col(beyond.find_feature("s.speed_mps"))
                                  .cwiseProduct(beyond.x.col(beyond.find_feature("u.push")));
  assert_true((said - wanted).norm() < 0.1 * wanted.norm());
}

void two_effects(void **) {
  const Diagnosis d = diagnosis(drives(4, [](double v, double, double b) {
    return -0.03 * v * std::abs(v) + (b > 12.3 ? -0.1 : 0.0);
  }));
  assert_true(d.findings.size() >= 2);
  assert_true(is_claimed(d, "quadratic_drag"));
  assert_true(is_claimed(d, "bias"));
}

// The measured acceleration is the simulation's of 0.3 s before.
void a_delay(void **) {
  auto logs = drives(5, [](double, double, double) { return 0.0; });
  for (rim::Log &log : logs) {
    constexpr Eigen::Index kRows = 3, kMeasured = 3, kPredicted = 4;
    const Eigen::VectorXd m = log.values.col(kPredicted);
    const Eigen::Index n = m.size() - kRows;
    log.values.col(kMeasured).tail(n) += m.head(n) - m.tail(n);
  }
  const Diagnosis d = diagnosis(logs);
  assert_false(d.adequate());
  const auto &term = d.findings[0].term;
  assert_string_equal(term.cause.c_str(), "delay");
  assert_near(term.shape[0].value, 0.3, 0.05);
}

// A reading that is late by four rows, where the prediction is another reading as it is.
void a_reading_that_is_late(void **) {
  std::vector<rim::Log> logs;
  for (int n = 0; n < 3; ++n) {
    Random random(160 + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "course" + std::to_string(n);
    log.columns = {{"x.wheel_mps", "m/s", Role::context},
                   {"x.yaw_radps", "rad/s", Role::context},
                   {"z.along_mps", "m/s", Role::outcome},
                   {"m.along_mps", "m/s", Role::mean}};
    constexpr int kRows = 900;
    log.values.resize(kRows, 4);
    const auto speed = [n](double i) {
      return 4.0 + std::sin(i / 40.0 + n) + 0.6 * std::sin(i / 17.0 + 2.0 * n);
    };
    for (int i = 0; i < kRows; ++i) {
      log.values.row(i) << speed(i), std::sin(i / 23.0) + 0.01 * random.normal(),
          speed(i - 4) + 0.04 * random.normal(), speed(i);
      log.t_s.push_back(0.05 * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = kRows;
    logs.push_back(log);
  }
  const Diagnosis d = diagnosis(logs);
  assert_false(d.adequate());
  assert_string_equal(d.findings[0].term.cause.c_str(), "delay");
  assert_near(d.findings[0].term.shape[0].value, 0.2, 0.02);
}

// The force of a tyre follows what is asked over .6 m that it rolls, at speeds of 3 to 11 m/s.
void a_force_over_a_length(void **) {
  std::vector<rim::Log> logs;
  for (int n = 0; n < 3; ++n) {
    Random random(180 + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "tyre" + std::to_string(n);
    log.columns = {{"u.slip_rad", "rad", Role::command},
                   {"x.road_mps", "m/s", Role::context},
                   {"z.side_N", "N", Role::outcome},
                   {"m.side_N", "N", Role::mean}};
    constexpr int kRows = 900;
    log.values.resize(kRows, 4);
    double force = 0.0;
    for (int i = 0; i < kRows; ++i) {
      const double slip = 0.03 * std::sin(i / 9.0 + n) + 0.02 * std::sin(i / 23.0),
                   speed = 7.0 + 4.0 * std::sin(i / 70.0 + 2.0 * n);
      force += (1500.0 * slip - force) * (1.0 - std::exp(-0.02 * speed / 0.6));
      log.values.row(i) << slip, speed + 0.02 * random.normal(), force + random.normal(),
          1500.0 * slip;
      log.t_s.push_back(0.02 * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = kRows;
    logs.push_back(log);
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  assert_string_equal(d.findings[0].term.form.c_str(), "lag_length");
  assert_string_equal(d.findings[0].term.arguments.at("along").c_str(), "x.road_mps");
  assert_near(d.findings[0].term.shape[0].value, 0.6, 0.05);
}

// A damper strut: oil through an orifice, a gas spring, a seal. Some formula of the stroke looks
// like the spring and its load, which are a straight line and are claimed as that.
rim::Log strut(std::uint64_t seed) {
  Random random(seed);
  rim::Log log;
  log.path = "strut" + std::to_string(seed);
  log.columns = {{"x.stroke_mm", "mm", Role::context},
                 {"x.stroke_mmps", "mm/s", Role::context},
                 {"x.top_mps2", "m/s2", Role::context},
                 {"z.force_N", "N", Role::outcome},
                 {"m.force_N", "N", Role::mean}};
  constexpr int kRows = 2000;
  log.values.resize(kRows, 5);
  double w[4], p[4];
  for (int k = 0; k < 4; ++k) {
    w[k] = 1.2 * std::exp(1.7 * random.uniform());
    p[k] = 6.28 * random.uniform();
  }
  for (int i = 0; i < kRows; ++i) {
    double x = 0.0, v = 0.0, a = 0.0;
    for (int k = 0; k < 4; ++k) {
      const double q = w[k] * 0.01 * i + p[k];
      x += 0.04 * std::sin(q);
      v += 0.04 * w[k] * std::cos(q);
      a -= 0.04 * w[k] * w[k] * std::sin(q);
    }
    const double top = a + 0.15 * random.normal();
    const double force = 40.0 * a + 720.0 * v * std::abs(v) + 1178.0 * x + 163.0 +
                         77.0 * std::tanh(v / 0.005) + 9.0 * random.normal();
    log.values.row(i) << 1e3 * x, 1e3 * (v + 0.004 * random.normal()), top, force, 40.0 * top;
    log.t_s.push_back(0.01 * i);
    log.row.push_back(static_cast<std::uint32_t>(i + 1));
  }
  log.rows_in_file = kRows;
  return log;
}

void a_formula_that_is_a_straight_line(void **) {
  for (const std::uint64_t seed : some({1930, 1950})) {
    const Diagnosis d = diagnosis({strut(seed), strut(seed + 1), strut(seed + 2)});
    assert_true(is_claimed(d, "coupling") && is_claimed(d, "bias") &&
                is_claimed(d, "coulomb_friction") && is_claimed(d, "quadratic_drag"));
    assert_false(is_claimed(d, "unknown"));
  }
}

// The zero of a voltage or temperature means nothing: where it varies by a twentieth of its mean,
// it acts in proportion to what it departs from the usual by, and that is a coupling.
void what_departs_from_its_usual_value(void **) {
  const Diagnosis d = diagnosis(drives(16, [](double, double, double b) { return 0.4 * b - 4.6; }));
  assert_true(is_claimed(d, "coupling") && is_claimed(d, "bias"));
  for (const auto &f : d.findings) {
    assert_string_not_equal(f.term.cause.c_str(), "unknown");
    if (f.term.cause == "coupling")
      assert_near(f.term.sizes[0].value, 0.4, 0.03);
  }
}

// A motor whose teeth meet the slots twelve times a turn.
void twelve_times_a_turn(void **) {
  auto logs = drives(17, [](double, double, double) { return 0.0; });
  for (rim::Log &log : logs) {
    constexpr Eigen::Index kMeasured = 3;
    log.columns[2] = {"x.rotor_rad", "rad", Role::context};
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      const double q = 1.5 * std::sin(static_cast<double>(i) / 61.0);
      log.values(i, 2) = q;
      log.values(i, kMeasured) += 0.2 * std::sin(12.0 * q + 0.7);
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  assert_string_equal(d.findings[0].term.cause.c_str(), "periodic");
  assert_near(d.findings[0].term.shape[0].value, 12.0, 0.0);
}

// A compass from 0 to 360 degrees: what goes with the sine of seven times the angle, and what is
// off on both sides of north.
void an_angle_in_degrees(void **) {
  for (const bool is_region : {false, true}) {
    auto logs = drives(18, [](double, double, double) { return 0.0; });
    for (rim::Log &log : logs) {
      constexpr Eigen::Index kMeasured = 3;
      log.columns[2] = {"x.heading_deg", "deg", Role::context};
      for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
        const double q = std::fmod(3.7 * static_cast<double>(i), 360.0);
        log.values(i, 2) = q;
        log.values(i, kMeasured) += is_region ? (q > 320.0 || q < 40.0 ? 0.2 : 0.0)
                                              : 0.2 * std::sin(7.0 * q * 0.017453292519943 + 0.7);
      }
    }
    const Diagnosis d = diagnosis(logs);
    assert_int_equal(d.findings.size(), 1);
    const rim::diagnose::Term &term = d.findings[0].term;
    assert_string_equal(term.cause.c_str(), is_region ? "bias" : "periodic");
    assert_near(term.sizes[0].value, is_region ? 0.2 : 0.2 * std::cos(0.7), 0.02);
    if (is_region) {
      assert_near(term.gate.lower[0], 320.0, 6.0);
      assert_near(term.gate.upper[0], 40.0, 6.0);
    } else {
      assert_near(term.shape[0].value, 7.0, 0.0);
      assert_true(d.findings[0].sentence.find("sin(7*heading*pi/180)") != std::string::npos);
    }
  }
}

void white_noise_claims_nothing(void **) {
  for (std::uint64_t seed = 11; seed <= 13; ++seed) {
    const Diagnosis d = diagnosis(drives(seed, [](double, double, double) { return 0.0; }));
    if (!d.adequate())
      fail_msg("seed %llu: %s", static_cast<unsigned long long>(seed), d.sentence.c_str());
  }
}

// Logs without sd. columns, of a wheel whose predictions are made of a noisy reading of the speed.
std::vector<rim::Log> made_of_readings(std::uint64_t seed, double of_reading) {
  std::vector<rim::Log> out;
  for (int n = 0; n < 2; ++n) {
    Random random(10 * seed + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "wheel" + std::to_string(n);
    log.columns = {{"x.speed_mps", "m/s", Role::context},
                   {"z.wheel_radps", "rad/s", Role::outcome},
                   {"m.wheel_radps", "rad/s", Role::mean}};
    constexpr int kRows = 900;
    log.values.resize(kRows, 3);
    for (int i = 0; i < kRows; ++i) {
      const double v = 5.0 + 3.0 * std::sin(i / 30.0 + n), read = v + of_reading * random.normal();
      log.values.row(i) << read, 2.0 * v + 0.05 * random.normal(), 2.0 * read;
      log.t_s.push_back(0.1 * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = kRows;
    out.push_back(log);
  }
  return out;
}

// A wheel's speed, predicted a row ahead from its own reading; of each row friction takes a share
// and so much, and holds the wheel where that is all. It is no dead zone of the speed, however
// often it holds.
void friction_that_holds(void **) {
  constexpr double kTaken = 0.06, kStep = 0.02;
  std::vector<rim::Log> logs;
  for (int n = 0; n < 2; ++n) {
    Random random(170 + static_cast<std::uint64_t>(n));
    rim::Log log;
    log.path = "held" + std::to_string(n);
    log.columns = {{"u.drive_V", "V", Role::command},
                   {"x.wheel_radps", "rad/s", Role::context},
                   {"z.wheel_radps", "rad/s", Role::outcome},
                   {"m.wheel_radps", "rad/s", Role::mean}};
    constexpr int kRows = 1200;
    log.values.resize(kRows, 4);
    double v = 0.0, read = 0.0;
    for (int i = 0; i < kRows; ++i) {
      const double u = 6.0 * std::sin(i / 23.0 + n) * std::sin(i / 71.0);
      const double free = 0.97 * v + kStep * u;
      v = std::abs(free) > kTaken ? free - std::copysign(kTaken, free) : 0.0;
      const double next = v + 0.002 * random.normal();
      log.values.row(i) << u, read, next, read + kStep * u;
      read = next;
      log.t_s.push_back(kStep * i);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = kRows;
    logs.push_back(log);
  }
  const Diagnosis d = diagnosis(logs);
  const auto is_found = [&d](const char *cause) {
    return std::any_of(d.findings.begin(), d.findings.end(),
                       [&](const auto &finding) { return finding.term.cause == cause; });
  };
  assert_true(is_found("coulomb_friction") && is_found("viscous_friction"));
  assert_false(is_found("dead_zone"));
}

// A lag, a delay or play would smooth the noise of the prediction: none is claimed.
void what_a_noisy_prediction_feigns(void **) {
  const Diagnosis d = diagnosis(made_of_readings(14, 0.1));
  for (const auto &finding : d.findings)
    assert_false(rim::diagnose::remembers(finding.term));
  const auto says_so = [](const std::string &note) {
    return note.find("made of noisy readings") != std::string::npos;
  };
  assert_true(std::any_of(d.notes.begin(), d.notes.end(), says_so));
}

// Without a stated deviation the noise is what physics leaves, far below the whole residual: a
// small effect is seen beside a large one.
void a_small_effect_beside_a_large_one(void **) {
  auto logs =
      drives(15, [](double v, double u, double) { return -0.9 * v * std::abs(v) + 0.3 * u * v; });
  for (rim::Log &log : logs) {
    log.columns.pop_back();
    log.values.conservativeResize(Eigen::NoChange, 5);
  }
  const Diagnosis d = diagnosis(logs);
  assert_true(d.findings.size() >= 2);
  assert_string_equal(d.findings[0].term.cause.c_str(), "quadratic_drag");
  assert_near(d.findings[0].term.sizes[0].value, 0.9, 0.05);
  const auto is_product = [](const auto &f) { return f.term.cause == "product"; };
  assert_true(std::any_of(d.findings.begin(), d.findings.end(), is_product));
}

void threads_change_nothing(void **) {
  const Measured t =
      rim::diagnose::make_measured(drives(3, [](double, double, double) { return 0.0; }));
  const auto causes = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  std::vector<rim::diagnose::Library> kept;
  setenv("RIM_THREADS", "1", 1);
  const auto one = rim::diagnose::simulate_null(t, causes, 6, 5, &kept);
  setenv("RIM_THREADS", "2", 1);
  const auto two = rim::diagnose::simulate_null(t, causes, 6, 5, &kept);
  unsetenv("RIM_THREADS");
  assert_true(one.location == two.location && one.spread == two.spread);
  assert_true(rim::diagnose::simulate_null(t, causes, 6, 6, &kept).location != one.location);
  assert_near(one.p_value(one.threshold(0.05)), 0.05, 1e-9);
  assert_true(one.threshold(0.01) > one.threshold(0.05));
}

} // namespace

int main() {
  std::printf("seeds 1 to 7, 11 to 27, 160 to 162, 170, 171, 180 to 182, 1930 to 1932, 1950 to "
              "1952\n");
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_constant_in_a_region),
      cmocka_unit_test(a_region_of_one_feature),
      cmocka_unit_test(a_coupling_of_what_varies_little),
      cmocka_unit_test(a_gain_in_one_direction),
      cmocka_unit_test(a_constant_beside_a_steady_speed),
      cmocka_unit_test(a_limit_in_each_direction),
      cmocka_unit_test(a_coarse_reading),
      cmocka_unit_test(drag),
      cmocka_unit_test(a_product_goes_on_beyond),
      cmocka_unit_test(two_effects),
      cmocka_unit_test(a_delay),
      cmocka_unit_test(a_reading_that_is_late),
      cmocka_unit_test(a_force_over_a_length),
      cmocka_unit_test(a_formula_that_is_a_straight_line),
      cmocka_unit_test(what_departs_from_its_usual_value),
      cmocka_unit_test(twelve_times_a_turn),
      cmocka_unit_test(an_angle_in_degrees),
      cmocka_unit_test(white_noise_claims_nothing),
      cmocka_unit_test(friction_that_holds),
      cmocka_unit_test(what_a_noisy_prediction_feigns),
      cmocka_unit_test(a_small_effect_beside_a_large_one),
      cmocka_unit_test(threads_change_nothing),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
