/* SPDX-License-Identifier: MIT */
#include "monitor/clock_guard.h"

#include <stddef.h>

#include "base/real.h"

static rim_clock_answer judge(const rim_clock_guard *guard, const rim_clock_guard_config *config,
                              double t_s, double here_s) {
  if (!guard->started)
    return RIM_CLOCK_BELIEVED;
  if (!(t_s > guard->last_s))
    return RIM_CLOCK_BACK;
  /* Silence explains a jump; twice, for a source whose clock runs ahead of ours. */
  const double passed_s = here_s > guard->last_here_s ? here_s - guard->last_here_s : 0.0;
  return t_s - guard->last_s > config->max_jump_s + 2.0 * passed_s ? RIM_CLOCK_FUTURE
                                                                   : RIM_CLOCK_BELIEVED;
}

static void believe(rim_clock_guard *guard, double t_s, double here_s) {
  guard->last_s = t_s;
  guard->last_here_s = here_s;
  guard->refused = 0;
  guard->started = true;
}

rim_clock_answer rim_clock_guard_take(rim_clock_guard *guard, const rim_clock_guard_config *config,
                                      double t_s, double here_s, double day_s) {
  if (guard == NULL || config == NULL || !rimi_is_finite(t_s))
    return RIM_CLOCK_FUTURE;
  if (config->max_skew_s > 0.0 && t_s > day_s + config->max_skew_s)
    return RIM_CLOCK_FUTURE;
  if (config->max_skew_s > 0.0 && t_s < day_s - config->max_skew_s)
    return RIM_CLOCK_BACK;
  const rim_clock_answer answer = judge(guard, config, t_s, here_s);
  if (answer == RIM_CLOCK_BELIEVED) {
    believe(guard, t_s, here_s);
    return RIM_CLOCK_BELIEVED;
  }
  const bool follows =
      guard->refused > 0 && t_s > guard->other_s && t_s - guard->other_s <= config->max_jump_s;
  guard->refused = follows ? guard->refused + 1 : 1;
  guard->other_s = t_s;
  if (guard->refused < config->resync_rows)
    return answer;
  believe(guard, t_s, here_s);
  return answer == RIM_CLOCK_BACK ? RIM_CLOCK_RESTARTED : RIM_CLOCK_BELIEVED;
}
