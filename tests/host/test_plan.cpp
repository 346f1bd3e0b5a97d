// SPDX-License-Identifier: MIT
// plan: the planner against its own configuration, and states over LCM.
#include "bus/lcm_bus.hpp"
#include "check.hpp"
#include "plan/plan_line.hpp"
#include "plan/planner.hpp"
#include "util/error.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

rim::PlannerConfig two_by_two() {
  rim::PlannerConfig c;
  c.state = {{0.0, 1.0, 0}};
  c.action = {{-1.0, 1.0, 3}, {10.0, 20.0, 2}};
  c.bandit.policy = RIM_BANDIT_RIM_GP_UCB;
  c.bandit.beta = 0.0;
  c.bandit.gp.points = c.bandit.extent.points = 32;
  c.bandit.gp.noise_var = 0.01;
  return c;
}

void actions_are_the_grid(void **) {
  rim::Planner planner(two_by_two());
  assert_int_equal(planner.features(), 3);
  for (std::uint32_t wanted = 0; wanted < 6; ++wanted) {
    rim::PlanRequest request;
    request.state = {0.3};
    request.nominal.assign(6, 0.0);
    request.nominal[wanted] = 1.0;
    const auto answer = planner.choose(request);
    assert_true(answer.has_value());
    assert_int_equal(answer->choice.action, wanted);
    assert_true(answer->action[0] == -1.0 + (wanted / 2));
    assert_true(answer->action[1] == 10.0 + 10.0 * (wanted % 2));
    assert_true(answer->features[0] == 0.3 && answer->features[2] == answer->action[1]);
  }
}

void what_does_not_fit_is_a_data_error(void **) {
  rim::Planner planner(two_by_two());
  const char *const lines[] = {"{\"state\":[1,2]}",
                               "{\"state\":[1],\"nominal\":[1,2]}",
                               "{\"state\":[1],\"allowed\":[true]}",
                               "{\"state\":[1],\"allowed\":[\"yes\"]}",
                               "{\"state\":\"here\"}",
                               "{\"actions\":[]}",
                               "{\"actions\":[[1]]}",
                               "{}",
                               "[1]",
                               "{",
                               "state",
                               "state,",
                               "reward,1,2",
                               "1,2"};
  for (const char *text : lines) {
    try {
      planner.choose(rim::read_plan_line(text).request);
      fail_msg("%s was taken", text);
    } catch (const rim::DataError &e) {
      assert_true(std::strlen(e.what()) > 0);
    }
  }
}

void a_wrong_configuration_is_a_usage_error(void **) {
  rim::PlannerConfig bad[4] = {two_by_two(), two_by_two(), two_by_two(), two_by_two()};
  bad[0].state[0] = {1.0, 1.0, 0};
  bad[1].action[0].count = 1;
  bad[2].bandit.beta = -1.0;
  bad[3].action = std::vector<rim::PlanAxis>(4, rim::PlanAxis{0.0, 1.0, 2}); // 5 features
  for (const rim::PlannerConfig &c : bad) {
    try {
      const rim::Planner planner(c);
      fail_msg("nothing was thrown");
    } catch (const rim::UsageError &) {
    }
  }
}

void nan_reward_is_refused(void **) {
  rim::Planner planner(two_by_two());
  try {
    planner.observe({0.3, 0.0, 10.0}, 0, 0.0, 0.0, std::nan(""));
    fail_msg("nothing was thrown");
  } catch (const rim::DataError &) {
  }
  assert_int_equal(rim_bandit_get_counters(planner.bandit()).refused, 1);
}

// What `rim plan` says to 12 states and rewards as RIM_OBSERVATION, from a recording; `change` may
// make each another.
std::vector<std::string> said_over_lcm(void (*change)(rim_observation_message *)) {
  const char *program = std::getenv("RIM");
  if (program == nullptr)
    skip();
  char folder[] = "/tmp/rim_plan_XXXXXX";
  assert_non_null(mkdtemp(folder));
  const std::string log = std::string(folder) + "/states.log";
  {
    rim::LcmBus bus("file://" + log + "?mode=w");
    for (std::uint32_t i = 0; i < 12; ++i) {
      rim_observation_message o{};
      o.sequence = i;
      o.t_us = i;
      o.count = 2;
      o.value[0] = 0.05 * i;
      o.value[1] = 1.0;
      change(&o);
      bus.publish(o);
    }
  }
  const std::string command = std::string(program) +
                              " plan --state 0:1 --action 0:1:5 --seconds 20 --lcm 'file://" + log +
                              "?speed=0' 2>&1";
  std::FILE *pipe = popen(command.c_str(), "r");
  assert_non_null(pipe);
  char text[512];
  std::vector<std::string> said;
  while (std::fgets(text, sizeof text, pipe) != nullptr)
    said.emplace_back(text);
  assert_int_equal(pclose(pipe), 0);
  (void)std::remove(log.c_str());
  (void)std::remove(folder);
  return said;
}

std::ptrdiff_t count_of(const std::vector<std::string> &lines, const char *words) {
  return std::count_if(lines.begin(), lines.end(), [&](const std::string &line) {
    return line.find(words) != std::string::npos;
  });
}

// One answer each, the misfit counted.
void states_come_over_lcm(void **) {
  const auto said = said_over_lcm([](rim_observation_message *o) {
    o->count = o->sequence == 5 ? 4 : 2;
    o->value[1] = o->sequence == 0 ? std::nan("") : 1.0;
  });
  assert_int_equal(count_of(said, "{\"id\":"), 11);
  assert_int_equal(count_of(said, "RIM_OBSERVATION 5: 4 numbers instead of 1 or 2"), 1);
}

// A robot that always sends a reward: the first, and the one behind a state of which nothing can be
// said, are for no answer. The states are answered.
void a_reward_too_many_keeps_no_state_from_its_answer(void **) {
  const auto said = said_over_lcm([](rim_observation_message *o) {
    o->value[0] = o->sequence == 5 ? std::nan("") : o->value[0];
  });
  assert_int_equal(count_of(said, "{\"id\":"), 12);
  assert_int_equal(count_of(said, "no answer waits for it"), 2);
  assert_int_equal(count_of(said, "plan: 11 answers, 10 rewards, "), 1);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(actions_are_the_grid),
      cmocka_unit_test(what_does_not_fit_is_a_data_error),
      cmocka_unit_test(a_wrong_configuration_is_a_usage_error),
      cmocka_unit_test(nan_reward_is_refused),
      cmocka_unit_test(states_come_over_lcm),
      cmocka_unit_test(a_reward_too_many_keeps_no_state_from_its_answer),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
