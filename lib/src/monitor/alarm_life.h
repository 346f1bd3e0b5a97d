/* SPDX-License-Identifier: MIT */
/* alarm_life.h - private: the life of the alarms, in one place.
 *
 * There are two slots, one for each detector (rim_detector): the regions and the motion
 * interference. Each slot holds at most one alarm:
 *
 *     found for raise_steps in a row   -> RAISED
 *     another outcome, kind or feature,
 *       or ln_anom moved far enough    -> UPDATED, at most once in inhibit_s
 *     not found for clear_steps        -> CLEARED; with policy.latch, and not acknowledged:
 *                                         UPDATED with the flag LATCHED, and it goes on standing
 *     acknowledged                     -> UPDATED with the flag ACKNOWLEDGED; CLEARED if latched
 *     no valid row for stale_s         -> UPDATED with level STALE; UPDATED again when rows return
 *
 * Where no alarm stands, a record with state NONE reports the beginning and the end of STALE.
 * A record waits in its slot until rimi_alarm_life_next_record() takes it; what happens meanwhile
 * is put into the same record, and neither RAISED nor CLEARED is ever skipped: a slot whose RAISED
 * waits does not clear, one whose CLEARED waits does not raise (a restart or a command alone may
 * turn a RAISED that waits into CLEARED). Records are numbered as they leave, the one that has
 * waited longest first; both at once: that of the regions first.
 *
 * All times are on the clock of the rows. Nothing here reads a clock, and no function takes more
 * than O(1) and 1 kB of stack. A life is plain data without pointers: a copy of its bytes goes
 * on as the original would. */
#ifndef RIM_ALARM_LIFE_H
#define RIM_ALARM_LIFE_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/alarm.h"
#include "rim/status.h"

typedef struct rim_alarm_slot_config {
  uint32_t raise_steps; /* consecutive steps with a finding before it is raised; 0: as 1 */
  uint32_t clear_steps; /* consecutive steps without a finding before it is over; 0: never */
  double inhibit_s;     /* least time between an update and the record before; 0: none */
  double update_ratio;  /* relative change of ln_anom worth an update; 0: any change */
} rim_alarm_slot_config;

typedef struct rim_alarm_life_config {
  rim_alarm_slot_config slot[RIM_DETECTORS]; /* by rim_detector */
  rim_alarm_policy policy;
  uint32_t model_id; /* of every record */
} rim_alarm_life_config;

/* One detector's alarm. */
typedef struct rim_alarm_slot {
  rim_alarm record;        /* newest; its seq: of the slot's last record sent */
  uint32_t found, missing; /* steps in a row with and without a finding, saturating */
  uint32_t ticket;         /* when the record that waits became due */
  uint8_t level;           /* rim_level of the newest step: OK, WARN or ERROR */
  bool due;                /* the record waits to be sent */
  bool stands;             /* raised and not cleared */
  bool is_over;            /* stands, but its detector finds it no longer: latched */
  bool acknowledged;       /* stands, and somebody has seen it */
} rim_alarm_slot;

/* Private to the functions below. */
typedef struct rim_alarm_life {
  rim_alarm_life_config config;
  rim_alarm_slot slot[RIM_DETECTORS];
  double row_s;         /* newest valid row; before the first, when it was first asked */
  double empty_s;       /* time of the record without an alarm that waits */
  uint32_t seq;         /* records sent */
  uint32_t tickets;     /* given out */
  uint32_t raised;      /* alarms so far, saturating */
  uint32_t stale_times; /* times that the input has stopped, saturating */
  uint8_t told;         /* slot of the record sent last */
  bool empty_due;
  bool started; /* row_s means something */
  bool stale;
  bool has_row; /* row_s is a row's */
} rim_alarm_life;

/* Sets up a life in which nothing has happened. RIM_E_ARGUMENT NULL; RIM_E_CONFIG a time or ratio
 * negative or not finite: *life is unchanged. */
rim_status rimi_alarm_life_init(rim_alarm_life *life, const rim_alarm_life_config *config);

/* Replaces the policy. Without `latch` an alarm that is held by it is cleared. Statuses as above.
 */
rim_status rimi_alarm_life_set_policy(rim_alarm_life *life, const rim_alarm_policy *policy);

/* A valid row came at now_s (finite): ends STALE. To be called before the row's steps. A silence
 * since the row before that nobody has asked about is counted here, and breaks what must be found
 * in a row. */
void rimi_alarm_life_row(rim_alarm_life *life, double now_s);

/* What one detector says at now_s (finite), in the row that was last given. candidate: NULL or
 * level OK: it finds nothing; ERROR: it finds an alarm, described whole; WARN: not enough to raise
 * one, but enough for one that was raised to go on standing, described whole if one stands. State,
 * seq, flags, detector and model_id of the candidate are not looked at. */
void rimi_alarm_life_step(rim_alarm_life *life, rim_detector detector, double now_s,
                          const rim_alarm *candidate);

/* Whether that step would raise an alarm. */
bool rimi_alarm_life_would_raise(const rim_alarm_life *life, rim_detector detector,
                                 const rim_alarm *candidate);

/* The cause is known to have ended: what clear_steps would come to, at once. False where no alarm
 * stands, or while its RAISED record has not left. */
bool rimi_alarm_life_over(rim_alarm_life *life, rim_detector detector, double now_s);

/* It is now_s, and no valid row has come since the last one; before the first row, since the first
 * call. Returns true once, when that has lasted longer than policy.stale_s: records of that time
 * (the last row's plus stale_s, whenever it is noticed) then wait. A time that is not finite, or
 * earlier: no effect. */
bool rimi_alarm_life_idle(rim_alarm_life *life, double now_s);

/* Somebody's command. bits: how many low bits of sequence and model_id its bus carries, 8 or 32.
 * *forget: the detectors, as bits 1 << rim_detector, whose memory is to be erased (CLEAR); 0 unless
 * RIM_OK. RIM_E_ARGUMENT NULL; RIM_E_RANGE an unknown command; RIM_E_DATA it is for another model
 * or record, or none stands, or its low bits fit the records of both alarms. No number names an
 * alarm whose RAISED waits; where 0 stands for any, it is meant too. */
rim_status rimi_alarm_life_command(rim_alarm_life *life, const rim_command *command, unsigned bits,
                                   uint32_t *forget);

/* Every detector has been made to forget, because the rows' clock went to now_s: what stands is
 * over, and told so. */
void rimi_alarm_life_restart(rim_alarm_life *life, double now_s);

/* Forgets everything, silently, but configuration and counts; sequence numbers count on. */
void rimi_alarm_life_reset(rim_alarm_life *life);

/* Sends every alarm that stands once more, as UPDATED: for listeners after a restart of the
 * computer. */
void rimi_alarm_life_repeat(rim_alarm_life *life);

/* After memory was damaged, in a life that was just set up: what goes on from the one before. The
 * next row tells that none stands. */
void rimi_alarm_life_go_on(rim_alarm_life *life, const rim_alarm_policy *policy, uint32_t seq,
                           uint32_t raised);

/* Whether one may wait: what rimi_alarm_life_next_record() looks at first. */
bool rimi_alarm_life_waits(const rim_alarm_life *life);

/* Takes the next record that waits. Returns false, and leaves *out alone, when none does. */
bool rimi_alarm_life_next_record(rim_alarm_life *life, rim_alarm *out);

/* rim_level of the whole: see rim_alarm_status. */
rim_level rimi_alarm_life_level(const rim_alarm_life *life);

/* The detector's alarm while it stands, as it was described last; NULL: none stands. */
const rim_alarm *rimi_alarm_life_standing(const rim_alarm_life *life, rim_detector detector);

void rimi_alarm_life_status(const rim_alarm_life *life, rim_alarm_status *status);

#endif
