// Training and its report: what is promised, that it is kept, what is refused.
#include "replay/replay.hpp"
#include "train/train_report.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"

#include "toy_log.hpp"

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

std::vector<rim::Log> healthy_logs(std::uint64_t first, std::size_t count) {
  std::vector<rim::Log> logs;
  for (std::size_t i = 0; i < count; ++i)
    logs.push_back(toy_log(first + i));
  return logs;
}

// Nineteen runs, the least for 5 %; trained once.
const rim::Training &trained() {
  static const rim::Training training = rim::train(healthy_logs(1, 19), rim::TrainOptions{});
  return training;
}

bool has(const std::string &text, const std::string &part) {
  if (text.find(part) != std::string::npos)
    return true;
  print_message("'%s' not in:\n%s\n", part.c_str(), text.c_str());
  return false;
}

void promise_is_what_ranks_allow(void **) {
  const struct {
    std::size_t runs;
    double wished;
    std::uint32_t rank;
    double rate;
  } table[] = {{8, 0.05, 8, 1.0 / 9},    {18, 0.05, 18, 1.0 / 19},  {19, 0.05, 19, 1.0 / 20},
               {50, 0.05, 49, 2.0 / 51}, {99, 0.05, 95, 5.0 / 100}, {3, 0.9, 1, 3.0 / 4}};
  for (const auto &line : table) {
    const rim::Promise promise = rim::promise_for(line.runs, line.wished);
    assert_int_equal(promise.rank, line.rank);
    assert_true(std::fabs(promise.rate - line.rate) < 1e-12);
    // Never more than what n + 1 exchangeable runs allow.
    assert_true(promise.rate >= 1.0 / static_cast<double>(line.runs + 1) - 1e-12);
  }
}

void equal_logs_equal_images(void **) {
  const rim::Training again = rim::train(healthy_logs(1, 19), rim::TrainOptions{});
  assert_true(rim::make_image(again.plan) == rim::make_image(trained().plan));
  const rim::Training other = rim::train(healthy_logs(2, 19), rim::TrainOptions{});
  assert_false(rim::make_image(other.plan) == rim::make_image(trained().plan));
}

// 60 fresh runs at a promised 5 %: more than 9 alarms have a chance below 1 in 1000.
void promise_is_kept_and_faults_are_found(void **) {
  rim::Replayer replayer(rim::make_image(trained().plan), "toy");
  unsigned false_alarms = 0, found = 0;
  for (std::uint64_t seed = 1000; seed < 1060; ++seed)
    false_alarms += replayer.replay(toy_log(seed), {}).raised > 0 ? 1 : 0;
  for (std::uint64_t seed = 2000; seed < 2020; ++seed)
    found += replayer.replay(toy_log(seed, 600, 0.5), {}).raised > 0 ? 1 : 0;
  print_message("seeds 1000.. and 2000..: %u of 60 false, %u of 20 found\n", false_alarms, found);
  assert_true(false_alarms <= 9);
  assert_true(found >= 18);
}

void report_says_what_was_done(void **) {
  const std::vector<rim::Log> logs = healthy_logs(1, 19);
  const rim::KernelReport kernels = rim::one_step_kernels(logs, trained());
  assert_int_equal(kernels.kernel.size(), 3);
  const std::string errors = rim::error_report(trained(), kernels);
  assert_true(has(errors, "position a"));
  assert_true(has(errors, "kernel average"));
  // The cart's position one row ahead cannot be known better than its sensor's noise, 0.03 m.
  assert_true(trained().models.step.rmse[0] > 0.029 && trained().models.step.rmse[0] < 0.05);
  assert_true(kernels.white[0] > 0.025 && kernels.white[0] < 0.035);
  const std::string promise = rim::promise_report(trained(), 0.05);
  assert_true(has(promise, "at most 5.0 %"));
  assert_true(promise.find("no rate below") == std::string::npos);
  assert_true(has(rim::promise_report(trained(), 0.01), "with 19 runs no rate below 5.0 %"));
  assert_true(has(rim::promise_report(trained(), 0.01), "99 runs are the least for 1 %"));
  const auto image = rim::make_image(trained().plan);
  assert_true(has(rim::image_report(image), std::to_string(image.size())));
  assert_true(has(rim::choice_report(trained()), "a block is 20 rows"));
}

// An alarm of such an image ends by itself.
void images_ask_for_clearing(void **) {
  const rim::Monitor monitor(rim::make_image(trained().plan), "toy");
  assert_int_equal(rim_monitor_config(monitor.get(), RIM_CONFIG_CLEAR), 30);
}

template <typename Call> std::string refusal(const Call &call) {
  try {
    call();
  } catch (const rim::DataError &error) {
    return error.what();
  }
  return "";
}

void refuses(void **) {
  const rim::TrainOptions options;
  assert_true(has(refusal([&] { rim::train(healthy_logs(1, 2), options); }), "at least 3 logs"));
  assert_true(has(refusal([&] {
                    rim::train(
                        {toy_external(1, 50, 0), toy_external(2, 50, 0), toy_external(3, 50, 0)},
                        options);
                  }),
                  "own predictions"));
  std::vector<rim::Log> logs = healthy_logs(1, 4);
  logs[2].columns[3].name = "s.velocity_mps";
  assert_true(has(refusal([&] { rim::train(logs, options); }), "toy3: column 's.velocity_mps'"));
  logs = healthy_logs(1, 3);
  logs.push_back(toy_log(9, 25));
  assert_true(has(refusal([&] { rim::train(logs, options); }), "toy9: fewer than two blocks"));
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(promise_is_what_ranks_allow),
      cmocka_unit_test(equal_logs_equal_images),
      cmocka_unit_test(promise_is_kept_and_faults_are_found),
      cmocka_unit_test(report_says_what_was_done),
      cmocka_unit_test(images_ask_for_clearing),
      cmocka_unit_test(refuses),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
