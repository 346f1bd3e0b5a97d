// SPDX-License-Identifier: MIT
// A cart on a line: a command, two position sensors with a bias of their own each run, a speed.
#pragma once

#include <cmath>
#include <string>

#include "log/log.hpp"
#include "base/rng.h"

inline rim::Log toy_log(std::uint64_t seed, std::size_t rows = 600, double bias_m = 0.0) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 77);
  rim::Log log;
  log.path = "toy" + std::to_string(seed);
  log.columns = {{"u.push", "", rim::Role::command},
                 {"s.position_a_m", "m", rim::Role::sensor},
                 {"s.position_b_m", "m", rim::Role::sensor},
                 {"s.speed_mps", "m/s", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(rows), 4);
  const double bias_a = 0.02 * rimi_rng_normal(&rng) + bias_m,
               bias_b = 0.02 * rimi_rng_normal(&rng);
  const double phase = rimi_rng_normal(&rng);
  double x = 0.0, v = 0.0;
  for (std::size_t t = 0; t < rows; ++t) {
    const double i = static_cast<double>(t);
    const double push = std::sin(i / 60.0 + phase) + 0.3 * std::sin(i / 17.0);
    v += 0.05 * (push - 0.5 * v);
    x += 0.05 * v;
    log.values.row(static_cast<Eigen::Index>(t)) << push, x + bias_a + 0.03 * rimi_rng_normal(&rng),
        x + bias_b + 0.03 * rimi_rng_normal(&rng), v + 0.02 * rimi_rng_normal(&rng);
    log.t_s.push_back(0.05 * i);
    log.row.push_back(static_cast<std::uint32_t>(t + 1));
  }
  log.rows_in_file = static_cast<std::uint32_t>(rows);
  return log;
}

// A log with its own predictions, wrong by `shift` sd where the context is above 0.5.
inline rim::Log toy_external(std::uint64_t seed, std::size_t rows, double shift) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 78);
  rim::Log log;
  log.path = "own" + std::to_string(seed);
  log.columns = {{"x.place", "", rim::Role::context},
                 {"z.force_N", "N", rim::Role::outcome},
                 {"m.force_N", "N", rim::Role::mean},
                 {"sd.force_N", "N", rim::Role::sd}};
  log.values.resize(static_cast<Eigen::Index>(rows), 4);
  for (std::size_t t = 0; t < rows; ++t) {
    const double place = rimi_rng_uniform(&rng), mean = 3.0 * place;
    const double sd = 0.5, off = place > 0.5 ? shift * sd : 0.0;
    log.values.row(static_cast<Eigen::Index>(t)) << place, mean + off + sd * rimi_rng_normal(&rng),
        mean, sd;
    log.t_s.push_back(static_cast<double>(t));
    log.row.push_back(static_cast<std::uint32_t>(t + 1));
  }
  log.rows_in_file = static_cast<std::uint32_t>(rows);
  return log;
}
