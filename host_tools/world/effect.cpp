// SPDX-License-Identifier: MIT
#include "world/effect.hpp"

#include <algorithm>

namespace rim::world {

const std::array<std::string, kQuantities> &quantity_names() {
  static const std::array<std::string, kQuantities> names = {
      "time_s",         "altitude_m",  "speed_mps", "velocity_x_mps", "velocity_y_mps",
      "velocity_z_mps", "downrange_m", "thrust",    "thrusting"};
  return names;
}

bool EffectTerm::is_open(const Quantities &truth) const {
  return std::all_of(gates.begin(), gates.end(), [&truth](const EffectGate &gate) {
    const double value = truth[static_cast<std::size_t>(gate.quantity)];
    return std::any_of(gate.intervals.begin(), gate.intervals.end(),
                       [value](const std::array<double, 2> &interval) {
                         return value >= interval[0] && value <= interval[1];
                       });
  });
}

} // namespace rim::world
