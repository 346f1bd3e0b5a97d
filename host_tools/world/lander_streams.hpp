// SPDX-License-Identifier: MIT
// world/lander_streams.hpp - purposes of the lander's random streams: one each, so that no draw
// shifts another.
#pragma once

#include <cstdint>

namespace rim::world {

constexpr std::uint64_t kBodyStream = 1;
constexpr std::uint64_t kVehicleStream = 2;
constexpr std::uint64_t kEngineStream = 3;
constexpr std::uint64_t kInitialStream = 4;
constexpr std::uint64_t kGuidanceStream = 5;
constexpr std::uint64_t kNavigationStream = 6;
constexpr std::uint64_t kProcessStream = 7;
constexpr std::uint64_t kSensorRunStream = 100;   // + sensor: what it keeps for the run
constexpr std::uint64_t kSensorNoiseStream = 200; // + sensor: white noise
constexpr std::uint64_t kEffectStream = 1000;     // + number of the effect's term

} // namespace rim::world
