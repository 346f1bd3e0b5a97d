// SPDX-License-Identifier: MIT
// util/data_path.hpp - where the files of data/ are on this machine.
#pragma once

#include <string>

namespace rim {

// The path of data/NAME ("lander.toml"): in $RIM_DATA when that is set; else beside an installed
// program (../share/rimwatch), in the source tree, in PREFIX/share/rimwatch. DataError naming the
// places when it is in none.
std::string data_path(const std::string &name);

// The folder of the programs in Python that read other formats; RIM_READERS names its parent.
std::string readers_path();

} // namespace rim
