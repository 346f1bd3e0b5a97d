// SPDX-License-Identifier: MIT
#include "replay/unit_check.hpp"

#include <cmath>

namespace rim {

namespace {

constexpr std::size_t kLeastBlocks = 10;
constexpr double kAlike = 0.1;     // by which a factor may differ from that of a unit
constexpr double kLeftOver = 0.10; // share of the readings' squares that the factor may leave

// Units of one kind, and how many of the kind's first one they are.
struct KnownUnit {
  const char *text, *kind;
  double value;
};
constexpr double kDegree = 0.017453292519943295;
constexpr KnownUnit kUnits[] = {
    {"m", "length", 1.0},        {"km", "length", 1e3},       {"cm", "length", 1e-2},
    {"mm", "length", 1e-3},      {"ft", "length", 0.3048},    {"m/s", "speed", 1.0},
    {"km/h", "speed", 1 / 3.6},  {"mm/s", "speed", 1e-3},     {"kn", "speed", 0.514444},
    {"ft/s", "speed", 0.3048},   {"m/s^2", "accel", 1.0},     {"g0", "accel", 9.80665},
    {"rad", "angle", 1.0},       {"deg", "angle", kDegree},   {"rad/s", "rate", 1.0},
    {"deg/s", "rate", kDegree},  {"rpm", "rate", 0.10471976}, {"Pa", "pressure", 1.0},
    {"kPa", "pressure", 1e3},    {"MPa", "pressure", 1e6},    {"bar", "pressure", 1e5},
    {"psi", "pressure", 6894.8}, {"N", "force", 1.0},         {"kN", "force", 1e3},
    {"lbf", "force", 4.4482},    {"kg", "mass", 1.0},         {"g", "mass", 1e-3},
    {"lb", "mass", 0.45359},     {"V", "voltage", 1.0},       {"mV", "voltage", 1e-3},
    {"A", "current", 1.0},       {"mA", "current", 1e-3},     {"W", "power", 1.0},
    {"kW", "power", 1e3},        {"kg/s", "flow", 1.0},       {"lb/h", "flow", 1.25998e-4},
    {"L/min", "volume", 1.0},    {"m^3/h", "volume", 16.667}, {"L/s", "volume", 60.0},
    {"s", "time", 1.0},          {"ms", "time", 1e-3},        {"us", "time", 1e-6},
    {"J", "energy", 1.0},        {"Wh", "energy", 3600.0},    {"kWh", "energy", 3.6e6}};

// The unit beside which readings in `unit` are taken for `factor` times as much; NULL: none.
const char *unit_instead(const std::string &unit, double factor) {
  for (const KnownUnit &own : kUnits) {
    for (const KnownUnit &other : kUnits) {
      if (unit == own.text && own.kind == std::string(other.kind) && &own != &other &&
          std::abs(factor * other.value / own.value - 1.0) < kAlike)
        return other.text;
    }
  }
  return nullptr;
}

} // namespace

void UnitCheck::add(const Eigen::VectorXd &measured, const Eigen::VectorXd &expected) {
  for (std::size_t o = 0; o < sums_.size(); ++o) {
    const double m = measured[static_cast<Eigen::Index>(o)];
    const double e = expected[static_cast<Eigen::Index>(o)];
    sums_[o].readings += m * m;
    sums_[o].products += m * e;
    sums_[o].expected += e * e;
  }
  ++blocks_;
}

std::vector<OtherUnit> UnitCheck::found(const Names &names) const {
  std::vector<OtherUnit> others;
  for (std::size_t o = 0; o < sums_.size() && blocks_ >= kLeastBlocks; ++o) {
    const Sums &s = sums_[o];
    const double factor = s.products / s.expected;
    const double left = s.readings - factor * s.products;
    if (!std::isfinite(factor) || !(left <= kLeftOver * s.readings))
      continue;
    const char *other = unit_instead(names.outcome(static_cast<std::uint16_t>(o)).unit, factor);
    if (other != nullptr)
      others.push_back({o, factor, other});
  }
  return others;
}

} // namespace rim
