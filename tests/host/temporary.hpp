// SPDX-License-Identifier: MIT
// Files for a test, in a folder of its program alone that goes when the program ends.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

inline const std::filesystem::path &temporary_folder() {
  static const struct Folder {
    std::filesystem::path path;
    Folder() {
      char name[] = "/tmp/rim_test_XXXXXX";
      if (mkdtemp(name) == nullptr)
        throw std::runtime_error("no temporary folder");
      path = name;
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  } folder;
  return folder.path;
}

// The path of a file of this name there, whether it exists or not.
inline std::string temporary_path(const std::string &name) { return temporary_folder() / name; }

// The path of a new file with this text.
inline std::string temporary_file(const std::string &text) {
  static int count = 0;
  const std::string path = temporary_folder() / ("file" + std::to_string(++count));
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush())
    throw std::runtime_error(path + ": cannot be written");
  return path;
}
