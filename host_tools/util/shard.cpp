// SPDX-License-Identifier: MIT
#include "util/shard.hpp"

#include <charconv>

#include "util/error.hpp"

namespace rim {

namespace {

bool parse_whole(const std::string &s, std::uint64_t &value) {
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  return error == std::errc() && end == s.data() + s.size() && !s.empty();
}

} // namespace

Shard parse_shard(const std::string &text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos || !parse_whole(text.substr(0, slash), shard.index) ||
      !parse_whole(text.substr(slash + 1), shard.count) || shard.index < 1 ||
      shard.index > shard.count)
    throw UsageError("--shard " + text + ": expected I/N with 1 <= I <= N");
  return shard;
}

} // namespace rim
