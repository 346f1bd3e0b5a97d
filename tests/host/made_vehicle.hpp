// SPDX-License-Identifier: MIT
// A vehicle whose every constant is known: what a model of it must find.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "log/log.hpp"
#include "base/rng.h"

struct MadeVehicle {
  std::size_t rows = 2400;
  double period_s = 0.1;
  double noise = 0.05;      // of every reading, white
  double run_spread = 0.0;  // of an offset of the run, in every outcome
  double start_spread = 1.0; // of the integrating state's start
  bool gaps = false;        // rows are missing here and there
};

inline constexpr double kMadeTau[] = {3.0, 1.2}; // s, of s.lag and s.product

// Outcomes: a lag of u.a and u.b, a lag of the product u.a u.b, the integral of u.a from a start
// that differs, a reading quantised to halves, and one that obeys nothing at all.
inline rim::Log made_vehicle(std::uint64_t seed, const MadeVehicle &made = {}) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 91);
  rim::Log log;
  log.path = "made" + std::to_string(seed);
  log.columns = {{"u.a", "", rim::Role::command},        {"u.b", "", rim::Role::command},
                 {"s.lag_m", "m", rim::Role::sensor},    {"s.product_m", "m", rim::Role::sensor},
                 {"s.state_m", "m", rim::Role::sensor},  {"s.count", "", rim::Role::sensor},
                 {"s.nothing", "", rim::Role::sensor}};
  std::vector<double> values;
  double a = 0.0, b = 0.0, lag = 0.0, product = 0.0, offset[3];
  double state = made.start_spread * rimi_rng_normal(&rng);
  for (double &o : offset)
    o = made.run_spread * rimi_rng_normal(&rng);
  std::size_t missing = 0;
  for (std::size_t t = 0; t < made.rows; ++t) {
    if (t % 90 == 0)
      a = 2.0 * rimi_rng_uniform(&rng) - 1.0;
    if (t % 130 == 0)
      b = 2.0 * rimi_rng_uniform(&rng) - 1.0;
    if (t == 0) { // it has held its first commands for long
      lag = a + 0.5 * b;
      product = a * b;
    }
    lag += (1.0 - std::exp(-made.period_s / kMadeTau[0])) * (a + 0.5 * b - lag);
    product += (1.0 - std::exp(-made.period_s / kMadeTau[1])) * (a * b - product);
    state += 0.05 * made.period_s * a;
    const double clean[] = {lag + offset[0], product + offset[1], state + offset[2]};
    double reading[5];
    for (std::size_t o = 0; o < 3; ++o)
      reading[o] = clean[o] + made.noise * rimi_rng_normal(&rng);
    reading[3] = std::round(4.0 * lag + rimi_rng_normal(&rng)) / 2.0;
    reading[4] = rimi_rng_normal(&rng);
    if (made.gaps && missing == 0 && rimi_rng_uniform(&rng) < 0.01)
      missing = 1 + static_cast<std::size_t>(8.0 * rimi_rng_uniform(&rng));
    if (missing > 0) {
      --missing;
      continue;
    }
    values.insert(values.end(), {a, b});
    values.insert(values.end(), reading, reading + 5);
    log.t_s.push_back(made.period_s * static_cast<double>(t));
    log.row.push_back(static_cast<std::uint32_t>(t + 1));
  }
  log.rows_in_file = static_cast<std::uint32_t>(made.rows);
  log.values = Eigen::Map<const rim::Matrix>(
      values.data(), static_cast<Eigen::Index>(log.t_s.size()), 7);
  return log;
}

inline std::vector<rim::Log> made_vehicles(std::uint64_t first, std::size_t count,
                                           const MadeVehicle &made = {}) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < count; ++i)
    logs.push_back(made_vehicle(first + i, made));
  return logs;
}
