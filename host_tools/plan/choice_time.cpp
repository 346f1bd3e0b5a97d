// SPDX-License-Identifier: MIT
#include "plan/choice_time.hpp"

#include "base/rng.h"
#include "util/error.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

namespace rim {

namespace {

double now_ms() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

} // namespace

ChoiceTime time_choice(rim_bandit_policy policy, rim_gp_kernel kernel, std::uint32_t actions,
                       std::uint16_t observations, std::size_t repeats) {
  rim_bandit_config c{};
  c.policy = static_cast<std::uint8_t>(policy);
  c.beta = 4.0;
  c.plans = policy == RIM_BANDIT_BANK ? 1 : 0;
  c.gp.kernel = static_cast<std::uint8_t>(kernel);
  c.gp.dims = c.extent.dims = 2;
  c.gp.points = c.extent.points = observations;
  c.gp.noise_var = 0.01;
  c.gp.length[0] = c.gp.length[1] = 0.2;
  ChoiceTime out;
  rim_bandit *bandit = nullptr;
  std::vector<std::uint64_t> memory;
  if (rim_bandit_size(&c, &out.bytes) == RIM_OK)
    memory.resize(out.bytes / 8 + 1);
  if (rim_bandit_init(&bandit, memory.data(), memory.size() * 8, &c) != RIM_OK)
    throw UsageError("bandit: settings out of range");
  rim_rng rng;
  rimi_rng_seed(&rng, 1, 0);
  const double start = now_ms();
  for (std::uint32_t i = 0; i < observations; ++i) {
    const double x[2] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    const double better = x[0] > 0.6 && x[1] > 0.5 ? 1.0 : 0.0;
    (void)rim_bandit_observe(bandit, x, 0, 0.0, 0.01, better + 0.1 * rimi_rng_normal(&rng));
  }
  out.observe_ms = (now_ms() - start) / observations;
  std::vector<double> x(2 * static_cast<std::size_t>(actions)), times;
  for (double &v : x)
    v = rimi_rng_uniform(&rng);
  const rim_bandit_actions proposed = {actions, x.data(), nullptr, nullptr, nullptr};
  for (std::size_t i = 0; i < repeats; ++i) {
    rim_bandit_choice choice;
    const double before = now_ms();
    (void)rim_bandit_choose(bandit, &proposed, &choice);
    times.push_back(now_ms() - before);
  }
  std::sort(times.begin(), times.end());
  out.least_ms = times.front();
  out.choose_ms = times[times.size() / 2];
  return out;
}

} // namespace rim
