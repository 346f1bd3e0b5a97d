/* SPDX-License-Identifier: MIT */
/* rim/clock_guard.h - is an observation's time to be believed?
 *
 * The monitor refuses times that do not increase, so one observation from far ahead would make it
 * refuse all that follow. The guard keeps such a time from it, and moves to another clock only when
 * many observations in a row agree on it (a source that was restarted). It reads no clock itself:
 * the caller says what its own clocks show. Plain data without pointers: a copy goes on. */
#ifndef RIM_CLOCK_GUARD_H
#define RIM_CLOCK_GUARD_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rim_clock_guard_config {
  double max_jump_s;    /* believed ahead of the newest time, beyond twice the time that passed */
  double max_skew_s;    /* believed away from this computer's clock; 0: not compared */
  uint32_t resync_rows; /* so many refused in a row, each at most max_jump_s after the one before:
                           their clock is believed; 0: as 1 */
} rim_clock_guard_config;

/* Private to rim_clock_guard_take. All zero: nothing seen. */
typedef struct rim_clock_guard {
  double last_s, last_here_s; /* of the newest believed one: its time, and when it came */
  double other_s;             /* of the newest refused one */
  uint32_t refused;           /* in a row */
  bool started;
} rim_clock_guard;

typedef enum rim_clock_answer {
  RIM_CLOCK_BELIEVED = 0, /* offer the row to the monitor */
  RIM_CLOCK_BACK = 1,     /* it does not increase: leave the row out */
  RIM_CLOCK_FUTURE = 2,   /* it is too far ahead: leave the row out */
  RIM_CLOCK_RESTARTED = 3 /* believed, and earlier than what was: rim_monitor_restart(), then offer
                             the row */
} rim_clock_answer;

/* t_s: time of the observation, finite. here_s: this computer's steady clock when it came; on the
 * ground, where a log is all there is, t_s itself. day_s: this computer's clock of the day, looked
 * at only where max_skew_s is not 0. NULL guard or config, or t_s not finite: RIM_CLOCK_FUTURE,
 * nothing changes. O(1). */
rim_clock_answer rim_clock_guard_take(rim_clock_guard *guard, const rim_clock_guard_config *config,
                                      double t_s, double here_s, double day_s);

#ifdef __cplusplus
}
#endif
#endif
