// SPDX-License-Identifier: MIT
// program.hpp - what the programs of this folder do alike with a command line and with errors.
#pragma once

#include <cstdio>
#include <exception>

#include "cli/arguments.hpp"

// run(): the program behind its arguments, which it declares and parses itself. Exit 2 for a wrong
// command line, 3 for anything else that is wrong.
template <typename Run> int run_as(const char *name, const Run &run) {
  try {
    return run();
  } catch (const rim::UsageError &e) {
    std::fprintf(stderr, "%s: %s\n", name, e.what());
    return 2;
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s: %s\n", name, e.what());
    return 3;
  }
}
