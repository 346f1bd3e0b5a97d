// SPDX-License-Identifier: MIT
// cli/arguments.hpp - CLI11 with the exit codes of this program.
#pragma once

#include "util/error.hpp"

#include <CLI/CLI.hpp>

namespace rim {

// False when help was asked for and printed: return EXIT_FINE then. A wrong command line throws
// UsageError.
inline bool parse_arguments(CLI::App &app, int argc, char **argv) {
  try {
    app.parse(argc, argv);
    return true;
  } catch (const CLI::ParseError &e) {
    if (e.get_exit_code() != 0)
      throw UsageError(e.what());
    app.exit(e);
    return false;
  }
}

} // namespace rim
