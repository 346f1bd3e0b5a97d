// SPDX-License-Identifier: MIT
#include "util/data_path.hpp"

#include "util/error.hpp"

#include <cstdlib>
#include <filesystem>
#include <vector>

namespace rim {

namespace fs = std::filesystem;

std::string source_path(const std::string &relative) { return RIM_SOURCE_DIR "/" + relative; }

std::string data_path(const std::string &name) {
  std::vector<fs::path> places;
  std::error_code ignored;
  if (const char *set = std::getenv("RIM_DATA"); set != nullptr && *set != '\0') {
    places.emplace_back(set);
  } else {
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    if (!program.empty())
      places.push_back(program.parent_path().parent_path() / "share/rimwatch");
    places.emplace_back(source_path("data"));
    places.emplace_back(RIM_PREFIX "/share/rimwatch");
  }
  std::string looked;
  for (const auto &place : places) {
    if (fs::exists(place / name, ignored))
      return (place / name).string();
    looked += (looked.empty() ? "" : ", ") + place.string();
  }
  throw DataError(name + ": not found in " + looked + " (RIM_DATA names another folder)");
}

} // namespace rim
