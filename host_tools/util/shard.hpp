// SPDX-License-Identifier: MIT
// util/shard.hpp - a part I/N of numbered work, as `--shard I/N` says it.
#pragma once

#include <cstdint>
#include <string>

namespace rim {

// Owns the units i with i % count == index - 1.
struct Shard {
  std::uint64_t index = 1; // 1..count
  std::uint64_t count = 1;
  bool owns(std::uint64_t unit) const { return unit % count == index - 1; }
};

// "2/5"; UsageError otherwise.
Shard parse_shard(const std::string &text);

} // namespace rim
