// rim COMMAND ...: dispatch only.
#include "cli/command.hpp"
#include "util/error.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace {

// The order in which a user meets the commands; any other follows by name.
const char *const kOrder[] = {"simulate", "train",      "replay", "listen",
                              "plan",     "experiment", "bench",  "merge"};

std::size_t rank(const rim::Command &c) {
  return static_cast<std::size_t>(std::find(std::begin(kOrder), std::end(kOrder), c.name) -
                                  std::begin(kOrder));
}

void print_usage(std::FILE *to) {
  auto list = rim::commands();
  std::sort(list.begin(), list.end(), [](const rim::Command &a, const rim::Command &b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a.name < b.name;
  });
  std::fputs("usage: rim COMMAND [ARGUMENT]...\n\n", to);
  for (const auto &c : list)
    std::fprintf(to, "  %-12s %s\n", c.name.c_str(), c.summary.c_str());
  std::fputs("\n'rim COMMAND --help' says how, with an example.\n"
             "Exit status: 0 fine, 1 something was found, 2 usage, 3 data or I/O, 4 internal.\n",
             to);
}

// A full disk behind a redirection must not look like success.
int flushed(int status) {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw rim::DataError("standard output: write failed");
  return status;
}

int help() {
  print_usage(stdout);
  return rim::EXIT_FINE;
}

int version() {
  std::puts("rim " RIM_VERSION);
  return rim::EXIT_FINE;
}

template <class Body> int guarded(const std::string &name, Body body) {
  try {
    return flushed(body());
  } catch (const rim::DataError &e) {
    std::fprintf(stderr, "rim: %s\n", e.what());
    return rim::EXIT_DATA;
  } catch (const rim::UsageError &e) {
    std::fprintf(stderr, "rim: %s\nrim: try 'rim %s --help'\n", e.what(), name.c_str());
    return rim::EXIT_USAGE;
  } catch (const std::exception &e) {
    std::fprintf(stderr, "rim: internal error: %s\n", e.what());
    return rim::EXIT_INTERNAL;
  }
}

} // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    print_usage(stderr);
    return rim::EXIT_USAGE;
  }
  const std::string name = argv[1];
  if (name == "--help" || name == "-h" || name == "help")
    return guarded("", help);
  if (name == "--version")
    return guarded("", version);
  for (const auto &command : rim::commands())
    if (command.name == name)
      return guarded(name, [&] { return command.run(argc - 1, argv + 1); });
  std::fprintf(stderr, "rim: no command '%s'\n", name.c_str());
  print_usage(stderr);
  return rim::EXIT_USAGE;
}
