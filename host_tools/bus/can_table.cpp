// SPDX-License-Identifier: MIT
#include "bus/can_table.hpp"

#include <algorithm>
#include <cfloat>
#include <map>

#include "base/bytes.h"
#include "image/image_writer.hpp"
#include "image/names.hpp"
#include "rim/can_table.h"
#include "rim/image.h"
#include "rim/monitor.h"
#include "util/error.hpp"
#include "util/toml_table.hpp"

namespace rim {

namespace {

// Where a value comes from, and what is done to it.
struct Source {
  std::size_t message = 0, signal = 0;
  double scale = 1.0, offset = 0.0, low = -DBL_MAX, high = DBL_MAX;
};

constexpr std::size_t kTime = static_cast<std::size_t>(-1);

class Compiler {
public:
  Compiler(const Dbc &dbc, const std::vector<std::string> &names) : dbc_(dbc), names_(names) {}
  void read_map(const std::string &path);
  void match_names();
  std::vector<std::uint8_t> bytes() const;

private:
  Source find(const std::string &path, const toml::node &node, const std::string &from) const;
  void read_signal(const std::string &path, const toml::table &table);
  const DbcSignal &signal_of(const Source &s) const {
    return dbc_.messages[s.message].signals[s.signal];
  }
  void put_signal(SectionBytes &out, std::size_t value, const Source &source) const;

  const Dbc &dbc_;
  const std::vector<std::string> &names_;
  std::map<std::size_t, Source> sources_; // by value; kTime
  std::size_t trigger_ = kTime;
};

// MESSAGE.SIGNAL
Source Compiler::find(const std::string &path, const toml::node &node,
                      const std::string &from) const {
  const std::size_t dot = from.find('.');
  Source source;
  for (source.message = 0; source.message < dbc_.messages.size(); source.message++) {
    const DbcMessage &message = dbc_.messages[source.message];
    if (dot == std::string::npos || message.name != from.substr(0, dot))
      continue;
    for (source.signal = 0; source.signal < message.signals.size(); source.signal++)
      if (message.signals[source.signal].name == from.substr(dot + 1))
        return source;
    fail(path, node,
         "message " + message.name + " of " + dbc_.path + " has no signal '" +
             from.substr(dot + 1) + "'");
  }
  fail(path, node, "'" + from + "' is no MESSAGE.SIGNAL of " + dbc_.path);
}

void Compiler::read_signal(const std::string &path, const toml::table &table) {
  Source source;
  std::size_t value = kTime;
  bool placed = false;
  for (const auto &[key, node] : table) {
    const std::string word(key.str());
    if (word == "name") {
      const std::string name = read_string(path, node, word);
      const auto at = std::find(names_.begin(), names_.end(), name);
      if (at == names_.end())
        fail(path, node, "the model has no '" + name + "'");
      value = static_cast<std::size_t>(at - names_.begin());
      if (sources_.count(value) != 0)
        fail(path, node, "'" + name + "' stands there twice");
    } else if (word == "from") {
      const Source found = find(path, node, read_string(path, node, word));
      source.message = found.message;
      source.signal = found.signal;
      placed = true;
    } else if (word == "scale" || word == "offset" || word == "min" || word == "max") {
      double &number = word == "scale"    ? source.scale
                       : word == "offset" ? source.offset
                       : word == "min"    ? source.low
                                          : source.high;
      number = read_number(path, node, word, Range::any);
    } else {
      fail(path, node, "unknown key '" + word + "'");
    }
  }
  if (value == kTime || !placed)
    fail(path, table, "name and from are needed");
  if (source.scale == 0.0 || source.low > source.high)
    fail(path, table, "scale is 0, or min above max");
  sources_[value] = source;
}

void Compiler::read_map(const std::string &path) {
  const toml::table root = parse_toml(path);
  double time_scale = 1.0;
  for (const auto &[key, node] : root) {
    const std::string word(key.str());
    if (word == "schema") {
      if (read_string(path, node, word) != "rim-can/1")
        fail(path, node, "schema must be \"rim-can/1\"");
    } else if (word == "trigger") {
      const std::string name = read_string(path, node, word);
      for (trigger_ = 0; trigger_ < dbc_.messages.size(); ++trigger_)
        if (dbc_.messages[trigger_].name == name)
          break;
      if (trigger_ == dbc_.messages.size())
        fail(path, node, "'" + name + "' is no message of " + dbc_.path);
    } else if (word == "time") {
      sources_[kTime] = find(path, node, read_string(path, node, word));
    } else if (word == "time_scale") {
      time_scale = read_number(path, node, word, Range::positive);
    } else if (word == "signal" && node.is_array_of_tables()) {
      for (const toml::node &one : *node.as_array())
        read_signal(path, *one.as_table());
    } else {
      fail(path, node, "unknown key '" + word + "'");
    }
  }
  if (!root.contains("schema"))
    throw DataError(path + ": schema = \"rim-can/1\" is missing");
  if (sources_.count(kTime) != 0)
    sources_[kTime].scale = time_scale;
}

void Compiler::match_names() {
  for (std::size_t value = 0; value < names_.size(); ++value) {
    if (sources_.count(value) != 0)
      continue;
    std::string wanted = names_[value];
    std::replace(wanted.begin(), wanted.end(), '.', '_');
    Source source;
    unsigned found = 0;
    for (std::size_t m = 0; m < dbc_.messages.size(); ++m) {
      const auto &signals = dbc_.messages[m].signals;
      for (std::size_t s = 0; s < signals.size(); ++s) {
        if (signals[s].name != wanted)
          continue;
        source.message = m;
        source.signal = s;
        found++;
      }
    }
    if (found != 1)
      throw DataError(dbc_.path + ": " + (found == 0 ? "no signal" : "more than one signal") +
                      " '" + wanted + "' for the model's '" + names_[value] +
                      "', and the map names none");
    sources_[value] = source;
  }
}

void Compiler::put_signal(SectionBytes &out, std::size_t value, const Source &source) const {
  const DbcMessage &message = dbc_.messages[source.message];
  const DbcSignal &signal = signal_of(source);
  const std::string where = dbc_.path + ":line " + std::to_string(signal.line) + ": ";
  if (signal.nested)
    throw DataError(where + "signal " + signal.name +
                    " is multiplexed by more than one selector: not supported");
  const DbcSignal *selector = nullptr;
  for (const DbcSignal &other : message.signals)
    if (signal.selected && other.selector)
      selector = &other;
  if (signal.selected && selector == nullptr)
    throw DataError(where + "message " + message.name + " has no selector (M)");
  if (selector != nullptr && selector->bits > 32)
    throw DataError(where + "a selector of more than 32 bits");
  out.u16(static_cast<std::uint16_t>(value == kTime ? RIM_CAN_TABLE_NONE : value));
  out.u8(signal.floating == 32   ? RIM_CAN_F32
         : signal.floating == 64 ? RIM_CAN_F64
         : signal.is_signed      ? RIM_CAN_SIGNED
                                 : RIM_CAN_UNSIGNED);
  out.u8(signal.motorola ? 1 : 0);
  out.u16(static_cast<std::uint16_t>(signal.start));
  out.u8(static_cast<std::uint8_t>(signal.bits));
  out.u8(static_cast<std::uint8_t>(selector != nullptr ? selector->bits : 0));
  out.u16(static_cast<std::uint16_t>(selector != nullptr ? selector->start : 0));
  out.u8(selector != nullptr && selector->motorola ? 1 : 0);
  out.u8(0);
  out.u32(signal.selector_value);
  out.f64(source.scale * signal.scale);
  out.f64(source.scale * signal.offset + source.offset);
  out.f64(source.low);
  out.f64(source.high);
}

std::vector<std::uint8_t> Compiler::bytes() const {
  // Messages that are used, in the file's order; the trigger even where no value is in it.
  std::map<std::size_t, std::vector<std::size_t>> of_message;
  for (const auto &[value, source] : sources_)
    of_message[source.message].push_back(value);
  if (trigger_ != kTime && of_message.count(trigger_) == 0)
    throw DataError(dbc_.path + ": the trigger " + dbc_.messages[trigger_].name +
                    " carries no value of the model");
  SectionBytes frames, signals;
  std::size_t frame = 0, signal = 0;
  std::size_t trigger = RIM_CAN_TABLE_NONE, time = RIM_CAN_TABLE_NONE;
  for (const auto &[index, values] : of_message) {
    const DbcMessage &message = dbc_.messages[index];
    if (index == trigger_)
      trigger = frame;
    frames.u32(message.id);
    frames.u8(static_cast<std::uint8_t>(message.bytes));
    frames.u8(message.fd ? 1 : 0);
    frames.u16(static_cast<std::uint16_t>(signal));
    frames.u16(static_cast<std::uint16_t>(values.size()));
    frames.u16(0);
    frame++;
    for (const std::size_t value : values) {
      if (value == kTime)
        time = signal;
      put_signal(signals, value, sources_.at(value));
      signal++;
    }
  }
  SectionBytes out;
  out.u32(RIM_CAN_TABLE_LAYOUT);
  for (const std::size_t word : {names_.size(), frame, signal, trigger, time, std::size_t{0}})
    out.u16(static_cast<std::uint16_t>(word));
  std::vector<std::uint8_t> all = out.bytes();
  all.insert(all.end(), frames.bytes().begin(), frames.bytes().end());
  all.insert(all.end(), signals.bytes().begin(), signals.bytes().end());
  return all;
}

} // namespace

std::vector<std::string> row_names(const rim_image &image, const std::string &name) {
  const Names names = names_of_image(image, name);
  if (names.features.empty())
    throw DataError(name + ": carries no names");
  std::vector<std::string> row;
  for (const Quantity &feature : names.features)
    row.push_back(feature.name);
  for (const char *prefix : {"z", "m", "sd"})
    for (const Quantity &outcome : names.outcomes)
      if (names.external)
        row.push_back(prefix +
                      outcome.name.substr(std::min(outcome.name.find('.'), outcome.name.size())));
  return row;
}

std::vector<std::uint8_t> compile_can_table(const Dbc &dbc, const std::string &map,
                                            const std::vector<std::string> &names) {
  Compiler compiler(dbc, names);
  if (!map.empty())
    compiler.read_map(map);
  compiler.match_names();
  const std::vector<std::uint8_t> bytes = compiler.bytes();
  rim_can_table table;
  const rim_status status = rim_can_table_open(&table, bytes.data(), bytes.size());
  if (status != RIM_OK)
    throw DataError(dbc.path + ": the table that it makes is not good: " + rim_status_text(status) +
                    " (a signal outside its message, an identifier or number out of range, or "
                    "more than " +
                    std::to_string(RIM_CAN_TABLE_MAX_SIGNALS) + " signals)");
  return bytes;
}

std::vector<std::uint8_t> with_can_table(const rim_image &image,
                                         const std::vector<std::uint8_t> &table) {
  return with_sections(image, {{RIM_SECTION_CAN_TABLE, table, 1}}, ModelId::kept);
}

std::vector<std::uint8_t> can_table_of(const rim_image &image) {
  const std::uint8_t *section = nullptr;
  std::size_t bytes = 0;
  if (rim_image_section(&image, RIM_SECTION_CAN_TABLE, &section, &bytes) != RIM_OK)
    return {};
  return {section, section + bytes};
}

std::optional<CanReading> can_reading(const rim_image &image, const std::string &name) {
  CanReading reading;
  reading.table = can_table_of(image);
  if (reading.table.empty())
    return std::nullopt;
  reading.names = row_names(image, name);
  return reading;
}

} // namespace rim
