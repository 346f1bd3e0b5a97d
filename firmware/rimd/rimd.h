/* SPDX-License-Identifier: MIT */
/* rimd.h - rimd: a monitor between its buses. One thread; memory is fixed once it has started. */
#ifndef RIMD_H
#define RIMD_H

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/can.h"
#include "rim/can_table.h"
#include "rim/image.h"
#include "rim/monitor.h"
#include "rimd/config.h"
#include "rimd/outbox.h"
#include "rimd/seal.h"
#include "rimd/state.h"
#include "rimd/watchdog.h"

#define RIMD_HELD 8u

/* What a restart goes on with, beside the monitor itself. Plain data. */
typedef struct rimd_kept {
  rim_clock_guard guard;
  rim_counters counters;
  uint32_t stale_taken, gaps_taken; /* of the monitor's own counts: taken over so far */
  uint32_t health_sequence;
  uint32_t dropped;     /* records that did not go out whole before this start */
  uint32_t source_next; /* expected sequence number of the source */
  bool has_source;
  uint32_t entry_sequence;
  double row_s;        /* time of the newest row used */
  double can_origin_s; /* clock of the day when the first CAN row came: time 0 */
  bool has_origin;
  seal_window commands_used, observations_used; /* counters of sealed messages */
  seal_counts sealed;
} rimd_kept;

typedef struct rimd {
  config config;
  const uint8_t *image;
  size_t image_bytes;
  uint32_t image_sums[3]; /* of the image at the start: rimd_image_sums */
  rim_image view;
  rim_monitor *monitor;
  uint8_t *memory; /* the monitor's */
  size_t memory_bytes;
  uint32_t features, outcomes;
  uint32_t values; /* of an observation */
  bool external;
  rim_can_table table;
  rim_can_gather gather;
  rimd_kept kept;
  rim_alarm_policy policy;
  rim_clock_guard_config guard_config;
  lcm_udp lcm;
  socketcan can, can_input;
  outbox outbox;
  seal seal;
  rim_lookahead ahead; /* the newest plan, and what was said of it */
  state_file state;
  bool state_wanted;         /* something to be kept has changed */
  rim_alarm held[RIMD_HELD]; /* records that are sent when the state that holds them is written */
  uint32_t held_count;
  uint32_t held_copied; /* the first of them that are in the copy under way */
  uint64_t held_ns;     /* since when the first waits */
  uint64_t valid_ns;    /* when the newest valid row came, or the start */
  uint64_t next_health_ns, next_model_ns, next_state_ns;
  watchdog watchdog;
  uint32_t state_failures; /* told so far */
  bool is_damaged;         /* memory does not hold: no row is used, and no state is saved */
  bool was_damaged;        /* since the start: told in every health message */
  bool ending;             /* the service manager is to start another one */
} rimd;

/* Reads image and state, opens the buses. d is all zero but for its configuration. Returns 0, or an
 * exit status after printing the reason. All memory is taken here. */
int rimd_start(rimd *d);

/* Reads and checks the files alone. Returns as rimd_start. */
int rimd_check(rimd *d);

/* Until d->ending, or until *stopped becomes other than 0 (by a signal, which is let in only while
 * waiting). */
void rimd_run(rimd *d, const volatile sig_atomic_t *stopped);

/* Writes the state, closes everything. Returns an exit status. */
int rimd_finish(rimd *d);

/* Says every counter that is not 0, as "name value": what was refused, lost or repaired. */
void rimd_tell_counts(const rimd_kept *kept);

/* What tells one image from another: the check sums of its head and body, and the model's id. head:
 * its first RIM_IMAGE_HEADER_BYTES. */
void rimd_image_sums(const uint8_t *head, uint32_t sums[3]);

/* The monitor says that its memory is damaged: does what the configuration asks. */
void rimd_damaged(rimd *d);

/* Takes over what the transports and the monitor have counted since the last time. */
void rimd_collect_counts(rimd *d);

/* The monitor was restarted or built anew: whatever it has counted by now was taken over. */
void rimd_counts_began(rimd *d);

/* Sends the records that wait for the state to be written, all of them. */
void rimd_release_records(rimd *d);

/* Sends every record of the monitor that waits. */
void rimd_send_records(rimd *d);

/* What the state file holds. */
state_parts rimd_parts(rimd *d);

/* For rimd_run and tests: one observation, and what time brings. */
void rimd_row(rimd *d, double t_s, const double *values, uint32_t count, uint64_t woke_ns);
int rimd_tick(rimd *d, uint64_t now_ns);
uint64_t rimd_now_ns(void);

#endif
