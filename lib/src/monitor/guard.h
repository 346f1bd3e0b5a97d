/* SPDX-License-Identifier: MIT */
/* guard.h - private: does memory still hold what was written to it?
 *
 * An upset turns a bit over in RAM and says nothing. Between two calls nobody writes the monitor's
 * memory, so each call first compares sums (rimi_word_sum) with those that the call before it left:
 *
 *   control   the header, the rows' counters and configuration, the head of the search: everything
 *             that a pointer, size, index or alarm lies in. Whole, at the begin of every call that
 *             follows a pointer, so that no damaged one is followed
 *   effects   sums of the run's effects in each channel, and integrals of outcomes. Whole, before
 *             each block
 *   ring      every block held, each with a sum of its own, of which the total is kept: a slice a
 *             row. So are the bins of rows with predictions, by what they have in common
 *   image     a slice a row, so that it is gone through in GUARD_IMAGE_S of flight. Damage is found
 *             where a part ends: after a pass and a part, 4.7 s, at the latest
 *
 * and all of it before an alarm is raised: what an alarm says was computed in memory that holds.
 * What fails is damage: the monitor uses no row from then on and says RIM_LEVEL_INTEGRITY.
 *
 * Not covered: what is computed again from the above within a few rows. Flips that come while a
 * call runs are found as those that come after it, or were never used. */
#ifndef RIM_SRC_MONITOR_GUARD_H
#define RIM_SRC_MONITOR_GUARD_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/monitor.h"

#define GUARD_IMAGE_S 4.2  /* of flight, in which the image is gone through */
#define GUARD_PARTS 8u     /* of the image, each with a sum of its own */
#define GUARD_LEAST 16u    /* words of the image a row, at least */
#define GUARD_MOST 2048u   /* at most */
#define GUARD_NO_RATE 32u  /* where rows have no rate */
#define GUARD_SLOTS 3u     /* blocks of the ring a row, */
#define GUARD_FEW_SLOTS 1u /* and where each row is a block */

/* A second copy of what outlives a repair, with a sum of its own. */
typedef struct monitor_kept {
  rim_alarm_policy policy;
  uint32_t seq, raised;
  uint32_t sum; /* of all that is above: last */
} monitor_kept;

/* Part of the monitor, outside of what it sums. */
typedef struct monitor_guard {
  monitor_kept kept;
  uint32_t fixed;                  /* of the header's begin, which rimi_guard_fix() took */
  uint32_t header, parts, history; /* left by the last call */
  uint32_t image[GUARD_PARTS];     /* sums of its parts, as it was accepted */
  uint32_t image_now, image_at;    /* of this part's words before image_at; words */
  uint32_t ring, ring_now, ring_at;
  uint32_t effects;
  uint32_t slot;      /* of the ring that a block is being written to */
  uint32_t next_bins; /* region feature whose bins are looked at next */
  uint8_t busy;       /* within a call: the sums are those of its begin */
  uint8_t damaged;    /* RIM_DAMAGE_...; 0: nothing was found */
} monitor_guard;

/* A call begins: whether control holds. False also when damage was found before. O(header). */
bool rimi_guard_enter(rim_monitor *m);
/* The same for a call that follows no pointer and writes the header alone: the other sums stay
 * those of the call before. It ends by rimi_guard_leave_header(). */
bool rimi_guard_enter_header(rim_monitor *m);
void rimi_guard_leave_header(rim_monitor *m);
/* Whether the header holds, for queries, which may also be made within a call. */
bool rimi_guard_header_holds(const rim_monitor *m);
/* The same of bytes that were kept. They do not hold where they were copied within a call, or where
 * a call never ended (RAM over a watchdog's reset): its sums are of before, so nobody can check. */
bool rimi_guard_copy_holds(const rim_monitor *m);
/* RIM_DAMAGE_...: what was found, and whether the header holds now. */
uint8_t rimi_guard_damage(const rim_monitor *m);
/* Takes the header up to the alarms' life as it is. It says what is where; no row changes it. */
void rimi_guard_fix(rim_monitor *m);
/* A call of rimi_guard_enter() ends. */
void rimi_guard_leave(rim_monitor *m);

/* A row begins: a slice of ring and image. False: damage. */
bool rimi_guard_scrub(rim_monitor *m);

/* Before and after the search takes a block. False: the effects are damaged; take none. */
bool rimi_guard_before_block(rim_monitor *m);
void rimi_guard_after_block(rim_monitor *m);

/* Everything at once, before an alarm is raised. O(memory + image). */
bool rimi_guard_all(rim_monitor *m);

/* Takes what is there as it is: after init, and after what changes the ring as a whole. O(memory);
 * the image's sum is left. */
void rimi_guard_renew(rim_monitor *m);
/* The image that was just accepted. O(image). */
void rimi_guard_accept_image(rim_monitor *m);

/* After the bytes were copied, with the header's pointers set to where they are now: whether the
 * other parts of control hold. */
bool rimi_guard_parts_hold(const rim_monitor *m);
/* With the parts' pointers too: whether the rows' history holds. */
bool rimi_guard_history_holds(const rim_monitor *m);

/* What a repair goes on with. */
monitor_kept rimi_guard_kept(const rim_monitor *m);

#endif
