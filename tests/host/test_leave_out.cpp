// SPDX-License-Identifier: MIT
// A context that changes from run to run and hardly within one, and on which nothing depends:
// models do without it, and predict whole runs as well as where nobody had measured it.
#include "learnt.hpp"
#include "made_vehicle.hpp"
#include "train/choose_models.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 7100; // of the first run
constexpr std::size_t kRuns = 12, kLag = 0, kProduct = 1, kState = 2, kOutcomes = 5;
constexpr std::uint16_t kCommandA = 0, kCommandB = 1, kAmbient = 2;

// The made vehicles' logs with the column x.ambient behind the commands.
std::vector<rim::Log> in_an_ambient() {
  std::vector<rim::Log> logs = made_vehicles(kSeed, kRuns);
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 3);
  for (rim::Log &log : logs) {
    const double of_run = 18.0 + 3.0 * rimi_rng_normal(&rng);
    log.columns.insert(log.columns.begin() + kAmbient,
                       {"x.ambient_degC", "degC", rim::Role::context});
    rim::Matrix values(log.values.rows(), log.values.cols() + 1);
    values << log.values.leftCols(kAmbient), Eigen::VectorXd::Zero(log.values.rows()),
        log.values.rightCols(log.values.cols() - kAmbient);
    for (Eigen::Index t = 0; t < values.rows(); ++t)
      values(t, kAmbient) = of_run + 0.1 * rimi_rng_normal(&rng);
    log.values = values;
  }
  return logs;
}

const Learnt &with_ambient() {
  static const Learnt learnt = learn(in_an_ambient());
  return learnt;
}

bool is_without(std::size_t target, std::uint16_t feature) {
  const std::vector<std::uint16_t> &without = with_ambient().behaviour.targets[target].without;
  return std::find(without.begin(), without.end(), feature) != without.end();
}

// A state begins where its run did, and a model may take the ambient for that.
void a_state_does_without_it(void **) {
  assert_true(is_without(kState, kAmbient));
  for (const std::size_t t : {kLag, kProduct}) { // and nothing without what moves it
    assert_false(is_without(t, kCommandA) || is_without(t, kCommandB));
  }
}

void no_term_is_made_of_what_is_left_out(void **) {
  const rim::Basis &basis = with_ambient().basis;
  std::size_t left_out = 0;
  for (std::size_t t = 0; t < 2 * kOutcomes; ++t) {
    for (std::size_t i = 0; i < basis.terms.size(); ++i) {
      for (const std::uint16_t f : rim::features_of(basis, basis.terms[i])) {
        if (!is_without(t, f))
          continue;
        ++left_out;
        assert_true(with_ambient().behaviour.targets[t].weight[static_cast<Eigen::Index>(i)] ==
                    0.0);
      }
    }
  }
  assert_true(left_out > 0);
}

// Whole runs: with the offset of the run that the models have not seen.
void whole_runs_are_predicted_as_if_it_were_not_there(void **) {
  static const Learnt plain = learn(made_vehicles(kSeed, kRuns));
  for (std::size_t t = 0; t < 2 * kOutcomes; ++t) {
    const double with = with_ambient().behaviour.targets[t].whole_error;
    const double without = plain.behaviour.targets[t].whole_error;
    print_message("target %zu: %.4f with an ambient, %.4f without\n", t, with, without);
    assert_true(with < 1.05 * without);
  }
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const CMUnitTest tests[] = {cmocka_unit_test(a_state_does_without_it),
                              cmocka_unit_test(no_term_is_made_of_what_is_left_out),
                              cmocka_unit_test(whole_runs_are_predicted_as_if_it_were_not_there)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
