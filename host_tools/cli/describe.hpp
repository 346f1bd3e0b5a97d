// SPDX-License-Identifier: MIT
// cli/describe.hpp - help, man pages and completion of the shells, from what a command declares.
#pragma once

#include <string>
#include <vector>

namespace rim {

// What Arguments::parse() prints instead of parsing. Set by run_program().
enum class Describe { nothing, man, words };
Describe &describing();

// One option of a command, or one argument by position.
struct OptionWords {
  std::string name;  // "--out", or "LOG" by position; empty where it has a short name alone
  std::string takes; // its metavariable, "MODEL.rim"; empty for a flag
  std::string help;
  bool positional;
};

// What a command declares.
struct Description {
  std::string name, summary, footer;
  std::vector<OptionWords> options; // in the order of their declaration
};

// Section 1 of the manual, in troff.
std::string man_page(const Description &command);
// A line each: an option with what it takes, "--out MODEL.rim", a flag alone, "--quick".
std::string option_words(const Description &command);

// Scripts that complete the commands and their options; options: a text of option_words() each.
struct CommandWords {
  std::string name, summary, options;
};
std::string bash_completion(const std::string &program, const std::vector<CommandWords> &commands);
std::string zsh_completion(const std::string &program, const std::vector<CommandWords> &commands);

// The known word that is nearest to the given one, in quotes after "; did you mean"; empty where
// none is near. O(words * letters^2).
std::string did_you_mean(const std::string &given, const std::vector<std::string> &known);
// Of an option that a command does not know.
std::string unknown_option(const Description &command, const std::string &given);

} // namespace rim
