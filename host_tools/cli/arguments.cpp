// SPDX-License-Identifier: MIT
#include "cli/arguments.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <type_traits>

#include <CLI/CLI.hpp>

#include "cli/describe.hpp"
#include "rim/image.h"
#include "util/error.hpp"

namespace rim::cli {

Check range(int least, int most) {
  return {Check::Kind::whole, static_cast<double>(least), static_cast<double>(most), {}};
}
Check range(unsigned least, unsigned most) {
  return {Check::Kind::unsigned_whole, static_cast<double>(least), static_cast<double>(most), {}};
}
Check range(double least, double most) { return {Check::Kind::range, least, most, {}}; }
Check positive_number() { return {Check::Kind::positive, 0.0, 0.0, {}}; }
Check non_negative_number() { return {Check::Kind::not_negative, 0.0, 0.0, {}}; }
Check is_member(std::vector<std::string> words) {
  return {Check::Kind::member, 0.0, 0.0, std::move(words)};
}
Check existing_file() { return {Check::Kind::existing_file, 0.0, 0.0, {}}; }
Check new_or_image() { return {Check::Kind::new_or_image, 0.0, 0.0, {}}; }

namespace {

namespace fs = std::filesystem;

// CLI11's own checks of a sign print the largest double, a number of 309 digits.
std::string refuse_sign(const std::string &value, bool zero_too) {
  double number = 0.0;
  if (!CLI::detail::lexical_cast(value, number))
    return "'" + value + "' is not a number";
  if (number < 0.0)
    return "must not be negative: " + value;
  return zero_too && number == 0.0 ? "must be above zero: " + value : "";
}

// CLI11 reads NaN and infinities as numbers, and no range refuses NaN.
std::string refuse_not_finite(const std::string &value) {
  double number = 0.0;
  const bool is_number = CLI::detail::lexical_cast(value, number);
  return is_number && !std::isfinite(number) ? "must be a finite number: " + value : "";
}

std::string refuse_other_file(const std::string &path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored) || fs::file_size(path, ignored) == 0)
    return "";
  char begin[8] = {};
  std::ifstream(path).read(begin, sizeof begin);
  const std::string magic(begin, sizeof begin);
  return magic == RIM_IMAGE_MAGIC || magic == "RIMPART1" // of train/part_file.cpp
             ? ""
             : path + " is there already and is no flight image: it is not written over";
}

CLI::Validator validator(const Check &check) {
  switch (check.kind) {
  case Check::Kind::range:
    return CLI::Range(check.least, check.most);
  case Check::Kind::whole:
    return CLI::Range(static_cast<int>(check.least), static_cast<int>(check.most));
  case Check::Kind::unsigned_whole:
    return CLI::Range(static_cast<unsigned>(check.least), static_cast<unsigned>(check.most));
  case Check::Kind::positive:
    return {[](std::string &value) { return refuse_sign(value, true); }, ""};
  case Check::Kind::not_negative:
    return {[](std::string &value) { return refuse_sign(value, false); }, ""};
  case Check::Kind::member:
    return CLI::IsMember(check.words);
  case Check::Kind::new_or_image:
    return {[](std::string &path) { return refuse_other_file(path); }, ""};
  case Check::Kind::existing_file:
    break;
  }
  return CLI::ExistingFile;
}

// What an option takes: its metavariable as a person writes it, "N", not "UINT:INT in [1 - 1000]";
// empty for a flag.
std::string takes(const CLI::Option *option) {
  if (option->get_items_expected_min() == 0) // a flag
    return "";
  std::string type = option->get_type_name();
  type.resize(std::min(type.find(':'), type.size())); // behind it: what is accepted
  type.resize(std::min(type.find(" in ["), type.size()));
  if (type == "UINT" || type == "INT")
    return "N";
  if (type == "FLOAT")
    return "X";
  return type.empty() || type == "TEXT" ? (option->nonpositional() ? "NAME" : "") : type;
}

class PlainFormatter : public CLI::Formatter {
public:
  PlainFormatter() { column_width(30); }
  std::string make_option_opts(const CLI::Option *option) const override {
    std::string text = option->nonpositional()                ? " " + takes(option)
                       : option->get_items_expected_max() > 1 ? "..."
                                                              : "";
    if (!option->get_default_str().empty())
      text += " (default " + option->get_default_str() + ")";
    return text + (option->get_required() ? " (required)" : "");
  }
};

Description description_of(const CLI::App &app) {
  Description out{app.get_name(), app.get_description(), app.get_footer(), {}};
  for (const CLI::Option *option : app.get_options()) {
    const bool positional = !option->nonpositional();
    std::string name = positional ? option->get_name() : "";
    if (!positional && !option->get_lnames().empty())
      name = "--" + option->get_lnames().front();
    out.options.push_back({name, takes(option), option->get_description(), positional});
  }
  return out;
}

// By any path to it, also a link. Devices and pipes are written as often as one likes.
bool is_same_file(const std::string &a, const std::string &b) {
  std::error_code error;
  const fs::file_status status = fs::status(a, error);
  return (fs::is_regular_file(status) || fs::is_directory(status)) && fs::equivalent(a, b, error);
}

template <class Same>
void refuse_same(const CLI::Option *written, const CLI::Option *other, Same same, const char *why) {
  for (const std::string &out : written->results())
    for (const std::string &name : other->results())
      if (same(out, name))
        throw UsageError(written->get_name() + " " + out + " and " + other->get_name() + " " +
                         name + " name the same file: " + why);
}

// Before anything is written: an output would replace what is read, or another output.
void check_files(const NamedFiles &files) {
  for (std::size_t i = 0; i < files.written.size(); ++i) {
    for (const CLI::Option *read : files.read)
      refuse_same(files.written[i], read, is_same_file, "what is read is not written over");
    for (std::size_t k = 0; k < i; ++k)
      refuse_same(files.written[k], files.written[i], name_same_file,
                  "it can hold only one of them");
  }
}

} // namespace

bool name_same_file(const std::string &a, const std::string &b) {
  std::error_code error;
  if (fs::exists(a, error) || fs::exists(b, error))
    return is_same_file(a, b);
  const auto plain = [&error](const std::string &name) { // "out/" is "out"
    const fs::path path = fs::weakly_canonical(fs::absolute(name), error);
    return path.has_filename() ? path : path.parent_path();
  };
  const fs::path one = plain(a);
  return !error && one == plain(b) && !error;
}

Option Option::required() { return Option(option_->required(), files_); }
Option Option::check(const Check &check) {
  return Option(option_->check(validator(check)), files_);
}
Option Option::type_name(const std::string &name) {
  return Option(option_->type_name(name), files_);
}
Option Option::delimiter(char between) { return Option(option_->delimiter(between), files_); }
Option Option::expected(int values) { return Option(option_->expected(values), files_); }
Option Option::repeated() {
  return Option(option_->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll), files_);
}
Option Option::excludes(const Option &other) {
  return Option(option_->excludes(other.option_), files_);
}
Option Option::needs(const Option &other) { return Option(option_->needs(other.option_), files_); }
Option Option::reads() {
  files_->read.push_back(option_);
  return *this;
}
Option Option::writes() {
  files_->written.push_back(option_);
  return *this;
}
std::size_t Option::count() const { return option_->count(); }

Arguments::Arguments(const std::string &description, const std::string &name)
    : own_(std::make_unique<CLI::App>(description, name)), app_(own_.get()) {}
Arguments::Arguments(CLI::App *subcommand) : app_(subcommand) {}
Arguments::~Arguments() = default;

template <class T>
Option Arguments::add_option(const std::string &name, T &value, const std::string &help) {
  CLI::Option *option = app_->add_option(name, value, help);
  if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::vector<double>>)
    option->check({[](std::string &text) { return refuse_not_finite(text); }, ""});
  return Option(option, &files_);
}
template Option Arguments::add_option(const std::string &, std::string &, const std::string &);
template Option Arguments::add_option(const std::string &, double &, const std::string &);
template Option Arguments::add_option(const std::string &, int &, const std::string &);
template Option Arguments::add_option(const std::string &, std::uint32_t &, const std::string &);
template Option Arguments::add_option(const std::string &, std::uint64_t &, const std::string &);
template Option Arguments::add_option(const std::string &, std::vector<std::string> &,
                                      const std::string &);
template Option Arguments::add_option(const std::string &, std::vector<double> &,
                                      const std::string &);
template Option Arguments::add_option(const std::string &, std::vector<std::size_t> &,
                                      const std::string &);

Option Arguments::add_flag(const std::string &name, bool &value, const std::string &help) {
  return Option(app_->add_flag(name, value, help), &files_);
}

std::size_t Arguments::count(const std::string &name) const { return app_->count(name); }
void Arguments::footer(const std::string &text) { app_->footer(text); }

Arguments *Arguments::add_subcommand(const std::string &name, const std::string &description) {
  app_->require_subcommand(1);
  subcommands_.push_back(
      std::unique_ptr<Arguments>(new Arguments(app_->add_subcommand(name, description))));
  return subcommands_.back().get();
}

bool Arguments::parsed() const { return app_->parsed(); }

bool Arguments::parse(int argc, char **argv) {
  app_->formatter(std::make_shared<PlainFormatter>());
  if (describing() != Describe::nothing) {
    const Description all = description_of(*app_);
    const std::string text = describing() == Describe::man ? man_page(all) : option_words(all);
    std::fputs(text.c_str(), stdout);
    return false;
  }
  // An option that is not known comes before what else is missing.
  const auto stray = [&]() -> std::string {
    for (const std::string &word : app_->remaining())
      if (word.size() > 1 && word[0] == '-' && (word[1] < '0' || word[1] > '9'))
        return word;
    return "";
  };
  try {
    app_->parse(argc, argv);
    check_files(files_);
    return true;
  } catch (const CLI::ParseError &e) {
    const bool left_over = e.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                           e.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
    if (left_over && !stray().empty())
      throw UsageError(unknown_option(description_of(*app_), stray()));
    if (e.get_exit_code() != 0)
      throw UsageError(e.what());
    app_->exit(e);
    return false;
  }
}

std::string command_line(int argc, char **argv) {
  std::string text = "rim";
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain =
        !word.empty() && word.find_first_of(" \t\n\"'`$&|;<>()*?[]#~!\\{}") == std::string::npos;
    text += " ";
    if (plain) {
      text += word;
      continue;
    }
    text += "'";
    for (const char letter : word)
      text += letter == '\'' ? "'\\''" : std::string(1, letter);
    text += "'";
  }
  return text;
}

} // namespace rim::cli
