// SPDX-License-Identifier: MIT
// What an extension is worth, against hand-computed figures; the intervals and the word "worse".
#include "diagnose/gain.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/rollout.hpp"
#include "diagnose_case.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::Gain;
using rim::diagnose::Judged;
using rim::diagnose::summarise;
using rim::diagnose::Term;
using rim::diagnose::TermKind;

const double kRoot = std::sqrt(2.0 * M_PI);

Term bias(double size, double lower = 0.0, double upper = 0.0) {
  Term term;
  term.channel = "a_mps2";
  term.cause = term.form = "bias";
  term.basis = {"1"};
  term.sizes = {{"size", size, 0.0, "m/s2"}};
  if (lower < upper) {
    term.gate.features = {"s.speed_mps"};
    term.gate.lower = {lower};
    term.gate.upper = {upper};
  }
  return term;
}

// Speeds 0, 1, 2 ... in every log; z = 2 where the speed is above the middle, m = 0, sd = 0.5.
Measured step_table(std::size_t logs, std::size_t rows, double dt = 0.5) {
  Measured t = table(logs, rows, dt, {{"s.speed_mps", "m/s", false, false}});
  for (std::size_t i = 0; i < logs * rows; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    t.x(k, 0) = static_cast<double>(i % rows);
    t.channels[0].sd(k) = 0.5;
    t.channels[0].z(k) = i % rows >= rows / 2 ? 2.0 : 0.25 * static_cast<double>(i % 3) - 0.25;
    t.channels[0].m(k) = 1e-3 * static_cast<double>(i % 2); // no two predictions alike in a row
  }
  return t;
}

void figures_by_hand(void **) {
  Judged judged;
  judged.z = {1.0, 3.0, -2.0, 0.0};
  judged.before = {0.0, 0.0, 0.0, 0.0};
  judged.after = {1.0, 2.0, -2.0, 0.5};
  judged.sd_before = {1.0, 1.0, 1.0, 2.0};
  judged.sd_after = {0.5, 1.0, 2.0, 2.0};
  judged.inside = {1, 1, 1, 0};
  judged.unit = {0, 0, 1, 1};
  Channel channel;
  channel.name = "force_N";
  channel.unit = "N";
  const std::vector<Gain> gains = summarise(judged, channel, 2.0, "held-out logs", 1);
  assert_int_equal(gains.size(), 3);
  const Gain &all = gains[0], &in = gains[1], &out = gains[2];
  assert_string_equal(all.where.c_str(), "all");
  assert_string_equal(in.where.c_str(), "inside");
  assert_string_equal(out.where.c_str(), "outside");
  assert_string_equal(all.channel.c_str(), "force_N");
  assert_string_equal(all.unit.c_str(), "N");
  assert_string_equal(all.data.c_str(), "held-out logs");
  assert_near(all.horizon_s, 2.0, 0.0);
  assert_int_equal(all.rows, 4);
  assert_int_equal(in.rows, 3);
  assert_int_equal(out.rows, 1);
  assert_near(all.rmse_before, std::sqrt((1 + 9 + 4 + 0) / 4.0), 1e-12);
  assert_near(all.rmse_after, std::sqrt((0 + 1 + 0 + 0.25) / 4.0), 1e-12);
  assert_near(all.ratio, std::sqrt(1.25 / 14.0), 1e-12);
  assert_near(in.ratio, std::sqrt(1.0 / 14.0), 1e-12);
  assert_near(out.rmse_before, 0.0, 0.0);
  assert_near(out.ratio, 1.0, 0.0); // nothing to compare with
  const double ln = std::log(kRoot);
  assert_near(all.nll_before, ((0.5 + 4.5 + 2.0) + 4 * ln + std::log(2.0)) / 4.0, 1e-12);
  assert_near(all.nll_after, (0.5 + 0.03125 + 4 * ln + std::log(0.5) + 2 * std::log(2.0)) / 4.0,
              1e-12);
  assert_near(all.mpa_before, (std::exp(-0.5) + std::exp(-4.5) + std::exp(-2.0) + 0.5) / kRoot / 4,
              1e-12);
  assert_near(all.mpa_after, (2.0 + std::exp(-0.5) + 0.5 + 0.5 * std::exp(-0.03125)) / kRoot / 4,
              1e-12);
  assert_false(all.worse);
  // resampled units: both of them, or either one twice
  const double first = std::sqrt(1.0 / 10.0), second = std::sqrt(0.25 / 4.0);
  assert_near(all.ratio_ci95.low, second, 1e-12);
  assert_near(all.ratio_ci95.high, first, 1e-12);
}

void the_interval_is_the_seeds(void **) {
  Judged judged;
  Random random(2);
  for (std::size_t i = 0; i < 300; ++i) {
    judged.z.push_back(random.normal());
    judged.before.push_back(0.5);
    judged.after.push_back(0.0);
    judged.sd_before.push_back(1.0);
    judged.sd_after.push_back(1.0);
    judged.inside.push_back(0);
    judged.unit.push_back(i / 15);
  }
  const Gain a = summarise(judged, {}, 0.0, "x", 1)[0], b = summarise(judged, {}, 0.0, "x", 1)[0],
             c = summarise(judged, {}, 0.0, "x", 2)[0];
  assert_true(a.ratio_ci95.low == b.ratio_ci95.low && a.ratio_ci95.high == b.ratio_ci95.high);
  assert_true(a.nll_gain_ci95.low == b.nll_gain_ci95.low);
  assert_true(a.ratio_ci95.low != c.ratio_ci95.low);
  assert_true(a.ratio_ci95.low < a.ratio && a.ratio < a.ratio_ci95.high);
  assert_near(a.ratio, 1.0 / std::sqrt(1.25), 0.05);
  const double gained = a.nll_before - a.nll_after;
  assert_true(a.nll_gain_ci95.low < gained && gained < a.nll_gain_ci95.high);
  assert_near(gained, 0.125, 0.1); // half a sd, and what the sample's mean is off
  assert_int_equal(summarise(judged, {}, 0.0, "x", 1).size(), 1); // nowhere inside
  assert_true(summarise({}, {}, 0.0, "x", 1).empty());
}

void worse_is_said(void **) {
  Judged judged;
  for (std::size_t i = 0; i < 100; ++i) {
    judged.z.push_back(i % 2 == 0 ? 1.0 : -1.0);
    judged.before.push_back(0.0);
    judged.after.push_back(0.3);
    judged.sd_before.push_back(1.0);
    judged.sd_after.push_back(1.0);
    judged.inside.push_back(0);
    judged.unit.push_back(i / 2);
  }
  const Gain gain = summarise(judged, {}, 0.0, "x", 1)[0];
  assert_near(gain.ratio, std::sqrt(1.09), 1e-12);
  assert_true(gain.worse);
  for (double &after : judged.after)
    after = 0.15; // 1.1 %, and on every log
  assert_true(summarise(judged, {}, 0.0, "x", 1)[0].worse);
  for (double &after : judged.after)
    after = 0.08; // .3 %: not worth the word
  assert_false(summarise(judged, {}, 0.0, "x", 1)[0].worse);
  for (double &after : judged.after)
    after = 0.0;
  assert_false(summarise(judged, {}, 0.0, "x", 1)[0].worse);
}

void rows_are_judged_where_they_lie(void **) {
  const Measured t = step_table(2, 40);
  Judged judged;
  rim::diagnose::append_judged({bias(2.0, 20.0, 39.0)}, t, 0, &judged);
  // the run of readings 2.0 is stuck: the second of them on is no measurement
  assert_int_equal(judged.z.size(), 80);
  const auto flagged = std::count(judged.flagged.begin(), judged.flagged.end(), 1);
  assert_true(flagged > 0 && flagged <= 40);
  // the gain is given without them and with them
  const auto gains = rim::diagnose::summarise(judged, t.channels[0], 0.0, "held-out logs", 1);
  assert_int_equal(gains.front().rows, 80 - flagged);
  assert_string_equal(gains.back().where.c_str(), "with flagged");
  assert_int_equal(gains.back().rows, 80);
  Measured loose = t;
  for (Eigen::Index i = 0; i < 80; ++i)
    loose.channels[0].z(i) += 1e-4 * static_cast<double>(i);
  judged = {};
  rim::diagnose::append_judged({bias(2.0, 20.0, 39.0)}, loose, 0, &judged);
  assert_int_equal(judged.z.size(), 80);
  assert_near(judged.after[25] - judged.before[25], 2.0, 1e-12);
  assert_near(judged.after[5] - judged.before[5], 0.0, 0.0);
  assert_int_equal(judged.inside[25], 1);
  assert_int_equal(judged.inside[5], 0);
  assert_true(judged.unit[0] != judged.unit[39] && judged.unit[39] != judged.unit[40]);
  const std::size_t units = 1 + judged.unit.back();
  rim::diagnose::append_judged({}, loose, 0, &judged);
  assert_int_equal(judged.unit[80], units); // another table's rows are other units
  // from six logs on a log is a unit
  const Measured many = step_table(6, 40);
  Judged by_log;
  rim::diagnose::append_judged({}, many, 0, &by_log);
  assert_int_equal(by_log.unit.back(), 5);
  assert_int_equal(by_log.unit.front(), 0);
}

void what_acts(void **) {
  const Measured t = step_table(1, 40);
  const auto count = [&](const std::vector<Term> &terms) {
    std::size_t rows = 0;
    for (const std::uint8_t a : rim::diagnose::acting(terms, t, t.channels[0]))
      rows += a;
    return rows;
  };
  assert_int_equal(count({}), 0);
  assert_int_equal(count({bias(0.06, 20.0, 39.0)}), 20); // .12 of the sd of 0.5
  assert_int_equal(count({bias(0.04, 20.0, 39.0)}), 0);
  Term noise = bias(4.0, 0.0, 4.0);
  noise.kind = TermKind::variance;
  assert_int_equal(count({noise}), 5);
  Term other = bias(5.0);
  other.channel = "another";
  assert_int_equal(count({other}), 0);
}

void means_over_a_horizon(void **) {
  Measured t = step_table(2, 40, 0.5); // 8 rows fill 4 s
  for (Eigen::Index i = 0; i < 80; ++i)
    t.channels[0].z(i) = static_cast<double>(i % 7) + 1e-4 * static_cast<double>(i);
  Judged judged;
  rim::diagnose::append_means({bias(1.0, 8.0, 12.0)}, t, 0, 4.0, &judged);
  assert_int_equal(judged.z.size(), 10);
  double mean = 0.0;
  for (Eigen::Index i = 8; i < 16; ++i)
    mean += t.channels[0].z(i) / 8.0;
  assert_near(judged.z[1], mean, 1e-12);
  assert_near(judged.after[1] - judged.before[1], 5.0 / 8.0, 1e-12);
  assert_near(judged.sd_before[1], 0.5 / std::sqrt(8.0), 1e-12);
  assert_int_equal(judged.inside[1], 1); // 5 of its 8 rows
  assert_int_equal(judged.inside[0], 0);
}

// Two outcomes in a log; a step carries the context on as it was measured, for as many calls as
// told.
class Steps : public rim::world::Predictor {
public:
  explicit Steps(int calls) : calls_(calls) {}
  std::string name() const override { return "steps"; }
  double step_s() const override { return 1.0; }
  rim::Log predict(const rim::Log &log) const override { return log; }
  bool advance(const rim::Log &, const rim::Matrix &, rim::Log *) const override {
    return calls_-- > 0;
  }

private:
  mutable int calls_;
};

rim::Log two_outcomes() {
  rim::Log log;
  log.path = "two";
  log.columns = {{"x.a", "", rim::Role::context}, {"z.p", "", rim::Role::outcome},
                 {"m.p", "", rim::Role::mean},    {"sd.p", "", rim::Role::sd},
                 {"z.q", "", rim::Role::outcome}, {"m.q", "", rim::Role::mean},
                 {"sd.q", "", rim::Role::sd}};
  log.values.resize(6, 7);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double k = static_cast<double>(i);
    log.t_s.push_back(k);
    log.row.push_back(static_cast<std::uint32_t>(i + 1));
    log.values.row(i) << k, 10.0 * k, k, 1.0, -k, 0.5 * k, 2.0;
  }
  log.rows_in_file = 6;
  return log;
}

// Three steps from each of the first four rows, for both channels in one pass; without a roll-out
// nothing is left behind.
void roll_outs_judge_every_channel(void **) {
  Term bias;
  bias.channel = "q";
  bias.cause = bias.form = "bias";
  bias.basis = {"1"};
  bias.sizes = {{"size", 0.25, 0.0, ""}};
  std::vector<Judged> judged(2);
  const Steps steps(2 * 2); // without and with the term, two steps after the first
  assert_true(rim::diagnose::append_rolled({bias}, two_outcomes(), 3.0, steps, &judged));
  for (std::size_t i = 0; i < 4; ++i) {
    const double k = static_cast<double>(i + 2); // the row at the horizon's last step
    assert_near(judged[0].z.at(i), 10.0 * k, 0.0);
    assert_near(judged[0].before[i], k, 0.0);
    assert_near(judged[0].after[i], k, 0.0);
    assert_near(judged[1].z.at(i), -k, 0.0);
    assert_near(judged[1].before[i], 0.5 * k, 0.0);
    assert_near(judged[1].after[i], 0.5 * k + 0.25, 1e-12);
    assert_near(judged[1].sd_after[i], 2.0, 0.0);
    assert_int_equal(judged[0].inside[i], 0);
    assert_int_equal(judged[1].inside[i], 1);
  }
  std::vector<Judged> none(2);
  const Steps stops(1);
  assert_false(rim::diagnose::append_rolled({bias}, two_outcomes(), 3.0, stops, &none));
  assert_true(none[0].z.empty() && none[1].z.empty());
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(figures_by_hand),
      cmocka_unit_test(the_interval_is_the_seeds),
      cmocka_unit_test(worse_is_said),
      cmocka_unit_test(rows_are_judged_where_they_lie),
      cmocka_unit_test(what_acts),
      cmocka_unit_test(means_over_a_horizon),
      cmocka_unit_test(roll_outs_judge_every_channel),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
