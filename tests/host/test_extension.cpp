// SPDX-License-Identifier: MIT
// extension.toml: every kind of term comes back to the same bits; what is wrong is refused with its
// line.
#include "check.hpp"
#include "diagnose/extension.hpp"
#include "temporary.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <unistd.h>

#include "util/error.hpp"

namespace {

using rim::diagnose::Gate;
using rim::diagnose::Parameter;
using rim::diagnose::Term;
using rim::diagnose::TermKind;

std::string written(const std::string &text) {
  const std::string path = temporary_path("extension.toml");
  std::ofstream(path) << text;
  return path;
}

bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool same(const std::vector<double> &a, const std::vector<double> &b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

void assert_same(const std::vector<Parameter> &a, const std::vector<Parameter> &b) {
  assert_int_equal(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    assert_string_equal(a[i].name.c_str(), b[i].name.c_str());
    assert_string_equal(a[i].unit.c_str(), b[i].unit.c_str());
    assert_true(same(a[i].value, b[i].value) && same(a[i].stderror, b[i].stderror));
  }
}

void assert_same(const Term &a, const Term &b) {
  assert_string_equal(a.channel.c_str(), b.channel.c_str());
  assert_string_equal(a.cause.c_str(), b.cause.c_str());
  assert_string_equal(a.form.c_str(), b.form.c_str());
  assert_true(a.kind == b.kind);
  assert_true(a.basis == b.basis && a.arguments == b.arguments);
  assert_same(a.sizes, b.sizes);
  assert_same(a.shape, b.shape);
  assert_true(same(a.knots, b.knots) && same(a.values, b.values));
  assert_int_equal(a.response.size(), b.response.size());
  for (const auto &[product, coefficient] : a.response)
    assert_true(same(coefficient, b.response.at(product)));
  assert_true(a.gate.features == b.gate.features && a.gate.units == b.gate.units);
  assert_true(same(a.gate.lower, b.gate.lower) && same(a.gate.upper, b.gate.upper));
  assert_true(a.gate.is_ellipse == b.gate.is_ellipse);
  assert_true(same(a.gate.center, b.gate.center));
  assert_true(same(a.gate.inverse_shape, b.gate.inverse_shape));
}

Gate box() {
  Gate gate;
  gate.features = {"s.altitude_m", "x.heading_rad"};
  gate.units = {"m", "rad"};
  gate.lower = {-0.0, 2.5};
  gate.upper = {std::nextafter(38400.0, 4e4), -2.5}; // the heading's interval runs through pi
  gate.center = {19200.1, M_PI};
  gate.inverse_shape = {1.0 / 3.0, 0.0, 0.0, 2.0};
  return gate;
}

Gate ellipse() {
  Gate gate;
  gate.features = {"s.speed_mps", "u.throttle"};
  gate.units = {"m/s", ""};
  gate.lower = {-1.0 / 3.0, 0.1};
  gate.upper = {1e19, 5e-324}; // no integer in TOML; the smallest number
  std::swap(gate.lower[1], gate.upper[1]);
  gate.is_ellipse = true;
  gate.center = {0.7, 0.05};
  gate.inverse_shape = {4.0, 0.1, 0.1, 1.0 / 7.0};
  return gate;
}

// One term of every kind.
std::vector<Term> every_kind() {
  std::vector<Term> terms(9);
  for (Term &term : terms) {
    term.channel = "speed_mps";
    term.form = term.cause = "bias";
  }
  terms[0].basis = {"1"};
  terms[0].sizes = {{"size", -1.0 / 3.0, 1e-17, "m/s"}};
  terms[0].gate = box();
  terms[1].cause = "quadratic_drag";
  terms[1].form = "quadratic_drag_density";
  terms[1].basis = {"-v*abs(v)*exp(-h/scale)", "1e-3*v"};
  terms[1].arguments = {{"v", "s.speed_mps"}, {"h", "s.altitude_m"}};
  terms[1].sizes = {{"size", 2.1e-3, 1e-5, "1/m"}, {"size_2", 5.0, 0.0, ""}};
  terms[1].shape = {{"scale", 7000.0, 12.5, "m"}};
  terms[1].gate = ellipse();
  terms[2].cause = terms[2].form = "noise";
  terms[2].kind = TermKind::variance;
  terms[2].sizes = {{"ratio", 2.25, 0.1, ""}};
  terms[3].cause = terms[3].form = "stuck";
  terms[3].kind = TermKind::stuck;
  terms[4].cause = terms[4].form = "dropout";
  terms[4].kind = TermKind::dropout;
  terms[5].cause = "unknown";
  terms[5].form = "table";
  terms[5].arguments = {{"x", "t_s"}};
  terms[5].knots = {-1.0, 0.1, 2.0};
  terms[5].values = {0.0, -0.0, 1.0 / 3.0};
  terms[6].cause = terms[6].form = "delay";
  terms[6].shape = {{"delay", 0.2, 0.0, "s"}};
  terms[6].response = {{"u.throttle", 0.1}, {"u.throttle*s.speed_mps", -2.0}};
  terms[7].cause = "saturation";
  terms[7].form = "saturation";
  terms[7].basis = {"max(-level, min(level, m)) - m"};
  terms[7].shape = {{"level", 3.0, 0.0, "m/s"}};
  terms[8].cause = terms[8].form = "lag";
  terms[8].shape = {{"lag", 0.5, 0.0, "s"}};
  return terms;
}

void every_kind_comes_back(void **) {
  const std::vector<Term> terms = every_kind();
  const std::string text = rim::diagnose::extension_toml(terms, "rim diagnose\n--seed 1");
  assert_int_equal(text.rfind("# rim diagnose\n# --seed 1\n", 0), 0);
  const std::vector<Term> back = rim::diagnose::read_extension(written(text));
  assert_int_equal(terms.size(), back.size());
  for (std::size_t i = 0; i < terms.size(); ++i)
    assert_same(terms[i], back[i]);
  assert_string_equal(rim::diagnose::extension_toml(back, "rim diagnose\n--seed 1").c_str(),
                      text.c_str());
}

void text_cannot_break_the_file(void **) {
  std::vector<Term> terms(1);
  terms[0] = every_kind()[0];
  terms[0].cause = "a \"bias\" \\ [[term]]";
  const std::string text = rim::diagnose::extension_toml(terms, "one\nschema = 3\n[x]");
  const std::vector<Term> back = rim::diagnose::read_extension(written(text));
  assert_int_equal(back.size(), 1);
  assert_string_equal(back[0].cause.c_str(), terms[0].cause.c_str());
}

void no_terms_are_no_extension_but_a_file(void **) {
  assert_true(
      rim::diagnose::read_extension(written(rim::diagnose::extension_toml({}, "x"))).empty());
}

// What a person may leave out.
void a_short_file_will_do(void **) {
  const std::vector<Term> terms = rim::diagnose::read_extension(written(R"(
schema = "rim-extension/1"
[[term]]
channel = "speed_mps"
cause = "bias"
basis = ["1"]
[[term.size]]
name = "size"
value = 2
unit = "m/s"
[term.region]
features = ["s.altitude_m"]
lower = [100]
upper = [300]
)"));
  assert_int_equal(terms.size(), 1);
  assert_string_equal(terms[0].form.c_str(), "bias");
  assert_true(terms[0].kind == TermKind::mean && terms[0].sizes[0].value == 2.0);
  assert_true(terms[0].gate.center[0] == 200.0);
  assert_true(terms[0].gate.inverse_shape[0] == 1e-4);
  assert_true(terms[0].gate.units[0].empty());
}

// Every function that the catalogue's expressions may use may stand in an extension.
void every_function_of_a_catalogue_is_read(void **) {
  for (const char *basis : {"tanh(v/0.1)", "sinh(v)", "log10(abs(v)+1)", "rint(v)", "v*_e"}) {
    const std::vector<Term> terms = rim::diagnose::read_extension(
        written(std::string("schema = \"rim-extension/1\"\n[[term]]\nchannel = \"speed_mps\"\n"
                            "cause = \"smooth\"\nbasis = [\"") +
                basis +
                "\"]\narguments = { v = \"s.speed_mps\" }\n[[term.size]]\nname = \"size\"\n"
                "value = 2\nunit = \"m/s\"\n"));
    assert_int_equal(terms.size(), 1);
    assert_string_equal(terms[0].basis[0].c_str(), basis);
  }
}

template <class Body> void assert_refused(Body body, const char *place, const char *part) {
  try {
    body();
  } catch (const rim::DataError &error) {
    if (std::strstr(error.what(), part) == nullptr || std::strstr(error.what(), place) == nullptr)
      fail_msg("'%s' does not contain '%s' and '%s'", error.what(), place, part);
    return;
  }
  fail_msg("nothing was thrown; expected '%s'", part);
}

// `bad` in place of the line that begins like it, or after the last line of the term.
std::string with(const std::string &bad) {
  static const char *const lines[] = {"schema = \"rim-extension/1\"",
                                      "[[term]]",
                                      "channel = \"speed_mps\"",
                                      "cause = \"drag\"",
                                      "form = \"drag\"",
                                      "kind = \"mean\"",
                                      "basis = [\"-v*abs(v)\"]",
                                      "arguments = { v = \"s.speed_mps\" }",
                                      "[[term.size]]",
                                      "name = \"size\"",
                                      "value = 1.5",
                                      "[term.region]",
                                      "features = [\"s.altitude_m\"]",
                                      "units = [\"m\"]",
                                      "lower = [1.0]",
                                      "upper = [2.0]",
                                      "shape = \"box\""};
  std::string text;
  const std::string key = bad.substr(0, bad.find(' ') + 1);
  bool used = false;
  for (const char *line : lines) {
    const bool is_it = !used && key.size() > 1 && std::strncmp(line, key.c_str(), key.size()) == 0;
    text += (is_it ? bad : std::string(line)) + "\n";
    used = used || is_it;
  }
  return used ? text : text + bad + "\n";
}

struct Bad {
  const char *line, *place, *part;
};

void what_is_wrong_is_refused_with_its_line(void **) {
  (void)rim::diagnose::read_extension(written(with(""))); // the model itself is right
  const Bad bad[] = {
      {"schema = \"rim-extension/2\"", ":line 1: ", "rim-extension/1"},
      {"channel = 3", ":line 3: ", "must be a string"},
      {"kind = \"median\"", ":line 6: ", "no kind 'median'"},
      {"kind = \"variance\"", ":line 5: ", "no form of its own"},
      {"form = \"what ever\"", ":line 5: ", "no name"},
      {"form = \"lag\"", ":line 7: ", "takes no basis"},
      {"basis = []", ":line 5: ", "unknown form 'drag'"},
      {"basis = \"v\"", ":line 7: ", "must be a list"},
      {"basis = [\"v\", \"v*v\"]", ":line 9: ", "1 sizes for 2"},
      {"basis = [\"v*\"]", ":line 7: ", "expression 'v*'"},
      {"basis = [\"v*w\"]", ":line 7: ", "'w' is neither"},
      {"basis = [\"frob(v)\"]", ":line 7: ", "frob"},
      {"basis = [\"v = 3\"]", ":line 7: ", "assign nothing"},
      {"basis = [\"v, m\"]", ":line 7: ", "one value"},
      {"basis = [\"\"]", ":line 7: ", "expression ''"},
      {"arguments = { v = \"z.speed_mps\" }", ":line 8: ", "cycle"},
      {"arguments = { v = \"sd.speed_mps\" }", ":line 8: ", "must be a feature"},
      {"arguments = { m = \"s.speed_mps\" }", ":line 8: ", "cannot name an argument"},
      {"arguments = { \"a b\" = \"s.speed_mps\" }", ":line 8: ", "cannot name an argument"},
      {"arguments = [\"v\"]", ":line 8: ", "must be a table"},
      {"name = \"\"", ":line 10: ", "no name"},
      {"value = nan", ":line 11: ", "finite"},
      {"value = \"1\"", ":line 11: ", "must be a number"},
      {"stderr = -1", ":line 18: ", "unknown key 'term.region.stderr'"},
      {"features = [\"z.speed_mps\"]", ":line 13: ", "cycle"},
      {"features = [\"s.a\", \"s.a\"]", ":line 13: ", "each once"},
      {"features = []", ":line 13: ", "each once"},
      {"units = [\"m\", \"m\"]", ":line 12: ", "needs 1 units"},
      {"lower = [3.0]", ":line 15: ", "wrong way round"},
      {"lower = [nan]", ":line 15: ", "finite"},
      {"lower = [1.0, 1.0]", ":line 12: ", "lower and upper"},
      {"shape = \"ball\"", ":line 17: ", "\"box\" or \"ellipse\""},
      {"shape = \"ellipse\"", ":line 12: ", "'center'"},
      {"shape = \"ellipse\"\ncenter = [1.5]\ninverse_shape = [[-4.0]]", ":line 19: ", "positive"},
      {"shape = \"ellipse\"\ncenter = [1.5]\ninverse_shape = [[4.0, 1.0]]", ":line 19: ", "row"},
      {"shape = \"ellipse\"\ncenter = [1.5, 2.0]\ninverse_shape = [[4.0]]", ":line 18: ", "1 num"},
      {"[nonsense]", ":line 18: ", "unknown key 'nonsense'"},
      {"[term.nonsense]", ":line 18: ", "unknown key 'term.nonsense'"},
      {"[term.response]\n\"u.a\" = 1.0", ":line 18: ", "has no response"},
      {"[[term.size]]\nname = \"size\"\nvalue = 2.0", ":line 19: ", "twice"},
      {"[[term.shape]]\nname = \"v\"\nvalue = 2.0", ":line 18: ", "name of something else"},
      {"[[term.shape]]\nname = \"c\"\nvalue = 2.0\nstderr = -1.0", ":line 21: ", "negative"},
      {"[[term]]\ncause = \"x\"", ":line 18: ", "'term.channel' is missing"},
      {"[[term", ":line 18", ""},
  };
  for (const Bad &b : bad) {
    const std::string path = written(with(b.line));
    assert_refused([&] { (void)rim::diagnose::read_extension(path); }, (path + b.place).c_str(),
                   b.part);
  }
}

void built_in_forms_need_what_they_need(void **) {
  const std::string head = "schema = \"rim-extension/1\"\n[[term]]\nchannel = \"v_mps\"\n"
                           "cause = \"delay\"\n";
  const std::string shape = "[[term.shape]]\nname = \"delay\"\nvalue = 0.1\n";
  const auto refuse = [&](const std::string &text, const char *place, const char *part) {
    const std::string path = written(head + text);
    assert_refused([&] { (void)rim::diagnose::read_extension(path); }, place, part);
  };
  (void)rim::diagnose::read_extension(written(head + shape + "[term.response]\n\"u.a\" = 1\n"));
  (void)rim::diagnose::read_extension(written(head + "form = \"delay_reading\"\n" + shape));
  refuse("", ":line 2: ", "needs a [[term.shape]] named 'delay'");
  refuse("form = \"delay_length\"\n" + shape, ":line 2: ", "needs the argument 'along'");
  (void)rim::diagnose::read_extension(
      written(head + "form = \"delay_length\"\narguments = { along = \"s.v_mps\" }\n" + shape));
  refuse("form = \"lag_length\"\narguments = { along = \"s.v_mps\" }\n" + shape,
         ":line 2: ", "needs a [[term.shape]] named 'lag'");
  (void)rim::diagnose::read_extension(written(head + shape)); /* the whole prediction is late */
  refuse(shape + "[term.response]\n\"u.a*z.v_mps\" = 1\n", ":line 9: ", "cycle");
  refuse("form = \"table\"\n", ":line 2: ", "two knots");
  refuse("form = \"table\"\nknots = [1, 1]\nvalues = [0, 1]\n", ":line 6: ", "must rise");
  refuse("form = \"table\"\nknots = [1, 2]\nvalues = [0, 1]\n", ":line 6: ", "one argument");
  refuse("kind = \"variance\"\n", ":line 2: ", "no form of its own");
  refuse("kind = \"variance\"\nform = \"noise\"\n", ":line 2: ", "ratio");
  refuse("kind = \"variance\"\nform = \"noise\"\n[[term.size]]\nname = \"ratio\"\nvalue = 0\n",
         ":line 7: ", "ratio");
  refuse("kind = \"stuck\"\nform = \"stuck\"\n[[term.size]]\nname = \"a\"\nvalue = 1\n",
         ":line 7: ", "has no size");
}

void files_that_are_none(void **) {
  assert_refused([] { (void)rim::diagnose::read_extension(temporary_path("none.toml")); },
                 "none.toml", "");
  const std::string path = written("[[cause]]\n");
  assert_refused([&] { (void)rim::diagnose::read_extension(path); }, ":line 1: ", "unknown key");
  const std::string empty = written("");
  assert_refused([&] { (void)rim::diagnose::read_extension(empty); }, empty.c_str(), "schema");
}

rim::diagnose::Measured table() {
  rim::diagnose::Measured measured;
  measured.features = {{"s.speed_mps", "m/s", false, false},
                       {"s.altitude_m", "m", false, false},
                       {"x.heading_rad", "rad", false, true},
                       {"u.throttle", "", true, false}};
  measured.x = Eigen::MatrixXd::Zero(3, 4);
  measured.t_s = measured.elapsed_s = {0.0, 0.1, 0.2};
  measured.row = {1, 2, 3};
  rim::diagnose::Channel channel;
  channel.name = "speed_mps";
  channel.unit = "m/s";
  channel.z = channel.m = channel.sd = Eigen::VectorXd::Ones(3);
  measured.channels = {channel};
  return measured;
}

void what_the_logs_have_not_is_refused(void **) {
  const std::vector<Term> good = every_kind();
  const std::string path = written(rim::diagnose::extension_toml(good, "x"));
  rim::diagnose::check_extension(good, table(), path);
  const auto refuse = [&](const std::vector<Term> &terms, const rim::diagnose::Measured &measured,
                          const char *key, const char *part) {
    assert_refused([&] { rim::diagnose::check_extension(terms, measured, path); },
                   (path + ":line ").c_str(), part);
    try { // the line named holds the key
      rim::diagnose::check_extension(terms, measured, path);
    } catch (const rim::DataError &error) {
      const int line = std::atoi(error.what() + path.size() + 6);
      std::ifstream file(path);
      std::string text;
      for (int i = 0; i < line; ++i)
        std::getline(file, text);
      assert_non_null(std::strstr(text.c_str(), key));
    }
  };
  rim::diagnose::Measured other = table();
  other.channels[0].name = "climb_mps";
  refuse(good, other, "channel", "no channel 'speed_mps'");
  other = table();
  other.features[0].name = "s.pace_mps";
  refuse(good, other, "arguments", "no feature 's.speed_mps'");
  other = table();
  other.features[0].unit = "km/s";
  refuse(good, other, "arguments", "'s.speed_mps' is in 'km/s' in the logs, not in 'm/s'");
  other = table();
  other.features[2].unit = "deg";
  refuse(good, other, "region", "'x.heading_rad' is in 'deg'");
  other = table();
  other.channels[0].unit = "km/s";
  refuse(good, other, "size", "the channel in 'km/s'");
  other = table();
  other.features[3].name = "u.thrust";
  refuse(good, other, "region", "no feature 'u.throttle'");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(every_kind_comes_back),
      cmocka_unit_test(text_cannot_break_the_file),
      cmocka_unit_test(no_terms_are_no_extension_but_a_file),
      cmocka_unit_test(a_short_file_will_do),
      cmocka_unit_test(every_function_of_a_catalogue_is_read),
      cmocka_unit_test(what_is_wrong_is_refused_with_its_line),
      cmocka_unit_test(built_in_forms_need_what_they_need),
      cmocka_unit_test(files_that_are_none),
      cmocka_unit_test(what_the_logs_have_not_is_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
