/* SPDX-License-Identifier: MIT */
#include "rim/monitor.h"

#include <stddef.h>

#include "base/real.h"

#define PASSED 1.01 /* of the time that passed here: the source's clock may run ahead of ours */

/* Whether t_s can come next after a row of from_s, which came at from_here_s. */
static bool is_near(const rim_clock_guard_config *config, double from_s, double from_here_s,
                    double t_s, double here_s) {
  const double passed_s = here_s > from_here_s ? here_s - from_here_s : 0.0;
  return t_s > from_s && t_s - from_s <= config->max_jump_s + PASSED * passed_s;
}

static rim_clock_answer judge(const rim_clock_guard *guard, const rim_clock_guard_config *config,
                              double t_s, double here_s) {
  if (!guard->started || is_near(config, guard->last_s, guard->last_here_s, t_s, here_s))
    return RIM_CLOCK_BELIEVED;
  return t_s > guard->last_s ? RIM_CLOCK_FUTURE : RIM_CLOCK_BACK;
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
  if (t_s == guard->last_s) /* the row that was believed, sent again: no witness of another clock */
    return RIM_CLOCK_BACK;
  const bool follows = is_near(config, guard->other_s, guard->other_here_s, t_s, here_s);
  guard->refused = follows ? guard->refused + 1 : 1;
  guard->other_s = t_s;
  guard->other_here_s = here_s;
  if (guard->refused < config->resync_rows)
    return answer;
  believe(guard, t_s, here_s);
  return answer == RIM_CLOCK_BACK ? RIM_CLOCK_RESTARTED : RIM_CLOCK_BELIEVED;
}
