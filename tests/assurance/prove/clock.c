/* SPDX-License-Identifier: MIT */
/* Any guard, configuration and time, NaN and infinity too: an answer of the four, and a row that is
 * believed is after the one before. */
#include "any.h"
#include "rim/monitor.h"

#include <float.h>

double nondet_double(void);

/* A double that leaves room for a difference: 1e300 s are no time. */
static bool is_time(double x) { return x >= -1e300 && x <= 1e300; }

int main(void) {
  rim_clock_guard guard;
  rim_clock_guard_config config;
  __ESBMC_assume(is_time(guard.last_s) && is_time(guard.last_here_s) && is_time(guard.other_s) &&
                 is_time(guard.other_here_s) && is_time(config.max_jump_s) &&
                 is_time(config.max_skew_s));
  const rim_clock_guard before = guard;
  const double t_s = nondet_double(), here_s = nondet_double(), day_s = nondet_double();
  __ESBMC_assume(is_time(t_s) || t_s != t_s || t_s > DBL_MAX || t_s < -DBL_MAX);
  __ESBMC_assume(is_time(here_s) && is_time(day_s));
  const rim_clock_answer answer = rim_clock_guard_take(&guard, &config, t_s, here_s, day_s);
  __ESBMC_assert(answer >= RIM_CLOCK_BELIEVED && answer <= RIM_CLOCK_RESTARTED, "an answer");
  if (answer == RIM_CLOCK_BELIEVED && before.started)
    __ESBMC_assert(t_s > before.last_s, "time increases");
  if (answer == RIM_CLOCK_BACK || answer == RIM_CLOCK_FUTURE)
    __ESBMC_assert(!(guard.last_s < before.last_s) || !before.started, "no row, no time");
  return 0;
}
