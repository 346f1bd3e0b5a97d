// SPDX-License-Identifier: MIT
#include "bus/model_dbc.hpp"

#include <cstdlib>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"

namespace rim {

namespace {

constexpr unsigned kDetail = 640, kSummary = 384; // identifiers of node 0, as in rim.dbc

// Installed beside the data; in the source tree with the library.
std::string shipped_dbc() {
  try {
    return read_file(data_path("wire/rim.dbc"));
  } catch (const DataError &) {
    return read_file(data_path("../lib/wire/rim.dbc"));
  }
}

// The line with the identifier that follows one of these words raised by `node`.
std::string for_node(const std::string &line, unsigned node) {
  for (const char *word :
       {"BO_ ", "CM_ BO_ ", "CM_ SG_ ", "VAL_ ", "SIG_VALTYPE_ ", "BA_ \"VFrameFormat\" BO_ "}) {
    const std::string start = word;
    if (line.rfind(start, 0) != 0)
      continue;
    char *end = nullptr;
    const unsigned long id = std::strtoul(line.c_str() + start.size(), &end, 10);
    return start + std::to_string(id + node) + end;
  }
  return line;
}

std::string value_table(unsigned id, const char *signal, const std::vector<Quantity> &list) {
  std::string text = fmt::format("VAL_ {} {}", id, signal);
  for (std::size_t i = 0; i < list.size(); ++i) {
    std::string words = list[i].name;
    if (!list[i].unit.empty())
      words += " [" + list[i].unit + "]";
    for (char &letter : words)
      if (letter == '"')
        letter = '\'';
    text += fmt::format(" {} \"{}\"", i, words);
  }
  return text + " ;\n";
}

} // namespace

std::string model_dbc(const ImageFacts &facts, unsigned node) {
  std::istringstream shipped(shipped_dbc());
  std::string text;
  for (std::string line; std::getline(shipped, line);) {
    if (line.rfind("CM_ \"", 0) == 0)
      line = fmt::format("CM_ \"Alarms of flight image {:08x} on node {}. Channel and Feature are "
                         "named with their units; Shift and ShiftSd are in the unit of Channel0, "
                         "Lower and Upper in that of their Feature.\";",
                         facts.model_id, node);
    text += for_node(line, node) + "\n";
  }
  const unsigned detail = kDetail + node;
  text += "\n";
  for (const char *signal : {"Channel0", "Channel1"})
    text += value_table(detail, signal, facts.names.outcomes);
  for (const char *signal : {"Feature0", "Feature1", "Feature2"})
    text += value_table(detail, signal, facts.names.features);
  for (const unsigned id : {kSummary + node, detail}) {
    const std::uint32_t mask = id == detail ? 0xffffU : 0xffU;
    text +=
        fmt::format("VAL_ {} ModelId {} \"{:08x}\" ;\n", id, facts.model_id & mask, facts.model_id);
  }
  return text;
}

} // namespace rim
