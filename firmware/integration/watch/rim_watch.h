/* SPDX-License-Identifier: MIT */
/* rim_watch.h - what every framework does with the monitor: opens an image, offers rows as
 * `rim replay` does, and hands every record on, so that the same rows give the same
 * records and the same digest on board and on the ground. Nothing of a framework is in here: the C
 * library's memcpy is enough.
 *
 * Calls on one watch must not overlap: one task owns it. Nothing blocks or allocates. */
#ifndef RIM_WATCH_H
#define RIM_WATCH_H

#include "rim/image.h"
#include "rim/monitor.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Called with every record, in order, from inside of the calls below. */
typedef void rim_watch_send(void *user, const rim_alarm *record);

/* All zero: closed; every call but rim_watch_open is refused then. */
typedef struct rim_watch {
  rim_monitor *monitor;
  rim_image image;
  rim_watch_send *send;
  void *user;
  uint64_t digest;  /* of all verdicts, as `rim replay` prints it */
  uint32_t rows;    /* offered to the monitor */
  uint32_t refused; /* of another length */
  uint32_t records; /* handed on */
  uint32_t values;  /* of a row: see rim_watch_row */
  double newest_s;  /* time of the newest valid row */
  double here_s;    /* the board's time at the newest tick */
  double silent_s;  /* on the board's clock, from the newest valid row to that tick */
  uint8_t level;    /* rim_level of the vehicle by the newest verdict; STALE before the first */
  uint8_t reason;   /* rim_reason: why the level says nothing about the vehicle */
  bool has_valid;   /* a valid row has come */
  bool is_fresh;    /* since the newest tick, or the watch was opened */
  bool is_guessed;  /* no valid row yet: what the monitor has for their time is the silence */
} rim_watch;

/* Opens the image in the caller's memory, both aligned to 8, as rim_monitor_init, with its errors;
 * both must outlive the watch. `send` may be NULL. On an error the watch is all zero. O(bytes). */
rim_status rim_watch_open(rim_watch *watch, void *memory, size_t bytes, const void *image,
                          size_t image_bytes, rim_watch_send *send, void *user);

/* Offers one row: `count` values, the features in the image's order and, where its rows bring their
 * own predictions, then outcomes, means and standard deviations. verdict may be NULL.
 * RIM_E_ARGUMENT: NULL or closed; RIM_E_SIZE: not watch->values of them, which is counted. The cost
 * is that of rim_monitor_step. */
rim_status rim_watch_row(rim_watch *watch, double t_s, const double *value, size_t count,
                         rim_verdict *verdict);

/* Tells that it is here_s on the board's own clock, in seconds from any start. Call it after each
 * row and from time to time while none comes. It counts the silence since the newest *valid* row,
 * or since the watch was opened: rows that are all refused, for their length, their values or their
 * time, are no news of the vehicle, and the monitor then becomes STALE where its image says so.
 * Where the clock goes back, as one that wraps does, what passed in that tick is not counted.
 * O(1). */
void rim_watch_tick(rim_watch *watch, double here_s);

/* For who counts the silence himself, in place of rim_watch_tick: no valid row has come for
 * silent_s seconds. rim_watch_row says with verdict->valid whether a row was one. O(1). */
void rim_watch_idle(rim_watch *watch, double silent_s);

/* The clock of the rows' source began again, and it is now_s on it: without this every row is
 * refused until its time is beyond that of the newest before. All observations are forgotten, and
 * alarms end or are latched (rim_monitor_restart). O(memory). */
void rim_watch_restart(rim_watch *watch, double now_s);

/* Obeys an operator, as rim_monitor_command with 32 bits. */
rim_status rim_watch_command(rim_watch *watch, const rim_command *command);

/* Writes one line without an end of line, "s.speed_mps +0.6012 m/s (sd 0.0040) since 20.45 s", cut
 * to bytes - 1 and terminated: for event texts where there is no printf. Returns its length.
 * O(names). */
size_t rim_watch_words(const rim_watch *watch, const rim_alarm *record, char *out, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
