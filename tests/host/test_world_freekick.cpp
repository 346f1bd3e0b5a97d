// SPDX-License-Identifier: MIT
// The free-kick world: threats, chances, streams, its file.
#include "check.hpp"
#include "damaged_file.hpp"
#include "util/data_path.hpp"
#include "world/freekick.hpp"

#include <cmath>
#include <cstdio>

namespace {

using rim::Defence;
using rim::FieldPoint;
using rim::Freekick;
using rim::FreekickParams;

constexpr std::uint64_t kSeed = 61;

FreekickParams shipped() { return rim::read_freekick_params(rim::data_path("freekick.toml")); }

void goal_angle_by_hand(void **) {
  const Freekick world(shipped(), Defence::time);
  // Half a metre to either side at 2 m.
  assert_true(std::fabs(world.goal_angle_rad({2.5, 0.0}) - 2.0 * std::atan(0.25)) < 1e-12);
  assert_true(world.goal_angle_rad({2.5, 2.5}) < world.goal_angle_rad({2.5, 0.5}));
}

// Two men before the goal: one near the ball at a narrow angle, one far from it in the middle.
void defences_rank_as_they_are_called(void **) {
  FreekickParams params = shipped();
  const FieldPoint near_ball{3.6, 2.4}, middle{3.2, 0.0}, far{-3.0, -2.5}, ball{3.5, 2.8};
  params.plans[0] = {{{middle, middle}, {near_ball, near_ball}, {far, far}, {far, far}}};
  params.open_angle_rad = 0.4;
  const auto first = [&params, &ball](Defence defence) {
    return Freekick(params, defence).ranking(ball, 0)[0];
  };
  assert_int_equal(first(Defence::time), 1);
  assert_int_equal(first(Defence::angle), 0);
  assert_int_equal(first(Defence::combined), 0); // one angle is narrow: the angle decides
  params.open_angle_rad = 0.05;
  assert_int_equal(first(Defence::combined), 1); // both are wide: time decides
}

void two_men_are_marked_the_third_is_free(void **) {
  FreekickParams params = shipped();
  const FieldPoint ball{3.5, 2.5}, open{2.6, -0.6}, far{-3.0, -2.5}, decoy{2.0, 1.4};
  // Standing receivers: the best of them alone is marked, so nobody scores; with two decoys that
  // the defence fears more, he is free.
  params.plans[0] = {{{open, open}, {far, far}, {far, far}, {far, far}}};
  params.plans[1] = {{{open, open}, {decoy, decoy}, {decoy, decoy}, {far, far}}};
  const Freekick world(params, Defence::time);
  assert_int_not_equal(world.ranking(ball, 1)[0], 0);
  assert_int_not_equal(world.ranking(ball, 1)[1], 0);
  assert_true(world.chance(ball, 0) < 0.1);
  assert_true(world.chance(ball, 1) > 0.3);
}

void chances_are_chances_and_plans_differ(void **) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const FreekickParams params = shipped();
  for (const Defence defence : {Defence::time, Defence::angle, Defence::combined}) {
    const Freekick world(params, defence);
    std::array<int, rim::kFreekickPlans> best_of{};
    double regret = 0.0;
    for (const rim::FreekickEpisode &e : rim::freekick_episodes(params, 500, kSeed)) {
      assert_true(e.ball.x_m >= params.ball_min_x_m && e.ball.x_m <= params.ball_max_x_m);
      assert_true(e.ball.y_m >= params.ball_min_y_m && e.ball.y_m <= params.ball_max_y_m);
      const double best = world.best_chance(e.ball);
      for (std::size_t k = 0; k < rim::kFreekickPlans; ++k) {
        const double p = world.chance(e.ball, k);
        assert_true(p >= 0.0 && p <= params.best_chance && p <= best);
        best_of[k] += p == best ? 1 : 0;
        regret += (best - p) / (500.0 * rim::kFreekickPlans);
      }
    }
    assert_true(regret > 0.1); // or there were nothing to learn
    int sometimes_best = 0;
    for (const int count : best_of)
      sometimes_best += count > 25 ? 1 : 0;
    assert_true(sometimes_best >= 3); // the place matters
  }
}

void defences_differ(void **) {
  const FreekickParams params = shipped();
  const Freekick time(params, Defence::time), angle(params, Defence::angle),
      combined(params, Defence::combined);
  int time_angle = 0, angle_combined = 0;
  for (const rim::FreekickEpisode &e : rim::freekick_episodes(params, 500, kSeed)) {
    for (std::size_t k = 0; k < rim::kFreekickPlans; ++k) {
      time_angle += std::fabs(time.chance(e.ball, k) - angle.chance(e.ball, k)) > 0.05 ? 1 : 0;
      angle_combined +=
          std::fabs(combined.chance(e.ball, k) - angle.chance(e.ball, k)) > 0.05 ? 1 : 0;
    }
  }
  assert_true(time_angle > 100);
  assert_true(angle_combined > 20);
}

void equal_seeds_equal_kicks(void **) {
  const FreekickParams params = shipped();
  const auto a = rim::freekick_episodes(params, 20, kSeed),
             b = rim::freekick_episodes(params, 40, kSeed);
  for (std::size_t i = 0; i < a.size(); ++i)
    assert_true(a[i].ball.x_m == b[i].ball.x_m && a[i].luck == b[i].luck);
  assert_true(a[0].luck != rim::freekick_episodes(params, 1, kSeed + 1)[0].luck);
}

void refuses(const char *from, const char *to, const char *reason) {
  const auto read = [](const std::string &path) { rim::read_freekick_params(path); };
  assert_true(refuses_damage("freekick.toml", from, to, reason, read));
}

void bad_files_are_refused(void **) {
  refuses("fk6 =", "fk7 =", "fk6");
  refuses("fk1 = [2.0, ", "fk1 = [", "16 numbers");
  refuses("fk1 = [2.0, ", "fk1 = ['a', ", "fk1");
  refuses("best_chance = 0.9", "best_chance = 1.9", "best_chance");
  refuses("ball_min_x_m = 0.3", "ball_min_x_m = 4.3", "ball_min_x_m");
  refuses("[plan]", "[plans]", "plan");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(goal_angle_by_hand),
      cmocka_unit_test(defences_rank_as_they_are_called),
      cmocka_unit_test(two_men_are_marked_the_third_is_free),
      cmocka_unit_test(chances_are_chances_and_plans_differ),
      cmocka_unit_test(defences_differ),
      cmocka_unit_test(equal_seeds_equal_kicks),
      cmocka_unit_test(bad_files_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
