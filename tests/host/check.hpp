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
// CMocka's macro fail() breaks the standard streams and every member of this name.
#undef fail
#undef fail_msg
#define fail_msg(...)                                                                              \
  do {                                                                                             \
    print_error("ERROR: ");                                                                        \
    print_error(__VA_ARGS__);                                                                      \
    print_error("\n");                                                                             \
    _fail(__FILE__, __LINE__);                                                                     \
  } while (0)

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
