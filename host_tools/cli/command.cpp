// SPDX-License-Identifier: MIT
#include "cli/command.hpp"
#include "cli/describe.hpp"
#include "util/error.hpp"
#include "util/interrupt.hpp"
#include "util/version.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

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

const Command *find_command(const std::string &name) {
  const auto found = std::find_if(commands().begin(), commands().end(),
                                  [&](const Command &c) { return c.name == name; });
  return found == commands().end() ? nullptr : &*found;
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
               "\n'%s help COMMAND' describes a command and ends in an example.\n"
               "Exit status: 0 fine, 1 something was found, 2 usage, 3 data or I/O, 4 internal.\n"
               "A command that is interrupted (Ctrl-C) leaves no unfinished file, and prints what "
               "it kept.\nIt ends by the signal itself, which a shell shows as 128 and its number: "
               "130 for Ctrl-C.\n",
               program.name);
  if (find_command("schema") != nullptr)
    std::fprintf(to, "\nYour own logs, to the first alarm:\n"
                     "    rim schema healthy/*.csv --out mine.toml     # then read and correct it\n"
                     "    rim train healthy/*.csv --schema mine.toml --out mine.rim\n"
                     "    rim replay suspect.csv --schema mine.toml --model mine.rim\n");
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
  std::printf("%s %s%s\n", program.name, RIM_VERSION, RIM_COMMIT);
  return EXIT_FINE;
}

std::string no_command(const Program &program, const std::string &name) {
  std::vector<std::string> known = program.order;
  known.emplace_back("help");
  return "no command '" + name + "'" + did_you_mean(name, known);
}

int help_of(const Program &program, const std::string &name) {
  const Command *command = find_command(name);
  if (command == nullptr)
    throw UsageError(no_command(program, name));
  std::string word = name, option = "--help";
  char *argv[] = {&word[0], &option[0], nullptr};
  return command->run(2, argv);
}

// What a command prints of itself, by way of Arguments::parse().
int described(const Command &command, Describe what) {
  describing() = what;
  std::string word = command.name;
  char *argv[] = {&word[0], nullptr};
  return command.run(1, argv);
}

// The words of a command's options: it prints them, into a file of our own for a moment.
std::string words_of(const Command &command) {
  std::fflush(stdout);
  std::FILE *file = std::tmpfile();
  const int saved = ::dup(STDOUT_FILENO);
  if (file == nullptr || saved < 0)
    throw DataError("no temporary file");
  ::dup2(::fileno(file), STDOUT_FILENO);
  described(command, Describe::words);
  std::fflush(stdout);
  ::dup2(saved, STDOUT_FILENO);
  ::close(saved);
  std::rewind(file);
  std::string text;
  for (int letter; (letter = std::fgetc(file)) != EOF;)
    text += static_cast<char>(letter);
  std::fclose(file);
  return text;
}

int completion(const Program &program, const std::string &shell) {
  std::vector<CommandWords> words;
  for (const std::string &name : program.order)
    if (const Command *command = find_command(name); command != nullptr)
      words.push_back({name, command->summary, words_of(*command)});
  if (shell != "bash" && shell != "zsh")
    throw UsageError("completion: bash or zsh");
  const std::string text =
      shell == "bash" ? bash_completion(program.name, words) : zsh_completion(program.name, words);
  std::fputs(text.c_str(), stdout);
  return EXIT_FINE;
}

std::string program_page(const Program &program) {
  std::string text =
      ".TH rim 1 \"\" \"rimwatch " RIM_VERSION "\"\n.SH NAME\nrim \\- learns, replays, "
      "diagnoses and listens to onboard monitors\n.SH SYNOPSIS\n.B rim\nCOMMAND "
      "[ARGUMENT]...\n.SH COMMANDS\n";
  for (const std::string &name : program.order)
    if (const Command *command = find_command(name); command != nullptr)
      text += ".TP\n.BR rim\\-" + name + " (1)\n" + command->summary + "\n";
  return text + ".SH EXIT STATUS\n0 fine, 1 something was found, 2 usage, 3 data or I/O, 4 "
                "internal; 130 interrupted by Ctrl-C.\n";
}

// `rim help`, `rim help COMMAND`, and for the makefile `rim help --man [COMMAND]`, `rim help
// --bash`, `rim help --zsh`.
int help_command(const Program &program, int argc, char **argv) {
  const std::string first = argc > 2 ? argv[2] : "";
  if (first.empty())
    return help(program);
  if (first == "--bash" || first == "--zsh")
    return completion(program, first.substr(2));
  if (first != "--man")
    return help_of(program, first);
  if (argc < 4) {
    std::fputs(program_page(program).c_str(), stdout);
    return EXIT_FINE;
  }
  const Command *command = find_command(argv[3]);
  if (command == nullptr)
    throw UsageError(no_command(program, argv[3]));
  return described(*command, Describe::man);
}

template <class Body> int guarded(const Program &program, const std::string &name, Body body) {
  try {
    return flushed(body());
  } catch (const DataError &e) {
    std::fprintf(stderr, "%s: %s\n", program.name, e.what());
    return EXIT_DATA;
  } catch (const UsageError &e) {
    std::fprintf(stderr, "%s: %s\n%s: try '%s %s'\n", program.name, e.what(), program.name,
                 program.name, name.empty() ? "help" : (name + " --help").c_str());
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
  if (name == "--help" || name == "-h")
    return guarded(program, "", [&] { return help(program); });
  if (name == "help")
    return guarded(program, "", [&] { return help_command(program, argc, argv); });
  if (name == "--version" || name == "-V")
    return guarded(program, "", [&] { return version(program); });
  if (const Command *command = find_command(name); command != nullptr) {
    clean_up_when_interrupted(program.name);
    return guarded(program, name, [&] { return command->run(argc - 1, argv + 1); });
  }
  std::fprintf(stderr, "%s: %s\n", program.name, no_command(program, name).c_str());
  print_usage(program, stderr);
  return EXIT_USAGE;
}

} // namespace rim
