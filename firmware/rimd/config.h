/* SPDX-License-Identifier: MIT */
/* config.h - rimd's configuration file: lines `key = value`, '#' begins a comment.
 *
 * It is validated whole before anything is opened. Every error is printed as "FILE:LINE: reason",
 * then their number. No key may stand twice; an unknown key is an error. */
#ifndef CONFIG_H
#define CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/can.h"
#include "rim/plan/lookahead.h"
#include "transport/lcm_udp.h"

#define CONFIG_TEXT_BYTES 256u
#define CONFIG_FILE_BYTES 16384u

/* One key a field, same name. Empty text and zero: as the comment says. */
typedef struct config {
  char image[CONFIG_TEXT_BYTES];         /* flight image; required */
  char state[CONFIG_TEXT_BYTES];         /* file that survives a restart; empty: none */
  char lcm[CONFIG_TEXT_BYTES];           /* URL; empty: no LCM */
  char lcm_interface[CONFIG_TEXT_BYTES]; /* its address; empty: 127.0.0.1, this computer alone;
                                            0.0.0.0: where the multicast route leads */
  char can[CONFIG_TEXT_BYTES];           /* interface for alarms and commands; empty: no CAN */
  char can_input[CONFIG_TEXT_BYTES];     /* interface for observations; empty: that of alarms */
  char can_table[CONFIG_TEXT_BYTES];     /* signals of observations; empty: the image's own */
  char input[CONFIG_TEXT_BYTES];         /* "lcm" or "can"; empty: lcm */
  char axis_x[CONFIG_TEXT_BYTES];        /* feature that is x of RIM_PLAN's poses; empty: none */
  char axis_y[CONFIG_TEXT_BYTES];
  char axis_z[CONFIG_TEXT_BYTES];
  char on_damage[CONFIG_TEXT_BYTES]; /* "rebuild", "restart" or "silent"; empty: rebuild */
  char key[CONFIG_TEXT_BYTES];       /* file of a shared key: commands must be sealed; empty: not */
  char footprint[CONFIG_TEXT_BYTES]; /* corners "x y z, x y z, ..." in m; empty: a point */
  bool can_fd;                       /* detail in one FD frame instead of segments */
  bool latch;                        /* an alarm that is over stands until acknowledged */
  bool command_any;                  /* a command's 0 stands for any alarm, any model */
  bool key_observations;             /* observations over LCM must be sealed too */
  bool replay;                       /* everything sent carries the replay flag */
  bool mlock;                        /* all memory stays in RAM */
  uint32_t node;                     /* CAN node, 0..127 */
  uint32_t fifo_priority;            /* SCHED_FIFO, 1..99; 0: ordinary scheduling */
  uint32_t stale_ms;    /* no valid observation for so long: STALE; 0: the image's, if any */
  uint32_t health_ms;   /* between health messages, and cyclic summaries; 0: 1000 */
  uint32_t deadline_us; /* from waking up for an observation to its answer sent; 0: not judged */
  uint32_t state_s;     /* between writes of the state file without an event; 0: 10 */
  uint32_t max_jump_s;  /* farther ahead than this and the time passed: refused until borne out;
                           0: 5 periods of the image's rows, or 1 s where it has none */
  uint32_t max_skew_s;  /* farther from this computer's clock: refused; 0: not compared */
  uint32_t
      resync_rows; /* refused rows in a row that agree among themselves move the clock; 0: 100 */
  uint32_t signal_age_ms; /* older CAN signals make an observation incomplete; 0: 1000 */
  uint32_t margin_mm;     /* around the footprint */
  /* Made from the above. */
  rim_lookahead_config ahead; /* its axes are looked up in the image */
  bool look_ahead;
  lcm_udp_address address;
  bool input_can;
  bool on_damage_restart, on_damage_silent;
} config;

/* Reads a file. state: of less than CONFIG_TEXT_BYTES characters, in place of the file's, which is
 * then checked with it; NULL: the file's. Returns the number of errors, each told by say(); 0: *c
 * is whole. */
unsigned config_read(config *c, const char *path, const char *state);

/* The same from text (not NUL-terminated) with its own state; name stands for the file. */
unsigned config_parse(config *c, const char *name, const char *text, size_t bytes);

#endif
