// SPDX-License-Identifier: MIT
// fuzz_ground.hpp - every reader of a file on the ground, behind one function of bytes.
//
// The first byte chooses the reader, the rest is its file. A reader takes it or throws DataError
// (or UsageError): anything else that it throws ends the program, as a crash does.
#pragma once

#include "base/bytes.h"
#include "base/crc.h"
#include "bus/can_table.hpp"
#include "bus/dbc.hpp"
#include "diagnose/catalogue.hpp"
#include "diagnose/extension.hpp"
#include "image/image_writer.hpp"
#include "image/names.hpp"
#include "log/log.hpp"
#include "log/schema.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/effect.hpp"
#include "world/lander.hpp"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

#define FUZZ_GROUND_READERS 9

namespace rim::fuzz {

// A file of these bytes that is in memory alone.
class MemoryFile {
public:
  MemoryFile(const std::uint8_t *data, std::size_t bytes) : fd_(::memfd_create("fuzz", 0)) {
    if (fd_ < 0 || ::write(fd_, data, bytes) != static_cast<ssize_t>(bytes))
      std::abort();
  }
  ~MemoryFile() { ::close(fd_); }
  MemoryFile(const MemoryFile &) = delete;
  MemoryFile &operator=(const MemoryFile &) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

private:
  int fd_;
};

// Both check sums right: what is behind them is looked at.
inline std::string repaired(std::string image) {
  auto *bytes = reinterpret_cast<std::uint8_t *>(image.data());
  if (image.size() < 64)
    return image;
  (void)rimi_le_put_u32(bytes + 16, static_cast<std::uint32_t>(image.size()));
  (void)rimi_le_put_u32(bytes + 20, rimi_crc32(0, bytes + 64, image.size() - 64));
  (void)rimi_le_put_u32(bytes + 32, 0);
  (void)rimi_le_put_u32(bytes + 32, rimi_crc32(0, bytes, 64));
  return image;
}

inline void read_image(const std::string &bytes) {
  const LoadedImage image(bytes, "image");
  const Names names = names_of_image(image.view(), "image");
  for (std::size_t i = 0; i < 3; ++i)
    if (names.feature(i).name.empty() && names.outcome(i).name.empty())
      std::fputs("", stdout);
  (void)can_table_of(image.view());
  (void)can_reading(image.view(), "image");
}

inline void read_any_log(const std::string &path, const Schema *schema) {
  static std::FILE *const nowhere = std::fopen("/dev/null", "w");
  ReadOptions options;
  options.warnings = nowhere;
  options.skip_bad_time = true;
  options.observation_names = {"u.push", "s.speed_mps"};
  const Log log = read_log(path, schema, options);
  for (std::size_t i = 0; i < log.t_s.size(); ++i) // what was read is what the header promises
    if (!(log.t_s[i] - log.t_s[i] == 0.0) || (i > 0 && !(log.t_s[i] > log.t_s[i - 1])) ||
        log.row.size() != log.t_s.size())
      std::abort();
}

inline void read_ground(unsigned reader, const std::uint8_t *data, std::size_t bytes) {
  const MemoryFile file(data, bytes);
  const std::string path = file.path();
  const std::string text(reinterpret_cast<const char *>(data), bytes);
  switch (reader) {
  case 0:
    return read_any_log(path, nullptr);
  case 1: {
    const Schema schema = read_schema(path);
    (void)schema;
    return;
  }
  case 2:
    (void)read_dbc(path);
    return;
  case 3: {
    Dbc dbc;
    (void)compile_can_table(dbc, path, {"u.push", "s.speed_mps"});
    return;
  }
  case 4:
    (void)diagnose::read_catalogue(path);
    return;
  case 5:
    (void)diagnose::read_extension(path);
    return;
  case 6: {
    static const world::LanderParams params = world::read_lander_params(data_path("lander.toml"));
    (void)world::read_effect(path, params);
    return;
  }
  case 7:
    return read_image(text);
  default:
    return read_image(repaired(text));
  }
}

// Returns whether the reader took it.
inline bool one_file(const std::uint8_t *data, std::size_t bytes) {
  if (bytes == 0)
    return false;
  try {
    read_ground(data[0] % FUZZ_GROUND_READERS, data + 1, bytes - 1);
    return true;
  } catch (const DataError &) {
    return false;
  } catch (const UsageError &) {
    return false;
  }
}

} // namespace rim::fuzz
