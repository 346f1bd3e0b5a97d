// SPDX-License-Identifier: MIT
// What a term adds, to exact values: gates, expressions and every built-in form; the order in which
// terms meet.
#include "diagnose/term.hpp"

#include <cmath>

#include "diagnose_case.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::basis_columns;
using rim::diagnose::Gate;
using rim::diagnose::gate_mask;
using rim::diagnose::mean_effect;
using rim::diagnose::Term;
using rim::diagnose::TermKind;

// Two logs of four rows, 0.1 s apart: s.speed_mps 0 1 2 3 | 10 11 12 13, u.push its square,
// x.heading_rad -3 -1 1 3, m = 2 * speed.
Measured small() {
  Measured t = table(2, 4, 0.1,
                     {{"s.speed_mps", "m/s", false, false},
                      {"u.push", "", true, false},
                      {"x.heading_rad", "rad", false, true}});
  for (Eigen::Index i = 0; i < 8; ++i) {
    const double v = static_cast<double>(i % 4 + (i < 4 ? 0 : 10));
    t.x.row(i) << v, v * v, 2.0 * static_cast<double>(i % 4) - 3.0;
    t.channels[0].m(i) = 2.0 * v;
  }
  return t;
}

Term term(const std::string &basis) {
  Term out;
  out.channel = "a_mps2";
  out.cause = out.form = "form";
  if (!basis.empty())
    out.basis = {basis};
  out.arguments = {{"v", "s.speed_mps"}};
  out.sizes = {{"size", 1.0, 0.0, ""}};
  return out;
}

Gate interval(const std::string &feature, double lower, double upper) {
  Gate gate;
  gate.features = {feature};
  gate.lower = {lower};
  gate.upper = {upper};
  return gate;
}

void gates_are_closed_wrap_and_round(void **) {
  const Measured t = small();
  assert_values(gate_mask({}, t), {1, 1, 1, 1, 1, 1, 1, 1});
  assert_values(gate_mask(interval("s.speed_mps", 1.0, 3.0), t), {0, 1, 1, 1, 0, 0, 0, 0});
  assert_values(gate_mask(interval("x.heading_rad", 3.0, -1.0), t), {1, 1, 0, 1, 1, 1, 0, 1});
  assert_values(gate_mask(interval("x.heading_rad", 3.0, -2.0), t), {1, 0, 0, 1, 1, 0, 0, 1});
  assert_values(gate_mask(interval("t_s", 0.1, 0.2), t), {0, 1, 1, 0, 0, 1, 1, 0}, 0.0);
  Gate box = interval("s.speed_mps", 1.0, 12.0);
  box.features.push_back("x.heading_rad");
  box.lower.push_back(-1.0);
  box.upper.push_back(1.0);
  assert_values(gate_mask(box, t), {0, 1, 1, 0, 0, 1, 1, 0});
  Gate ellipse = box; // about (2, 0), half axes 1.5 and 2, tilted a little
  ellipse.is_ellipse = true;
  ellipse.center = {2.0, 0.0};
  ellipse.inverse_shape = {1 / 2.25, 0.1, 0.1, 1 / 4.0};
  // (1, -1): 1/2.25 + .2 + .25 = .894; (2, 1): .25; (3, 3): above 1
  assert_values(gate_mask(ellipse, t), {0, 1, 1, 0, 0, 0, 0, 0});
  ellipse.inverse_shape = {1 / 2.25, 0.16, 0.16, 1 / 4.0}; // (1, -1): 1.014
  assert_values(gate_mask(ellipse, t), {0, 0, 1, 0, 0, 0, 0, 0});
  ellipse.center = {3.0, 1.0}; // the boundary itself is outside: strictly below 1 (eq. 3.8)
  ellipse.inverse_shape = {1.0, 0.0, 0.0, 1 / 4.0};
  assert_values(gate_mask(ellipse, t), {0, 0, 0, 0, 0, 0, 0, 0});
  assert_refused([&] { (void)gate_mask(interval("s.none", 0, 1), t); }, {"no feature 's.none'"});
}

void features_of_another_moment(void **) {
  Measured t = small();
  using rim::diagnose::feature_column;
  assert_values(feature_column(t, "t_s"), {0, .1, .2, .3, 0, .1, .2, .3});
  assert_values(feature_column(t, "s.speed_mps@0.1"), {0, 0, 1, 2, 10, 10, 11, 12});
  assert_values(feature_column(t, "s.speed_mps@0.2"), {0, 0, 0, 1, 10, 10, 10, 11});
  // between two rows by a straight line; before the log's beginning its first value
  assert_values(feature_column(t, "s.speed_mps@0.15"), {0, 0, .5, 1.5, 10, 10, 10.5, 11.5});
  assert_values(feature_column(t, "s.speed_mps@0"), {0, 1, 2, 3, 10, 11, 12, 13});
  const double share = 1.0 - std::exp(-0.1 / 0.2);
  const double one = share, two = one + share * (2 - one), three = two + share * (3 - two);
  assert_values(feature_column(t, "s.speed_mps~0.2"),
                {0, one, two, three, 10, 10 + one, 10 + two, 10 + three});
  for (std::size_t i = 2; i < 4; ++i) // a gap of .5 s after the second row
    t.elapsed_s[i] += 0.5;
  // inside a short gap a straight line too: nearest in time to the rows after it
  assert_values(feature_column(t, "s.speed_mps@0.15"),
                {0, 0, 1 + .45 / .6, 1 + .55 / .6, 10, 10, 10.5, 11.5});
  assert_values(feature_column(t, "s.speed_mps@0.1"), {0, 0, 1 + .5 / .6, 2, 10, 10, 11, 12});
  Measured apart = t;
  for (std::size_t i = 2; i < 4; ++i) // a gap of 5.5 s: what was held before it
    apart.elapsed_s[i] += 5.0;
  assert_values(feature_column(apart, "s.speed_mps@0.15"), {0, 0, 1, 1, 10, 10, 10.5, 11.5});
  // late, and then through a lag
  const Vector late = feature_column(t, "s.speed_mps@0.1");
  Measured shifted = t;
  shifted.x.col(t.find_feature("s.speed_mps")) = late;
  const Vector both = feature_column(t, "s.speed_mps@0.1~0.2"),
               then = feature_column(shifted, "s.speed_mps~0.2");
  assert_true((both - then).cwiseAbs().maxCoeff() < 1e-12);
  assert_string_equal(rim::diagnose::base_feature("u.push@0.2").c_str(), "u.push");
  assert_string_equal(rim::diagnose::base_feature("u.push~0.2").c_str(), "u.push");
  assert_string_equal(rim::diagnose::base_feature("u.push").c_str(), "u.push");
  assert_refused([&] { (void)feature_column(t, "u.none@0.1"); }, {"no feature 'u.none'"});
  for (const char *bad : {"u.push@", "u.push@x", "u.push@-1", "u.push~0.1s"})
    assert_refused([&] { (void)feature_column(t, bad); }, {bad, "must be seconds"});
}

void expressions_see_rows_prediction_time_and_shape(void **) {
  const Measured t = small();
  const Vector &m = t.channels[0].m;
  assert_values(basis_columns(term("-v*abs(v)"), t, m).col(0),
                {0, -1, -4, -9, -100, -121, -144, -169});
  assert_values(basis_columns(term("m - v + 10*t"), t, m).col(0), {0, 2, 4, 6, 10, 12, 14, 16},
                1e-9);
  Term hinge = term("max(0, v - level)");
  hinge.shape = {{"level", 1.5, 0.0, "m/s"}};
  assert_values(basis_columns(hinge, t, m).col(0), {0, 0, .5, 1.5, 8.5, 9.5, 10.5, 11.5});
  Term two = term("v");
  two.basis.push_back("1");
  two.sizes = {{"sine", 2.0, 0.0, ""}, {"cosine", -1.0, 0.0, ""}};
  assert_int_equal(basis_columns(two, t, m).cols(), 2);
  assert_values(mean_effect(two, t, m), {-1, 1, 3, 5, 19, 21, 23, 25});
  two.gate = interval("s.speed_mps", 1.0, 11.0);
  assert_values(mean_effect(two, t, m), {0, 1, 3, 5, 19, 21, 0, 0});
  two.support = interval("s.speed_mps", 2.0, 10.0); // outside it nothing is known
  assert_values(mean_effect(two, t, m), {0, 0, 3, 5, 19, 0, 0, 0});
  two.kind = TermKind::variance;
  assert_values(mean_effect(two, t, m), {0, 0, 0, 0, 0, 0, 0, 0});
}

void expressions_that_are_none_are_refused(void **) {
  const Measured t = small();
  const auto refuse = [&](const Term &bad, const std::vector<std::string> &parts) {
    assert_refused([&] { (void)basis_columns(bad, t, t.channels[0].m); }, parts);
  };
  refuse(term("v*"), {"form 'form'", "expression 'v*'"});
  refuse(term("v*w"), {"expression 'v*w'", "w"});
  refuse(term("1/v"), {"expression '1/v'", "not finite"});
  refuse(term("ln(-v-1)"), {"not finite"});
  refuse(term(""), {"form 'form'", "no expression"});
  Term other = term("v");
  other.arguments["v"] = "s.none";
  refuse(other, {"no feature 's.none'"});
  Term table = term("");
  table.form = "table";
  refuse(table, {"form 'table'"});
  table.knots = {0.0, 1.0};
  table.values = {0.0};
  refuse(table, {"form 'table'"});
  Term lag = term("");
  lag.form = "lag";
  refuse(lag, {"form 'lag'", "'lag' is missing"});
  lag.form = lag.cause = "delay";
  refuse(lag, {"form 'delay'", "'delay' is missing"});
}

void tables_are_straight_between_knots_and_flat_beyond(void **) {
  const Measured t = small();
  Term table = term("");
  table.form = "table";
  table.knots = {1.0, 2.5, 11.0};
  table.values = {-2.0, 1.0, 5.0};
  assert_values(mean_effect(table, t, t.channels[0].m),
                {-2, -2, 0, 1 + 4 * .5 / 8.5, 1 + 4 * 7.5 / 8.5, 5, 5, 5});
}

void a_delay_takes_the_command_of_then(void **) {
  const Measured t = small();
  const Vector &m = t.channels[0].m;
  Term reading = term("");
  reading.cause = "delay";
  reading.form = "delay_reading";
  reading.shape = {{"delay", 0.1, 0.0, "s"}};
  assert_values(mean_effect(reading, t, m), {0, -2, -2, -2, 0, -2, -2, -2});
  Term delay = reading;
  delay.form = "delay";
  delay.response = {{"u.push", 0.5}, {"u.push*s.speed_mps", 2.0}};
  // 0.5 (push then - push now) + 2 speed now (push then - push now)
  assert_values(mean_effect(delay, t, m), {0, -2.5, -13.5, -32.5, 0, -472.5, -563.5, -662.5}, 1e-9);
  delay.response = {{"s.speed_mps", 3.0}}; // a state is not delayed
  assert_values(mean_effect(delay, t, m), {0, 0, 0, 0, 0, 0, 0, 0});
  Term lag = term("");
  lag.cause = lag.form = "lag";
  lag.shape = {{"lag", 0.2, 0.0, "s"}};
  const double share = 1.0 - std::exp(-0.5);
  const double first = share * 2.0;
  assert_near(mean_effect(lag, t, m)(1), first - 2.0, 1e-12);
  assert_near(mean_effect(lag, t, m)(2), first + share * (4.0 - first) - 4.0, 1e-12);
  assert_near(mean_effect(lag, t, m)(4), 0.0, 0.0); // each log from its own first value
  Measured commanded = t; // of a prediction that is made of commands, from its first reading
  commanded.x.col(1) = 0.5 * m;
  commanded.channels[0].z(4) = m(4) + 1.0;
  assert_near(mean_effect(lag, commanded, m)(4), 1.0, 0.0);
}

// Late by a length instead of a time: the way at the speeds of the first log is 0, 0, .1, .3 m, of
// the other 0, 1, 2.1, 3.3 m.
void late_by_a_length(void **) {
  const Measured t = small();
  Term late = term("");
  late.arguments = {{rim::diagnose::kAlong, "s.speed_mps"}};
  late.cause = "delay";
  late.form = "delay_length";
  late.shape = {{"delay", 0.2, 0.0, "m"}};
  const Vector m = t.channels[0].m;
  assert_near(mean_effect(late, t, m)(2), 0.0 - 4.0, 1e-12); // the log's first row before it
  assert_near(mean_effect(late, t, m)(3), 4.0 - 6.0, 1e-12);
  assert_near(mean_effect(late, t, m)(5), 20.0 + 2.0 * 0.8 - 22.0, 1e-12);
  assert_string_equal(rim::diagnose::expression_text(late).c_str(),
                      "the prediction of 0.2 m at speed before, in place of now's");
  late.cause = "lag";
  late.form = "lag_length";
  late.shape = {{"lag", 0.5, 0.0, "m"}, {"delay", 0.1, 0.0, "s"}};
  const double share = 1.0 - std::exp(-1.0 / 0.5);             // of a metre
  assert_near(mean_effect(late, t, m)(5), 20.0 - 22.0, 1e-12); // what came a row before
  assert_near(mean_effect(late, t, m)(6), 20.0 + (1.0 - std::exp(-1.1 / 0.5)) * 2.0 - 24.0, 1e-12);
  late.shape[1].value = 0.0;
  assert_near(mean_effect(late, t, m)(5), 20.0 + share * 2.0 - 22.0, 1e-12);
  assert_string_equal(rim::diagnose::expression_text(late).c_str(),
                      "the prediction through a first-order lag over 0.5 m at speed");
}

// A lag of .2 s of what a dead zone or saturation of 3 before it leaves.
Term lag_behind(const char *limit) {
  Term lag = term("");
  lag.arguments.clear();
  lag.cause = lag.form = "lag";
  lag.shape = {{"lag", 0.2, 0.0, "s"}, {limit, 3.0, 0.0, ""}};
  return lag;
}

// A dead zone before a lag: the lag is of what it leaves, and both together make the prediction.
void a_dead_zone_before_a_lag(void **) {
  Measured t = small(); // m: 0 2 4 6 | 20 22 24 26
  const Vector &m = t.channels[0].m;
  t.x.col(1) = m;
  t.channels[0].z << 0, 0, 0, 0, 17, 0, 0, 0;
  Term zone = term("-max(-level, min(level, m))");
  zone.form = rim::diagnose::kDeadZoneBefore;
  zone.arguments.clear();
  zone.shape = {{"level", 3.0, 0.0, ""}};
  const Term lag = lag_behind(rim::diagnose::kBeyond);
  const double share = 1.0 - std::exp(-0.5), second = share * 1.0;
  const Vector after = rim::diagnose::extended_prediction({zone, lag}, t.channels[0], t)
                           .m; // of 0 0 1 3 | 17 19 21 23
  assert_near(after(1), 0.0, 1e-12);
  assert_near(after(2), second, 1e-12);
  assert_near(after(3), second + share * (3.0 - second), 1e-12);
  assert_near(after(4), 17.0, 1e-12);
  assert_near(after(5), 17.0 + share * 2.0, 1e-12);
  assert_near(mean_effect(zone, t, m)(3), -3.0, 1e-12);
  assert_true(rim::diagnose::moves_prediction(zone) && !rim::diagnose::remembers(zone));
}

// Saturation before a lag: what it cuts off never comes, and what it leaves comes late.
void saturation_before_a_lag(void **) {
  const Measured t = small(); // m: 0 2 4 6 | 20 22 24 26
  const Vector &m = t.channels[0].m;
  Term most = term("max(-level, min(level, m)) - m");
  most.form = rim::diagnose::kSaturationBefore;
  most.cause = "saturation";
  most.arguments.clear();
  most.shape = {{"level", 3.0, 0.0, ""}};
  const Term lag = lag_behind(rim::diagnose::kUpTo);
  const double share = 1.0 - std::exp(-0.5), second = share * 2.0; // of 0 2 3 3 | 3 3 3 3
  const Vector after = rim::diagnose::extended_prediction({most, lag}, t.channels[0], t).m;
  assert_near(after(1), second, 1e-12);
  assert_near(after(2), second + share * (3.0 - second), 1e-12);
  assert_near(after(7), 3.0, 1e-12);
  assert_true(rim::diagnose::moves_prediction(most) && !rim::diagnose::remembers(most));
  assert_near(mean_effect(lag, t, m)(2), after(2) - 3.0, 1e-12);
}

void play_holds_until_it_is_taken_up(void **) {
  const Measured t = small();
  Term play = term("");
  play.cause = play.form = rim::diagnose::kBacklash;
  play.shape = {{"play", 3.0, 0.0, ""}};
  assert_values(mean_effect(play, t, t.channels[0].m), {0, -1.5, -1.5, -1.5, 0, -1.5, -1.5, -1.5});
  assert_true(rim::diagnose::remembers(play) && !rim::diagnose::moves_prediction(play));
}

// Where the prediction starts from a reading it is the change that comes late.
void a_lag_of_the_change(void **) {
  const Measured t = small();
  const Vector &m = t.channels[0].m;
  Term lag = term("");
  lag.cause = lag.form = "lag";
  lag.shape = {{"lag", 0.2, 0.0, "s"}};
  lag.arguments = {{"s", "s.speed_mps"}};
  const Vector change = m - rim::diagnose::feature_column(t, "s.speed_mps");
  const double share = 1.0 - std::exp(-0.5);
  assert_near(mean_effect(lag, t, m)(0), 0.0, 1e-12);
  assert_near(mean_effect(lag, t, m)(1), (share - 1.0) * (change(1) - change(0)), 1e-12);
}

// Of eight springs that slip at 1 to 8: drawn up by 1, 2, 3, or down from 10 by as much.
void springs_hold_until_they_slip(void **) {
  Measured t = small();
  using rim::diagnose::feature_column;
  assert_values(feature_column(t, "s.speed_mps%8").head(4), {0, 1, 15.0 / 8.0, 21.0 / 8.0});
  t.x.row(7) = t.x.row(5); // back from 12 to 11: all of them follow
  const Vector held = feature_column(t, "s.speed_mps%8");
  assert_near(held(6) - held(7), 1.0, 1e-12);
  assert_values(feature_column(t, "s.speed_mps%8@0.1").head(4), {0, 0, 1, 15.0 / 8.0});
  assert_string_equal(rim::diagnose::base_feature("s.speed_mps%8").c_str(), "s.speed_mps");
  assert_string_equal(rim::diagnose::late_text("s.speed_mps%8@0.1").c_str(),
                      "held within 8 0.1 s ago");
}

// The angle and the speed of one joint have one plain name.
void two_of_one_name_are_told_apart(void **) {
  Term two = term("f*sin(g)");
  two.arguments = {{"f", "x.q2_radps"}, {"g", "x.q2_rad"}};
  two.sizes[0].value = 3.0;
  assert_string_equal(rim::diagnose::expression_text(two).c_str(), "3 * q2_radps*sin(q2_rad)");
  two.arguments["g"] = "x.q1_rad";
  assert_string_equal(rim::diagnose::expression_text(two).c_str(), "3 * q2*sin(q1)");
}

void a_delay_comes_first_and_the_others_see_it(void **) {
  const Measured t = small();
  Channel channel = t.channels[0];
  channel.sd *= 0.5;
  Term delay = term("");
  delay.cause = "delay";
  delay.form = "delay_reading";
  delay.shape = {{"delay", 0.1, 0.0, "s"}};
  Term gain = term("m");
  gain.sizes[0].value = 1.0; // doubles what it sees
  Term bias = term("1");
  Term noise = term("");
  noise.kind = TermKind::variance;
  noise.sizes = {{"ratio", 4.0, 0.0, ""}};
  noise.gate = interval("s.speed_mps", 2.0, 3.0);
  Term other = bias;
  other.channel = "another";
  Term stuck = term("");
  stuck.kind = TermKind::stuck;
  const auto after =
      rim::diagnose::extended_prediction({gain, bias, noise, other, stuck, delay}, channel, t);
  assert_values(after.m, {1, 1, 5, 9, 41, 41, 45, 49});
  assert_values(after.sd, {.5, .5, 1, 1, .5, .5, .5, .5});
  assert_true(rim::diagnose::moves_prediction(delay));
  assert_false(rim::diagnose::moves_prediction(gain));
  // Alone it sees the prediction as it is, beside the delay as that leaves it.
  using rim::diagnose::effect_beside;
  assert_values(effect_beside(gain, {gain}, channel, t), {0, 2, 4, 6, 20, 22, 24, 26});
  assert_values(effect_beside(gain, {gain, delay}, channel, t), {0, 0, 2, 4, 20, 20, 22, 24});
  assert_values(effect_beside(delay, {gain, delay}, channel, t), {0, -2, -2, -2, 0, -2, -2, -2});
  const auto none = rim::diagnose::extended_prediction({}, channel, t);
  assert_true(none.m == channel.m && none.sd == channel.sd);
}

void terms_in_words(void **) {
  Term drag = term("-v*abs(v)");
  drag.sizes[0].value = 0.0021;
  assert_string_equal(rim::diagnose::expression_text(drag).c_str(), "0.0021 * -speed*abs(speed)");
  Term bias = term("1");
  bias.sizes[0].value = -0.3;
  assert_string_equal(rim::diagnose::expression_text(bias).c_str(), "-0.3");
  Gate gate = interval("s.altitude_m", 12.0, 38.0);
  gate.units = {"m"};
  assert_string_equal(rim::diagnose::gate_text(gate).c_str(), "altitude 12 to 38 m");
  gate = interval("x.heading_rad", 2.5, -2.5);
  gate.units = {"rad"};
  assert_string_equal(rim::diagnose::gate_text(gate).c_str(),
                      "heading above 2.5 or below -2.5 rad");
  assert_string_equal(rim::diagnose::gate_text({}).c_str(), "");
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(gates_are_closed_wrap_and_round),
      cmocka_unit_test(features_of_another_moment),
      cmocka_unit_test(expressions_see_rows_prediction_time_and_shape),
      cmocka_unit_test(expressions_that_are_none_are_refused),
      cmocka_unit_test(tables_are_straight_between_knots_and_flat_beyond),
      cmocka_unit_test(a_delay_takes_the_command_of_then),
      cmocka_unit_test(late_by_a_length),
      cmocka_unit_test(a_dead_zone_before_a_lag),
      cmocka_unit_test(saturation_before_a_lag),
      cmocka_unit_test(play_holds_until_it_is_taken_up),
      cmocka_unit_test(springs_hold_until_they_slip),
      cmocka_unit_test(two_of_one_name_are_told_apart),
      cmocka_unit_test(a_lag_of_the_change),
      cmocka_unit_test(a_delay_comes_first_and_the_others_see_it),
      cmocka_unit_test(terms_in_words),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
