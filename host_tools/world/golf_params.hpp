// SPDX-License-Identifier: MIT
// world/golf_params.hpp - parameters of the golf world: data/golf.toml, a user's file laid over it.
#pragma once

#include "world/golf.hpp"

#include <string>

namespace rim::world {

// Reads `base` (which must be complete) and lays `overlay` (any part of it; empty: none) over it.
// Throws DataError naming file, line and key.
GolfParams read_golf_params(const std::string &base, const std::string &overlay = "");

// The same parameters as TOML, readable as --params.
std::string golf_params_toml(const GolfParams &params);

} // namespace rim::world
