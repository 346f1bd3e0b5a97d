// SPDX-License-Identifier: MIT
// cli/describe.hpp - help, man pages and completion of the shells, from what a command declares.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace rim {

// What Arguments::parse() prints instead of parsing. Set by run_program().
enum class Describe { nothing, man, words };
Describe &describing();

// Metavariables as a person writes them: "--runs N", not "UINT:INT in [1 - 1000000]".
void use_plain_help(CLI::App *app);

// Section 1 of the manual, in troff.
std::string man_page(const CLI::App &app);
// A line each: an option with what it takes, "--out MODEL.rim", a flag alone, "--quick".
std::string option_words(const CLI::App &app);

// Scripts that complete the commands and their options; options: a text of option_words() each.
struct CommandWords {
  std::string name, summary, options;
};
std::string bash_completion(const std::string &program, const std::vector<CommandWords> &commands);
std::string zsh_completion(const std::string &program, const std::vector<CommandWords> &commands);

// The known word that is nearest to the given one, in quotes after "; did you mean"; empty where
// none is near. O(words * letters^2).
std::string did_you_mean(const std::string &given, const std::vector<std::string> &known);
// Of an option that an app does not know.
std::string unknown_option(const CLI::App &app, const std::string &given);

} // namespace rim
