/* SPDX-License-Identifier: MIT */
/* Any guard, configuration and time, NaN and infinity too: an answer of the four, and a row that is
 * believed is after the one before. */
#include "any.h"
#include "rim/monitor.h"

double nondet_double(void);

int main(void) {
  rim_clock_guard guard;
  rim_clock_guard_config config;
  const rim_clock_guard before = guard;
  const double t_s = nondet_double();
  const rim_clock_answer answer =
      rim_clock_guard_take(&guard, &config, t_s, nondet_double(), nondet_double());
  __ESBMC_assert(answer >= RIM_CLOCK_BELIEVED && answer <= RIM_CLOCK_RESTARTED, "an answer");
  if (answer == RIM_CLOCK_BELIEVED && before.started)
    __ESBMC_assert(t_s > before.last_s, "time increases");
  if (answer == RIM_CLOCK_BACK || answer == RIM_CLOCK_FUTURE)
    __ESBMC_assert(!(guard.last_s < before.last_s) || !before.started, "a refused row sets no time");
  return 0;
}
