// SPDX-License-Identifier: MIT
#include "util/utf8.hpp"

#include <algorithm>

namespace rim {

namespace {

void append(std::string *out, unsigned code) {
  const auto put = [out](unsigned byte) { *out += static_cast<char>(byte); };
  if (code < 0x80u) {
    put(code);
  } else if (code < 0x800u) {
    put(0xc0u | code >> 6);
    put(0x80u | (code & 0x3fu));
  } else if (code < 0x10000u) {
    put(0xe0u | code >> 12);
    put(0x80u | (code >> 6 & 0x3fu));
    put(0x80u | (code & 0x3fu));
  } else {
    put(0xf0u | code >> 18);
    put(0x80u | (code >> 12 & 0x3fu));
    put(0x80u | (code >> 6 & 0x3fu));
    put(0x80u | (code & 0x3fu));
  }
}

// Behind the byte order mark; `low` is the place of the less significant byte of a pair.
std::string of_utf16(std::string_view text, std::size_t low) {
  std::string out;
  const auto unit = [&](std::size_t at) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[at + i]); };
    return static_cast<unsigned>(byte(low) | byte(1 - low) << 8);
  };
  for (std::size_t at = 2; at + 1 < text.size(); at += 2) {
    unsigned code = unit(at);
    const bool first = code >= 0xd800u && code < 0xdc00u, half = code >= 0xd800u && code < 0xe000u;
    const unsigned next = first && at + 3 < text.size() ? unit(at + 2) : 0u;
    if (next >= 0xdc00u && next < 0xe000u) {
      code = 0x10000u + ((code - 0xd800u) << 10) + (next - 0xdc00u);
      at += 2;
    } else if (half) {
      code = 0xfffdu;
    }
    append(&out, code);
  }
  return out;
}

} // namespace

std::size_t utf8_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned first = byte(0);
  const auto follows = [&byte](std::size_t i) { return (byte(i) & 0xc0u) == 0x80u; };
  if (first < 0x80u)
    return 1;
  if (first >= 0xc2u && first < 0xe0u)
    return follows(1) ? 2 : 0;
  if (first >= 0xe0u && first < 0xf0u) {
    const bool overlong = first == 0xe0u && byte(1) < 0xa0u;
    const bool surrogate = first == 0xedu && byte(1) >= 0xa0u;
    return follows(1) && follows(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xf0u && first < 0xf5u) {
    const bool outside =
        (first == 0xf0u && byte(1) < 0x90u) || (first == 0xf4u && byte(1) >= 0x90u);
    return follows(1) && follows(2) && follows(3) && !outside ? 4 : 0;
  }
  return 0;
}

std::string as_utf8(std::string text) {
  const std::string_view mark = std::string_view(text).substr(0, 2);
  if (mark == "\xff\xfe" || mark == "\xfe\xff")
    return of_utf16(text, mark[0] == '\xff' ? 0 : 1);
  std::string out;
  std::size_t done = 0;
  for (std::size_t at = 0; at < text.size();) {
    const bool ascii = static_cast<unsigned char>(text[at]) < 0x80u;
    const std::size_t length = ascii ? 1 : utf8_length(std::string_view(text).substr(at, 4));
    if (length == 0) {
      out.append(text, done, at - done);
      append(&out, static_cast<unsigned char>(text[at]));
      done = at + 1;
    }
    at += std::max<std::size_t>(1, length);
  }
  return done == 0 ? text : out.append(text, done);
}

std::string without_accents(std::string_view text) {
  // U+00C0 to U+00FF, whose UTF-8 is the byte C3 and one of 80 to BF.
  static constexpr std::string_view kBare =
      "AAAAAAACEEEEIIIIDNOOOOOxOUUUUYTsaaaaaaaceeeeiiiidnooooo/ouuuuyty";
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool accented = text[at] == '\xc3' && at + 1 < text.size();
    if (accented)
      ++at;
    out += accented ? kBare[static_cast<unsigned char>(text[at]) & 0x3fu] : text[at];
  }
  return out;
}

} // namespace rim
