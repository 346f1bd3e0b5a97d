// SPDX-License-Identifier: MIT
// Planted intervals, boxes, ellipses and changes of scatter are found where they were put, to
// within a bin. Seeds are fixed.
#include "diagnose/scan.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose_case.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::Catalogue;
using rim::diagnose::Fit;
using rim::diagnose::Gate;
using rim::diagnose::Library;
using rim::diagnose::Noise;
using rim::diagnose::Proposal;
using rim::diagnose::Scanner;

constexpr std::size_t kRows = 1600;

// Three features, uniform in 0 .. 10, and one channel of nothing.
Measured uniform_table(std::uint64_t seed) {
  Measured t =
      table(2, kRows / 2, 0.1,
            {{"x.a", "", false, false}, {"x.b_m", "m", false, false}, {"x.c", "", false, false}});
  Random random(seed);
  for (Eigen::Index i = 0; i < t.x.rows(); ++i)
    t.x.row(i) << 10 * random.uniform(), 10 * random.uniform(), 10 * random.uniform();
  return t;
}

Catalogue bias_alone() {
  const Catalogue ours = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  Catalogue out = ours;
  out.forms.clear();
  for (const auto &form : ours.forms) {
    if (form.form == "bias" || form.form == "noise")
      out.forms.push_back(form);
  }
  return out;
}

struct Found {
  Proposal proposal;
  Gate gate;
  double agreement = 0.0; // F1 of the rows
};

Noise plain() {
  Noise noise;
  noise.weight = Vector::Ones(static_cast<Eigen::Index>(kRows));
  return noise;
}

double agreement(const Vector &said, const Vector &truth) {
  return 2.0 * said.dot(truth) / (said.sum() + truth.sum());
}

// The best proposal, refined, for noise with `size` sd more where truth is 1.
Found best_for(const Measured &t, const Vector &truth, double size, std::uint64_t seed) {
  const Library library = rim::diagnose::make_library(t, t.channels[0], bias_alone());
  Random random(seed);
  Vector y = size * truth;
  for (double &value : y)
    value += random.normal();
  const Noise noise = plain();
  const Scanner scanner(library, noise.weight);
  const Fit fit = rim::diagnose::fit_members(y, {}, noise);
  const auto proposals = scanner.mean(fit, noise, 10);
  assert_true(!proposals.empty());
  for (std::size_t i = 1; i < proposals.size(); ++i)
    assert_true(proposals[i - 1].score() >= proposals[i].score());
  Found found;
  found.proposal = proposals[0];
  scanner.refine(fit.residual, noise, &found.proposal);
  found.gate = scanner.gate(found.proposal);
  found.agreement = agreement(scanner.inside(found.proposal), truth);
  assert_true(
      (scanner.inside(found.proposal) - rim::diagnose::gate_mask(found.gate, t)).cwiseAbs().sum() <=
      2.0); // rows on a bound
  return found;
}

void an_interval(void **) {
  const Measured t = uniform_table(1);
  const Vector truth = ((t.x.col(1).array() >= 6.0) && (t.x.col(1).array() <= 8.0)).cast<double>();
  const Found found = best_for(t, truth, 1.0, 2);
  assert_int_equal(found.gate.features.size(), 1);
  assert_string_equal(found.gate.features[0].c_str(), "x.b_m");
  assert_string_equal(found.gate.units[0].c_str(), "m");
  assert_near(found.gate.lower[0], 6.0, 0.25); // a bin is 10 / 40
  assert_near(found.gate.upper[0], 8.0, 0.25);
  assert_true(found.proposal.score() > 20.0);
}

void a_box(void **) {
  const Measured t = uniform_table(3);
  const Vector truth = ((t.x.col(0).array() > 2.0) && (t.x.col(0).array() < 6.0) &&
                        (t.x.col(2).array() > 5.0) && (t.x.col(2).array() < 9.0))
                           .cast<double>();
  const Found found = best_for(t, truth, 1.2, 4);
  assert_int_equal(found.gate.features.size(), 2);
  if (found.agreement < 0.85)
    fail_msg("F1 %.3f: %s", found.agreement, rim::diagnose::gate_text(found.gate).c_str());
}

void an_ellipse(void **) {
  const Measured t = uniform_table(5);
  const auto a = (t.x.col(0).array() - 5.0) / 3.5, b = (t.x.col(1).array() - 5.0) / 3.0;
  const Vector truth = (a.square() + b.square() < 1.0).cast<double>();
  const Found found = best_for(t, truth, 1.5, 6);
  assert_int_equal(found.gate.features.size(), 2);
  assert_true(found.gate.is_ellipse);
  if (found.agreement < 0.9)
    fail_msg("F1 %.3f", found.agreement);
  assert_near(found.gate.center[0], 5.0, 0.6);
  assert_near(found.gate.center[1], 5.0, 0.6);
}

void everywhere(void **) {
  const Measured t = uniform_table(7);
  const Found found = best_for(t, Vector::Ones(static_cast<Eigen::Index>(kRows)), 0.3, 8);
  assert_true(found.gate.everywhere());
}

void scatter_in_an_interval(void **) {
  const Measured t = uniform_table(9);
  const Library library = rim::diagnose::make_library(t, t.channels[0], bias_alone());
  const Vector truth = (t.x.col(2).array() >= 7.0).cast<double>();
  Random random(10);
  Vector y(static_cast<Eigen::Index>(kRows));
  for (Eigen::Index i = 0; i < y.size(); ++i)
    y(i) = random.normal() * (truth(i) > 0.0 ? 1.6 : 1.0);
  const Noise noise = plain();
  const Scanner scanner(library, noise.weight);
  const Fit fit = rim::diagnose::fit_members(y, {}, noise);
  const auto proposals = scanner.variance(fit, noise);
  assert_true(!proposals.empty());
  assert_true(proposals[0].score() > 15.0);
  assert_int_equal(scanner.gate(proposals[0]).features.size(), 1);
  assert_string_equal(scanner.gate(proposals[0]).features[0].c_str(), "x.c");
  // more above 7, or, which is the same, less below it
  const Gate gate = scanner.gate(proposals[0]);
  const bool is_above = gate.lower[0] > 3.5;
  assert_near(is_above ? gate.lower[0] : gate.upper[0], 7.0, 0.4);
  assert_near(is_above ? proposals[0].ratio : 1.0 / proposals[0].ratio, 1.6 * 1.6, 0.5);
}

// Rows of weight 0 are no measurements: what lies in them is not found.
void rows_without_weight_say_nothing(void **) {
  const Measured t = uniform_table(11);
  const Library library = rim::diagnose::make_library(t, t.channels[0], bias_alone());
  const Vector truth = (t.x.col(0).array() >= 8.0).cast<double>();
  Random random(12);
  Vector y = 50.0 * truth;
  for (double &value : y)
    value += random.normal();
  Noise noise = plain();
  noise.weight -= truth;
  const Scanner scanner(library, noise.weight);
  for (const Proposal &p : scanner.mean(rim::diagnose::fit_members(y, {}, noise), noise, 10))
    assert_true(p.score() < 6.0);
}

// A box is cut where its features have a cut, also over a feature of three values.
void boxes_end_at_cuts(void **) {
  Measured t = uniform_table(13);
  t.x.col(1) = (t.x.col(1).array() / 4.0).floor();
  const Library library = rim::diagnose::make_library(t, t.channels[0], bias_alone());
  const Noise noise = plain();
  const Scanner scanner(library, noise.weight);
  for (std::uint64_t seed = 14; seed < 64; ++seed) {
    Random random(seed);
    Vector y(static_cast<Eigen::Index>(kRows));
    for (Eigen::Index i = 0; i < y.size(); ++i)
      y(i) = random.normal() + (t.x(i, 0) > 5.0 && t.x(i, 1) > 1.0 ? 0.4 : 0.0);
    for (const Proposal &p : scanner.mean(rim::diagnose::fit_members(y, {}, noise), noise, 50)) {
      if (p.bounds.size() != 2)
        continue;
      for (const auto &bound : p.bounds) {
        const auto &cuts = library.gates[static_cast<std::size_t>(bound.feature)].coarse_edge;
        assert_true(std::find(cuts.begin(), cuts.end(), bound.upper) != cuts.end());
        assert_true(std::find(cuts.begin(), cuts.end(), bound.lower) != cuts.end());
      }
    }
  }
}

} // namespace

int main() {
  std::printf("seeds 1 to 63\n");
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_interval),
      cmocka_unit_test(a_box),
      cmocka_unit_test(an_ellipse),
      cmocka_unit_test(everywhere),
      cmocka_unit_test(scatter_in_an_interval),
      cmocka_unit_test(rows_without_weight_say_nothing),
      cmocka_unit_test(boxes_end_at_cuts),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
