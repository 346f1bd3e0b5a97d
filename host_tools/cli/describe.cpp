// SPDX-License-Identifier: MIT
#include "cli/describe.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

namespace rim {

namespace {

// What an option takes: its metavariable; empty for a flag.
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
  std::string make_option_opts(const CLI::Option *option) const override {
    std::string text = option->nonpositional()                ? " " + takes(option)
                       : option->get_items_expected_max() > 1 ? "..."
                                                              : "";
    if (!option->get_default_str().empty())
      text += " (default " + option->get_default_str() + ")";
    return text + (option->get_required() ? " (required)" : "");
  }
};

std::string troff(const std::string &text) {
  std::string out;
  bool at_begin = true;
  for (const char letter : text) {
    if (at_begin && (letter == '.' || letter == '\''))
      out += "\\&";
    if (letter == '\\')
      out += "\\e";
    else if (letter == '-')
      out += "\\-";
    else
      out += letter;
    at_begin = letter == '\n';
  }
  return out;
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string long_name(const CLI::Option *option) {
  return option->get_lnames().empty() ? "" : "--" + option->get_lnames().front();
}

std::string replaced(std::string text, const std::string &what, const std::string &with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, what.size(), with);
  return text;
}

} // namespace

Describe &describing() {
  static Describe what = Describe::nothing;
  return what;
}

void use_plain_help(CLI::App *app) {
  const auto formatter = std::make_shared<PlainFormatter>();
  formatter->column_width(30);
  app->formatter(formatter);
}

std::string man_page(const CLI::App &app) {
  const std::string title = replaced(app.get_name(), " ", "-");
  std::string text = ".TH " + troff(title) + " 1 \"\" \"rimwatch " RIM_VERSION "\"\n.SH NAME\n" +
                     troff(title) + " \\- " + troff(one_line(app.get_description())) +
                     "\n.SH SYNOPSIS\n.B " + troff(app.get_name()) + "\n[OPTION]...";
  std::string options, arguments;
  for (const CLI::Option *option : app.get_options()) {
    std::string head = "\\fB" + troff(long_name(option)) + "\\fR";
    if (!option->nonpositional()) {
      text += " " + troff(option->get_name());
      head = troff(option->get_name());
    }
    const std::string entry = ".TP\n" + head + " " + troff(takes(option)) + "\n" +
                              troff(option->get_description()) + "\n";
    (option->nonpositional() ? options : arguments) += entry;
  }
  text +=
      "\n" + (arguments.empty() ? "" : ".SH ARGUMENTS\n" + arguments) + ".SH OPTIONS\n" + options;
  if (!app.get_footer().empty())
    text += ".SH NOTES\n.nf\n" + troff(app.get_footer()) + "\n.fi\n";
  return text + ".SH EXIT STATUS\n0 fine, 1 something was found, 2 usage, 3 data or I/O, 4 "
                "internal.\n.SH SEE ALSO\n.BR rim (1)\n";
}

std::string option_words(const CLI::App &app) {
  std::string text;
  for (const CLI::Option *option : app.get_options()) {
    if (option->nonpositional() && !long_name(option).empty())
      text += long_name(option) + (takes(option).empty() ? "" : " " + takes(option)) + "\n";
  }
  return text;
}

namespace {

std::string options_alone(const std::string &lines) {
  std::istringstream all(lines);
  std::string text;
  for (std::string line; std::getline(all, line);)
    text += (text.empty() ? "" : " ") + line.substr(0, line.find(' '));
  return text;
}

} // namespace

std::string bash_completion(const std::string &program, const std::vector<CommandWords> &commands) {
  std::string names, cases;
  for (const CommandWords &c : commands) {
    names += c.name + " ";
    cases += fmt::format("  {}) words=\"{}\" ;;\n", c.name, options_alone(c.options));
  }
  return fmt::format(
      "# bash completion of {0}\n_{0}() {{\n  local word=${{COMP_WORDS[COMP_CWORD]}} words=\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
      "    COMPREPLY=($(compgen -W \"{1}help --help --version\" -- \"$word\"))\n    return\n  fi\n"
      "  case ${{COMP_WORDS[1]}} in\n  help) words=\"{1}\" ;;\n{2}  esac\n"
      "  if [[ $word == -* || ${{COMP_WORDS[1]}} == help ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      "  else\n    COMPREPLY=($(compgen -f -- \"$word\"))\n  fi\n}}\n"
      "complete -o filenames -F _{0} {0}\n",
      program, names, cases);
}

std::string zsh_completion(const std::string &program, const std::vector<CommandWords> &commands) {
  std::string names, cases;
  for (const CommandWords &c : commands) {
    names += fmt::format("    '{}:{}'\n", c.name, replaced(c.summary, "'", ""));
    std::istringstream lines(c.options);
    cases += fmt::format("    {}) _arguments", c.name);
    for (std::string line; std::getline(lines, line);) {
      const std::size_t space = line.find(' ');
      cases +=
          fmt::format(" '{}{}'", line.substr(0, space),
                      space == std::string::npos
                          ? ""
                          : fmt::format(":{}:_files", replaced(line.substr(space + 1), ":", " ")));
    }
    cases += " '*:file:_files' ;;\n";
  }
  return fmt::format("#compdef {0}\n# zsh completion of {0}\n_{0}() {{\n  local -a commands\n"
                     "  commands=(\n{1}    'help:how to use a command'\n  )\n"
                     "  if (( CURRENT == 2 )); then\n    _describe command commands\n    return\n"
                     "  fi\n  local command=$words[2]\n  shift words; (( CURRENT-- ))\n"
                     "  case $command in\n    help) _describe command commands ;;\n{2}  esac\n}}\n"
                     "_{0} \"$@\"\n",
                     program, names, cases);
}

namespace {

// Letters to add, drop, change or swap with the next.
std::size_t distance(const std::string &a, const std::string &b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min(
          {d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

} // namespace

std::string did_you_mean(const std::string &given, const std::vector<std::string> &known) {
  std::string best;
  std::size_t least = 1 + std::min<std::size_t>(3, given.size() / 3);
  for (const std::string &word : known) {
    const std::size_t far = distance(given, word);
    if (far < least) {
      least = far;
      best = word;
    }
  }
  return best.empty() ? "" : "; did you mean '" + best + "'?";
}

std::string unknown_option(const CLI::App &app, const std::string &given) {
  std::vector<std::string> known;
  for (const CLI::Option *option : app.get_options())
    if (!long_name(option).empty())
      known.push_back(long_name(option));
  const std::string name = given.substr(0, given.find('='));
  return "unknown option '" + name + "'" + did_you_mean(name, known);
}

} // namespace rim
