// SPDX-License-Identifier: MIT
#include "log/units.hpp"

#include <algorithm>
#include <iterator>

namespace rim {

namespace {

constexpr double kFoot = 0.3048, kPound = 0.45359237, kDegree = 0.017453292519943295;
constexpr double kGravity = 9.80665, kKnot = 1852.0 / 3600.0, kTurn = 360.0 * kDegree;
constexpr double kPoundForce = kPound * kGravity;

constexpr Unit kUnits[] = {{"m", "length", 1.0, ""},
                           {"km", "length", 1e3, ""},
                           {"cm", "length", 1e-2, "m"},
                           {"mm", "length", 1e-3, ""},
                           {"ft", "length", kFoot, "m"},
                           {"feet", "length", kFoot, "m"},
                           {"in", "length", kFoot / 12.0, "mm"},
                           {"m/s", "speed", 1.0, ""},
                           {"km/h", "speed", 1.0 / 3.6, ""},
                           {"cm/s", "speed", 1e-2, "m/s"},
                           {"mm/s", "speed", 1e-3, ""},
                           {"kn", "speed", kKnot, ""},
                           {"kt", "speed", kKnot, "m/s"},
                           {"kts", "speed", kKnot, "m/s"},
                           {"knots", "speed", kKnot, "m/s"},
                           {"mph", "speed", 5280.0 * kFoot / 3600.0, "m/s"},
                           {"ft/s", "speed", kFoot, "m/s"},
                           {"m/s^2", "acceleration", 1.0, ""},
                           {"g0", "acceleration", kGravity, ""},
                           {"mG", "acceleration", 1e-3 * kGravity, "m/s^2"},
                           {"rad", "angle", 1.0, ""},
                           {"mrad", "angle", 1e-3, "rad"},
                           {"deg", "angle", kDegree, ""},
                           {"rad/s", "rate", 1.0, ""},
                           {"deg/s", "rate", kDegree, ""},
                           {"rpm", "rate", kTurn / 60.0, ""},
                           {"Pa", "pressure", 1.0, ""},
                           {"hPa", "pressure", 1e2, "kPa"},
                           {"mbar", "pressure", 1e2, "kPa"},
                           {"kPa", "pressure", 1e3, ""},
                           {"MPa", "pressure", 1e6, ""},
                           {"bar", "pressure", 1e5, ""},
                           {"psi", "pressure", kPoundForce / (kFoot * kFoot / 144.0), "kPa"},
                           {"N", "force", 1.0, ""},
                           {"kN", "force", 1e3, ""},
                           {"lbf", "force", kPoundForce, ""},
                           {"kg", "mass", 1.0, ""},
                           {"g", "mass", 1e-3, ""},
                           {"lb", "mass", kPound, "kg"},
                           {"V", "voltage", 1.0, ""},
                           {"mV", "voltage", 1e-3, ""},
                           {"A", "current", 1.0, ""},
                           {"mA", "current", 1e-3, ""},
                           {"W", "power", 1.0, ""},
                           {"kW", "power", 1e3, ""},
                           {"kg/s", "flow", 1.0, ""},
                           {"kg/h", "flow", 1.0 / 3600.0, ""},
                           {"lb/h", "flow", kPound / 3600.0, ""},
                           {"L/min", "volume flow", 1.0, ""},
                           {"m^3/h", "volume flow", 1000.0 / 60.0, ""},
                           {"L/s", "volume flow", 60.0, ""},
                           {"s", "time", 1.0, ""},
                           {"ms", "time", 1e-3, ""},
                           {"us", "time", 1e-6, ""},
                           {"J", "energy", 1.0, ""},
                           {"Wh", "energy", 3600.0, ""},
                           {"kWh", "energy", 3.6e6, ""},
                           {"degC", "temperature", 1.0, ""},
                           {"K", "temperature", 1.0, "", -273.15},
                           {"degF", "temperature", 5.0 / 9.0, "", -160.0 / 9.0}};

} // namespace

const std::vector<Unit> &known_units() {
  static const std::vector<Unit> units(std::begin(kUnits), std::end(kUnits));
  return units;
}

const Unit *find_unit(const std::string &text) {
  const std::vector<Unit> &units = known_units();
  const auto found =
      std::find_if(units.begin(), units.end(), [&](const Unit &u) { return text == u.text; });
  return found == units.end() ? nullptr : &*found;
}

} // namespace rim
