/* SPDX-License-Identifier: MIT */
/* rim/alarm.h - the alarm record: what the monitor found, where, how much, how surely.
 *
 * The record is the one currency between the detector and every bus: lib packs and unpacks it to
 * CAN (alarm_can.c) and LCM (alarm_lcm.c); host tools write it as JSON lines. Public descriptions
 * of the bytes are in lib/wire/. */
#ifndef RIM_ALARM_H
#define RIM_ALARM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/region.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_ALARM_MAX_CHANNELS 4 /* outcomes named in one alarm, most anomalous first */

#define RIM_DETECTORS 2u /* at most one alarm of each stands at a time */

typedef enum rim_detector { RIM_DETECTOR_RIM = 0, RIM_DETECTOR_INTERFERENCE = 1 } rim_detector;
typedef enum rim_alarm_state {
  RIM_ALARM_NONE = 0,    /* none stands: the record tells the level alone (STALE, or OK again) */
  RIM_ALARM_RAISED = 1,  /* begins to stand */
  RIM_ALARM_UPDATED = 2, /* stands, and something about it has changed: its level, flags, region */
  RIM_ALARM_CLEARED = 3  /* stands no longer */
} rim_alarm_state;
typedef enum rim_level {
  RIM_LEVEL_OK = 0,
  RIM_LEVEL_WARN = 1, /* above the warning confidence; no alarm stands */
  RIM_LEVEL_ERROR = 2,
  RIM_LEVEL_STALE = 3, /* too few usable rows, or another rate: says nothing about the vehicle */
  RIM_LEVEL_OUT_OF_RANGE = 4 /* of a verdict, never of a record: a value beyond what was trained */
} rim_level;
/* How the outcome deviates. */
typedef enum rim_kind {
  RIM_KIND_SHIFT = 0,    /* measured less nominal, in the outcome's unit */
  RIM_KIND_GAIN = 1,     /* in proportion to the outcome: shift is the share, 0.08 for 8 % high */
  RIM_KIND_VARIANCE = 2, /* scatter of the readings: shift is the ratio of variances */
  RIM_KIND_DRIFT = 3,    /* grows since the onset: shift is measured less nominal by now */
  RIM_KIND_REPEAT = 4    /* share of readings equal to the one before: shift is its excess */
} rim_kind;
/* What the interference detector says in the place of a rim_kind. */
enum {
  RIM_KIND_BLOCKED = 5, /* slower than commanded */
  RIM_KIND_PUSHED = 6   /* faster than commanded, or moved without a command */
};

#define RIM_ALARM_FLAG_REPLAY 0x01u /* from a recording: must not be mistaken for live */
/* The cause is gone, and the alarm stands until somebody acknowledges it: only where latching was
 * asked for (rim_alarm_policy.latch). */
#define RIM_ALARM_FLAG_LATCHED 0x02u
/* Somebody has acknowledged this alarm since it was raised; it stands as long as its cause does. */
#define RIM_ALARM_FLAG_ACKNOWLEDGED 0x04u

typedef struct rim_alarm {
  double t_s;        /* time of the observation that caused this record */
  double since_s;    /* estimated onset; for a region without onset the first visit */
  double since_sd_s; /* standard error of the onset; 0: not estimated */
  uint32_t seq;      /* counts the records of this monitor from 1, as they leave; 0: never sent */
  uint32_t model_id;
  uint32_t observations; /* inside the region */
  uint8_t detector;      /* rim_detector */
  uint8_t state;         /* rim_alarm_state */
  uint8_t level;         /* rim_level */
  uint8_t kind;          /* rim_kind, or BLOCKED, PUSHED */
  uint8_t flags;
  uint8_t channels;                         /* 1..RIM_ALARM_MAX_CHANNELS outcomes in channel[] */
  uint16_t channel[RIM_ALARM_MAX_CHANNELS]; /* index of the outcome, most anomalous first */
  double shift[RIM_ALARM_MAX_CHANNELS]; /* in the outcome's unit (VARIANCE: ratio of variances) */
  double shift_sd[RIM_ALARM_MAX_CHANNELS]; /* standard error, same unit */
  rim_region region;                       /* in feature units; dims 0: everywhere */
  double ln_anom;                          /* natural logarithm, eq. 3.1 */
  double threshold; /* on ln_anom, at the promised run-level false-alarm rate */
  double p_value;   /* run-level, conformal: never below 1/(calibration runs + 1) */
} rim_alarm;

/* What the application asks of the alarms, beside what the flight image says. All zero: nothing is
 * latched, nothing carries the replay flag, and silence is never STALE. */
typedef struct rim_alarm_policy {
  double stale_s; /* no valid row for longer than this: STALE; 0: never */
  bool latch;     /* an alarm whose cause is gone stands until somebody has acknowledged it */
  bool replay;    /* every record carries RIM_ALARM_FLAG_REPLAY */
} rim_alarm_policy;

/* How the alarms stand now: for health messages, and for summaries that are sent again and again.
 */
typedef struct rim_alarm_status {
  rim_alarm newest;  /* as it was sent: the alarm that stands (of two, the one sent last), or the
                         last record of all where none stands; seq 0: none was sent yet */
  uint32_t records;  /* sent so far: the seq of the last one */
  uint8_t level;     /* rim_level of the vehicle: STALE, else ERROR while any alarm stands, else
                         WARN while a detector warns or has not found for long enough, else OK */
  bool stands;       /* at least one alarm was raised and is not cleared */
  bool acknowledged; /* one stands, and all that stand are acknowledged */
} rim_alarm_status;

/* What somebody at the receiving end may ask of the monitor. */
typedef enum rim_command_code {
  RIM_COMMAND_ACKNOWLEDGE = 1, /* somebody has seen it: a latched alarm may go */
  RIM_COMMAND_CLEAR = 2        /* the cause is gone: forget the alarm and what was learnt from it */
} rim_command_code;

typedef struct rim_command {
  uint32_t sequence; /* of the newest record of the alarm that is meant; 0: all that stand */
  uint32_t model_id; /* 0: any */
  uint8_t command;   /* rim_command_code */
} rim_command;

#ifdef __cplusplus
}
#endif
#endif
