// SPDX-License-Identifier: MIT
// A disturbance that is measured is an input of what it acts on, also where a controller answers it
// so well that the commands seem to explain it; what the vehicle brings about is none.
#include "base/rng.h"
#include "learnt.hpp"
#include "train/outside.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 5200; // of the first run
constexpr std::size_t kRuns = 12, kRows = 2400;
constexpr double kPeriod = 0.2;
constexpr double kDrag = 0.3, kHeating = 0.02, kCooling = 0.01;
enum { kSlope, kSpeed, kWay, kHeat, kOutcomes };

// A cart with a controller that holds random speeds on hills: what it asks for answers the slope.
// Its way is the integral of its speed; its motor warms slowly.
rim::Log cart(std::uint64_t seed, double slope_sd) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 17);
  rim::Log log;
  log.path = "cart" + std::to_string(seed);
  log.columns = {{"u.push", "", rim::Role::command},
                 {"s.slope_pct", "%", rim::Role::sensor},
                 {"s.speed_mps", "m/s", rim::Role::sensor},
                 {"s.way_m", "m", rim::Role::sensor},
                 {"s.heat_degC", "degC", rim::Role::sensor}};
  double slope = slope_sd * rimi_rng_normal(&rng), speed = 1.0, way = 0.0, heat = 0.0, wanted = 1.0;
  double error = 0.0;
  log.values.resize(static_cast<Eigen::Index>(kRows), static_cast<Eigen::Index>(1 + kOutcomes));
  for (std::size_t t = 0; t < kRows; ++t) {
    const auto row = static_cast<Eigen::Index>(t);
    if (t % 150 == 0)
      wanted = 1.0 + 2.0 * rimi_rng_uniform(&rng);
    slope += -0.01 * slope + slope_sd * std::sqrt(0.02) * rimi_rng_normal(&rng);
    error += kPeriod * (wanted - speed);
    const double push = 0.6 * (wanted - speed) + 0.1 * error;
    speed += kPeriod * (push - slope - kDrag * speed);
    way += kPeriod * speed;
    heat += kPeriod * (kHeating * push * push - kCooling * heat);
    log.t_s.push_back(kPeriod * static_cast<double>(t));
    log.values.row(row) << push, slope + 0.05 * rimi_rng_normal(&rng),
        speed + 0.02 * rimi_rng_normal(&rng), way + 0.02 * rimi_rng_normal(&rng),
        heat + 0.01 * rimi_rng_normal(&rng);
  }
  return log;
}

// draw(seed): a run.
template <typename Draw> Learnt learn_runs(Draw draw) {
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < kRuns; ++i)
    logs.push_back(draw(kSeed + i));
  return learn(logs, 1e4F);
}

Learnt learn_cart(double slope_sd) {
  return learn_runs([slope_sd](std::uint64_t seed) { return cart(seed, slope_sd); });
}

bool uses(const Learnt &l, std::size_t outcome, std::size_t input) {
  const std::vector<std::size_t> &outside = l.behaviour.targets[outcome].outside;
  return std::find(outside.begin(), outside.end(), input) != outside.end();
}

// The commands answer the slope, so they explain most of it; it is an input all the same, of the
// speed, and of nothing that does not feel it.
void a_slope_that_is_answered_is_an_input(void **) {
  const Learnt l = learn_cart(0.4);
  assert_true(l.behaviour.targets[kSlope].r2 > 0.5);
  assert_true(uses(l, kSpeed, kSlope));
  assert_true(l.behaviour.targets[kSlope].outside.empty());
  for (std::size_t o = 0; o < kOutcomes; ++o) {
    assert_false(uses(l, o, kSpeed));
    assert_false(uses(l, o, kWay));
    assert_false(uses(l, o, kHeat));
  }
  assert_true(l.behaviour.targets[kSpeed].r2 > 0.97);
}

// Without hills the slope reads noise: nothing is predicted from it.
void noise_is_no_input(void **) {
  const Learnt l = learn_cart(0.0);
  for (std::size_t o = 0; o < 2 * static_cast<std::size_t>(kOutcomes); ++o)
    assert_true(l.behaviour.targets[o].outside.empty());
}

void what_moves_is_told_from_what_does_not(void **) {
  const Learnt l = learn_cart(0.4);
  std::vector<Eigen::Index> means;
  for (std::size_t i = 0; i < l.basis.terms.size(); ++i) {
    if (l.basis.terms[i].op == BASIS_MEAN && l.basis.terms[i].group == rim::TermGroup::mean)
      means.push_back(static_cast<Eigen::Index>(i));
  }
  const auto terms = [&](std::size_t r) {
    const auto wide = l.runs.wide(r);
    rim::Matrix x(wide->terms.rows(), static_cast<Eigen::Index>(means.size()));
    for (std::size_t i = 0; i < means.size(); ++i) {
      const auto k = static_cast<std::size_t>(means[i]);
      x.col(static_cast<Eigen::Index>(i)) =
          (wide->terms.col(means[i]).array() - l.basis.center[k]) * l.basis.inverse_sd[k];
    }
    return x;
  };
  const std::vector<std::size_t> found =
      rim::not_moved({kSpeed, kSlope}, std::vector<bool>(kOutcomes, false), l.runs, terms);
  assert_int_equal(found.size(), 1);
  assert_int_equal(found.front(), kSlope);
}

void a_way_is_the_integral_of_a_speed(void **) {
  const Learnt l = learn_cart(0.4);
  const std::vector<bool> integrated =
      rim::integrated_outcomes(l.layout, l.options.integrands, l.runs);
  assert_true(integrated[kWay]);
  assert_false(integrated[kSpeed] || integrated[kSlope]);
}

// What nothing commands: any reading would seem to come from outside, and nothing settles from the
// start of a log.
void without_commands_nothing_is_an_input(void **) {
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < kRuns; ++i) {
    logs.push_back(cart(kSeed + i, 0.4));
    logs.back().columns.front() = {"s.push", "", rim::Role::sensor};
  }
  const Learnt l = learn(logs, 1e4F);
  assert_true(l.basis.inputs.empty());
  for (const rim::Basis::Term &t : l.basis.terms)
    assert_true(t.op == BASIS_TIME || (t.op == BASIS_INITIAL && t.b == 0));
  for (const rim::TargetModel &target : l.behaviour.targets)
    assert_true(target.outside.empty());
}

// Only inputs that a term uses fly, and the terms find theirs.
void unused_inputs_do_not_fly(void **) {
  Learnt l = learn_cart(0.4);
  const std::size_t before = l.basis.inputs.size();
  rim::shrink_basis(&l.basis, &l.behaviour);
  assert_true(l.basis.inputs.size() < before);
  const auto sensors = [&](std::uint16_t feature) {
    return std::count_if(l.basis.inputs.begin(), l.basis.inputs.end(),
                         [feature](const rim::Basis::Input &i) { return i.a == feature; });
  };
  assert_int_equal(sensors(l.layout.outcome_feature[kSlope]), 1);
  assert_int_equal(sensors(l.layout.outcome_feature[kWay]), 0);
  for (const rim::Basis::Term &t : l.basis.terms) {
    if (t.group == rim::TermGroup::outside)
      assert_int_equal(l.basis.inputs[t.a / l.basis.share.size()].a,
                       l.layout.outcome_feature[kSlope]);
  }
  assert_true(basis_opens(l));
}

enum { kSun, kAir, kRoom, kTank, kAmps, kOfHouse };

// A heated room under sun and weather. Its blind follows the sun within a minute, so the commands
// explain the sun, or is drawn and opened at random. A tank in the open is warmed by sun and air,
// and by nothing that is commanded.
rim::Log house(std::uint64_t seed, bool follows) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 18);
  rim::Log log;
  log.path = "house" + std::to_string(seed);
  log.columns = {
      {"u.heating", "", rim::Role::command},      {"u.blind", "", rim::Role::command},
      {"s.sun_Wpm2", "W/m^2", rim::Role::sensor}, {"s.air_degC", "degC", rim::Role::sensor},
      {"s.room_degC", "degC", rim::Role::sensor}, {"s.tank_degC", "degC", rim::Role::sensor},
      {"s.heater_A", "A", rim::Role::sensor}};
  double sun = rimi_rng_normal(&rng), air = rimi_rng_normal(&rng), room = 0.0, error = 0.0;
  double tank = air + 2.0 * sun, blind = sun;
  log.values.resize(static_cast<Eigen::Index>(kRows), static_cast<Eigen::Index>(2 + kOfHouse));
  double drawn = 0.0;
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 200 == 0)
      drawn = rimi_rng_normal(&rng);
    sun += -0.004 * sun + std::sqrt(0.008) * rimi_rng_normal(&rng);
    air += -0.003 * air + std::sqrt(0.006) * rimi_rng_normal(&rng);
    error -= room;
    const double heating = 5.0 - 1.5 * (room + 0.1 * rimi_rng_normal(&rng)) + 0.02 * error;
    blind += ((follows ? sun : drawn) - blind) / 20.0;
    room += 0.02 * (heating - 5.0) + 0.03 * (1.5 - 0.3 * blind) * sun - 0.01 * (room - air);
    tank += 0.02 * (air + 2.0 * sun - tank);
    log.t_s.push_back(kPeriod * static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << heating, blind + 0.1 * rimi_rng_normal(&rng),
        sun + 0.05 * rimi_rng_normal(&rng), air + 0.02 * rimi_rng_normal(&rng),
        room + 0.02 * rimi_rng_normal(&rng), tank + 0.05 * rimi_rng_normal(&rng),
        2.0 * heating + 0.02 * rimi_rng_normal(&rng);
  }
  return log;
}

Learnt learn_house(bool follows) {
  return learn_runs([follows](std::uint64_t seed) { return house(seed, follows); });
}

// That the commands explain it does not tell where it comes from.
void what_the_commands_explain_may_be_an_input(void **) {
  const Learnt l = learn_house(true);
  assert_true(l.behaviour.targets[kSun].r2 > 0.9);
  assert_true(uses(l, kRoom, kSun));
}

// Neither what other disturbances bring about is an input, nor what follows a command at once.
void what_is_driven_is_no_input(void **) {
  const Learnt l = learn_house(false);
  for (std::size_t o = 0; o < kOfHouse; ++o) {
    assert_false(uses(l, o, kTank));
    assert_false(uses(l, o, kAmps));
    assert_false(uses(l, o, kRoom));
  }
  assert_true(uses(l, kTank, kSun));
  assert_true(uses(l, kTank, kAir));
  assert_true(l.behaviour.targets[kTank].r2 > 0.98);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(a_slope_that_is_answered_is_an_input),
                              cmocka_unit_test(noise_is_no_input),
                              cmocka_unit_test(what_the_commands_explain_may_be_an_input),
                              cmocka_unit_test(what_is_driven_is_no_input),
                              cmocka_unit_test(what_moves_is_told_from_what_does_not),
                              cmocka_unit_test(a_way_is_the_integral_of_a_speed),
                              cmocka_unit_test(without_commands_nothing_is_an_input),
                              cmocka_unit_test(unused_inputs_do_not_fly)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
