// SPDX-License-Identifier: MIT
// util/utf8.hpp - text of other encodings as UTF-8, in which all text here is.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace rim {

// Bytes of the UTF-8 sequence that the text begins with; 0 where it begins with none (overlong
// forms and surrogates are none).
std::size_t utf8_length(std::string_view text);

// The same text in UTF-8. With the byte order mark of UTF-16 it is taken for UTF-16 ("Unicode text"
// of a spreadsheet); elsewhere a byte that is no UTF-8 is taken for a letter of Latin-1 (loggers
// and spreadsheets of Europe). Half a surrogate pair becomes U+FFFD. O(bytes).
std::string as_utf8(std::string text);

// The text with Latin letters' accents taken off (o for o umlaut): for names that may hold ASCII
// alone. Other letters beyond ASCII stay.
std::string without_accents(std::string_view text);

} // namespace rim
