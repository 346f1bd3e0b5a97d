// SPDX-License-Identifier: MIT
// Keepers that correct their model: the greedy planner, what the monitor learns, eq. 3.26.
#include "check.hpp"
#include "thesis/experiment/keepaway.hpp"
#include "util/data_path.hpp"

#include <cmath>
#include <cstdio>
#include <set>

namespace {

using namespace rim;
using world::PassContext;
using world::PassOption;

constexpr std::uint64_t kSeed = 81;

world::KeepawayParams shipped() { return world::read_keepaway_params(data_path("keepaway.toml")); }

KeepawayLearner small() {
  KeepawayLearner learner;
  learner.nominal_runs = 9;
  return learner;
}

template <class Body> void every_state(std::size_t passes, const Body &body) {
  const world::KeepawayParams params = shipped();
  const world::KeepawayModel model(params);
  world::Keepaway keepaway(params, kSeed);
  world::play_passes(
      model, keepaway, params, passes,
      [&](const std::vector<PassOption> &options) {
        body(options);
        return choose_pass(options, nullptr);
      },
      [](const PassOption &, const world::PassResult &) {});
}

void without_regions_the_choice_is_the_nominal_one(void **) {
  const world::KeepawayParams params = shipped();
  KeepawayMonitor monitor(params, small(), nullptr, kSeed);
  every_state(30, [&](const std::vector<PassOption> &options) {
    const PassOption *chosen = choose_pass(options, &monitor);
    assert_true(chosen == choose_pass(options, nullptr));
    for (const PassOption &option : options) {
      assert_true(monitor.value(option) == option.nominal());
      assert_true(option.nominal() <= chosen->nominal());
    }
  });
}

// A context with one taker at `beside`, far from it the others.
PassOption option_at(double beside_m, double expected) {
  PassOption option;
  option.expected.fill(1.0);
  option.context.fill(PassContext{-1.0, 1.9, 0.0, 0.0, 4.0});
  option.context[0] = {0.5, beside_m, 0.0, 0.0, 4.0};
  option.expected[0] = expected;
  option.keepers_s = 0.5;
  return option;
}

// Takers within [0.1, 0.5] m to the left win every pass that 0.95 were to pass.
void teach(const world::KeepawayParams &params, KeepawayMonitor &monitor) {
  world::Random random(kSeed, 1, 1);
  for (int k = 0; k < 60; ++k) {
    const PassOption option = option_at(random.uniform(-1.5, 1.5), 0.95);
    const bool lost = option.context[0][1] > 0.1 && option.context[0][1] < 0.5;
    world::PassResult result;
    result.success = !lost;
    result.touched_by = lost ? static_cast<int>(params.keeper_count()) : 0;
    monitor.observe(option, result);
  }
  monitor.update();
}

void what_fails_is_avoided(void **) {
  const world::KeepawayParams params = shipped();
  const KeepawayLearner learner = small().certain();
  const KeepawayNull null(params, learner, 60, kSeed);
  KeepawayMonitor monitor(params, learner, &null, kSeed);
  teach(params, monitor);
  assert_true(monitor.found().count >= 1);
  std::size_t region = 0;
  const PassOption bad = option_at(0.3, 0.97), good = option_at(-0.6, 0.95);
  assert_true(monitor.corrected(bad, 0, &region) < 0.5);
  assert_int_equal(region, 1);
  assert_true(monitor.shift(0) < -0.5);
  assert_true(monitor.corrected(good, 0, &region) > 0.8);
  const std::vector<PassOption> options = {bad, good};
  assert_true(choose_pass(options, nullptr) == &options[0]);
  assert_true(choose_pass(options, &monitor) == &options[1]);
  // Eq. 3.30: within 0 and 1, the share of the shift that is believed.
  const double mean =
      0.97 + monitor.shift(0) * null.confidence(60, monitor.found().region[0].ln_anom);
  assert_true(std::fabs(monitor.corrected(bad, 0) - std::fmax(0.0, mean)) < 1e-9);
}

// How many different values passes across the edges of what fails have.
std::size_t grades(const KeepawayLearner &learner) {
  const world::KeepawayParams params = shipped();
  const KeepawayNull null(params, learner, 60, kSeed);
  KeepawayMonitor monitor(params, learner, &null, kSeed);
  teach(params, monitor);
  std::set<double> values;
  for (int k = -100; k <= 100; ++k) {
    values.insert(monitor.corrected(option_at(0.01 * k, 0.95), 0));
    assert_true(*values.begin() >= 0.0 && *values.rbegin() <= 1.0);
  }
  assert_true(monitor.corrected(option_at(0.3, 0.95), 0) < 0.5);
  assert_true(monitor.corrected(option_at(-0.6, 0.95), 0) > 0.8);
  return values.size();
}

void many_explanations_grade_the_edges_of_one(void **) {
  assert_true(grades(small()) > grades(small().certain()));
}

void who_touched_it_is_who_won_it(void **) {
  const world::KeepawayParams params = shipped();
  KeepawayLearner learner = small();
  learner.least = 1;
  KeepawayMonitor monitor(params, learner, nullptr, kSeed);
  // Ten passes out of the field: charged to the taker that decided eq. 3.34.
  for (int k = 0; k < 10; ++k) {
    PassOption option = option_at(0.02 * k, 0.9);
    option.decisive = 0;
    monitor.observe(option, {});
  }
  monitor.update();
  std::size_t region = 0;
  assert_true(monitor.corrected(option_at(0.1, 0.9), 0, &region) < 0.5 && region > 0);
  monitor.corrected(option_at(0.1, 0.9), 1, &region);
  assert_int_equal(region, 0);
}

void confidence_is_a_rank_among_nominal_runs(void **) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  KeepawayLearner learner = small();
  learner.quantile = 0.0;
  const KeepawayNull low(shipped(), learner, 40, kSeed);
  learner.quantile = 0.99;
  const KeepawayNull high(shipped(), learner, 40, kSeed);
  double before = -1.0;
  for (double ln_anom = 0.0; ln_anom < 60.0; ln_anom += 0.5) {
    const double confidence = high.confidence(40, ln_anom);
    assert_true(confidence >= before && confidence >= 0.0 && confidence <= 0.9 + 1e-12);
    before = confidence;
  }
  assert_true(std::fabs(before - 0.9) < 1e-12); // nine runs promise no more
  assert_true(low.lambda(40) <= high.lambda(40));
  assert_true(high.confidence(40, high.lambda(40)) >= 0.8 - 1e-12);
}

void runs_repeat_and_the_shadow_plays_the_baseline(void **) {
  const world::KeepawayParams params = shipped();
  const KeepawayNull null(params, small(), 40, kSeed);
  const auto run = [&](KeepawayPlay play) {
    return run_keepaway(params, small(), null, play, 40, kSeed);
  };
  const KeepawayRun baseline = run(KeepawayPlay::baseline), shadow = run(KeepawayPlay::shadow),
                    one = run(KeepawayPlay::adaptive), two = run(KeepawayPlay::adaptive);
  assert_true(shadow.success == baseline.success && baseline.corrected.empty());
  assert_true(one.success == two.success && one.corrected == two.corrected);
  assert_true(one.success != baseline.success);
  assert_int_equal(one.success.size(), 40);
  assert_int_equal(shadow.corrected.size(), shadow.nominal.size());
  for (const double likelihood : shadow.corrected)
    assert_true(likelihood >= 0.0 && likelihood <= 1.0);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(without_regions_the_choice_is_the_nominal_one),
      cmocka_unit_test(what_fails_is_avoided),
      cmocka_unit_test(many_explanations_grade_the_edges_of_one),
      cmocka_unit_test(who_touched_it_is_who_won_it),
      cmocka_unit_test(confidence_is_a_rank_among_nominal_runs),
      cmocka_unit_test(runs_repeat_and_the_shadow_plays_the_baseline),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
