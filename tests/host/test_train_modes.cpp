// SPDX-License-Identifier: MIT
// A command that is the number of a mode: what each mode does is a table, and is learnt as one.
#include "base/rng.h"
#include "replay/replay.hpp"
#include "train/healthy_blocks.hpp"
#include "train/trainer.hpp"

#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <setjmp.h>
extern "C" {
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 8700; // of the first run
constexpr std::size_t kRows = 1200, kModes = 11;
constexpr double kNoise = 0.02; // of either sensor
constexpr double kDraws[kModes] = {1.0, 2.6, 1.4, 4.1, 2.0, 3.1, 0.4, 3.6, 1.2, 2.2, 0.9}; // A
constexpr double kGains[kModes] = {1.0, 0.2, 0.6, 0.6, 0.1, 0.9, 0.5, 0.3, 0.8, 0.4, 0.7};

// A bus that draws what its mode asks for, and a wheel whose speed follows its command by a gain
// that the mode sets. off: what the draw has too much, of the mode and the row.
rim::Log bus(std::uint64_t seed, const std::function<double(std::size_t, std::size_t)> &off) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 5);
  rim::Log log;
  log.path = "bus" + std::to_string(seed);
  log.columns = {{"u.mode", "", rim::Role::command},
                 {"u.wheel", "", rim::Role::command},
                 {"s.draw_A", "A", rim::Role::sensor},
                 {"s.speed_mps", "m/s", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 4);
  std::size_t mode = 0;
  double wheel = 0.0;
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 40 == 0)
      mode = static_cast<std::size_t>(rimi_rng_uniform(&rng) * static_cast<double>(kModes));
    if (t % 30 == 0)
      wheel = 2.0 * rimi_rng_uniform(&rng) - 1.0;
    log.t_s.push_back(static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << static_cast<double>(mode), wheel,
        kDraws[mode] + off(mode, t) + kNoise * rimi_rng_normal(&rng),
        kGains[mode] * wheel + kNoise * rimi_rng_normal(&rng);
  }
  return log;
}

double healthy(std::size_t, std::size_t) { return 0.0; }

std::vector<rim::Log> buses(std::size_t n) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < n; ++i)
    logs.push_back(bus(kSeed + i, healthy));
  return logs;
}

const rim::Training &trained() {
  static const rim::Training training = rim::train(buses(16), {});
  return training;
}

void every_mode_is_learnt(void **) {
  print_message("seed %u: error of the draw %.4f A, of the speed %.4f m/s\n",
                static_cast<unsigned>(kSeed), trained().outcomes[0].error,
                trained().outcomes[1].error);
  assert_true(trained().outcomes[0].error < 2.0 * kNoise); // the modes' own draws differ by 1.2
  assert_true(trained().outcomes[1].r2 > 0.97);
}

void a_mode_that_draws_too_much_is_found(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "bus");
  std::size_t false_alarms = 0, found = 0;
  constexpr std::size_t flights = 6;
  for (std::uint64_t i = 0; i < flights; ++i) {
    false_alarms += replayer.replay(bus(kSeed + 100 + i, healthy), {}).raised > 0 ? 1 : 0;
    const auto too_much = [](std::size_t mode, std::size_t) { return mode == 7 ? 0.1 : 0.0; };
    const rim::ReplayedLog faulty = replayer.replay(bus(kSeed + 100 + i, too_much), {});
    found += faulty.raised > 0 ? 1 : 0;
  }
  print_message("%zu of %zu healthy flights alarm, %zu of as many faults are found\n", false_alarms,
                flights, found);
  assert_true(false_alarms <= 1);
  assert_int_equal(found, flights);
}

// How many harmonics of u.mode are inputs, after its numbers were changed.
std::size_t harmonics(const std::function<double(double)> &change) {
  std::vector<rim::Log> logs = buses(3);
  for (rim::Log &log : logs) {
    for (double &mode : log.values.col(0))
      mode = change(mode);
  }
  rim::LogSet set(logs);
  const rim::Basis basis = rim::make_basis(rim::survey_of(&set), static_cast<double>(kRows));
  std::size_t n = 0;
  for (const rim::Basis::Input &in : basis.inputs)
    n += in.a == 0 && in.b >= BASIS_LEAST_HARMONIC && in.b <= BASIS_COSINE ? 1 : 0;
  return n / 2;
}

void quantities_are_no_modes(void **) {
  assert_int_equal(harmonics([](double m) { return m; }), 4);
  assert_int_equal(harmonics([](double m) { return std::floor(m / 3.0); }), 1); // four modes
  assert_int_equal(harmonics([](double m) { return std::floor(m / 4.0); }), 0); // three
  assert_int_equal(harmonics([](double m) { return m / 4.0; }), 0);
  assert_int_equal(harmonics([](double m) { return 4.0 * m; }), 0); // up to 40
  assert_int_equal(harmonics([](double m) { return m - 20.0; }), 4);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(every_mode_is_learnt),
                              cmocka_unit_test(a_mode_that_draws_too_much_is_found),
                              cmocka_unit_test(quantities_are_no_modes)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
