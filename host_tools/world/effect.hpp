// SPDX-License-Identifier: MIT
// world/effect.hpp - effects hidden in a simulated flight: what the TOML files of data/effects/
// say (data/README.md has the schema).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "world/lander_params.hpp"
#include "world/random.hpp"

namespace rim::world {

// True quantities of a row that gates may refer to, in the order of quantity_names().
enum class Quantity {
  time_s,
  altitude_m,
  speed_mps,
  velocity_x_mps,
  velocity_y_mps,
  velocity_z_mps,
  downrange_m,
  thrust,    // delivered flow, mean of the engines, share of full
  thrusting, // 0 or 1
};
constexpr std::size_t kQuantities = 9;
const std::array<std::string, kQuantities> &quantity_names();
using Quantities = std::array<double, kQuantities>;

enum class EffectKind {
  bias,           // adds size
  gain,           // adds size * true value
  drift,          // adds size * seconds since the gate first opened
  noise,          // raises the white noise's variance by the share size
  dropout,        // reads exactly 0, each row with probability size
  stuck,          // share size of the rows repeats an earlier reading, hold_rows at a time
  delay,          // shows what it would have shown size seconds ago
  cross_coupling, // adds size * thrust (share of full)
  thrust_loss,    // physics: engine's flow falls by the share size
  isp_loss,       // physics: engine's thrust per flow falls by the share size
  misalignment,   // physics: the engine frame tilts by size rad about an axis
};

// A closed gate passes no row; a term acts where every one of its gates holds.
struct EffectGate {
  Quantity quantity;
  std::vector<std::array<double, 2>> intervals; // closed; one of them must hold the quantity
};

struct EffectTerm {
  EffectKind kind = EffectKind::bias;
  std::size_t sensor = kSensors; // kSensors for physics
  std::size_t engine = kEngines; // thrust_loss, isp_loss; kEngines: all
  std::size_t axis = 0;          // misalignment: 0 about x, 1 about y
  std::size_t hold_rows = 0;     // stuck
  double multiple = 0.0;
  double dispersion = 0.0; // in the unit of size
  std::vector<EffectGate> gates;

  double size() const { return multiple * dispersion; }
  bool is_physics() const { return sensor == kSensors; }
  bool is_open(const Quantities &truth) const;
};

struct Effect {
  std::string path, name, description;
  std::vector<EffectTerm> terms;
};

// Throws DataError naming file, line and key.
Effect read_effect(const std::string &path, const LanderParams &params);

} // namespace rim::world
