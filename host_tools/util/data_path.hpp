// SPDX-License-Identifier: MIT
// util/data_path.hpp - where the files of data/ are on this machine.
#pragma once

#include <string>

namespace rim {

// The path of data/NAME ("lander.toml"): in $RIM_DATA when that is set; else beside an installed
// program (../share/rimwatch), in the source tree, in PREFIX/share/rimwatch. DataError naming the
// places when it is in none.
std::string data_path(const std::string &name);

// The path of a file of the source tree that this program was built from ("lib/wire"); it need not
// exist.
std::string source_path(const std::string &relative);

} // namespace rim
