// SPDX-License-Identifier: MIT
#include "cli/command.hpp"
#include "util/error.hpp"

#include <algorithm>
#include <cstdio>

namespace rim {

std::vector<Command> &commands() {
  static std::vector<Command> list;
  return list;
}

namespace {

std::size_t rank(const Program &program, const Command &c) {
  return static_cast<std::size_t>(std::find(program.order.begin(), program.order.end(), c.name) -
                                  program.order.begin());
}

void print_usage(const Program &program, std::FILE *to) {
  auto list = commands();
  std::sort(list.begin(), list.end(), [&](const Command &a, const Command &b) {
    return rank(program, a) != rank(program, b) ? rank(program, a) < rank(program, b)
                                                : a.name < b.name;
  });
  std::fprintf(to, "usage: %s COMMAND [ARGUMENT]...\n\n", program.name);
  for (const auto &c : list)
    std::fprintf(to, "  %-12s %s\n", c.name.c_str(), c.summary.c_str());
  std::fprintf(to,
               "\n'%s COMMAND --help' says how, with an example.\n"
               "Exit status: 0 fine, 1 something was found, 2 usage, 3 data or I/O, 4 internal.\n",
               program.name);
}

// A full disk behind a redirection must not look like success.
int flushed(int status) {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw DataError("standard output: write failed");
  return status;
}

int help(const Program &program) {
  print_usage(program, stdout);
  return EXIT_FINE;
}

int version(const Program &program) {
  std::printf("%s %s\n", program.name, RIM_VERSION);
  return EXIT_FINE;
}

template <class Body> int guarded(const Program &program, const std::string &name, Body body) {
  try {
    return flushed(body());
  } catch (const DataError &e) {
    std::fprintf(stderr, "%s: %s\n", program.name, e.what());
    return EXIT_DATA;
  } catch (const UsageError &e) {
    std::fprintf(stderr, "%s: %s\n%s: try '%s %s --help'\n", program.name, e.what(), program.name,
                 program.name, name.c_str());
    return EXIT_USAGE;
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s: internal error: %s\n", program.name, e.what());
    return EXIT_INTERNAL;
  }
}

} // namespace

int run_program(const Program &program, int argc, char **argv) {
  if (argc < 2) {
    print_usage(program, stderr);
    return EXIT_USAGE;
  }
  const std::string name = argv[1];
  if (name == "--help" || name == "-h" || name == "help")
    return guarded(program, "", [&] { return help(program); });
  if (name == "--version")
    return guarded(program, "", [&] { return version(program); });
  for (const auto &command : commands())
    if (command.name == name)
      return guarded(program, name, [&] { return command.run(argc - 1, argv + 1); });
  std::fprintf(stderr, "%s: no command '%s'\n", program.name, name.c_str());
  print_usage(program, stderr);
  return EXIT_USAGE;
}

} // namespace rim
