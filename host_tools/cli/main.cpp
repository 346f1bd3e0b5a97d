// SPDX-License-Identifier: MIT
// rim COMMAND ...: dispatch only.
#include "cli/command.hpp"

int main(int argc, char **argv) {
  return rim::run_program({"rim",
                           {"schema", "train", "check", "replay", "diagnose", "show", "listen",
                            "command", "can-table", "simulate", "plan", "bench"}},
                          argc, argv);
}
