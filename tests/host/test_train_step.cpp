// SPDX-License-Identifier: MIT
// What an outcome does next. A boat keeps its speed in gusts: its speed in the long run follows the
// gusts, and the throttle answers them. From one block to the next it follows the throttle.
#include "base/rng.h"
#include "replay/replay.hpp"
#include "train/quadratic.hpp"
#include "train/trainer.hpp"

#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include "image/quadratic.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 9400; // of the first run
constexpr std::size_t kRows = 1500, kRuns = 20, kFaulty = 700;
constexpr double kGust = 0.01; // new in every row, m/s
constexpr double kLost = 0.12;  // of the thrust, from row kFaulty on, of a faulty run
enum { kSpeed, kRudder, kMotor, kOutcomes };

rim::Log cruise(std::uint64_t seed, double lost) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 7);
  rim::Log log;
  log.path = "cruise" + std::to_string(seed);
  log.columns = {{"u.throttle", "", rim::Role::command},
                 {"s.speed_mps", "m/s", rim::Role::sensor},
                 {"s.rudder_deg", "deg", rim::Role::sensor},
                 {"s.motor_degC", "degC", rim::Role::sensor}};
  log.values.resize(static_cast<Eigen::Index>(kRows), 4);
  double speed = 5.0, wanted = 5.0, rudder = 0.0, motor = 60.0, gust = 0.0;
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 150 == 0)
      wanted = 4.0 + 2.0 * rimi_rng_uniform(&rng);
    gust += 0.5 * -gust + kGust * rimi_rng_normal(&rng);
    const double throttle = std::fmin(std::fmax(0.5 + 0.3 * (wanted - speed), 0.0), 1.0);
    log.t_s.push_back(static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << throttle, speed + 0.03 * rimi_rng_normal(&rng),
        rudder + 0.3 * rimi_rng_normal(&rng), motor + 0.2 * rimi_rng_normal(&rng);
    speed += 0.5 * throttle * (t < kFaulty ? 1.0 : 1.0 - lost) - 0.01 * speed * speed + gust;
    rudder += 0.1 * -rudder + 0.5 * rimi_rng_normal(&rng);
    motor += 0.02 * (20.0 + 80.0 * throttle - motor);
  }
  return log;
}

const rim::Training &trained() {
  static const rim::Training training = [] {
    std::vector<rim::Log> logs;
    for (std::size_t i = 0; i < kRuns; ++i)
      logs.push_back(cruise(kSeed + i, 0.0));
    return rim::train(logs, {});
  }();
  return training;
}

void outcomes_have_channels_of_their_steps(void **) {
  assert_int_equal(trained().noise.channels.size(), (RIM_CHANNEL_STEP + 1) * kOutcomes);
  const rim::ChannelNoise &step = trained().noise.channels[RIM_CHANNEL_STEP * kOutcomes + kSpeed];
  print_message("seed %u: noise of a step %.4f, lag-1 correlation %.2f\n",
                static_cast<unsigned>(kSeed), step.s, step.rho);
  assert_true(step.active);
}

// Lost thrust, which the throttle makes up for.
void lost_thrust_is_found(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "cruise");
  constexpr std::size_t flights = 6, healthy = 30; // at a promise of 1 in 21: 4 or more in 5 %
  std::size_t false_alarms = 0, found = 0, named = 0;
  for (std::uint64_t i = 0; i < healthy; ++i)
    false_alarms += replayer.replay(cruise(kSeed + 100 + i, 0.0), {}).raised > 0 ? 1 : 0;
  for (std::uint64_t i = 0; i < flights; ++i) {
    std::vector<rim_alarm> records;
    rim::ReplayOptions options;
    options.record = [&records](const rim_alarm &a) { records.push_back(a); };
    (void)replayer.replay(cruise(kSeed + 200 + i, kLost), options);
    found += records.empty() ? 0 : 1;
    named +=
        !records.empty() && records.back().channel[0] == kSpeed && records.back().shift[0] < 0.0
            ? 1
            : 0;
  }
  print_message("found %zu, named %zu of %zu, false %zu of %zu\n", found, named, flights,
                false_alarms, healthy);
  assert_true(found >= flights - 1 && named == found && false_alarms <= 3);
}

// A reading that is off by a constant from some block on is off by as much from what is expected of
// it, though that follows its own last reading.
void an_offset_is_shown_in_full(void **) {
  const rim::Layout layout = trained().plan.layout;
  const auto d = static_cast<Eigen::Index>(layout.features());
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 8);
  rim::Quadratic of;
  of.centre = Eigen::VectorXd::Constant(d, 5.0);
  of.inverse_scale = Eigen::VectorXd::Constant(d, 0.02); // nothing is clipped
  of.paired = d;
  const Eigen::Index own = layout.outcome_feature[kSpeed];
  const double mean = 4.0, sd = 3.0, offset = 2.5;
  rim::BlockRun run[2];
  for (rim::BlockRun &r : run) {
    r.time_s.setLinSpaced(40, 0.0, 39.0);
    r.context.resize(40, d);
    r.outcome.resize(40, kOutcomes);
    r.follows.assign(40, true);
  }
  for (Eigen::Index i = 0; i < 40; ++i) {
    for (Eigen::Index f = 0; f < d; ++f)
      run[0].context(i, f) = 5.0 + 10.0 * rimi_rng_normal(&rng);
  }
  run[1].context = run[0].context;
  run[1].context.col(own).array() += offset;
  Eigen::VectorXd weight =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(RIM_QUADRATIC_TERMS(d, d)));
  for (const Eigen::Index c : rim::quadratic_columns(of, layout, kSpeed, rim::Readings::before)) {
    if (c < 1 + 2 * d)
      weight[c] = rimi_rng_normal(&rng);
  }
  weight[1 + d + own] = 0.7 / (of.inverse_scale[own] * sd);
  const double g = rim::slope_along_own(of, own, sd, weight);
  assert_true(std::fabs(g - 0.7) < 1e-12);
  rim::show_offset_in_full(of, own, mean, sd, g, &weight);
  for (Eigen::Index i = 1; i < 40; ++i) {
    double left[2];
    for (int k = 0; k < 2; ++k)
      left[k] = (run[k].context(i, own) - mean) -
                sd * rim::quadratic_terms(of, layout, run[k]).row(i).dot(weight);
    assert_true(std::fabs(left[1] - left[0] - offset) < 1e-9);
  }
}

// Of all terms those may be used that say what was before the block, or what was commanded in it.
void a_step_does_not_know_its_own_block(void **) {
  const rim::Layout layout = trained().plan.layout;
  const auto d = static_cast<Eigen::Index>(layout.features());
  rim::Quadratic of;
  of.centre = Eigen::VectorXd::Zero(d);
  of.inverse_scale = Eigen::VectorXd::Ones(d);
  of.paired = 2 * d;
  rim::BlockRun run;
  run.time_s.setLinSpaced(2, 0.0, 1.0);
  run.outcome.resize(2, kOutcomes);
  run.context = rim::Matrix::Random(2, d);
  run.follows = {false, true};
  const rim::Matrix terms = rim::quadratic_terms(of, layout, run);
  for (Eigen::Index f = 0; f < d; ++f) {
    rim::BlockRun other = run;
    other.context(1, f) += 0.5;
    const rim::Matrix changed = rim::quadratic_terms(of, layout, other);
    bool same = true;
    for (const Eigen::Index c : rim::quadratic_columns(of, layout, kSpeed, rim::Readings::before))
      same = same && changed(1, c) == terms(1, c);
    assert_int_equal(same, f != 0); // feature 0 is the command
  }
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(outcomes_have_channels_of_their_steps),
                              cmocka_unit_test(lost_thrust_is_found),
                              cmocka_unit_test(an_offset_is_shown_in_full),
                              cmocka_unit_test(a_step_does_not_know_its_own_block)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
