// SPDX-License-Identifier: MIT
#include "bus/model_dbc.hpp"

#include <cstdlib>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"

#include "rim/can.h"

namespace rim {

namespace {

constexpr unsigned kShippedNode = 1; // of the identifiers in the shipped files

// Installed beside the data; in the source tree with the library.
std::string shipped_dbc(bool fd) {
  const std::string name = fd ? "wire/rim_fd.dbc" : "wire/rim.dbc";
  try {
    return read_file(data_path(name));
  } catch (const DataError &) {
    return read_file(data_path("../lib/" + name));
  }
}

// The line with the identifier that follows one of these words made that of `node`.
std::string for_node(const std::string &line, unsigned node) {
  for (const char *word : {"BO_ ", "CM_ BO_ ", "CM_ SG_ ", "VAL_ ", "SIG_VALTYPE_ ",
                           "BA_ \"VFrameFormat\" BO_ ", "BA_ \"GenMsgCycleTime\" BO_ "}) {
    const std::string start = word;
    if (line.rfind(start, 0) != 0)
      continue;
    char *end = nullptr;
    const unsigned long id = std::strtoul(line.c_str() + start.size(), &end, 10);
    return start + std::to_string(id - kShippedNode + node) + end;
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

std::string model_dbc(const ImageFacts &facts, unsigned node, bool fd) {
  std::istringstream shipped(shipped_dbc(fd));
  std::string text;
  for (std::string line; std::getline(shipped, line);) {
    if (line.rfind("CM_ \"", 0) == 0)
      line =
          fmt::format("CM_ \"Alarms of flight image {:08x} on node {}. Outcomes and features are "
                      "named with their units; Shift and ShiftSd are in the unit of the outcome, "
                      "Lower and Upper in that of their Feature.\";",
                      facts.model_id, node);
    text += for_node(line, node) + "\n";
  }
  text += "\n";
  const char *const features[] = {"Feature0", "Feature1", "Feature2"};
  for (const unsigned id : {RIM_CAN_FINDING_ID + node, RIM_CAN_DETAIL_ID + node}) {
    const bool is_finding = id == RIM_CAN_FINDING_ID + node;
    if (!is_finding && !fd)
      continue; // in segments, which a DBC cannot look into
    text += value_table(id, is_finding ? "Outcome" : "Channel0", facts.names.outcomes);
    if (!is_finding)
      text += value_table(id, "Channel1", facts.names.outcomes);
    for (const char *signal : features)
      text += value_table(id, signal, facts.names.features);
  }
  const auto model = [&](unsigned id, std::uint32_t mask) {
    text +=
        fmt::format("VAL_ {} ModelId {} \"{:08x}\" ;\n", id, facts.model_id & mask, facts.model_id);
  };
  for (const unsigned first : {RIM_CAN_SUMMARY_ID, RIM_CAN_ENTRY_ID, RIM_CAN_HEARTBEAT_ID})
    model(first + node, 0xffU);
  if (fd)
    model(RIM_CAN_DETAIL_ID + node, 0xffffU);
  return text;
}

} // namespace rim
