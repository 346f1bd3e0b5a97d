// SPDX-License-Identifier: MIT
// world/lander.hpp - a landing: simulates the vehicle, then reads its sensors, with effects
// hidden where asked.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "world/effect.hpp"
#include "world/lander_dynamics.hpp"

namespace rim::world {

constexpr double kLanderStep_s = 0.05; // 20 Hz

// The truth of one row.
struct LanderRow {
  double t_s = 0.0;
  std::array<double, kEngines> throttle{}; // commanded for the step that begins here
  std::array<double, kSensors> sensor{};   // what perfect sensors would show
  Quantities quantity{};
  bool acts = false; // an effect on the physics acts during the step
};

struct LanderRun {
  std::vector<LanderRow> rows;
  // readings: rows x sensors, with errors, effects and resolution
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> readings;
  std::vector<std::uint8_t> acts; // rows on which any effect acts
  double ignition_s = 0.0;
  double touchdown_velocity_mps[3] = {0.0, 0.0, 0.0};
};

// The same (params, effects, seed, run) give the same run, bit by bit on one machine and compiler.
// Throws DataError where the parameters lead to no touchdown within kMaxLanderRows rows.
LanderRun simulate_lander(const LanderParams &params, const std::vector<Effect> &effects,
                          std::uint64_t seed, std::uint64_t run);

constexpr std::size_t kMaxLanderRows = 20000;

// Names of the log's columns after t_s: u.throttle_1.., s.position_x_m, ...
std::vector<std::string> lander_columns();

// Fills readings and the sensors' part of acts.
void read_lander_sensors(const LanderParams &params, const std::vector<Effect> &effects,
                         std::uint64_t seed, std::uint64_t run, LanderRun &result);

} // namespace rim::world
