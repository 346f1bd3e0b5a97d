/* SPDX-License-Identifier: MIT */
/* rim/interference.h - motion interference: is somebody or something holding, blocking or pushing
 * the vehicle (thesis App. C, p. 127-134)?
 *
 * Where the flight image has the sections for it, the monitor runs three detectors on the forward
 * velocity of every valid row, and verdict.interference points to what they say; the largest score
 * decides. Their alarm leaves with the records of the regions (rim/alarm.h).
 *   HMM        a hidden Markov model of five motions; score: log odds of interference;
 *   one-step   a cumulative sum of the velocity less the one predicted from the row before;
 *   open-loop  the same against a prediction from the commands alone. */
#ifndef RIM_INTERFERENCE_H
#define RIM_INTERFERENCE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The states of the HMM. */
typedef enum rim_motion {
  RIM_MOTION_STOP = 0,
  RIM_MOTION_ACCEL = 1,
  RIM_MOTION_CONSTANT = 2,
  RIM_MOTION_DECEL = 3,
  RIM_MOTION_MI = 4 /* motion interference */
} rim_motion;

typedef enum rim_interference_kind {
  RIM_INTERFERENCE_NONE = 0,
  RIM_INTERFERENCE_BLOCKED = 1, /* slower than commanded: held, blocked, a wheel stuck */
  RIM_INTERFERENCE_PUSHED = 2   /* faster than commanded, or moved without a command */
} rim_interference_kind;

/* Index of rim_interference_verdict.score. */
enum { RIM_INTERFERENCE_HMM = 0, RIM_INTERFERENCE_ONE_STEP = 1, RIM_INTERFERENCE_OPEN_LOOP = 2 };

typedef struct rim_interference_verdict {
  double t_s;
  double score[3];      /* HMM, one-step, open-loop: an alarm from 1 on */
  double ln_odds;       /* of MI by the HMM; -1e12 before it has seen enough rows */
  double residual_mps;  /* measured less the nearest open-loop velocity */
  double one_step_mps;  /* measured less the velocity predicted one step ahead */
  double since_onset_s; /* while alarmed */
  double onset_s;
  uint8_t motion; /* rim_motion, the most likely state of the HMM */
  uint8_t kind;   /* rim_interference_kind, while alarmed */
  bool alarmed;
  bool raised; /* in this step */
  bool valid;  /* this row was used; otherwise it was counted */
} rim_interference_verdict;

/* Counted since init, saturating. */
typedef struct rim_interference_health {
  uint32_t rows;
  uint32_t not_finite;       /* velocity or time: row skipped */
  uint32_t time_back;        /* time does not increase: row skipped */
  uint32_t no_command;       /* command missing: the last one was taken, or the row skipped */
  uint32_t gaps;             /* rows too far apart: the detectors started again from nothing */
  uint32_t command_overflow; /* more changes of command were under way than can be held */
  uint32_t alarms;
} rim_interference_health;

struct rim_monitor; /* rim/monitor.h */

/* Returns the detectors' counters; all 0 for NULL and for an image without the sections. */
rim_interference_health rim_interference_get_health(const struct rim_monitor *monitor);

#ifdef __cplusplus
}
#endif
#endif
