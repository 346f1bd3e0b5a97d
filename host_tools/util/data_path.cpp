// SPDX-License-Identifier: MIT
#include "util/data_path.hpp"

#include "util/error.hpp"

#include <cstdlib>
#include <filesystem>
#include <vector>

namespace rim {

namespace fs = std::filesystem;

namespace {

std::string find(const std::string &name, const char *variable, const char *source_folder) {
  std::vector<fs::path> places;
  std::error_code ignored;
  if (const char *set = std::getenv(variable); set != nullptr && *set != '\0') {
    places.emplace_back(set);
  } else {
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    if (!program.empty())
      places.push_back(program.parent_path().parent_path() / "share/rimwatch");
    places.push_back(fs::path(RIM_SOURCE_DIR) / source_folder);
    places.emplace_back(RIM_PREFIX "/share/rimwatch");
  }
  std::string looked;
  for (const auto &place : places) {
    if (fs::exists(place / name, ignored))
      return (place / name).string();
    looked += (looked.empty() ? "" : ", ") + place.string();
  }
  throw DataError(name + ": not found in " + looked + " (" + variable + " names another folder)");
}

} // namespace

std::string data_path(const std::string &name) { return find(name, "RIM_DATA", "data"); }

std::string readers_path() {
  return find("readers", "RIM_READERS", "host_tools/python/src/rimwatch");
}

} // namespace rim
