// SPDX-License-Identifier: MIT
#include "diagnose/catalogue.hpp"

#include <algorithm>
#include <initializer_list>
#include <map>

#include <fmt/format.h>
#include <muParser.h>
#include <toml++/toml.h>

#include "util/atomic_file.hpp"
#include "util/error.hpp"

namespace rim::diagnose {

namespace {

const std::map<std::string, ArgumentRole> kRoles{
    {"any", ArgumentRole::any},
    {"other", ArgumentRole::other},
    {"own", ArgumentRole::own},
    {"velocity", ArgumentRole::velocity},
    {"signed", ArgumentRole::signed_},
    {"command", ArgumentRole::command},
    {"angle", ArgumentRole::angle},
    {"heading", ArgumentRole::heading},
    {"altitude", ArgumentRole::altitude},
    {"state", ArgumentRole::state},
    {"lagged", ArgumentRole::lagged},
    {"held", ArgumentRole::held},
    {"own_state", ArgumentRole::own_state},
    {"stream", ArgumentRole::stream},
    {"alike", ArgumentRole::alike},
};
const std::map<std::string, TermKind> kKinds{{"mean", TermKind::mean},
                                             {"variance", TermKind::variance},
                                             {"stuck", TermKind::stuck},
                                             {"dropout", TermKind::dropout}};
const std::map<std::string, GateKind> kGates{
    {"none", GateKind::none}, {"interval", GateKind::interval}, {"pair", GateKind::pair}};

class Reader {
public:
  explicit Reader(std::string path) { catalogue_.path = std::move(path); }
  Catalogue read();

private:
  [[noreturn]] void fail(const toml::node *at, const std::string &reason) const {
    std::string where = catalogue_.path;
    if (at != nullptr && at->source().begin)
      where += ":line " + std::to_string(at->source().begin.line);
    throw DataError(where + ": " + reason);
  }
  void check_keys(const toml::table &table, std::initializer_list<std::string_view> known) const {
    for (const auto &[key, node] : table) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(&node, fmt::format("unknown key '{}'", key.str()));
    }
  }
  template <class T> T get(const toml::table &table, const char *key, T otherwise) const {
    const toml::node *node = table.get(key);
    if (node == nullptr)
      return otherwise;
    const auto value = node->value<T>();
    if (!value)
      fail(node, fmt::format("'{}' is of the wrong type", key));
    return *value;
  }
  template <class T>
  T choice(const toml::table &table, const char *key, const std::map<std::string, T> &known,
           const char *otherwise) const {
    const auto text = get<std::string>(table, key, otherwise);
    const auto found = known.find(text);
    if (found == known.end())
      fail(table.get(key), fmt::format("unknown {} '{}'", key, text));
    return found->second;
  }
  std::vector<std::string> texts(const toml::table &table, const char *key) const;
  void read_arguments(const toml::table &table, Form *form) const;
  void read_shape(const toml::table &table, Form *form) const;
  void check_names(const toml::table &table, const Form &form) const;
  void check_sizes(const toml::table &table, const Form &form) const;
  void check_expressions(const toml::table &table, const Form &form) const;
  void read_form(const toml::table &table);
  void read_sets(const toml::table &root);

  Catalogue catalogue_;
};

std::vector<std::string> Reader::texts(const toml::table &table, const char *key) const {
  std::vector<std::string> out;
  const toml::node *node = table.get(key);
  if (node == nullptr)
    return out;
  if (!node->is_array())
    fail(node, fmt::format("'{}' must be a list of texts", key));
  for (const toml::node &entry : *node->as_array()) {
    const auto text = entry.value<std::string>();
    if (!text)
      fail(&entry, fmt::format("'{}' must be a list of texts", key));
    out.push_back(*text);
  }
  return out;
}

void Reader::read_arguments(const toml::table &table, Form *form) const {
  const toml::node *node = table.get("arguments");
  if (node == nullptr)
    return;
  if (!node->is_table())
    fail(node, "'arguments' must be a table: { v = \"velocity\" }");
  for (const auto &[key, value] : *node->as_table()) {
    Argument argument;
    argument.name = std::string(key.str());
    const auto found = kRoles.find(value.value<std::string>().value_or(""));
    if (found == kRoles.end())
      fail(&value, fmt::format("unknown role of argument '{}'", argument.name));
    argument.role = found->second;
    form->arguments.push_back(argument);
  }
  if (form->arguments.size() > 2)
    fail(node, "a form takes at most two arguments");
}

void Reader::read_shape(const toml::table &table, Form *form) const {
  const toml::node *node = table.get("shape");
  if (node == nullptr)
    return;
  if (!node->is_table())
    fail(node, "'shape' must be a table of parameters");
  for (const auto &[key, value] : *node->as_table()) {
    if (!value.is_table())
      fail(&value, "a shape parameter is a table: { quantiles_of = \"f\", count = 8 }");
    const toml::table &entry = *value.as_table();
    check_keys(entry, {"quantiles_of", "count", "low_share", "high_share", "values", "unit",
                       "first_is_usual", "most_of_rms", "share_of"});
    ShapeParameter p;
    p.name = std::string(key.str());
    p.quantiles_of = get<std::string>(entry, "quantiles_of", "");
    p.count = static_cast<int>(get<std::int64_t>(entry, "count", 8));
    p.low_share = get<double>(entry, "low_share", 0.05);
    p.high_share = get<double>(entry, "high_share", 0.95);
    p.unit = get<std::string>(entry, "unit", "");
    p.first_is_usual = get<bool>(entry, "first_is_usual", false);
    p.share_of = get<std::string>(entry, "share_of", "");
    p.most_of_rms = get<double>(entry, "most_of_rms", p.most_of_rms);
    if (const toml::array *values = entry.get_as<toml::array>("values")) {
      for (const toml::node &number : *values) {
        if (!number.value<double>())
          fail(&number, "'values' must be numbers");
        p.values.push_back(*number.value<double>());
      }
    }
    if (p.values.empty() == p.quantiles_of.empty())
      fail(&value, "a shape parameter needs either 'quantiles_of' or 'values'");
    if (p.count < 1 || p.count > 64 ||
        !(p.low_share >= 0.0 && p.low_share < p.high_share && p.high_share <= 1.0))
      fail(&value, "count must be 1 to 64, and 0 <= low_share < high_share <= 1");
    form->shape.push_back(p);
  }
  if (form->shape.size() > 2)
    fail(node, "a form takes at most two shape parameters");
  if (form->shape.size() == 2 && form->shape[1].values.empty())
    fail(node, "the second shape parameter, in the order of the alphabet, needs 'values'");
}

// What quantiles_of and per name must be an argument, the prediction or the time.
void Reader::check_names(const toml::table &table, const Form &form) const {
  const auto is_argument = [&form](const std::string &name) {
    return std::any_of(form.arguments.begin(), form.arguments.end(),
                       [&name](const Argument &a) { return a.name == name; });
  };
  for (const ShapeParameter &p : form.shape) {
    if (!p.share_of.empty() && !is_argument(p.share_of))
      fail(table["shape"][p.name].node(), fmt::format("share_of '{}' is no argument", p.share_of));
    std::string of = p.quantiles_of;
    if (of.rfind("abs(", 0) == 0 && of.back() == ')')
      of = of.substr(4, of.size() - 5);
    if (!of.empty() && of != "m" && of != "t" && !is_argument(of))
      fail(table["shape"][p.name].node(),
           fmt::format("quantiles_of '{}' is neither an argument nor m nor t, nor the abs() of one",
                       p.quantiles_of));
  }
  for (const std::string &name : form.per) {
    if (name != "m" && name != "t" && !is_argument(name))
      fail(table.get("per"), fmt::format("per '{}' is neither an argument nor m nor t", name));
  }
}

void Reader::check_sizes(const toml::table &table, const Form &form) const {
  if (form.basis.size() > 2)
    fail(table.get("basis"), "a form has at most two basis functions");
  if (form.basis.size() == 2 && (form.is_fixed || form.gate == GateKind::pair))
    fail(table.get("basis"),
         "a form of two basis functions can be neither fixed nor gated by two features");
  if (!form.size_names.empty() && form.size_names.size() != form.basis.size())
    fail(table.get("sizes"), "there must be as many names of sizes as basis functions");
}

void Reader::check_expressions(const toml::table &table, const Form &form) const {
  for (const std::string &expression : form.basis) {
    mu::Parser parser;
    std::map<std::string, double> values{{"m", 0.5}, {"t", 0.5}};
    for (const Argument &a : form.arguments)
      values[a.name] = 0.5;
    for (const ShapeParameter &p : form.shape)
      values[p.name] = 0.5;
    try {
      for (auto &[name, value] : values)
        parser.DefineVar(name, &value);
      parser.SetExpr(expression);
      parser.Eval();
    } catch (const mu::Parser::exception_type &e) {
      fail(table.get("basis"), fmt::format("expression '{}': {}", expression, e.GetMsg()));
    }
  }
}

void Reader::read_form(const toml::table &table) {
  check_keys(table, {"cause", "form", "description", "kind", "basis", "arguments", "unordered",
                     "fixed", "positive", "gate", "shape", "per", "least_spread", "most_spread",
                     "cost", "sizes", "physical", "better", "worse_by", "of_command"});
  Form form;
  form.line = static_cast<int>(table.source().begin.line);
  form.cause = get<std::string>(table, "cause", "");
  if (form.cause.empty())
    fail(&table, "a form needs a 'cause'");
  form.form = get<std::string>(table, "form", form.cause);
  form.description = get<std::string>(table, "description", "");
  form.kind = choice(table, "kind", kKinds, "mean");
  form.basis = texts(table, "basis");
  form.gate = choice(table, "gate", kGates, "none");
  form.is_unordered = get<bool>(table, "unordered", false);
  form.is_fixed = get<bool>(table, "fixed", false);
  form.is_positive = get<bool>(table, "positive", false);
  form.cost = get<double>(table, "cost", 0.0);
  form.least_spread = get<double>(table, "least_spread", 0.0);
  form.most_spread = get<double>(table, "most_spread", form.most_spread);
  form.per = texts(table, "per");
  form.size_names = texts(table, "sizes");
  form.is_physical = get<bool>(table, "physical", false);
  form.better = get<std::string>(table, "better", "");
  form.worse_by = get<double>(table, "worse_by", 5.0);
  form.is_of_command = get<bool>(table, "of_command", false);
  read_arguments(table, &form);
  read_shape(table, &form);
  const bool is_built_in = has_no_expression(form.form);
  if (form.kind == TermKind::mean && form.basis.empty() != is_built_in)
    fail(&table, is_built_in ? fmt::format("form '{}' is built in and takes no basis", form.form)
                             : fmt::format("unknown form '{}' without a basis", form.form));
  check_sizes(table, form);
  check_names(table, form);
  check_expressions(table, form);
  for (const Form &other : catalogue_.forms) {
    if (other.form == form.form)
      fail(&table, fmt::format("form '{}' is there twice", form.form));
  }
  catalogue_.forms.push_back(form);
}

void Reader::read_sets(const toml::table &root) {
  const toml::node *node = root.get("set");
  if (node == nullptr)
    return;
  if (!node->is_array())
    fail(node, "a set must be a table: [[set]]");
  for (const toml::node &entry : *node->as_array()) {
    if (!entry.is_table())
      fail(&entry, "a set must be a table: [[set]]");
    check_keys(*entry.as_table(), {"forms"});
    catalogue_.sets.push_back(texts(*entry.as_table(), "forms"));
    if (catalogue_.sets.back().size() < 2)
      fail(&entry, "a set needs 'forms', at least two");
  }
}

Catalogue Reader::read() {
  toml::table root;
  try {
    root = toml::parse(read_file(catalogue_.path), catalogue_.path);
  } catch (const toml::parse_error &e) {
    throw DataError(fmt::format("{}:line {}: {}", catalogue_.path, e.source().begin.line,
                                std::string(e.description())));
  }
  check_keys(root, {"schema", "cause", "set"});
  if (root["schema"].value_or(std::string()) != "rim-causes/1")
    fail(&root, "schema must be \"rim-causes/1\"");
  const toml::array *causes = root.get_as<toml::array>("cause");
  if (causes == nullptr || causes->empty())
    fail(&root, "there is no [[cause]]");
  for (const toml::node &entry : *causes) {
    if (!entry.is_table())
      fail(&entry, "a cause must be a table: [[cause]]");
    read_form(*entry.as_table());
  }
  read_sets(root);
  return std::move(catalogue_);
}

} // namespace

Catalogue read_catalogue(const std::string &path) { return Reader(path).read(); }

Catalogue merged(const Catalogue &base, const Catalogue &more) {
  Catalogue out = base;
  for (const Form &form : more.forms) {
    const auto same = std::find_if(out.forms.begin(), out.forms.end(),
                                   [&form](const Form &f) { return f.form == form.form; });
    if (same != out.forms.end())
      *same = form;
    else
      out.forms.push_back(form);
  }
  out.sets.insert(out.sets.end(), more.sets.begin(), more.sets.end());
  return out;
}

} // namespace rim::diagnose
