// SPDX-License-Identifier: MIT
// check.hpp - CMocka as a test of C++ needs it, and what several tests ask in its terms.
#pragma once

#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <string>

#include "util/error.hpp"

extern "C" {
#include <cmocka.h>
}
// CMocka's macro of this name breaks the standard streams; tests say why they fail, by fail_msg().
#undef fail

// Whether a text holds a part; prints the text where it does not.
inline bool has(const std::string &text, const std::string &part) {
  if (text.find(part) != std::string::npos)
    return true;
  print_message("'%s' not in:\n%s\n", part.c_str(), text.c_str());
  return false;
}

// The error by which a call refuses data, or "usage: " and the error by which it refuses its
// arguments; empty where it returns.
template <typename Call> std::string refusal(const Call &call) {
  try {
    call();
  } catch (const rim::DataError &error) {
    return error.what();
  } catch (const rim::UsageError &error) {
    return std::string("usage: ") + error.what();
  }
  return "";
}
