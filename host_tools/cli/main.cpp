// SPDX-License-Identifier: MIT
// rim COMMAND ...: dispatch only.
#include "cli/command.hpp"

int main(int argc, char **argv) {
  return rim::run_program({"rim",
                           {"schema", "train", "diagnose", "replay", "check", "show", "listen",
                            "command", "can-table", "simulate", "plan", "bench"}},
                          argc, argv);
}
