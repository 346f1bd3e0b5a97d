// SPDX-License-Identifier: MIT
// What a feature is to a channel: velocities by unit, by name, or as the rate of another whatever
// its unit; whether a velocity counts with the channel or against it.
#include "diagnose/roles.hpp"

#include <cmath>

#include "diagnose_case.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::Term;

constexpr std::size_t kRows = 400;
constexpr double kStep_s = 0.02;

// An axis that swings: x.pos, x.b (its rate times `ratio`, read in grains), x.free (no rate).
Measured axis(double ratio, double grain, const std::string &channel, const std::string &unit) {
  Measured t =
      table(2, kRows, kStep_s,
            {{"x.pos", "", false, false}, {"x.b", "", false, false}, {"x.free", "", false, false}},
            channel, unit);
  Random random(7);
  for (std::size_t i = 0; i < 2 * kRows; ++i) {
    const double s = 2.1 * kStep_s * static_cast<double>(i % kRows);
    const auto k = static_cast<Eigen::Index>(i);
    t.x(k, 0) = std::sin(s) + 0.3 * std::sin(2.7 * s);
    const double rate = 2.1 * (std::cos(s) + 0.81 * std::cos(2.7 * s));
    t.x(k, 1) = ratio * grain * std::round(rate / grain);
    t.x(k, 2) = random.normal();
    t.channels[0].m(k) = -2.1 * 2.1 * (std::sin(s) + 2.187 * std::sin(2.7 * s));
  }
  return t;
}

void a_rate_is_one_in_any_unit(void **) {
  const std::vector<int> only_b{1};
  assert_true(rim::diagnose::velocities(axis(1.0, 1e-6, "a", "")) == only_b);
  assert_true(rim::diagnose::velocities(axis(57.3, 1e-6, "a", "")) == only_b); // degrees
  assert_true(rim::diagnose::velocities(axis(9.55, 0.1, "a", "")) == only_b);  // rpm, coarse
  assert_true(rim::diagnose::velocities(axis(-1.0, 1e-6, "a", "")).empty());   // the other way
}

// A feature of no known unit or name that changes as the prediction says is the velocity, coarse or
// noisy as it may be; what merely wanders is none.
void what_moves_as_predicted_is_a_velocity(void **) {
  Measured t = axis(3.6, 1e-6, "acc_mps2", "m/s2");
  Random random(5);
  for (Eigen::Index k = 0; k < t.x.rows(); ++k) {
    t.x(k, 0) = random.normal();
    t.x(k, 1) += 0.4 * random.normal();
  }
  const std::vector<int> only_b{1};
  assert_true(rim::diagnose::own_velocity(t, t.channels[0]) == only_b);
  t.channels[0].m = t.x.col(2);
  assert_true(rim::diagnose::own_velocity(t, t.channels[0]).empty());
}

// The angle of an arm is predicted to be that of its motor, which is read: that is no step ahead
// from a reading. The angle after a row is.
void an_arm_does_not_start_from_its_motor(void **) {
  Measured t = axis(1.0, 1e-6, "arm_deg", "deg");
  t.features[0] = {"x.motor_deg", "deg", false, false};
  t.channels[0].m = t.x.col(0);
  Random random(8);
  for (Eigen::Index k = 0; k < t.x.rows(); ++k)
    t.x(k, 0) += 1e-5 * random.normal();
  assert_false(starts_from(t, t.channels[0], 0));
  t.channels[0].m = t.x.col(0) + kStep_s * t.x.col(1);
  assert_true(starts_from(t, t.channels[0], 0));
}

Term friction(double size) {
  Term term;
  term.basis = {"-sign(v)"};
  term.arguments["v"] = "x.b";
  term.sizes = {{"size", size, 0.0, ""}};
  return term;
}

// A friction opposes with either sign, if the velocity counts that way.
void opposition_follows_the_sense(void **) {
  for (const bool is_force : {false, true}) {
    for (const double sense : {1.0, -1.0}) {
      Measured t = is_force ? axis(1.0, 1e-6, "drive_N", "N") : axis(1.0, 1e-6, "acc_mps2", "m/s2");
      t.features[1] = {"x.b", "m/s", false, false};
      t.x.col(1) *= sense;
      find_senses(&t);
      const double size = sense * (is_force ? -1.0 : 1.0); // of what takes motion away
      assert_int_equal(sense_of(friction(size), t.channels[0]), static_cast<int>(sense));
      assert_true(opposes(friction(size), t.channels[0]));
      assert_false(opposes(friction(-size), t.channels[0]));
    }
  }
}

// The weight of a pendulum's bob grows against the acceleration: it must not turn the sense.
void weight_does_not_turn_the_sense(void **) {
  Measured t = axis(1.0, 1e-6, "torque_Nm", "N m");
  t.features[0] = {"x.pos", "rad", false, false};
  t.features[1] = {"x.b", "rad/s", false, false};
  t.channels[0].m = 0.05 * t.channels[0].m + 40.0 * Vector(t.x.col(0).array().sin());
  find_senses(&t);
  assert_true(opposes(friction(-1.0), t.channels[0]));
  assert_int_equal(sense_of(friction(-1.0), t.channels[0]), 1);
}

// Nothing goes with the velocity's changes: what is said is what the signs say, and no more.
void an_unknown_sense_is_unknown(void **) {
  Measured t = axis(1.0, 1e-6, "acc_mps2", "m/s2");
  t.features[1] = {"x.b", "m/s", false, false};
  t.channels[0].m = t.x.col(2);
  find_senses(&t);
  assert_int_equal(sense_of(friction(1.0), t.channels[0]), 0);
  assert_true(opposes(friction(1.0), t.channels[0]));
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_rate_is_one_in_any_unit),
      cmocka_unit_test(what_moves_as_predicted_is_a_velocity),
      cmocka_unit_test(an_arm_does_not_start_from_its_motor),
      cmocka_unit_test(opposition_follows_the_sense),
      cmocka_unit_test(weight_does_not_turn_the_sense),
      cmocka_unit_test(an_unknown_sense_is_unknown),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
