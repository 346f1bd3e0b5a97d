// SPDX-License-Identifier: MIT
// cli/arguments.hpp - CLI11 with the exit codes of this program.
#pragma once

#include "cli/describe.hpp"
#include "util/error.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

namespace rim {

// False when help, or another description, was asked for and printed: return EXIT_FINE then. A
// wrong command line throws UsageError.
inline bool parse_arguments(CLI::App &app, int argc, char **argv) {
  use_plain_help(&app);
  if (describing() != Describe::nothing) {
    const std::string text = describing() == Describe::man ? man_page(app) : option_words(app);
    std::fputs(text.c_str(), stdout);
    return false;
  }
  // An option that is not known comes before what else is missing.
  const auto stray = [&]() -> std::string {
    for (const std::string &word : app.remaining())
      if (word.size() > 1 && word[0] == '-' && (word[1] < '0' || word[1] > '9'))
        return word;
    return "";
  };
  try {
    app.parse(argc, argv);
    return true;
  } catch (const CLI::ParseError &e) {
    const bool left_over = e.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                           e.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
    if (left_over && !stray().empty())
      throw UsageError(unknown_option(app, stray()));
    if (e.get_exit_code() != 0)
      throw UsageError(e.what());
    app.exit(e);
    return false;
  }
}

} // namespace rim
