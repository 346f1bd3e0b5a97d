// SPDX-License-Identifier: MIT
// Many commands: a spacecraft with a thruster in every column. All of them are inputs of the models
// as far as there is room, and those for which there is none are named.
#include "base/rng.h"
#include "check.hpp"
#include "learnt.hpp"
#include "train/healthy_runs.hpp"

#include <cstdlib>

namespace {

constexpr double kNoise = 0.1;

// s.pull_N is the sum of all commands, which are as large, and change every two seconds.
std::vector<rim::Log> thrusters(std::size_t commands, std::size_t runs, std::size_t rows) {
  std::vector<rim::Log> logs;
  for (std::size_t r = 0; r < runs; ++r) {
    rim_rng rng;
    rimi_rng_seed(&rng, 8700 + r, 3);
    rim::Log log;
    log.path = "run" + std::to_string(r);
    for (std::size_t c = 0; c < commands; ++c)
      log.columns.push_back({"u.c" + std::to_string(c), "", rim::Role::command});
    log.columns.push_back({"s.pull_N", "N", rim::Role::sensor});
    log.values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(commands + 1));
    for (Eigen::Index t = 0; t < log.values.rows(); ++t) {
      for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(commands); ++c)
        log.values(t, c) = t % 20 == 0 ? rimi_rng_normal(&rng) : log.values(t - 1, c);
      log.values(t, log.values.cols() - 1) =
          log.values.row(t).head(log.values.cols() - 1).sum() + kNoise * rimi_rng_normal(&rng);
      log.t_s.push_back(0.1 * static_cast<double>(t));
    }
    logs.push_back(log);
  }
  return logs;
}

void every_command_is_an_input(void **) {
  // More than 20, which were all inputs once. The time goes with the square of their number: 30
  // with RIM_LONG (`make test-long`).
  const std::size_t commands = std::getenv("RIM_LONG") != nullptr ? 30 : 22;
  const Learnt l = learn(thrusters(commands, 10, 800));
  assert_true(basis_opens(l));
  const rim::TargetModel &pull = l.behaviour.targets[0];
  print_message("R2 %.4f, error %.3f N\n", pull.r2, pull.error);
  assert_true(pull.r2 > 0.99 && pull.error < 2.0 * kNoise);
}

void what_has_no_room_is_named(void **) {
  const std::vector<rim::Log> logs = thrusters(rim::kMostCommands + 2, 3, 400);
  rim::LogSet set(logs);
  const rim::Survey survey = rim::survey_of(&set);
  const std::vector<std::uint16_t> left{rim::kMostCommands, rim::kMostCommands + 1};
  assert_true(rim::no_inputs(survey) == left);
  const rim::HealthyRuns healthy = rim::healthy_runs(&set, {});
  assert_int_equal(healthy.warnings.size(), 1);
  assert_true(has(healthy.warnings.front(), "no model knows of u.c36, u.c37. Put"));
  const std::vector<rim::Log> few = thrusters(rim::kMostCommands, 3, 400);
  rim::LogSet all(few);
  assert_true(rim::no_inputs(rim::survey_of(&all)).empty());
}

// An angle is two inputs: one is left out where there is room for one more.
void an_angle_takes_two(void **) {
  for (const std::size_t commands : {rim::kMostCommands - 1, rim::kMostCommands}) {
    std::vector<rim::Log> logs = thrusters(commands, 3, 400);
    for (rim::Log &log : logs) {
      log.columns[commands - 1] = {"u.heading_deg", "deg", rim::Role::command};
      for (std::size_t t = 0; t < log.t_s.size(); ++t)
        log.values(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(commands - 1)) =
            std::remainder(7.0 * static_cast<double>(t), 360.0);
    }
    rim::LogSet set(logs);
    const rim::Survey survey = rim::survey_of(&set);
    assert_int_equal(rim::no_inputs(survey).size(), commands == rim::kMostCommands ? 1 : 0);
  }
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(every_command_is_an_input),
      cmocka_unit_test(what_has_no_room_is_named),
      cmocka_unit_test(an_angle_takes_two),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
