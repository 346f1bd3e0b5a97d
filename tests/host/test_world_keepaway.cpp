// SPDX-License-Identifier: MIT
// The keepaway world: motion and contacts by hand, interceptions, habits, episodes, its file.
#include "check.hpp"
#include "damaged_file.hpp"
#include "util/data_path.hpp"
#include "world/keepaway_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using namespace rim::world;

constexpr std::uint64_t kSeed = 77;

KeepawayParams shipped() { return read_keepaway_params(rim::data_path("keepaway.toml")); }

void close_to(double a, double b, double tolerance) {
  if (!(std::fabs(a - b) <= tolerance)) {
    std::fprintf(stderr, "%.12g is not within %g of %.12g\n", a, tolerance, b);
    fail_msg("nothing was thrown");
  }
}

// Against small steps of the equation of motion; the steps of the world add up to the closed form.
void ball_slides_then_rolls(void **) {
  const BallFriction friction;
  KeepawayBall ball;
  ball.kick({0.0, 5.0});
  double speed = 5.0, path = 0.0, time_s = 0.0, energy = 25.0;
  const double small = 1e-6;
  for (int k = 1; k <= 200; ++k) {
    ball.step(friction, 0.02);
    for (; time_s < 0.02 * k - 0.5 * small; time_s += small) {
      path += speed * small;
      speed -= (speed > 25.0 / 7.0 ? 3.5 : 0.4) * small;
    }
    close_to(ball.at_m.y(), path, 2e-5);
    close_to(ball.velocity_mps.norm(), speed, 2e-5);
    assert_true(ball.velocity_mps.squaredNorm() < energy);
    energy = ball.velocity_mps.squaredNorm();
  }
  close_to(ball_speed_mps(friction, 5.0, 100.0), 0.0, 0.0); // it stops, and stays
  close_to(ball_path_m(friction, 5.0, 100.0), ball_path_m(friction, 5.0, 50.0), 0.0);
}

double energy_of(const std::vector<KeepawayRobot> &robots, const KeepawayBall &ball,
                 const BodySizes &sizes) {
  double sum = 0.5 * sizes.ball_mass_kg * ball.velocity_mps.squaredNorm();
  for (const KeepawayRobot &robot : robots)
    sum += 0.5 * sizes.robot_mass_kg * robot.velocity_mps.squaredNorm();
  return sum;
}

Vec2 random_vector(Random &random, double most) {
  return {random.uniform(-most, most), random.uniform(-most, most)};
}

void contacts_take_bodies_apart_and_give_no_energy(void **) {
  const BodySizes sizes;
  Random random(kSeed, 1, 1);
  int touched = 0;
  for (int k = 0; k < 2000; ++k) {
    std::vector<KeepawayRobot> robots(2);
    for (KeepawayRobot &robot : robots) {
      robot = {random_vector(random, 0.1), random_vector(random, 2.0), random.uniform(-3.0, 3.0),
               0.0};
    }
    KeepawayBall ball;
    ball.at_m = random_vector(random, 0.2);
    ball.kick(random_vector(random, 5.0));
    Vec2 momentum = sizes.ball_mass_kg * ball.velocity_mps;
    for (const KeepawayRobot &robot : robots)
      momentum += sizes.robot_mass_kg * robot.velocity_mps;
    const double before = energy_of(robots, ball, sizes);
    for (int again = 0; again < 20; ++again) // overlaps of this depth do not arise in one step
      touched += resolve_contacts(robots, &ball, sizes, nullptr) >= 0 ? 1 : 0;
    assert_true(energy_of(robots, ball, sizes) <= before * (1.0 + 1e-12));
    assert_true(overlap_of(robots[0], robots[1], sizes).depth_m < 1e-5);
    assert_true(overlap_of(robots[0], ball, sizes).depth_m < 1e-5);
    assert_true(overlap_of(robots[1], ball, sizes).depth_m < 1e-5);
    for (const KeepawayRobot &robot : robots)
      momentum -= sizes.robot_mass_kg * robot.velocity_mps;
    momentum -= sizes.ball_mass_kg * ball.velocity_mps;
    close_to(momentum.norm(), 0.0, 1e-10);
  }
  assert_true(touched > 200);
}

// Along the flat front the ball comes nearer than along the rim.
void the_front_of_a_robot_is_flat(void **) {
  const BodySizes sizes;
  KeepawayRobot robot;
  KeepawayBall ball;
  const double front = sizes.robot_front_m + sizes.ball_radius_m;
  const double rim = sizes.robot_radius_m + sizes.ball_radius_m;
  for (const double side : {-0.03, 0.0, 0.03}) {
    ball.at_m = {front + 1e-4, side};
    close_to(overlap_of(robot, ball, sizes).depth_m, 0.0, 0.0);
    ball.at_m = {front - 1e-3, side};
    close_to(overlap_of(robot, ball, sizes).depth_m, 1e-3, 1e-5);
    close_to(overlap_of(robot, ball, sizes).away.x(), 1.0, 1e-3);
  }
  ball.at_m = {-rim + 1e-3, 0.0};
  close_to(overlap_of(robot, ball, sizes).depth_m, 1e-3, 1e-5);
  ball.at_m = {0.0, rim + 1e-4};
  close_to(overlap_of(robot, ball, sizes).depth_m, 0.0, 0.0);
}

void robots_keep_their_limits(void **) {
  const MotionLimits limits;
  KeepawayRobot robot;
  double fastest = 0.0;
  for (int k = 0; k < 600; ++k) {
    const Vec2 before = robot.velocity_mps;
    step_robot(robot, drive_to(robot, {3.0, 0.0}, limits), 1.0, limits, 0.005);
    assert_true((robot.velocity_mps - before).norm() <= limits.accel_mps2 * 0.005 * (1.0 + 1e-9));
    fastest = std::fmax(fastest, robot.velocity_mps.norm());
  }
  close_to(fastest, limits.speed_mps, 1e-9);
  close_to(robot.at_m.x(), 3.0, 0.01); // and stands where it was sent
  close_to(robot.heading_rad, 1.0, 1e-9);
  KeepawayRobot through;
  through.velocity_mps = {0.0, 0.5};
  for (int k = 0; k < 200; ++k)
    step_robot(through, drive_through(through, {0.4, 0.6}, 1.0 - 0.005 * k, limits), 0.0, limits,
               0.005);
  close_to((through.at_m - Vec2(0.4, 0.6)).norm(), 0.0, 0.02);
}

BallFlight straight(const std::vector<double> &path, double step_s) {
  BallFlight flight;
  flight.forward = {1.0, 0.0};
  flight.path_m = path.data();
  flight.count = path.size();
  flight.step_s = step_s;
  return flight;
}

void interception_by_hand(void **) {
  const MotionLimits limits;
  const std::vector<double> still(200, 0.0);
  KeepawayRobot robot;
  robot.at_m = {0.0, 0.5};
  // From rest, after 0.1 s, 0.4 m: half a t^2.
  close_to(intercept(robot, limits, 0.1, 0.1, straight(still, 0.02)).time_s,
           0.1 + std::sqrt(0.8 / 3.0), 2e-3);
  MotionLimits fast = limits;
  fast.accel_mps2 = 6.0;
  close_to(intercept(robot, fast, 0.1, 0.1, straight(still, 0.02)).time_s,
           0.1 + std::sqrt(0.8 / 6.0), 2e-3);
  robot.at_m = {0.0, 3.1}; // top speed after 2/3 s and 2/3 m
  close_to(intercept(robot, limits, 0.1, 0.1, straight(still, 0.02)).time_s,
           0.1 + 2.0 / 3.0 + (3.0 - 2.0 / 3.0) / 2.0, 2e-3);
  std::vector<double> path(100);
  for (std::size_t k = 0; k < path.size(); ++k)
    path[k] = 0.08 * static_cast<double>(k); // 4 m/s
  robot.at_m = {2.0, 0.05};
  close_to(intercept(robot, limits, 9.0, 0.1, straight(path, 0.02)).time_s, (2.0 - 0.0866) / 4.0,
           3e-3); // the ball runs into it
  robot.at_m = {0.5, 0.7};
  assert_true(std::isinf(intercept(robot, limits, 0.1, 0.1, straight(path, 0.02)).time_s));
  // Sooner the faster it is, and the sooner it starts.
  robot.at_m = {2.0, 0.3};
  const double slow = intercept(robot, limits, 0.1, 0.1, straight(path, 0.02)).time_s;
  assert_true(intercept(robot, fast, 0.1, 0.1, straight(path, 0.02)).time_s < slow);
  assert_true(intercept(robot, limits, -0.1, 0.1, straight(path, 0.02)).time_s < slow);
}

void nominal_model_by_hand(void **) {
  const KeepawayParams params = shipped();
  const KeepawayModel model(params);
  Keepaway keepaway(params, kSeed);
  std::vector<PassOption> options;
  std::size_t evaluated = 0;
  for (int k = 0; k < 8; ++k) {
    const KeepawayState state = keepaway.ready();
    model.options(state, options);
    evaluated += options.size();
    PassOption slow;
    slow.speed_mps = params.kick_min_mps;
    for (const PassOption &option : options) {
      const double margin = option.takers_s[option.decisive] - option.keepers_s;
      close_to(option.nominal(), 0.5 * std::erfc(-margin / params.time_sd_s / std::sqrt(2.0)),
               1e-12);
      const Vec2 forward(std::cos(option.direction_rad), std::sin(option.direction_rad));
      for (std::size_t i = 0; i < params.taker_count(); ++i) {
        assert_true(option.takers_s[i] >= option.takers_s[option.decisive]);
        assert_true(option.expected[i] >= option.nominal());
        KeepawayRobot taker = state.robots[params.keeper_count() + i];
        coast_to_stop(taker, params.limits, params.aim_s);
        const double front = params.sizes.robot_front_m + params.sizes.ball_radius_m;
        const Vec2 away = taker.at_m - state.robots[state.holder].at_m - front * forward;
        close_to(option.context[i][0], away.dot(forward), 1e-12);
        close_to(std::hypot(option.context[i][0], option.context[i][1]), away.norm(), 1e-12);
        assert_true((option.context[i][1] > 0.0) ==
                    (forward.x() * away.y() - forward.y() * away.x() > 0.0));
        close_to(option.context[i][4], option.speed_mps, 0.0);
      }
    }
    keepaway.pass(options.empty() ? slow : options[static_cast<std::size_t>(k) % options.size()]);
  }
  assert_true(evaluated > 100);
}

const PassOption *nominal_choice(const std::vector<PassOption> &options) {
  return best_pass(options, [](const PassOption &o) { return o.nominal(); });
}

// Shares of completed passes and of passes on which a habit acted.
std::pair<double, double> play(const KeepawayParams &params, std::uint64_t seed,
                               std::size_t passes) {
  const KeepawayModel model(params);
  Keepaway keepaway(params, seed);
  double completed = 0.0, acted = 0.0;
  play_passes(model, keepaway, params, passes, nominal_choice,
              [&](const PassOption &, const PassResult &result) {
                completed += result.success ? 1.0 : 0.0;
                for (const bool habit : result.habit)
                  acted += habit ? 1.0 : 0.0;
                assert_true(!result.success || result.touched_by >= 0);
                assert_true(!result.out || result.touched_by < 0);
                for (const KeepawayRobot &a : keepaway.state().robots) {
                  for (const KeepawayRobot &b : keepaway.state().robots)
                    assert_true(&a == &b || overlap_of(a, b, params.sizes).depth_m < 1e-3);
                }
              });
  assert_true(keepaway.episodes() > 1);
  const auto n = static_cast<double>(passes);
  return {completed / n, acted / n};
}

// The model is right about takers without habits; with them they win more.
void habits_cost_passes(void **) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const KeepawayParams params = shipped();
  KeepawayParams plain = params;
  plain.habits.clear();
  const auto with = play(params, kSeed, 400), without = play(plain, kSeed, 400);
  assert_true(with.second > 0.2 && without.second == 0.0);
  assert_true(without.first > 0.85);
  assert_true(with.first < without.first - 0.1);
}

void a_habit_acts_in_its_box_alone(void **) {
  TakerHabit habit;
  habit.low = {0.0, -1.0, -9.0, -9.0, 3.0};
  habit.high = {1.0, 1.0, 9.0, 9.0, 4.0};
  assert_true(habit.acts({0.5, 0.5, 0.0, 0.0, 3.5}));
  assert_false(habit.acts({0.5, 0.5, 0.0, 0.0, 4.5}));
  assert_false(habit.acts({-0.1, 0.5, 0.0, 0.0, 3.5}));
  assert_false(habit.acts({NAN, 0.5, 0.0, 0.0, 3.5}));
}

void episodes_begin_and_end(void **) {
  const KeepawayParams params = shipped();
  const KeepawayModel model(params);
  Keepaway keepaway(params, kSeed, 2);
  std::vector<PassOption> options;
  int kept = 0, ended = 0;
  for (int k = 0; k < 60; ++k) {
    const bool was_over = keepaway.episode_over();
    const std::size_t before = keepaway.episodes();
    const KeepawayState &state = keepaway.ready();
    assert_int_equal(keepaway.episodes() - before, was_over ? 1 : 0);
    assert_true(state.holder < params.keeper_count());
    model.options(state, options);
    if (const PassOption *best = nominal_choice(options)) {
      const PassResult result = keepaway.pass(*best);
      // Nobody but a keeper that has the ball goes on.
      assert_true(!result.out || keepaway.episode_over());
      (keepaway.episode_over() ? ended : kept) += 1;
    } else {
      PassOption away;
      away.speed_mps = params.kick_min_mps;
      keepaway.pass(away);
    }
  }
  assert_true(kept > 5 && ended > 5);
}

void the_same_run_again(void **) {
  const KeepawayParams params = shipped();
  Keepaway one(params, kSeed, 3), two(params, kSeed, 3), other(params, kSeed, 4);
  const Recording a = record_keepaway(one, params, 20), b = record_keepaway(two, params, 20),
                  c = record_keepaway(other, params, 20);
  assert_true(a.log.values == b.log.values && a.log.t_s == b.log.t_s && a.finding == b.finding);
  assert_false(a.log.values == c.log.values);
  assert_int_equal(a.log.t_s.size(), 20);
  assert_true(std::is_sorted(a.log.t_s.begin(), a.log.t_s.end()));
}

void refuses(const std::string &from, const std::string &to, const char *reason) {
  assert_true(refuses_damage("keepaway.toml", from, to, reason,
                             [](const std::string &path) { read_keepaway_params(path); }));
}

void bad_files_are_refused(void **) {
  refuses("takers = 3", "takers = 3.5", "keepaway.takers");
  refuses("keepers = 4", "keepers = 1", "keepaway.keepers");
  refuses("aim_s = 0.2", "aim_ss = 0.2", "aim_ss");
  refuses("\nheld_s = 1.0", "\n# held_s = 1.0", "held_s");
  refuses("kick_max_mps = 8.0", "kick_max_mps = 9.0", "8 m/s");
  refuses("step_s = 0.005", "step_s = 0.05", "step_s");
  refuses("hold_min_s = 0.8", "hold_min_s = 3.0", "hold_min_s");
  refuses("beside_m = [0.1, 0.6]", "beside_m = [0.6, 0.1]", "habit.beside_m");
  refuses("beside_m = [0.1, 0.6]", "beside_m = 0.6", "[low, high]");
  refuses("\nstart_s = -0.2", "", "start_s");
  refuses("[keepaway]", "[keepers]", "keepers");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(ball_slides_then_rolls),
      cmocka_unit_test(contacts_take_bodies_apart_and_give_no_energy),
      cmocka_unit_test(the_front_of_a_robot_is_flat),
      cmocka_unit_test(robots_keep_their_limits),
      cmocka_unit_test(interception_by_hand),
      cmocka_unit_test(nominal_model_by_hand),
      cmocka_unit_test(habits_cost_passes),
      cmocka_unit_test(a_habit_acts_in_its_box_alone),
      cmocka_unit_test(episodes_begin_and_end),
      cmocka_unit_test(the_same_run_again),
      cmocka_unit_test(bad_files_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
