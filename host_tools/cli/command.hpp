// SPDX-License-Identifier: MIT
// cli/command.hpp - how a command makes itself known to the program, and the program itself.
//
// In cmd_x.cpp, at namespace scope:
//   namespace { int cmd_x(int argc, char **argv) { ... } }
//   RIM_COMMAND(x, "one line for the list of commands", cmd_x)
// argv[0] is the command's name. Return an exit code of exit_code; throw DataError, UsageError or
// any std::exception and main() prints 'rim: ...' and exits 3, 2 or 4.
#pragma once

#include <string>
#include <vector>

namespace rim {

enum exit_code { EXIT_FINE = 0, EXIT_FOUND = 1, EXIT_USAGE = 2, EXIT_DATA = 3, EXIT_INTERNAL = 4 };

struct Command {
  std::string name;
  std::string summary;
  int (*run)(int argc, char **argv);
};

// Every command linked in, in no order.
std::vector<Command> &commands();

struct CommandRegistration {
  CommandRegistration(const char *name, const char *summary, int (*run)(int, char **)) {
    commands().push_back({name, summary, run});
  }
};

// A program of commands: `rim` here, `rim-thesis` in thesis/.
struct Program {
  const char *name;
  std::vector<std::string> order; // in which a user meets the commands; any other follows by name
};

// Runs the command that argv[1] names and returns the exit code. What is thrown is printed.
int run_program(const Program &program, int argc, char **argv);

} // namespace rim

#define RIM_COMMAND(name, summary, function)                                                       \
  static const rim::CommandRegistration rim_command_##name{#name, summary, function};
