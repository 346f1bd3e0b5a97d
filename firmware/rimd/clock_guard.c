#include "rimd/clock_guard.h"

static clock_answer judge(const clock_guard *guard, const clock_guard_config *config, double t_s,
                          double here_s) {
  if (!guard->started)
    return CLOCK_BELIEVED;
  if (!(t_s > guard->last_s))
    return CLOCK_BACK;
  /* Silence explains a jump; twice, for a source whose clock runs ahead of ours. */
  const double passed_s = here_s > guard->last_here_s ? here_s - guard->last_here_s : 0.0;
  return t_s - guard->last_s > config->max_jump_s + 2.0 * passed_s ? CLOCK_FUTURE : CLOCK_BELIEVED;
}

static void believe(clock_guard *guard, double t_s, double here_s) {
  guard->last_s = t_s;
  guard->last_here_s = here_s;
  guard->refused = 0;
  guard->started = true;
}

clock_answer clock_guard_take(clock_guard *guard, const clock_guard_config *config, double t_s,
                              double here_s, double day_s) {
  if (config->max_skew_s > 0.0 && t_s > day_s + config->max_skew_s)
    return CLOCK_FUTURE;
  if (config->max_skew_s > 0.0 && t_s < day_s - config->max_skew_s)
    return CLOCK_BACK;
  const clock_answer answer = judge(guard, config, t_s, here_s);
  if (answer == CLOCK_BELIEVED) {
    believe(guard, t_s, here_s);
    return CLOCK_BELIEVED;
  }
  const bool follows =
      guard->refused > 0 && t_s > guard->other_s && t_s - guard->other_s <= config->max_jump_s;
  guard->refused = follows ? guard->refused + 1 : 1;
  guard->other_s = t_s;
  if (guard->refused < config->resync_rows)
    return answer;
  believe(guard, t_s, here_s);
  return answer == CLOCK_BACK ? CLOCK_RESET : CLOCK_BELIEVED;
}
