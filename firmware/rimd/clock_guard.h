/* clock_guard.h - is an observation's time to be believed?
 *
 * The monitor refuses times that do not increase, so one observation from far ahead would make it
 * refuse all that follow. The guard keeps such a time from it, and moves to another clock only when
 * many observations in a row agree on it (a source that was restarted). */
#ifndef CLOCK_GUARD_H
#define CLOCK_GUARD_H

#include <stdbool.h>
#include <stdint.h>

typedef struct clock_guard_config {
  double max_jump_s;    /* ahead of the last one, beyond twice the time that has passed */
  double max_skew_s;    /* from this computer's clock; 0: not compared */
  uint32_t resync_rows; /* refused in a row that rise by at most max_jump_s each: believed */
} clock_guard_config;

/* All zero: nothing seen. */
typedef struct clock_guard {
  double last_s, last_here_s; /* of the newest believed one: its time, and when it came */
  double other_s;             /* of the newest refused one */
  uint32_t refused;           /* in a row */
  bool started;
} clock_guard;

typedef enum clock_answer {
  CLOCK_BELIEVED,
  CLOCK_BACK,   /* does not increase */
  CLOCK_FUTURE, /* too far ahead */
  CLOCK_RESET   /* believed, and earlier than what was: the monitor must begin anew */
} clock_answer;

/* t_s: of the observation, finite. here_s: steady clock; day_s: this computer's clock of the day.
 */
clock_answer clock_guard_take(clock_guard *guard, const clock_guard_config *config, double t_s,
                              double here_s, double day_s);

#endif
