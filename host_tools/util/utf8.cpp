// SPDX-License-Identifier: MIT
#include "util/utf8.hpp"

#include <iconv.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "util/error.hpp"

namespace rim {

namespace {

// With its byte order mark, by the C library. What is no letter, half a surrogate pair, becomes
// U+FFFD; a single byte at the end is dropped. Two bytes become at most three.
std::string of_utf16(std::string text) {
  const iconv_t to_utf8 = iconv_open("UTF-8", "UTF-16");
  if (to_utf8 == reinterpret_cast<iconv_t>(-1))
    throw DataError("the C library of this machine does not read UTF-16");
  std::string out(text.size() / 2 * 3 + 3, '\0');
  char *in = &text[0], *to = &out[0];
  std::size_t left = text.size(), room = out.size();
  while (iconv(to_utf8, &in, &left, &to, &room) == static_cast<std::size_t>(-1) &&
         (errno == EILSEQ || errno == EINVAL) && left >= 2) {
    to = std::copy_n("\xef\xbf\xbd", 3, to);
    room -= 3;
    in += 2;
    left -= 2;
  }
  iconv_close(to_utf8);
  out.resize(out.size() - room);
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
    return of_utf16(std::move(text));
  std::string out;
  std::size_t done = 0;
  for (std::size_t at = 0; at < text.size();) {
    const bool ascii = static_cast<unsigned char>(text[at]) < 0x80u;
    const std::size_t length = ascii ? 1 : utf8_length(std::string_view(text).substr(at, 4));
    if (length == 0) {
      out.append(text, done, at - done);
      const auto letter = static_cast<unsigned char>(text[at]); // of Latin-1, 0x80 to 0xff
      out += static_cast<char>(0xc0u | letter >> 6);
      out += static_cast<char>(0x80u | (letter & 0x3fu));
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
