// SPDX-License-Identifier: MIT
// bus/model_dbc.hpp - the DBC of the alarms of one image on one node.
#pragma once

#include <cstdint>
#include <string>

#include "image/facts.hpp"

namespace rim {

// The shipped rim.dbc, or rim_fd.dbc, with the identifiers of this node, and with value tables that
// name the image's outcomes and features with their units. DataError where it is not installed.
std::string model_dbc(const ImageFacts &facts, unsigned node, bool fd);

} // namespace rim
