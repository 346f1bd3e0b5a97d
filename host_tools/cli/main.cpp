// SPDX-License-Identifier: MIT
// rim COMMAND ...: dispatch only.
#include "cli/command.hpp"

int main(int argc, char **argv) {
  return rim::run_program({"rim",
                           {"simulate", "train", "diagnose", "replay", "schema", "check", "show",
                            "listen", "command", "can-table", "plan", "bench"}},
                          argc, argv);
}
