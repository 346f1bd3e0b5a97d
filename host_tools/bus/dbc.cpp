// SPDX-License-Identifier: MIT
#include "bus/dbc.hpp"

#include <cmath>
#include <cstdlib>
#include <sstream>

#include <regex.h>

#include "util/atomic_file.hpp"
#include "util/error.hpp"

namespace rim {

namespace {

// One group of its own for the whole number, and one for its exponent.
#define DBC_NUMBER "([-+]?[0-9.]+([eE][-+]?[0-9]+)?)"

// An extended regular expression of POSIX that a whole line must match.
class Form {
public:
  using Parts = std::vector<std::string>; // what each group matched, from 1

  explicit Form(const char *text) {
    if (::regcomp(&form_, text, REG_EXTENDED) != 0)
      throw std::logic_error(std::string("not a regular expression: ") + text);
  }
  ~Form() { ::regfree(&form_); }
  Form(const Form &) = delete;
  Form &operator=(const Form &) = delete;

  bool match(const std::string &line, Parts *part) const {
    std::vector<regmatch_t> at(form_.re_nsub + 1);
    if (line.find('\0') != std::string::npos ||
        ::regexec(&form_, line.c_str(), at.size(), at.data(), 0) != 0)
      return false;
    part->clear();
    for (const regmatch_t &m : at)
      part->push_back(m.rm_so < 0 ? ""
                                  : line.substr(static_cast<std::size_t>(m.rm_so),
                                                static_cast<std::size_t>(m.rm_eo - m.rm_so)));
    return true;
  }

private:
  regex_t form_;
};

class DbcReader {
public:
  explicit DbcReader(const std::string &path) { dbc_.path = path; }

  Dbc read(const std::string &text);

private:
  [[noreturn]] void fail(const std::string &reason) const {
    throw DataError(dbc_.path + ":line " + std::to_string(line_) + ": " + reason);
  }

  static bool begins(const std::string &line, const std::string &word) {
    const std::size_t at = line.find_first_not_of(" \t");
    return at != std::string::npos && line.compare(at, word.size(), word) == 0 &&
           at + word.size() < line.size() &&
           (line[at + word.size()] == ' ' || line[at + word.size()] == '\t');
  }

  // Whether the line opens a text that it does not close, or closes one that is open.
  static bool turns(const std::string &line) {
    bool is_odd = false;
    for (std::size_t i = 0; i < line.size(); ++i)
      is_odd ^= line[i] == '"' && (i == 0 || line[i - 1] != '\\');
    return is_odd;
  }

  std::uint64_t whole(const std::string &text, std::uint64_t most, const char *what) const {
    if (text.size() > 10 || std::strtoull(text.c_str(), nullptr, 10) > most)
      fail(std::string(what) + " " + text + " is too large");
    return std::strtoull(text.c_str(), nullptr, 10);
  }

  double number(const std::string &text) const {
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value))
      fail("'" + text + "' is not a finite number");
    return value;
  }

  DbcMessage &message_of(const std::string &id) {
    const std::uint64_t wanted = whole(id, 0xffffffffu, "identifier");
    for (DbcMessage &message : dbc_.messages)
      if (message.id == wanted)
        return message;
    fail("there is no message " + id);
  }

  DbcSignal &signal_of(DbcMessage &message, const std::string &name) const {
    for (DbcSignal &signal : message.signals)
      if (signal.name == name)
        return signal;
    fail("message " + message.name + " has no signal " + name);
  }

  void take(const std::string &line) {
    if (begins(line, "BO_"))
      take_message(line);
    else if (begins(line, "SG_"))
      take_signal(line);
    else if (begins(line, "SIG_VALTYPE_"))
      take_type(line);
    else if (begins(line, "SG_MUL_VAL_"))
      take_nesting(line);
    else if (begins(line, "BA_ \"VFrameFormat\" BO_"))
      take_format(line);
  }

  void take_message(const std::string &line) {
    static const Form form(R"(^\s*BO_\s+([0-9]+)\s+(\w+)\s*:\s*([0-9]+)\s+\S+\s*$)");
    Form::Parts part;
    if (!form.match(line, &part))
      fail("not 'BO_ ID NAME: BYTES SENDER'");
    DbcMessage message;
    message.id = static_cast<std::uint32_t>(whole(part[1], 0xffffffffu, "identifier"));
    message.name = part[2];
    message.bytes = static_cast<unsigned>(whole(part[3], 64, "length"));
    message.fd = message.bytes > 8;
    message.line = line_;
    for (const DbcMessage &other : dbc_.messages)
      if (other.id == message.id || other.name == message.name)
        fail("message " + message.name + " stands on line " + std::to_string(other.line) +
             " already");
    dbc_.messages.push_back(message);
  }

  void take_signal(const std::string &line) {
    static const Form form(
        R"(^\s*SG_\s+(\w+)\s*(M|m[0-9]+M?)?\s*:\s*([0-9]+)\|([0-9]+)@([01])([-+])\s*\(\s*)"
        DBC_NUMBER R"(\s*,\s*)" DBC_NUMBER R"re(\s*\)\s*\[[^]]*\]\s*"([^"]*)".*$)re");
    Form::Parts part;
    if (dbc_.messages.empty())
      fail("a signal before any message");
    if (!form.match(line, &part))
      fail("not 'SG_ NAME : START|BITS@ORDER SIGN (SCALE,OFFSET) [LOW|HIGH] \"UNIT\" RECEIVERS'");
    DbcMessage &message = dbc_.messages.back();
    DbcSignal signal;
    signal.name = part[1];
    const std::string &selection = part[2];
    signal.selector = selection == "M";
    signal.selected = !selection.empty() && selection[0] == 'm';
    signal.nested = signal.selected && selection.back() == 'M';
    if (signal.selected)
      signal.selector_value = static_cast<std::uint32_t>(
          whole(selection.substr(1, selection.find('M') - 1), 0xffffffffu, "selector"));
    signal.start = static_cast<unsigned>(whole(part[3], 511, "start bit"));
    signal.bits = static_cast<unsigned>(whole(part[4], 64, "length"));
    signal.motorola = part[5] == "0";
    signal.is_signed = part[6] == "-";
    signal.scale = number(part[7]);
    signal.offset = number(part[9]);
    signal.unit = part[11];
    signal.line = line_;
    for (const DbcSignal &other : message.signals)
      if (other.name == signal.name)
        fail("signal " + signal.name + " stands on line " + std::to_string(other.line) +
             " already");
    message.signals.push_back(signal);
  }

  void take_type(const std::string &line) {
    static const Form form(
        R"(^\s*SIG_VALTYPE_\s+([0-9]+)\s+(\w+)(\s*:\s*|\s+)([0-3])\s*;\s*$)");
    Form::Parts part;
    if (!form.match(line, &part))
      fail("not 'SIG_VALTYPE_ ID SIGNAL : TYPE ;'");
    DbcSignal &signal = signal_of(message_of(part[1]), part[2]);
    signal.floating = part[4] == "1" ? 32 : part[4] == "2" ? 64 : 0;
    if (signal.floating != 0 && signal.bits != static_cast<unsigned>(signal.floating))
      fail("signal " + signal.name + " has " + std::to_string(signal.bits) + " bits, its type " +
           std::to_string(signal.floating));
  }

  void take_nesting(const std::string &line) {
    static const Form form(R"(^\s*SG_MUL_VAL_\s+([0-9]+)\s+(\w+)\s.*$)");
    Form::Parts part;
    if (!form.match(line, &part))
      fail("not 'SG_MUL_VAL_ ID SIGNAL SELECTOR RANGES ;'");
    signal_of(message_of(part[1]), part[2]).nested = true;
  }

  void take_format(const std::string &line) {
    static const Form form(R"(^\s*BA_\s+"VFrameFormat"\s+BO_\s+([0-9]+)\s+([0-9]+)\s*;\s*$)");
    Form::Parts part;
    if (!form.match(line, &part))
      fail("not 'BA_ \"VFrameFormat\" BO_ ID NUMBER;'");
    DbcMessage &message = message_of(part[1]);
    message.fd = message.fd || whole(part[2], 100, "format") >= 14;
  }

  Dbc dbc_;
  unsigned line_ = 0;
};

Dbc DbcReader::read(const std::string &text) {
  std::istringstream lines(text);
  std::string line;
  unsigned comment = 0; // the line that it begins on; 0: none is open
  while (std::getline(lines, line)) {
    line_++;
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (line_ == 1 && line.rfind("\ufeff", 0) == 0)
      line.erase(0, 3);
    if (comment == 0)
      take(line);
    if ((comment != 0 || begins(line, "CM_")) && turns(line))
      comment = comment == 0 ? line_ : 0;
  }
  if (comment != 0)
    throw DataError(dbc_.path + ":line " + std::to_string(comment) + ": the comment has no end");
  if (dbc_.messages.empty())
    throw DataError(dbc_.path + ": has no messages (BO_): is it a DBC?");
  return std::move(dbc_);
}

} // namespace

Dbc read_dbc(const std::string &path) { return DbcReader(path).read(read_file(path)); }

} // namespace rim
