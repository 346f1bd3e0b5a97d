// SPDX-License-Identifier: MIT
// rim-thesis COMMAND ...: dispatch only.
#include "cli/command.hpp"

int main(int argc, char **argv) {
  return rim::run_program({"rim-thesis", {"experiment", "merge"}}, argc, argv);
}
