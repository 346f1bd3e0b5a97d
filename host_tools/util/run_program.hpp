// SPDX-License-Identifier: MIT
// util/run_program.hpp - another program, run to its end, with what it said.
#pragma once

#include <string>
#include <vector>

namespace rim {

struct ProgramResult {
  int status = 0; // exit status; 127: it could not be started; 128 + signal: it was ended
  std::string out, err;
};

// Runs argv[0], looked up in PATH, with an empty standard input, and waits. Nothing is passed
// through a shell. DataError: no pipe or no process could be had.
ProgramResult run_program(const std::vector<std::string> &argv);

// The interpreter of the readers: RIM_PYTHON, else python3.
std::string python_program();

} // namespace rim
