// SPDX-License-Identifier: MIT
// bus/can_table.hpp - compiles the table of CAN signals (rim/can_table.h) of a flight image from a
// DBC.
//
//   schema = "rim-can/1"
//   trigger = "State"              # message that completes a row; default: the last to arrive
//   time = "State.Clock"           # signal that carries the time; default: time of reception
//   time_scale = 0.001             # seconds per unit of that signal
//   [[signal]]
//   name = "s.altitude_m"          # of the model: a feature; with own predictions also z. m. sd.
//   from = "State.Altitude"        # MESSAGE.SIGNAL of the DBC
//   scale = 0.3048
//   offset = 0                     # value = scale * physical + offset
//   min = 0
//   max = 20000                    # a value outside is refused and counted
//
// A value that the map does not name is taken from the one signal of the same name with '_' for
// '.': s_altitude_m.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <optional>

#include "bus/dbc.hpp"
#include "image/image_writer.hpp"
#include "log/log.hpp"
#include "rim/image.h"

namespace rim {

// The names of the values of a row, in order: the features; with external predictions then
// outcomes, means and standard deviations. DataError where the image carries no names.
std::vector<std::string> row_names(const rim_image &image, const std::string &name);

// The bytes of the section. map: path of the TOML, empty: by name alone. DataError names the file
// and line of what is wrong, or the value that has no signal.
std::vector<std::uint8_t> compile_can_table(const Dbc &dbc, const std::string &map,
                                            const std::vector<std::string> &names);

// The image with the section in it; one that it had is replaced. The model id stays.
std::vector<std::uint8_t> with_can_table(const rim_image &image,
                                         const std::vector<std::uint8_t> &table);

// The section's bytes; empty: the image has none.
std::vector<std::uint8_t> can_table_of(const rim_image &image);

// What a log of CAN frames is read by; nothing where the image has no table. DataError as
// row_names().
std::optional<CanReading> can_reading(const rim_image &image, const std::string &name);

} // namespace rim
