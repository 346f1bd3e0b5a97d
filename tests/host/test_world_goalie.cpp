// SPDX-License-Identifier: MIT
// The goalie world: the nominal model by hand, the four behaviours against it, its file.
#include "check.hpp"
#include "damaged_file.hpp"
#include "util/data_path.hpp"
#include "world/goalie.hpp"

#include <cmath>
#include <cstdio>

namespace {

using rim::Goalie;
using rim::GoalieBehaviour;
using rim::GoalieParams;

constexpr std::uint64_t kSeed = 31;

void close_to(double a, double b, double tolerance) {
  if (!(std::fabs(a - b) <= tolerance)) {
    std::fprintf(stderr, "%.12g is not within %g of %.12g\n", a, tolerance, b);
    fail_msg("nothing was thrown");
  }
}

// Places and aims all over.
template <class Body> void everywhere(const Body &body) {
  for (double s_m = 1.05; s_m < 5.0; s_m += 0.35) {
    for (double a_m = -0.5; a_m < 0.501; a_m += 0.04)
      body(s_m, a_m);
  }
}

// Against small steps of the equations of motion: 8 m/s, sliding until 5/7 of it, then rolling.
void ball_time_is_the_motion_integrated(void **) {
  const Goalie world({}, GoalieBehaviour::nominal);
  double speed = 8.0, at_m = 0.0, time_s = 0.0, next_m = 0.5;
  const double step_s = 1e-6;
  while (next_m < 6.0) {
    const double decel = speed > 8.0 * 5.0 / 7.0 ? 3.5 : 0.4;
    at_m += speed * step_s;
    speed -= decel * step_s;
    time_s += step_s;
    if (at_m >= next_m) {
      close_to(world.ball_time_s(next_m), time_s, 1e-5);
      next_m += 0.5;
    }
  }
  assert_true(std::isinf(world.ball_time_s(1000.0)));
}

void nominal_model_by_hand(void **) {
  const Goalie world({}, GoalieBehaviour::nominal);
  // s = 2.2, a = 0.33: crosses the goalie's line at 0.3, 2 m and a little away from the ball.
  const double ball_m = std::hypot(2.0, 0.3);
  const double moving_s = (8.0 - std::sqrt(64.0 - 7.0 * ball_m)) / 3.5 - 0.1;
  const double past_m = 0.3 - 1.5 * moving_s * moving_s - 0.09 - 0.0215;
  close_to(world.nominal_mean(2.2, 0.33), std::fmin(0.17, past_m), 1e-12);
  assert_true(past_m < 0.17);
  close_to(world.nominal_mean(2.2, 0.48), 0.02, 1e-12);   // the post is nearer
  close_to(world.nominal_mean(4.0, 0.0), -0.1115, 1e-12); // in the goalie's arms
  close_to(world.nominal_sd(3.0, 0.4), std::tan(0.01) * std::hypot(3.0, 0.4), 1e-12);
}

// Eq. 5.18 and 5.19 are this goalie exactly: without noise the model is the world.
void nominal_goalie_is_the_model(void **) {
  const Goalie world({}, GoalieBehaviour::nominal);
  everywhere([&](double s_m, double a_m) {
    close_to(world.reward(s_m, a_m, 0.0), world.nominal_mean(s_m, a_m), 1e-9);
  });
}

void region_concedes_inside_only(void **) {
  const GoalieParams params = rim::read_goalie_params(rim::data_path("goalie.toml"));
  const Goalie nominal(params, GoalieBehaviour::nominal), region(params, GoalieBehaviour::region);
  int inside = 0, all = 0;
  everywhere([&](double s_m, double a_m) {
    const bool is_in = region.in_region(s_m, a_m);
    close_to(region.reward(s_m, a_m, 0.004) - nominal.reward(s_m, a_m, 0.004),
             is_in ? params.region_gain_m : 0.0, 1e-12);
    inside += is_in ? 1 : 0;
    ++all;
  });
  assert_true(inside * 20 > all && inside * 3 < all);
  // The ends of the parallelogram (fig. 5.6).
  assert_true(region.in_region(params.region_min_m, params.region_at_min_m));
  assert_false(region.in_region(params.region_min_m - 0.01, params.region_at_min_m));
  assert_false(region.in_region(params.region_max_m + 0.01, params.region_at_min_m));
}

void obstruction_only_helps_and_on_its_side(void **) {
  const Goalie nominal({}, GoalieBehaviour::nominal), hidden({}, GoalieBehaviour::obstructed);
  double most_high = 0.0, most_near = 0.0;
  everywhere([&](double s_m, double a_m) {
    const double gain = hidden.reward(s_m, a_m, 0.0) - nominal.reward(s_m, a_m, 0.0);
    assert_true(gain >= -1e-12);
    if (a_m > 0.1)
      most_high = std::fmax(most_high, gain);
    if (s_m < 1.5) // the ball starts on the goalie's side of the obstruction
      most_near = std::fmax(most_near, gain);
  });
  assert_true(most_high > 0.15);
  close_to(most_near, 0.0, 1e-12);
  // Over the high end of the obstruction nothing is hidden from the start on.
  GoalieParams beside;
  beside.obstacle_low_m = 0.4;
  beside.obstacle_high_m = 0.5;
  const Goalie seen(beside, GoalieBehaviour::obstructed);
  close_to(seen.reward(3.0, 0.3, 0.0), nominal.reward(3.0, 0.3, 0.0), 1e-12);
}

void overshoot_passes_the_ball_only_with_time_to_spare(void **) {
  const Goalie nominal({}, GoalieBehaviour::nominal), eager({}, GoalieBehaviour::overshoot);
  // Too near to reach the ball: both accelerate all the time.
  close_to(eager.reward(1.2, 0.3, 0.0), nominal.reward(1.2, 0.3, 0.0), 1e-6);
  // From 4.5 m at 0.12 the goalie is there early, fast, and slides past.
  const double blocked = nominal.reward(4.5, 0.12, 0.0), open = eager.reward(4.5, 0.12, 0.0);
  close_to(blocked, -0.1115, 1e-9);
  assert_true(open > blocked + 0.05);
  // It swings about the ball's path with the amplitude of its start: never farther off than that.
  everywhere([&](double s_m, double a_m) {
    const double crossing_m = std::fabs(a_m) * (1.0 - 0.2 / s_m);
    const double limit = std::fmin(0.5 - std::fabs(a_m), crossing_m - 0.1115);
    assert_true(eager.reward(s_m, a_m, 0.0) <= limit + 2e-3);
  });
}

void expected_is_the_mean_of_rewards(void **) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const GoalieParams params;
  for (const auto behaviour : {GoalieBehaviour::region, GoalieBehaviour::overshoot}) {
    const Goalie world(params, behaviour);
    double sum = 0.0;
    const auto episodes = rim::goalie_episodes(params, 40000, kSeed);
    for (const rim::GoalieEpisode &e : episodes) {
      assert_true(e.s_m > params.ball_min_m && e.s_m < params.ball_max_m);
      sum += world.reward(3.0, 0.35, e.error_rad);
    }
    close_to(world.expected(3.0, 0.35), sum / 40000.0, 1e-3); // five standard errors
    assert_true(world.expected(3.0, 0.35) < world.reward(3.0, 0.35, 0.0));
  }
  const auto one = rim::goalie_episodes(params, 50, kSeed),
             again = rim::goalie_episodes(params, 9, kSeed);
  assert_true(one[8].s_m == again[8].s_m && one[8].error_rad == again[8].error_rad);
  assert_true(rim::goalie_episodes(params, 1, kSeed + 1)[0].s_m != one[0].s_m);
}

void refuses(const char *from, const char *to, const char *reason) {
  const auto read = [](const std::string &path) { rim::read_goalie_params(path); };
  assert_true(refuses_damage("goalie.toml", from, to, reason, read));
}

void bad_files_are_refused(void **) {
  refuses("goal_half_m", "goal_halve_m", "goal_halve_m");
  refuses("step_s = 0.001", "", "step_s");
  refuses("latency_s = 0.1", "latency_s = -0.1", "latency_s");
  refuses("ball_min_m = 1.0", "ball_min_m = 0.1", "ball_min_m");
  refuses("obstacle_low_m = -0.04", "obstacle_low_m = 0.4", "obstacle_low_m");
  refuses("[goalie]", "[keeper]", "keeper");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(ball_time_is_the_motion_integrated),
      cmocka_unit_test(nominal_model_by_hand),
      cmocka_unit_test(nominal_goalie_is_the_model),
      cmocka_unit_test(region_concedes_inside_only),
      cmocka_unit_test(obstruction_only_helps_and_on_its_side),
      cmocka_unit_test(overshoot_passes_the_ball_only_with_time_to_spare),
      cmocka_unit_test(expected_is_the_mean_of_rewards),
      cmocka_unit_test(bad_files_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
