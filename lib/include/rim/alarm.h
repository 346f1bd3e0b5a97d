/* SPDX-License-Identifier: MIT */
/* rim/alarm.h - the alarm record: what the monitor found, where, how large, and how surely.
 * rim/can.h and rim/lcm.h turn a record into bytes and back. */
#ifndef RIM_ALARM_H
#define RIM_ALARM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/region.h"
#include "rim/status.h"

#define RIM_ALARM_MAX_CHANNELS 4 /* outcomes named in one record */
#define RIM_DETECTORS 2u         /* at most one alarm of each stands at a time */

typedef enum rim_detector { RIM_DETECTOR_RIM = 0, RIM_DETECTOR_INTERFERENCE = 1 } rim_detector;

typedef enum rim_alarm_state {
  RIM_ALARM_NONE = 0,    /* none stands: the record only reports the level (STALE, or OK again) */
  RIM_ALARM_RAISED = 1,  /* an alarm begins to stand */
  RIM_ALARM_UPDATED = 2, /* it stands, and its level, flags or region have changed */
  RIM_ALARM_CLEARED = 3  /* it no longer stands */
} rim_alarm_state;

typedef enum rim_level {
  RIM_LEVEL_OK = 0,
  RIM_LEVEL_WARN = 1,         /* above the warning score; no alarm stands */
  RIM_LEVEL_ERROR = 2,        /* an alarm stands */
  RIM_LEVEL_STALE = 3,        /* too few usable rows, or another rate: nothing is known */
  RIM_LEVEL_OUT_OF_RANGE = 4, /* in verdicts only: a value far beyond what was trained */
  RIM_LEVEL_INTEGRITY = 5     /* in verdicts only: memory is damaged; nothing is known */
} rim_level;

/* How the outcome deviates, and in which unit `shift` is then given. */
typedef enum rim_kind {
  RIM_KIND_SHIFT = 0,    /* measured less nominal, in the outcome's unit */
  RIM_KIND_GAIN = 1,     /* in proportion to the outcome: 0.08 for 8 % high */
  RIM_KIND_VARIANCE = 2, /* scatter of the readings: ratio of variances */
  RIM_KIND_DRIFT = 3,    /* grows since the onset: measured less nominal at t_s */
  RIM_KIND_REPEAT = 4,   /* readings equal to the one before, or to 0: excess share */
  RIM_KIND_BLOCKED = 5,  /* interference: slower than commanded, m/s */
  RIM_KIND_PUSHED = 6    /* interference: faster than commanded, or moved without a command, m/s */
} rim_kind;

#define RIM_ALARM_FLAG_REPLAY 0x01u       /* from a recording: must not be mistaken for live */
#define RIM_ALARM_FLAG_LATCHED 0x02u      /* the cause is gone, but nobody has acknowledged it */
#define RIM_ALARM_FLAG_ACKNOWLEDGED 0x04u /* somebody has acknowledged it since it was raised */

typedef struct rim_alarm {
  double t_s;            /* time of the observation that caused this record */
  double since_s;        /* estimated onset; for a region without onset the first visit */
  double since_sd_s;     /* standard error of the onset; 0: not estimated */
  uint32_t seq;          /* counts the records of a monitor from 1, as they leave; 0: never sent */
  uint32_t model_id;     /* of the flight image */
  uint32_t observations; /* inside the region */
  uint8_t detector;      /* rim_detector */
  uint8_t state;         /* rim_alarm_state */
  uint8_t level;         /* rim_level */
  uint8_t kind;          /* rim_kind */
  uint8_t flags;         /* RIM_ALARM_FLAG_... */
  uint8_t channels;      /* entries of channel[], shift[] and shift_sd[] in use */
  uint16_t channel[RIM_ALARM_MAX_CHANNELS]; /* indices of outcomes, the most anomalous first */
  double shift[RIM_ALARM_MAX_CHANNELS]; /* unit: see rim_kind. [0] inside `region`; a further entry
                                           inside that outcome's own best region */
  double shift_sd[RIM_ALARM_MAX_CHANNELS]; /* standard errors, same unit; [i > 0]: 0 if unknown */
  rim_region region;                       /* in the features' units; dims 0: everywhere */
  double ln_anom;   /* evidence in nats (eq. 3.1) less what describes the hypothesis; of the
                       interference detector the log odds of its HMM */
  double threshold; /* value of ln_anom at which the alarm was raised */
  double p_value;   /* of the whole run, conformal: at least 1 / (calibration runs + 1) */
} rim_alarm;

/* What the application asks of the alarms beside what the image says. All zero: none of it. */
typedef struct rim_alarm_policy {
  double stale_s;   /* STALE after longer than this without a valid row; 0: never */
  bool latch;       /* an alarm whose cause is gone stands until somebody acknowledges it */
  bool replay;      /* every record carries RIM_ALARM_FLAG_REPLAY */
  bool command_any; /* a command's 0 stands for any alarm, any model */
} rim_alarm_policy;

/* How the alarms stand: for health messages, and for summaries that are sent repeatedly. */
typedef struct rim_alarm_status {
  rim_alarm newest;  /* the alarm that stands, as it was sent (of two, the one sent last); where
                        none stands, the last record; seq 0: none was sent yet */
  uint32_t records;  /* sent so far */
  uint8_t level;     /* rim_level of the vehicle: STALE, else ERROR, else WARN, else OK */
  bool stands;       /* at least one alarm stands */
  bool acknowledged; /* one stands, and all that stand are acknowledged */
} rim_alarm_status;

typedef enum rim_command_code {
  RIM_COMMAND_ACKNOWLEDGE = 1, /* somebody has seen the alarm: it will not be latched */
  RIM_COMMAND_CLEAR = 2,       /* the cause is gone: forget the alarm and its observations */
  RIM_COMMAND_DESCRIBE = 3     /* to whoever carries the monitor, not to it: send RIM_MODEL now */
} rim_command_code;

/* What an operator asks, of the record so numbered; 0: any, where the policy says command_any. */
typedef struct rim_command {
  uint32_t sequence; /* of the newest record of the alarm that is meant; 0: all that stand */
  uint32_t model_id; /* of that record; 0: any */
  uint8_t command;   /* rim_command_code */
} rim_command;

#endif
