// SPDX-License-Identifier: MIT
// cli/arguments.hpp - the command line of one command: what it takes, and what was given.
//
// The reading is CLI11's; only arguments.cpp includes that, because it compiles slowly. The types
// that an option may write to are listed there.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "util/error.hpp"

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace rim::cli {

// What a value must be; `words` stand in the help.
struct Check {
  // The help shows a range's type: FLOAT, INT or UINT.
  enum class Kind {
    range,
    whole,
    unsigned_whole,
    positive,
    not_negative,
    member,
    existing_file,
    new_or_image
  } kind;
  double least = 0.0, most = 0.0;
  std::vector<std::string> words;
};
Check range(int least, int most);
Check range(unsigned least, unsigned most);
Check range(double least, double most);
Check positive_number();
Check non_negative_number();
Check is_member(std::vector<std::string> words);
template <class Value> Check is_member(const std::map<std::string, Value> &by_word) {
  std::vector<std::string> words;
  for (const auto &entry : by_word)
    words.push_back(entry.first);
  return is_member(std::move(words));
}
Check existing_file();
// A flight image or a part of one may be written over, any other file not: `--out *.csv` would
// otherwise replace the first of the logs.
Check new_or_image();

// The files that a command line names.
struct NamedFiles {
  std::vector<const CLI::Option *> read, written;
};

// One option. Each call returns the option, so that calls chain.
class Option {
public:
  Option(CLI::Option *option, NamedFiles *files) : option_(option), files_(files) {}
  Option *operator->() { return this; }
  const Option *operator->() const { return this; }

  Option required();
  Option check(const Check &check); // of every value; more than one may be asked
  Option type_name(const std::string &name);
  Option delimiter(char between_values);
  Option expected(int values);
  Option repeated(); // one value each time it is given, all are kept
  Option excludes(const Option &other);
  Option needs(const Option &other);
  // Its values name files, or folders, that the command reads or writes. Arguments::parse() refuses
  // a file that would be written and is named a second time.
  Option reads();
  Option writes();
  std::size_t count() const; // values given

private:
  CLI::Option *option_;
  NamedFiles *files_;
};

class Arguments {
public:
  Arguments(const std::string &description, const std::string &name);
  ~Arguments();
  Arguments(const Arguments &) = delete;
  Arguments &operator=(const Arguments &) = delete;

  // Names as "--out", "-o,--out" or, without dashes, by position. Instantiated in arguments.cpp.
  template <class T>
  Option add_option(const std::string &name, T &value, const std::string &help = "");
  Option add_flag(const std::string &name, bool &value, const std::string &help = "");
  // How often the option of this name was given.
  std::size_t count(const std::string &name) const;
  void footer(const std::string &text);

  // A subcommand; it lives as long as this. Exactly one must then be given.
  Arguments *add_subcommand(const std::string &name, const std::string &description);
  const Arguments &subcommand(std::size_t i) const { return *subcommands_.at(i); }
  bool parsed() const; // of a subcommand: whether it was the one given

  // False when help, or another description, was asked for and printed: return EXIT_FINE then. A
  // wrong command line throws UsageError.
  bool parse(int argc, char **argv);

private:
  explicit Arguments(CLI::App *subcommand);
  std::unique_ptr<CLI::App> own_;
  CLI::App *app_;
  NamedFiles files_;
  std::vector<std::unique_ptr<Arguments>> subcommands_;
};

// The command as it can be typed again: "rim" and the words, quoted where a shell needs it.
std::string command_line(int argc, char **argv);

// Whether two paths lead to one file or folder, which need not be there yet.
bool name_same_file(const std::string &a, const std::string &b);

} // namespace rim::cli
