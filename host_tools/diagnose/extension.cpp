// SPDX-License-Identifier: MIT
#include "diagnose/extension.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <muParser.h>

#include "log/log.hpp"
#include "util/toml_table.hpp"

namespace rim::diagnose {
namespace {

constexpr const char *kSchema = "rim-extension/1";

struct KindName {
  const char *name;
  TermKind kind;
};
constexpr std::array<KindName, 4> kKinds{{{"mean", TermKind::mean},
                                          {"variance", TermKind::variance},
                                          {"stuck", TermKind::stuck},
                                          {"dropout", TermKind::dropout}}};

bool is_function(const std::string &name) { return mu::Parser().GetFunDef().count(name) > 0; }

const char *kind_name(TermKind kind) {
  return std::find_if(kKinds.begin(), kKinds.end(),
                      [kind](const KindName &k) { return k.kind == kind; })
      ->name;
}

bool is_identifier(const std::string &name) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  return !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), is_word);
}

// ---- writing ----

// The shortest decimal that reads back to the same bits, never taken for an integer.
std::string number(double value) {
  std::array<char, 32> text;
  std::string out(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
  return out.find_first_of(".en") == std::string::npos ? out + ".0" : out;
}

std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

template <class T, class Text> std::string list(const std::vector<T> &items, Text text) {
  std::string out = "[";
  for (std::size_t i = 0; i < items.size(); ++i)
    out += (i > 0 ? ", " : "") + text(items[i]);
  return out + "]";
}

std::string comment(const std::string &text) {
  std::string out = "# ";
  for (const char c : text)
    out += c == '\n' ? std::string("\n# ") : std::string(1, c == '\r' ? ' ' : c);
  return out + "\n";
}

std::string parameters_toml(const char *header, const std::vector<Parameter> &parameters) {
  std::string out;
  for (const Parameter &p : parameters) {
    out += fmt::format("{}\nname = {}\nvalue = {}\nstderr = {}\nunit = {}\n", header,
                       quoted(p.name), number(p.value), number(p.stderror), quoted(p.unit));
    if (!p.per_log.empty())
      out += "between_logs_sd = " + number(p.between_logs_sd) +
             "\nper_log = " + list(p.per_log, number) + "\nnew_log = " + number(p.new_log) + "\n";
  }
  return out;
}

std::string region_toml(const char *key, const Gate &gate) {
  if (gate.everywhere())
    return "";
  std::string out = fmt::format("[term.{}]\n", key);
  out += "features = " + list(gate.features, quoted) + "\n";
  out += "units = " + list(gate.units, quoted) + "\n";
  // An edge that is only the end of the data is none.
  std::vector<double> lower = gate.lower, upper = gate.upper;
  for (std::size_t k = 0; k < lower.size(); ++k) {
    lower[k] = gate.is_open(k, false) ? -INFINITY : lower[k];
    upper[k] = gate.is_open(k, true) ? INFINITY : upper[k];
  }
  const bool is_open = lower != gate.lower || upper != gate.upper;
  out += "lower = " + list(lower, number) + "\n";
  out += "upper = " + list(upper, number) + "\n";
  out += fmt::format("shape = \"{}\"\n", gate.is_ellipse ? "ellipse" : "box");
  if (!gate.center.empty() && !is_open)
    out += "center = " + list(gate.center, number) + "\n";
  if (!gate.inverse_shape.empty() && !is_open) {
    std::vector<std::vector<double>> rows;
    const std::size_t d = gate.features.size();
    for (std::size_t i = 0; i + d <= gate.inverse_shape.size(); i += d)
      rows.emplace_back(gate.inverse_shape.begin() + static_cast<std::ptrdiff_t>(i),
                        gate.inverse_shape.begin() + static_cast<std::ptrdiff_t>(i + d));
    out += "inverse_shape = " +
           list(rows, [](const std::vector<double> &row) { return list(row, number); }) + "\n";
  }
  return out;
}

std::string term_toml(const Term &term) {
  const std::string where = gate_text(term.gate);
  std::string out = "\n" + comment(term.channel + ": " + expression_text(term) +
                                   (where.empty() ? "" : ", in " + where));
  if (is_swing(term) && !term.logs.empty())
    out += "# Amplitude and period hold for other logs, the phase does not: nothing is added there,"
           "\n# but the standard deviation of the prediction is wider by what it swings.\n";
  out += fmt::format("[[term]]\nchannel = {}\ncause = {}\nform = {}\nkind = \"{}\"\n",
                     quoted(term.channel), quoted(term.cause), quoted(term.form),
                     kind_name(term.kind));
  if (!term.basis.empty())
    out += "basis = " + list(term.basis, quoted) + "\n";
  if (!term.arguments.empty()) {
    std::string pairs;
    for (const auto &[name, feature] : term.arguments)
      pairs += (pairs.empty() ? "" : ", ") + name + " = " + quoted(feature);
    out += "arguments = { " + pairs + " }\n";
  }
  if (!term.logs.empty())
    out += "logs = " + list(term.logs, quoted) + "\n";
  if (!term.knots.empty())
    out += "knots = " + list(term.knots, number) + "\nvalues = " + list(term.values, number) + "\n";
  out += parameters_toml("[[term.size]]", term.sizes);
  out += parameters_toml("[[term.shape]]", term.shape);
  if (!term.response.empty()) {
    out += "[term.response]\n";
    for (const auto &[product, coefficient] : term.response)
      out += quoted(product) + " = " + number(coefficient) + "\n";
  }
  for (const Ridge &ridge : term.ridges) {
    std::string weights;
    for (const auto &[feature, weight] : ridge.weights)
      weights += (weights.empty() ? "" : ", ") + quoted(feature) + " = " + number(weight);
    out += "[[term.ridge]]\nweights = { " + weights + " }\nknots = " + list(ridge.knots, number) +
           "\nvalues = " + list(ridge.values, number) + "\n";
  }
  return out + region_toml("region", term.gate) + region_toml("support", term.support);
}

// ---- reading ----

// One [[term]] of a file.
class TermReader {
public:
  TermReader(const std::string &path, const toml::node &node) : path_(path) {
    if (!node.is_table())
      fail(path, node, "key 'term': must be an array of tables, [[term]]");
    table_ = node.as_table();
  }
  Term read();

private:
  using Keys = std::set<std::string>;
  void check_keys(const toml::table &table, const std::string &name, const Keys &known) const;
  const toml::node &need(const toml::table &table, const std::string &name,
                         const std::string &key) const;
  const toml::array &array_at(const toml::table &table, const std::string &name,
                              const std::string &key) const;
  std::vector<std::string> texts(const toml::table &table, const std::string &name,
                                 const std::string &key) const;
  std::vector<double> numbers(const toml::node &node, const std::string &name, bool finite) const;
  std::vector<Parameter> parameters(const char *key) const;
  TermKind read_kind() const;
  void read_arguments(Term *term) const;
  void read_table(Term *term) const;
  void read_response(Term *term) const;
  void read_ridges(Term *term) const;
  void read_region(const char *key, Gate *gate) const;
  void read_ellipsoid(const toml::table &table, Gate *gate) const;
  void check_bounds(const toml::table &table, const Gate &gate) const;
  void check_feature(const toml::node &node, const std::string &channel,
                     const std::string &feature) const;
  void check_form(const Term &term) const;
  void check_delay(const Term &term) const;
  void check_swing(const Term &term) const;
  void check_sizes(const Term &term) const;
  void check_expressions(const Term &term) const;
  void check_expression(const Term &term, const std::string &expression,
                        const toml::node &node) const;

  std::string path_;
  const toml::table *table_ = nullptr;
};

void TermReader::check_keys(const toml::table &table, const std::string &name,
                            const Keys &known) const {
  for (const auto &[key, node] : table) {
    if (known.count(std::string(key.str())) == 0)
      fail(path_, node, fmt::format("unknown key '{}.{}'", name, key.str()));
  }
}

const toml::node &TermReader::need(const toml::table &table, const std::string &name,
                                   const std::string &key) const {
  const toml::node *node = table.get(key);
  if (node == nullptr)
    fail(path_, table, fmt::format("key '{}.{}' is missing", name, key));
  return *node;
}

const toml::array &TermReader::array_at(const toml::table &table, const std::string &name,
                                        const std::string &key) const {
  const toml::node &node = need(table, name, key);
  if (!node.is_array())
    fail(path_, node, fmt::format("key '{}.{}': must be a list", name, key));
  return *node.as_array();
}

std::vector<std::string> TermReader::texts(const toml::table &table, const std::string &name,
                                           const std::string &key) const {
  std::vector<std::string> out;
  for (const toml::node &node : array_at(table, name, key))
    out.push_back(read_string(path_, node, name + "." + key));
  return out;
}

std::vector<double> TermReader::numbers(const toml::node &node, const std::string &name,
                                        bool finite) const {
  std::vector<double> out;
  if (!node.is_array())
    fail(path_, node, fmt::format("key '{}': must be a list of numbers", name));
  for (const toml::node &entry : *node.as_array()) {
    const auto value = entry.value<double>();
    if (!value || std::isnan(*value) || (finite && !std::isfinite(*value)))
      fail(path_, entry, fmt::format("key '{}': must be finite numbers", name));
    out.push_back(*value);
  }
  return out;
}

std::vector<Parameter> TermReader::parameters(const char *key) const {
  std::vector<Parameter> out;
  const std::string name = fmt::format("term.{}", key);
  if (table_->get(key) == nullptr)
    return out;
  for (const toml::node &node : array_at(*table_, "term", key)) {
    if (!node.is_table())
      fail(path_, node, fmt::format("key '{}': must be an array of tables, [[{}]]", name, name));
    const toml::table &table = *node.as_table();
    check_keys(table, name,
               {"name", "value", "stderr", "unit", "between_logs_sd", "per_log", "new_log"});
    Parameter p;
    p.name = read_string(path_, need(table, name, "name"), name + ".name");
    p.value = read_number(path_, need(table, name, "value"), name + ".value", Range::any);
    if (const toml::node *error = table.get("stderr"))
      p.stderror = read_number(path_, *error, name + ".stderr", Range::not_negative);
    if (const toml::node *unit = table.get("unit"))
      p.unit = read_string(path_, *unit, name + ".unit");
    if (const toml::node *spread = table.get("between_logs_sd"))
      p.between_logs_sd =
          read_number(path_, *spread, name + ".between_logs_sd", Range::not_negative);
    if (const toml::node *each = table.get("per_log"))
      p.per_log = numbers(*each, name + ".per_log", true);
    p.new_log = p.value;
    if (const toml::node *of_new = table.get("new_log"))
      p.new_log = read_number(path_, *of_new, name + ".new_log", Range::any);
    if (!is_identifier(p.name))
      fail(path_, *table.get("name"), fmt::format("key '{}.name': no name: '{}'", name, p.name));
    if (std::any_of(out.begin(), out.end(), [&p](const Parameter &o) { return o.name == p.name; }))
      fail(path_, *table.get("name"), fmt::format("parameter '{}' is there twice", p.name));
    out.push_back(p);
  }
  return out;
}

TermKind TermReader::read_kind() const {
  const toml::node *node = table_->get("kind");
  const std::string name = node == nullptr ? "mean" : read_string(path_, *node, "term.kind");
  for (const KindName &kind : kKinds) {
    if (name == kind.name)
      return kind.kind;
  }
  fail(path_, *node,
       fmt::format("key 'term.kind': no kind '{}' (mean, variance, stuck, dropout)", name));
}

// What is measured of an outcome is known only after what is predicted of it.
void TermReader::check_feature(const toml::node &node, const std::string &channel,
                               const std::string &feature) const {
  if (feature == "z." + channel)
    fail(path_, node,
         fmt::format("'{}': a cycle: the term takes the outcome that it predicts", feature));
  Role role = Role::outcome;
  if (feature != kTime &&
      (!role_of_name(feature, role) || (role != Role::context && role != Role::command &&
                                        role != Role::sensor && role != Role::mean)))
    fail(path_, node, fmt::format("'{}': must be a feature (x. u. s. m.) or {}", feature, kTime));
}

void TermReader::read_arguments(Term *term) const {
  const toml::node *node = table_->get("arguments");
  if (node == nullptr)
    return;
  if (!node->is_table())
    fail(path_, *node, "key 'term.arguments': must be a table, { v = \"s.speed_mps\" }");
  for (const auto &[key, value] : *node->as_table()) {
    const std::string name(key.str());
    const std::string feature = read_string(path_, value, "term.arguments." + name);
    if (!is_identifier(name) || name == "m" || name == "t" || is_function(name))
      fail(path_, value, fmt::format("key 'term.arguments': '{}' cannot name an argument", name));
    check_feature(value, term->channel, feature);
    term->arguments[name] = feature;
  }
}

void TermReader::read_table(Term *term) const {
  if (const toml::node *knots = table_->get("knots"))
    term->knots = numbers(*knots, "term.knots", true);
  if (const toml::node *values = table_->get("values"))
    term->values = numbers(*values, "term.values", true);
  const toml::node *at = table_->get(table_->get("knots") != nullptr ? "knots" : "values");
  if (term->form != "table") {
    if (at != nullptr)
      fail(path_, *at, fmt::format("form '{}' has no knots and values", term->form));
    return;
  }
  if (at == nullptr)
    at = table_;
  if (term->knots.size() < 2 || term->knots.size() != term->values.size())
    fail(path_, *at,
         fmt::format("a table needs at least two knots and as many values, not {} and {}",
                     term->knots.size(), term->values.size()));
  for (std::size_t k = 1; k < term->knots.size(); ++k) {
    if (!(term->knots[k] > term->knots[k - 1]))
      fail(path_, *at, "key 'term.knots': must rise");
  }
  if (term->arguments.size() != 1)
    fail(path_, *at, "a table needs one argument");
}

void TermReader::read_response(Term *term) const {
  const toml::node *node = table_->get("response");
  if (node == nullptr)
    return;
  if (!node->is_table())
    fail(path_, *node, "key 'term.response': must be a table, \"u.a*s.b\" = 0.5");
  if (term->form != "delay" && term->form != "lag_command")
    fail(path_, *node, fmt::format("form '{}' has no response", term->form));
  for (const auto &[key, value] : *node->as_table()) {
    const std::string product(key.str());
    for (std::size_t at = 0; at <= product.size();) {
      const std::size_t end = std::min(product.find('*', at), product.size());
      check_feature(value, term->channel, product.substr(at, end - at));
      at = end + 1;
    }
    term->response[product] = read_number(path_, value, "term.response." + product, Range::any);
  }
}

void TermReader::read_ridges(Term *term) const {
  const toml::node *node = table_->get("ridge");
  if (node == nullptr)
    return;
  if (!node->is_array() || (term->form != "delay" && term->form != "lag_command"))
    fail(path_, *node, "key 'term.ridge': [[term.ridge]] of a delay or lag of a command");
  for (const toml::node &entry : *node->as_array()) {
    if (!entry.is_table())
      fail(path_, entry, "key 'term.ridge': must be tables, [[term.ridge]]");
    const toml::table &table = *entry.as_table();
    check_keys(table, "term.ridge", {"weights", "knots", "values"});
    Ridge ridge;
    const toml::node &weights = need(table, "term.ridge", "weights");
    if (!weights.is_table() || weights.as_table()->empty())
      fail(path_, weights, "key 'term.ridge.weights': must be a table, { \"u.a\" = 1.0 }");
    for (const auto &[key, value] : *weights.as_table()) {
      check_feature(value, term->channel, std::string(key.str()));
      ridge.weights[std::string(key.str())] =
          read_number(path_, value, "term.ridge.weights", Range::any);
    }
    const toml::node &knots = need(table, "term.ridge", "knots");
    ridge.knots = numbers(knots, "term.ridge.knots", true);
    ridge.values = numbers(need(table, "term.ridge", "values"), "term.ridge.values", true);
    if (ridge.knots.size() < 2 || ridge.knots.size() != ridge.values.size() ||
        !(ridge.knots.back() > ridge.knots.front()))
      fail(path_, knots, "key 'term.ridge.knots': at least two, rising, and as many values");
    term->ridges.push_back(std::move(ridge));
  }
}

// On an angle the lower bound may exceed the upper: the interval then runs through pi.
void TermReader::check_bounds(const toml::table &table, const Gate &gate) const {
  for (std::size_t k = 0; k < gate.features.size(); ++k) {
    const bool is_angle = turn_in(gate.units[k]) > 0.0 && !gate.is_ellipse;
    const bool is_right = gate.is_ellipse ? gate.lower[k] < gate.upper[k]
                                          : gate.lower[k] <= gate.upper[k] || is_angle;
    if (!is_right)
      fail(path_, *table.get("lower"),
           fmt::format("bounds of '{}' the wrong way round: {} above {}", gate.features[k],
                       gate.lower[k], gate.upper[k]));
  }
}

void TermReader::read_ellipsoid(const toml::table &table, Gate *gate) const {
  const std::size_t d = gate->features.size();
  if (const toml::node *center = table.get("center")) {
    gate->center = numbers(*center, "term.region.center", !gate->lower.empty() && gate->is_ellipse);
    if (gate->center.size() != d)
      fail(path_, *center, fmt::format("key 'term.region.center': must be {} numbers", d));
  }
  if (const toml::node *shape = table.get("inverse_shape")) {
    Eigen::MatrixXd a(d, d);
    if (!shape->is_array() || shape->as_array()->size() != d)
      fail(path_, *shape, fmt::format("key 'term.region.inverse_shape': must be {} rows", d));
    for (std::size_t i = 0; i < d; ++i) {
      const toml::node &entry = *shape->as_array()->get(i);
      const std::vector<double> row = numbers(entry, "term.region.inverse_shape", true);
      if (row.size() != d)
        fail(path_, entry, fmt::format("key 'term.region.inverse_shape': a row of {} numbers", d));
      for (std::size_t j = 0; j < d; ++j)
        a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
      gate->inverse_shape.insert(gate->inverse_shape.end(), row.begin(), row.end());
    }
    const bool is_symmetric =
        (a - a.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * a.diagonal().cwiseAbs().maxCoeff();
    if (gate->is_ellipse &&
        (!is_symmetric || Eigen::LLT<Eigen::MatrixXd>(a).info() != Eigen::Success))
      fail(path_, *shape, "key 'term.region.inverse_shape': must be symmetric, positive definite");
  }
  if (gate->is_ellipse && (gate->center.empty() || gate->inverse_shape.empty()))
    fail(path_, table, "an ellipse needs 'center' and 'inverse_shape'");
}

void TermReader::read_region(const char *key, Gate *gate) const {
  const toml::node *node = table_->get(key);
  if (node == nullptr)
    return;
  const std::string name = std::string("term.") + key;
  if (!node->is_table())
    fail(path_, *node, fmt::format("key '{0}': must be a table, [{0}]", name));
  const toml::table &table = *node->as_table();
  check_keys(table, name,
             {"features", "units", "lower", "upper", "shape", "center", "inverse_shape"});
  gate->features = texts(table, name, "features");
  const std::size_t d = gate->features.size();
  if (d == 0 || std::set<std::string>(gate->features.begin(), gate->features.end()).size() != d)
    fail(path_, need(table, name, "features"), "a region needs features, each once");
  gate->units = table.contains("units") ? texts(table, name, "units") : std::vector<std::string>(d);
  const std::string shape =
      table.contains("shape") ? read_string(path_, *table.get("shape"), name + ".shape") : "box";
  if (shape != "box" && shape != "ellipse")
    fail(path_, *table.get("shape"),
         fmt::format("key '{}.shape': must be \"box\" or \"ellipse\"", name));
  gate->is_ellipse = shape == "ellipse";
  gate->lower = numbers(need(table, name, "lower"), name + ".lower", gate->is_ellipse);
  gate->upper = numbers(need(table, name, "upper"), name + ".upper", gate->is_ellipse);
  if (gate->units.size() != d || gate->lower.size() != d || gate->upper.size() != d)
    fail(path_, table,
         fmt::format("a region over {} features needs {} units, lower and upper "
                     "bounds",
                     d, d));
  check_bounds(table, *gate);
  read_ellipsoid(table, gate);
}

void TermReader::check_delay(const Term &term) const {
  std::vector<std::string> names;
  if (term.form == kBacklash)
    names.emplace_back("play");
  if (term.form.rfind("lag", 0) == 0)
    names.emplace_back("lag");
  if (term.form.rfind("delay", 0) == 0 || term.form == "lag_delay" || term.form == "lag_length")
    names.emplace_back("delay");
  if (is_late_form(term.form) && term.form.find("_length") != std::string::npos &&
      term.arguments.count(kAlong) == 0)
    fail(path_, *table_, fmt::format("form '{}' needs the argument '{}'", term.form, kAlong));
  for (const std::string &name : names) {
    const auto found = std::find_if(term.shape.begin(), term.shape.end(),
                                    [&name](const Parameter &p) { return p.name == name; });
    if (found == term.shape.end() || !(found->value >= 0.0))
      fail(path_, *table_,
           fmt::format("form '{}' needs a [[term.shape]] named '{}', not negative", term.form,
                       name));
  }
}

void TermReader::check_swing(const Term &term) const {
  if (term.shape.size() != 2 || term.shape[0].name != "period" || !(term.shape[0].value > 0.0) ||
      term.shape[1].name != "phase")
    fail(path_, *table_,
         fmt::format("form '{}' needs two [[term.shape]], 'period', above 0, and 'phase'",
                     term.form));
  if (term.sizes.size() != 1)
    fail(path_, *table_,
         fmt::format("form '{}' needs one [[term.size]], its amplitude", term.form));
  for (const Parameter *p : {&term.sizes[0], &term.shape[1]}) {
    if (!p->per_log.empty() && p->per_log.size() != term.logs.size())
      fail(path_, *table_,
           fmt::format("form '{}': '{}' has {} values for {} logs", term.form, p->name,
                       p->per_log.size(), term.logs.size()));
  }
}

void TermReader::check_form(const Term &term) const {
  const toml::node *form = table_->get("form");
  const toml::node &at = form != nullptr ? *form : static_cast<const toml::node &>(*table_);
  if (!is_identifier(term.form))
    fail(path_, at, fmt::format("key 'term.form': no name: '{}'", term.form));
  const bool is_built_in = term.form == "table" || has_no_expression(term.form); // no expression
  if (term.kind != TermKind::mean) {
    if (!term.basis.empty() || is_built_in)
      fail(path_, at,
           fmt::format("form '{}': a term of kind '{}' has no form of its own", term.form,
                       kind_name(term.kind)));
    return;
  }
  if (is_built_in && !term.basis.empty())
    fail(path_, *table_->get("basis"),
         fmt::format("form '{}' is built in and takes no basis", term.form));
  if (!is_built_in && term.basis.empty())
    fail(path_, at,
         fmt::format("unknown form '{}': it has no basis and is none of table, delay, "
                     "delay_reading, lag, lag_command, lag_delay, backlash, periodic_time",
                     term.form));
  if (is_swing(term))
    check_swing(term);
  else if (is_built_in && term.form != "table")
    check_delay(term);
}

// Fixed forms (a saturation) have no size: 1 is meant.
void TermReader::check_sizes(const Term &term) const {
  const toml::node *size = table_->get("size");
  const toml::node &at = size != nullptr ? *size : static_cast<const toml::node &>(*table_);
  const std::size_t n = term.sizes.size();
  if (term.kind == TermKind::variance) {
    if (n != 1 || !(term.sizes[0].value > 0.0))
      fail(path_, at, "a variance term needs one [[term.size]], its ratio, above 0");
    return;
  }
  if (term.kind != TermKind::mean) {
    if (n > 0)
      fail(path_, at, fmt::format("a term of kind '{}' has no size", kind_name(term.kind)));
    return;
  }
  const std::size_t columns = std::max<std::size_t>(1, term.basis.size());
  if (n != columns && !(n == 0 && columns == 1))
    fail(path_, at, fmt::format("{} sizes for {} basis functions", n, columns));
}

void TermReader::check_expression(const Term &term, const std::string &expression,
                                  const toml::node &node) const {
  const auto refuse = [&](const std::string &why) {
    fail(path_, node, fmt::format("expression '{}': {}", expression, why));
  };
  std::set<std::string> names{"m", "t", "_pi"};
  for (const auto &[name, feature] : term.arguments)
    names.insert(name);
  for (const Parameter &p : term.shape)
    names.insert(p.name);
  try {
    mu::Parser parser;
    std::map<std::string, double> values;
    for (const std::string &name : names) {
      if (name != "_pi")
        parser.DefineVar(name, &(values[name] = 0.5));
    }
    for (const Parameter &p : term.shape)
      values[p.name] = p.value;
    const std::map<std::string, double> before = values;
    parser.SetExpr(expression);
    for (const auto &[used, value] : parser.GetUsedVar()) {
      if (names.count(used) == 0)
        refuse(fmt::format("'{}' is neither an argument nor a shape parameter, m or t", used));
    }
    (void)parser.Eval();
    if (parser.GetNumResults() != 1 || values != before)
      refuse("must be one value and assign nothing");
  } catch (const mu::Parser::exception_type &error) {
    refuse(error.GetMsg());
  }
}

void TermReader::check_expressions(const Term &term) const {
  for (const Parameter &p : term.shape) {
    if (p.name == "m" || p.name == "t" || is_function(p.name) || term.arguments.count(p.name) > 0)
      fail(path_, *table_->get("shape"),
           fmt::format("shape parameter '{}' has the name of something else", p.name));
  }
  for (std::size_t k = 0; k < term.basis.size(); ++k)
    check_expression(term, term.basis[k], *table_->get("basis")->as_array()->get(k));
}

Term TermReader::read() {
  check_keys(*table_, "term",
             {"channel", "cause", "form", "kind", "basis", "arguments", "size", "shape", "region",
              "support", "knots", "values", "response", "ridge", "logs"});
  Term term;
  term.channel = read_string(path_, need(*table_, "term", "channel"), "term.channel");
  term.cause = read_string(path_, need(*table_, "term", "cause"), "term.cause");
  const toml::node *form = table_->get("form");
  term.form = form == nullptr ? term.cause : read_string(path_, *form, "term.form");
  term.kind = read_kind();
  if (table_->contains("basis"))
    term.basis = texts(*table_, "term", "basis");
  if (table_->contains("logs"))
    term.logs = texts(*table_, "term", "logs");
  term.sizes = parameters("size");
  term.shape = parameters("shape");
  read_arguments(&term);
  read_table(&term);
  read_response(&term);
  read_ridges(&term);
  for (const auto &[key, gate] : {std::pair{"region", &term.gate}, {"support", &term.support}}) {
    read_region(key, gate);
    for (const std::string &feature : gate->features)
      check_feature(*table_->get(key)->as_table()->get("features"), term.channel, feature);
  }
  check_form(term);
  check_sizes(term);
  check_expressions(term);
  return term;
}

// A box's ellipsoid, where its bounds have one.
void fill_box(Gate *gate) {
  const std::size_t d = gate->features.size();
  std::vector<double> center(d), inverse(d * d, 0.0);
  for (std::size_t k = 0; k < d; ++k) {
    const double half = 0.5 * (gate->upper[k] - gate->lower[k]);
    if (!(half > 0.0) || !std::isfinite(half))
      return;
    center[k] = 0.5 * (gate->lower[k] + gate->upper[k]);
    inverse[k * d + k] = 1.0 / (half * half);
  }
  if (gate->center.empty())
    gate->center = center;
  if (gate->inverse_shape.empty())
    gate->inverse_shape = inverse;
}

} // namespace

std::string extension_toml(const std::vector<Term> &terms, const std::string &made_by) {
  std::string out = comment(made_by);
  out += "#\n# Terms added to a model's prediction: what (basis, size) and where (region).\n"
         "# rim simulate, replay and diagnose read it with --extension.\n\n";
  out += fmt::format("schema = \"{}\"\n", kSchema);
  for (const Term &term : terms)
    out += term_toml(term);
  return out;
}

std::vector<Term> read_extension(const std::string &path) {
  const toml::table file = parse_toml(path);
  for (const auto &[key, node] : file) {
    if (key.str() != "schema" && key.str() != "term")
      fail(path, node, fmt::format("unknown key '{}'", key.str()));
  }
  const toml::node *schema = file.get("schema");
  if (schema == nullptr)
    throw DataError(path +
                    fmt::format(": key 'schema' is missing: no extension (\"{}\")", kSchema));
  if (read_string(path, *schema, "schema") != kSchema)
    fail(path, *schema, fmt::format("key 'schema': must be \"{}\"", kSchema));
  std::vector<Term> terms;
  const toml::node *list = file.get("term");
  if (list == nullptr)
    return terms;
  if (!list->is_array())
    fail(path, *list, "key 'term': must be an array of tables, [[term]]");
  for (const toml::node &node : *list->as_array()) {
    terms.push_back(TermReader(path, node).read());
    for (Gate *gate : {&terms.back().gate, &terms.back().support}) {
      if (!gate->is_ellipse)
        fill_box(gate);
    }
  }
  return terms;
}

namespace {

// Complains about a term with the line of its key in the file, while that can still be read.
class Complaint {
public:
  explicit Complaint(const std::string &path) : path_(path) {}

  [[noreturn]] void operator()(std::size_t term, const char *key, const std::string &why) const {
    throw DataError(place(term, key) + why);
  }

private:
  std::string place(std::size_t term, const char *key) const {
    try {
      const toml::table file = parse_toml(path_);
      const toml::array *terms = file.get_as<toml::array>("term");
      const toml::node *node = terms != nullptr ? terms->get(term) : nullptr;
      if (node != nullptr && node->is_table() && node->as_table()->get(key) != nullptr)
        node = node->as_table()->get(key);
      return node != nullptr ? rim::where(path_, *node) : path_ + ": ";
    } catch (const DataError &) {
      return path_ + ": ";
    }
  }

  std::string path_;
};

// `unit` is what the file says, or else what the feature's name says.
void check_unit(const Complaint &complain, std::size_t term, const char *key,
                const std::string &name, const std::string &unit, const Measured &measured) {
  if (name == kTime) {
    if (!unit.empty() && unit != "s")
      complain(term, key, fmt::format("'{}' is in s, not in '{}'", name, unit));
    return;
  }
  const int exact = measured.find_feature(name);
  const int f = exact >= 0 ? exact : measured.find_feature(base_feature(name));
  if (f < 0)
    complain(term, key, fmt::format("there is no feature '{}' in the logs", base_feature(name)));
  const std::string &has = measured.features[static_cast<std::size_t>(f)].unit;
  if (!unit.empty() && unit != has)
    complain(term, key, fmt::format("'{}' is in '{}' in the logs, not in '{}'", name, has, unit));
}

} // namespace

void check_extension(const std::vector<Term> &terms, const Measured &measured,
                     const std::string &path) {
  const Complaint complain(path);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Term &term = terms[i];
    const int c = measured.find_channel(term.channel);
    if (c < 0)
      complain(i, "channel", fmt::format("there is no channel '{}' in the logs", term.channel));
    const std::string &unit = measured.channels[static_cast<std::size_t>(c)].unit;
    for (const auto &[name, feature] : term.arguments)
      check_unit(complain, i, "arguments", feature, unit_of_name(base_feature(feature)), measured);
    for (const auto &[product, coefficient] : term.response) {
      for (std::size_t at = 0; at <= product.size();) {
        const std::size_t end = std::min(product.find('*', at), product.size());
        const std::string feature = product.substr(at, end - at);
        check_unit(complain, i, "response", feature, unit_of_name(feature), measured);
        at = end + 1;
      }
    }
    for (const Ridge &ridge : term.ridges) {
      for (const auto &[feature, weight] : ridge.weights)
        check_unit(complain, i, "ridge", feature, unit_of_name(feature), measured);
    }
    for (std::size_t k = 0; k < term.gate.features.size(); ++k)
      check_unit(complain, i, "region", term.gate.features[k], term.gate.units[k], measured);
    for (std::size_t k = 0; k < term.support.features.size(); ++k)
      check_unit(complain, i, "support", term.support.features[k], term.support.units[k], measured);
    for (std::size_t k = 0; k < term.basis.size() && k < term.sizes.size(); ++k) {
      if (term.basis[k] == "1" && term.sizes[k].unit != unit)
        complain(i, "size",
                 fmt::format("the size of '{}' is in '{}', the channel in '{}'", term.cause,
                             term.sizes[k].unit, unit));
    }
  }
}

} // namespace rim::diagnose
