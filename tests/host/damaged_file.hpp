// SPDX-License-Identifier: MIT
// A shipped parameter file with one passage replaced, in a folder of its own: its reader must
// refuse it, and say why.
#pragma once

#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <unistd.h>

// Whether read(path) throws a DataError that holds `reason`, with `from` replaced by `to` in
// data/NAME. False, and the error told, where the passage is not there or the reason is another.
template <class Read>
bool refuses_damage(const char *name, const std::string &from, const std::string &to,
                    const char *reason, const Read &read) {
  std::string text = rim::read_file(rim::data_path(name));
  const std::size_t at = text.find(from);
  if (at == std::string::npos)
    return false;
  text.replace(at, from.size(), to);
  char folder[] = "/tmp/rim_damaged_XXXXXX";
  if (mkdtemp(folder) == nullptr)
    return false;
  const std::string path = std::string(folder) + "/" + name;
  rim::AtomicFile file(path);
  file.write(text);
  file.commit();
  bool refused = false;
  try {
    read(path);
  } catch (const rim::DataError &error) {
    refused = std::string(error.what()).find(reason) != std::string::npos;
    if (!refused)
      std::fprintf(stderr, "%s\n", error.what());
  }
  std::remove(path.c_str());
  rmdir(folder);
  return refused;
}
