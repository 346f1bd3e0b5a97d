// SPDX-License-Identifier: MIT
// The catalogue of causes: the one of data/ is read whole, a user's lies over it, and everything
// that is wrong in one is refused with its file and line.
#include "diagnose/catalogue.hpp"

#include <fstream>
#include <set>
#include <unistd.h>

#include "diagnose_case.hpp"
#include "temporary.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::ArgumentRole;
using rim::diagnose::Catalogue;
using rim::diagnose::Form;
using rim::diagnose::GateKind;
using rim::diagnose::merged;
using rim::diagnose::read_catalogue;
using rim::diagnose::TermKind;

std::string written(const std::string &text) {
  const std::string path = temporary_path("causes.toml");
  std::ofstream(path) << text;
  return path;
}

const std::string kHead = "schema = \"rim-causes/1\"\n";

const Form &form(const Catalogue &catalogue, const std::string &name) {
  for (const Form &f : catalogue.forms) {
    if (f.form == name)
      return f;
  }
  fail_msg("there is no form '%s'", name.c_str());
  std::abort();
}

void ours_has_every_family(void **) {
  const Catalogue ours = read_catalogue(rim::data_path("causes.toml"));
  std::set<std::string> causes;
  for (const Form &f : ours.forms) {
    causes.insert(f.cause);
    assert_true(f.line > 0);
    if (f.description.empty())
      fail_msg("form '%s' is not described", f.form.c_str());
  }
  for (const char *cause : {"bias", "gain", "drift", "noise", "dropout", "stuck", "delay", "lag",
                            "saturation", "coupling", "coulomb_friction", "viscous_friction",
                            "quadratic_drag", "slope", "periodic", "hinge", "product"}) {
    if (causes.count(cause) == 0)
      fail_msg("there is no cause '%s'", cause);
  }
  assert_true(form(ours, "bias").gate == GateKind::pair);
  assert_true(form(ours, "noise").kind == TermKind::variance);
  assert_true(form(ours, "saturation").is_fixed);
  assert_true(form(ours, "quadratic_drag").is_physical);
  assert_true(form(ours, "quadratic_drag_density").arguments.size() == 2);
  assert_true(form(ours, "product").is_unordered);
  assert_string_equal(form(ours, "quadratic_drag").better.c_str(), "quadratic_drag_density");
  assert_true(ours.sets.size() > 5);
  for (const std::vector<std::string> &set : ours.sets) {
    for (const std::string &name : set)
      assert_false(form(ours, name).description.empty());
  }
}

void every_key_is_read(void **) {
  const Catalogue c = read_catalogue(written(kHead + R"(
[[cause]]
cause = "lift"
form = "lift_squared"
description = "grows with the square"
kind = "mean"
basis = ["max(0, f - level)*g"]
arguments = { f = "altitude", g = "signed" }
unordered = true
positive = true
gate = "interval"
per = ["f", "g"]
least_spread = 0.25
most_spread = 0.75
cost = 1.5
[cause.shape]
level = { quantiles_of = "f", count = 5, low_share = 0.1, high_share = 0.9, unit = "m" }
)"));
  assert_int_equal(c.forms.size(), 1);
  const Form &f = c.forms[0];
  assert_string_equal(f.cause.c_str(), "lift");
  assert_string_equal(f.form.c_str(), "lift_squared");
  assert_int_equal(f.line, 3);
  assert_int_equal(f.arguments.size(), 2);
  assert_true(f.arguments[0].role == ArgumentRole::altitude);
  assert_true(f.arguments[1].role == ArgumentRole::signed_);
  assert_true(f.is_unordered && f.is_positive && !f.is_fixed);
  assert_true(f.gate == GateKind::interval);
  assert_near(f.least_spread, 0.25, 0.0);
  assert_near(f.most_spread, 0.75, 0.0);
  assert_near(f.cost, 1.5, 0.0);
  assert_int_equal(f.shape.size(), 1);
  assert_string_equal(f.shape[0].quantiles_of.c_str(), "f");
  assert_int_equal(f.shape[0].count, 5);
  assert_near(f.shape[0].low_share, 0.1, 0.0);
  assert_near(f.shape[0].high_share, 0.9, 0.0);
}

struct Bad {
  const char *text; // after the schema's line
  const char *place, *part;
};

void what_is_wrong_is_refused_with_its_line(void **) {
  const Bad bad[] = {
      {"[[cause]]\ncause = \"a\"\nbasiss = [\"1\"]\n", ":line 4: ", "unknown key 'basiss'"},
      {"colour = 1\n", ":line 2: ", "unknown key 'colour'"},
      {"", ":line 1: ", "no [[cause]]"},
      {"cause = [1]\n", ":line 2: ", "must be a table"},
      {"[[cause]]\nbasis = [\"1\"]\n", ":line 2: ", "needs a 'cause'"},
      {"[[cause]]\ncause = 3\n", ":line 3: ", "'cause' is of the wrong type"},
      {"[[cause]]\ncause = \"a\"\n", ":line 2: ", "unknown form 'a' without a basis"},
      {"[[cause]]\ncause = \"delay\"\nbasis = [\"1\"]\n", ":line 2: ", "is built in"},
      {"[[cause]]\ncause = \"a\"\nkind = \"median\"\n", ":line 4: ", "unknown kind 'median'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\"]\ngate = \"box\"\n",
       ":line 5: ", "unknown gate 'box'"},
      {"[[cause]]\ncause = \"a\"\nbasis = \"1\"\n", ":line 4: ", "list of texts"},
      {"[[cause]]\ncause = \"a\"\nbasis = [1]\n", ":line 4: ", "list of texts"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\", \"m\", \"t\"]\n", ":line 4: ", "at most two"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\", \"m\"]\ngate = \"pair\"\n",
       ":line 4: ", "neither fixed nor gated"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"v*\"]\n", ":line 4: ", "expression 'v*'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"v*v\"]\n", ":line 4: ", "expression 'v*v'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"v\"]\narguments = { v = \"speed\" }\n",
       ":line 5: ", "unknown role of argument 'v'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"v\"]\narguments = [\"v\"]\n",
       ":line 5: ", "'arguments' must be a table"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\"]\narguments = { u = \"any\", v = \"any\", w = "
       "\"any\" }\n",
       ":line 5: ", "at most two arguments"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = 3\n",
       ":line 6: ", "is a table"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { count = 3 }\n",
       ":line 6: ", "either 'quantiles_of' or 'values'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { quantiles_of = \"m\", "
       "count = 0 }\n",
       ":line 6: ", "count must be"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { values = [1, \"x\"] }\n",
       ":line 6: ", "must be numbers"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { values = [1] }\nd = { "
       "values = [1] }\ne = { values = [1] }\n",
       ":line 5: ", "at most two shape parameters"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { values = [1] }\nd = { "
       "quantiles_of = \"m\" }\n",
       ":line 5: ", "needs 'values'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { values = [1], share_of = "
       "\"v\" }\n",
       ":line 6: ", "share_of 'v' is no argument"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"c\"]\n[cause.shape]\nc = { quantiles_of = \"f\" }\n",
       ":line 6: ", "quantiles_of 'f'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\"]\nper = [\"v\"]\n", ":line 5: ", "per 'v'"},
      {"[[cause]]\ncause = \"a\"\nbasis = [\"1\"]\n[[cause]]\ncause = \"a\"\nbasis = [\"m\"]\n",
       ":line 5: ", "form 'a' is there twice"},
      {"[[cause]\n", ":line 2", ""},
  };
  for (const Bad &b : bad) {
    const std::string path = written(kHead + b.text);
    assert_refused([&] { (void)read_catalogue(path); }, {path + b.place, b.part});
  }
  const std::string path = written("schema = \"rim-causes/2\"\n");
  assert_refused([&] { (void)read_catalogue(path); }, {path + ":line 1: ", "rim-causes/1"});
  assert_refused([] { (void)read_catalogue(temporary_path("none.toml")); }, {"none.toml"});
}

void a_users_file_lies_over_ours(void **) {
  const Catalogue ours = read_catalogue(rim::data_path("causes.toml"));
  const Catalogue theirs = read_catalogue(
      written(kHead + "[[cause]]\ncause = \"offset\"\nform = \"bias\"\nbasis = [\"2\"]\n"
                      "[[cause]]\ncause = \"lift\"\nbasis = [\"m^3\"]\n"));
  const Catalogue both = merged(ours, theirs);
  assert_int_equal(both.forms.size(), ours.forms.size() + 1);
  assert_string_equal(form(both, "bias").cause.c_str(), "offset");
  assert_string_equal(form(both, "bias").basis[0].c_str(), "2");
  assert_true(form(both, "bias").gate == GateKind::none);
  assert_string_equal(both.forms.back().form.c_str(), "lift");
  assert_string_equal(both.forms.front().form.c_str(), ours.forms.front().form.c_str());
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(ours_has_every_family),
      cmocka_unit_test(every_key_is_read),
      cmocka_unit_test(what_is_wrong_is_refused_with_its_line),
      cmocka_unit_test(a_users_file_lies_over_ours),
  };
  const int failed = cmocka_run_group_tests(tests, nullptr, nullptr);
  return failed;
}
