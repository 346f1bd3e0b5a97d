// SPDX-License-Identifier: MIT
// Reading the TOML of an effect; the schema is in data/README.md.
#include <algorithm>

#include "util/error.hpp"
#include "world/effect.hpp"
#include "util/toml_table.hpp"

namespace rim::world {
namespace {

struct KindName {
  const char *name;
  EffectKind kind;
  bool is_physics;
};

constexpr KindName kKinds[] = {
    {"bias", EffectKind::bias, false},
    {"gain", EffectKind::gain, false},
    {"drift", EffectKind::drift, false},
    {"noise", EffectKind::noise, false},
    {"dropout", EffectKind::dropout, false},
    {"stuck", EffectKind::stuck, false},
    {"delay", EffectKind::delay, false},
    {"cross_coupling", EffectKind::cross_coupling, false},
    {"thrust_loss", EffectKind::thrust_loss, true},
    {"isp_loss", EffectKind::isp_loss, true},
    {"misalignment", EffectKind::misalignment, true},
};

// One [[term]] of a file.
class TermReader {
public:
  TermReader(const std::string &path, const toml::node &node, const LanderParams &params);
  EffectTerm read();

private:
  const toml::node &need(const char *key) const;
  void refuse(const char *key, const std::string &why) const;
  const KindName &read_kind() const;
  void read_target(const KindName &kind, EffectTerm &term) const;
  void read_sensor(EffectTerm &term) const;
  void read_engine(const KindName &kind, EffectTerm &term) const;
  void read_axis(const KindName &kind, EffectTerm &term) const;
  void read_hold(const KindName &kind, EffectTerm &term) const;
  // A number with its derivation, or the name of a dispersion of lander.toml.
  double read_dispersion(const EffectTerm &term) const;
  void check_size(const EffectTerm &term) const;
  void read_gates(EffectTerm &term) const;
  std::vector<std::array<double, 2>> read_intervals(const std::string &name,
                                                    const toml::node &node) const;
  std::array<double, 2> read_interval(const std::string &name, const toml::array &pair) const;

  std::string path_;
  const LanderParams &params_;
  const toml::table *table_ = nullptr;
};

TermReader::TermReader(const std::string &path, const toml::node &node, const LanderParams &params)
    : path_(path), params_(params) {
  if (!node.is_table())
    fail(path, node, "key 'term': must be an array of tables");
  table_ = node.as_table();
  for (const auto &[key, value] : *table_) {
    static const std::array<std::string, 10> known = {
        "target", "sensor",    "kind",     "engine",     "axis",
        "gate",   "hold_rows", "multiple", "dispersion", "derivation"};
    const std::string name(key.str());
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      fail(path, value, "unknown key 'term." + name + "'");
    }
  }
}

EffectTerm TermReader::read() {
  EffectTerm term;
  const KindName &kind = read_kind();
  term.kind = kind.kind;
  read_target(kind, term);
  term.multiple = read_number(path_, need("multiple"), "term.multiple", Range::any);
  term.dispersion = read_dispersion(term);
  read_gates(term);
  check_size(term);
  return term;
}

const toml::node &TermReader::need(const char *key) const {
  const toml::node *node = table_->get(key);
  if (node == nullptr)
    fail(path_, *table_, "key 'term." + std::string(key) + "' is missing");
  return *node;
}

void TermReader::refuse(const char *key, const std::string &why) const {
  if (const toml::node *node = table_->get(key)) {
    fail(path_, *node, "key 'term." + std::string(key) + "': " + why);
  }
}

const KindName &TermReader::read_kind() const {
  const toml::node &node = need("kind");
  const std::string name = read_string(path_, node, "term.kind");
  for (const KindName &kind : kKinds) {
    if (name == kind.name)
      return kind;
  }
  std::string all;
  for (const KindName &kind : kKinds)
    all += std::string(all.empty() ? "" : ", ") + kind.name;
  fail(path_, node, "key 'term.kind': no kind '" + name + "' (one of " + all + ")");
}

void TermReader::read_target(const KindName &kind, EffectTerm &term) const {
  const toml::node &node = need("target");
  const std::string target = read_string(path_, node, "term.target");
  if (target != "sensor" && target != "physics") {
    fail(path_, node, "key 'term.target': must be \"sensor\" or \"physics\"");
  }
  if ((target == "physics") != kind.is_physics) {
    fail(path_, node,
         "key 'term.target': kind '" + std::string(kind.name) + "' acts on the " +
             (kind.is_physics ? "physics" : "sensor"));
  }
  if (kind.is_physics) {
    refuse("sensor", "an effect on the physics has no sensor");
  } else {
    read_sensor(term);
  }
  read_engine(kind, term);
  read_axis(kind, term);
  read_hold(kind, term);
}

void TermReader::read_sensor(EffectTerm &term) const {
  const toml::node &sensor = need("sensor");
  const std::string name = read_string(path_, sensor, "term.sensor");
  term.sensor = sensor_index(name);
  if (term.sensor == kSensors)
    fail(path_, sensor, "key 'term.sensor': no sensor '" + name + "'");
}

void TermReader::read_engine(const KindName &kind, EffectTerm &term) const {
  if (kind.kind != EffectKind::thrust_loss && kind.kind != EffectKind::isp_loss) {
    refuse("engine", "only thrust_loss and isp_loss have an engine");
    return;
  }
  const toml::node &node = need("engine");
  if (node.is_string() && *node.value<std::string>() == "all")
    return;
  const auto number = node.is_integer() ? *node.value<std::int64_t>() : 0;
  if (number < 1 || number > static_cast<std::int64_t>(kEngines)) {
    fail(path_, node, "key 'term.engine': must be 1 to 4 or \"all\"");
  }
  term.engine = static_cast<std::size_t>(number - 1);
}

void TermReader::read_axis(const KindName &kind, EffectTerm &term) const {
  if (kind.kind != EffectKind::misalignment) {
    refuse("axis", "only misalignment has an axis");
    return;
  }
  const toml::node &node = need("axis");
  const std::string axis = read_string(path_, node, "term.axis");
  if (axis != "x" && axis != "y")
    fail(path_, node, "key 'term.axis': must be \"x\" or \"y\"");
  term.axis = axis == "y" ? 1 : 0;
}

void TermReader::read_hold(const KindName &kind, EffectTerm &term) const {
  if (kind.kind != EffectKind::stuck) {
    refuse("hold_rows", "only stuck has hold_rows");
    return;
  }
  const toml::node &node = need("hold_rows");
  const auto rows = node.is_integer() ? *node.value<std::int64_t>() : 0;
  if (rows < 1 || rows > 100000) {
    fail(path_, node, "key 'term.hold_rows': must be a whole number from 1 to 100000");
  }
  term.hold_rows = static_cast<std::size_t>(rows);
}

double TermReader::read_dispersion(const EffectTerm &term) const {
  const toml::node &node = need("dispersion");
  if (!node.is_string()) {
    const double value = read_number(path_, node, "term.dispersion", Range::positive);
    read_string(path_, need("derivation"), "term.derivation");
    return value;
  }
  const std::string name = read_string(path_, node, "term.dispersion");
  const EngineParams &e = params_.engine;
  if (term.is_physics()) {
    if (name == "flow_sd")
      return e.flow_sd;
    if (name == "specific_impulse_sd")
      return e.specific_impulse_sd;
    if (name == "frame_misalignment_sd_rad")
      return e.frame_misalignment_sd_rad;
  } else {
    const SensorParams &s = params_.sensor[term.sensor];
    if (name == "bias_sd")
      return s.bias_sd;
    if (name == "scale_sd")
      return s.scale_sd;
    if (name == "drift_sd_per_s")
      return s.drift_sd_per_s;
    if (name == "noise_variance")
      return 2.0 * s.noise_level_sd;
  }
  fail(path_, node, "key 'term.dispersion': '" + name + "' is no dispersion of this target");
}

void TermReader::check_size(const EffectTerm &term) const {
  const bool is_share = term.kind == EffectKind::dropout || term.kind == EffectKind::stuck ||
                        term.kind == EffectKind::thrust_loss || term.kind == EffectKind::isp_loss;
  if (is_share && (term.size() <= 0.0 || term.size() >= 1.0)) {
    fail(path_, need("multiple"),
         "key 'term.multiple': multiple x dispersion is a share and must lie between 0 and 1");
  }
  const bool is_positive = term.kind == EffectKind::noise || term.kind == EffectKind::delay;
  if (is_positive && term.size() <= 0.0) {
    fail(path_, need("multiple"), "key 'term.multiple': must be positive for this kind");
  }
}

void TermReader::read_gates(EffectTerm &term) const {
  const toml::node *node = table_->get("gate");
  if (node == nullptr)
    return;
  if (!node->is_table())
    fail(path_, *node, "key 'term.gate': must be a table");
  for (const auto &[key, value] : *node->as_table()) {
    const std::string name(key.str());
    const auto &names = quantity_names();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      std::string all;
      for (const std::string &n : names)
        all += (all.empty() ? "" : ", ") + n;
      fail(path_, value, "unknown key 'term.gate." + name + "' (one of " + all + ")");
    }
    term.gates.push_back(
        {static_cast<Quantity>(found - names.begin()), read_intervals(name, value)});
  }
}

std::vector<std::array<double, 2>> TermReader::read_intervals(const std::string &name,
                                                              const toml::node &node) const {
  if (name == "thrusting") {
    if (!node.is_boolean())
      fail(path_, node, "key 'term.gate.thrusting': must be true or false");
    const double wanted = *node.value<bool>() ? 1.0 : 0.0;
    return {{wanted, wanted}};
  }
  const toml::array *list = node.as_array();
  if (list == nullptr || list->empty()) {
    fail(path_, node, "key 'term.gate." + name + "': must be [low, high] or a list of such");
  }
  std::vector<std::array<double, 2>> intervals;
  if (!list->get(0)->is_array())
    return {read_interval(name, *list)};
  for (const toml::node &entry : *list) {
    if (!entry.is_array())
      fail(path_, entry, "key 'term.gate." + name + "': must be [low, high]");
    intervals.push_back(read_interval(name, *entry.as_array()));
  }
  return intervals;
}

std::array<double, 2> TermReader::read_interval(const std::string &name,
                                                const toml::array &pair) const {
  const std::string key = "term.gate." + name;
  if (pair.size() != 2)
    fail(path_, pair, "key '" + key + "': must be [low, high]");
  const double low = read_number(path_, *pair.get(0), key, Range::any);
  const double high = read_number(path_, *pair.get(1), key, Range::any);
  if (low >= high)
    fail(path_, pair, "key '" + key + "': low must be below high");
  return {low, high};
}

} // namespace

Effect read_effect(const std::string &path, const LanderParams &params) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"name", "description", "term"});
  Effect effect;
  effect.path = path;
  for (const char *key : {"name", "description", "term"}) {
    if (!root.contains(key))
      throw DataError(path + ": key '" + key + "' is missing");
  }
  effect.name = read_string(path, *root.get("name"), "name");
  effect.description = read_string(path, *root.get("description"), "description");
  const toml::node &terms = *root.get("term");
  if (!terms.is_array() || terms.as_array()->empty()) {
    fail(path, terms, "key 'term': must be one or more [[term]] tables");
  }
  for (const toml::node &term : *terms.as_array()) {
    effect.terms.push_back(TermReader(path, term, params).read());
  }
  return effect;
}

} // namespace rim::world
