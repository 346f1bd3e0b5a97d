// SPDX-License-Identifier: MIT
// tests/host/interrupted.hpp - a program of its own that SIGINT ends, and what it says.
#pragma once

#include "check.hpp"
#include "util/interrupt.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

// What it writes on stderr. work() is what it does; meanwhile(its process) is done here, and either
// of the two sends the signal.
template <typename Work, typename Meanwhile>
std::string interrupted(const Work &work, const Meanwhile &meanwhile) {
  std::array<int, 2> said{};
  assert_int_equal(pipe(said.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(said[1], STDERR_FILENO);
    rim::clean_up_when_interrupted("program");
    work();
    _exit(1);
  }
  close(said[1]);
  meanwhile(child);
  std::string text(4096, '\0');
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(read(said[0], text.data(), 4096), 0)));
  close(said[0]);
  int status = 0;
  waitpid(child, &status, 0);
  assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);
  return text;
}
