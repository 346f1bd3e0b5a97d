// SPDX-License-Identifier: MIT
#include "util/run_program.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "util/error.hpp"

extern char **environ;

namespace rim {

namespace {

struct Pipe {
  std::array<int, 2> end{-1, -1};
  Pipe() {
    if (::pipe2(end.data(), O_CLOEXEC) != 0)
      throw DataError(std::string("no pipe: ") + std::strerror(errno));
  }
  ~Pipe() {
    shut(0);
    shut(1);
  }
  Pipe(const Pipe &) = delete;
  Pipe &operator=(const Pipe &) = delete;
  void shut(std::size_t i) {
    if (end[i] >= 0)
      ::close(end[i]);
    end[i] = -1;
  }
};

// False at the end.
bool take(int descriptor, std::string *text) {
  std::array<char, 65536> buffer;
  const ssize_t n = ::read(descriptor, buffer.data(), buffer.size());
  if (n > 0)
    text->append(buffer.data(), static_cast<std::size_t>(n));
  return n > 0 || (n < 0 && errno == EINTR);
}

void gather(Pipe *out, Pipe *err, ProgramResult *result) {
  while (out->end[0] >= 0 || err->end[0] >= 0) {
    std::array<pollfd, 2> ready{{{out->end[0], POLLIN, 0}, {err->end[0], POLLIN, 0}}};
    if (::poll(ready.data(), ready.size(), -1) < 0 && errno != EINTR)
      return;
    if (ready[0].revents != 0 && !take(out->end[0], &result->out))
      out->shut(0);
    if (ready[1].revents != 0 && !take(err->end[0], &result->err))
      err->shut(0);
  }
}

} // namespace

ProgramResult run_program(const std::vector<std::string> &argv) {
  Pipe out, err;
  std::vector<char *> words;
  for (const std::string &word : argv)
    words.push_back(const_cast<char *>(word.c_str()));
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.end[1], 1);
  posix_spawn_file_actions_adddup2(&actions, err.end[1], 2);
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, words.front(), &actions, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ProgramResult result;
  if (failed != 0) {
    result.status = 127;
    return result;
  }
  out.shut(1);
  err.shut(1);
  gather(&out, &err, &result);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

std::string python_program() {
  const char *set = std::getenv("RIM_PYTHON");
  return set != nullptr && *set != '\0' ? set : "python3";
}

} // namespace rim
