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

typedef enum rim_detector { RIM_DETECTOR_RIM = 0, RIM_DETECTOR_INTERFERENCE = 1 } rim_detector;
typedef enum rim_alarm_state {
  RIM_ALARM_NONE = 0,
  RIM_ALARM_RAISED = 1,
  RIM_ALARM_UPDATED = 2,
  RIM_ALARM_CLEARED = 3
} rim_alarm_state;
typedef enum rim_level {
  RIM_LEVEL_OK = 0,
  RIM_LEVEL_WARN = 1, /* above the warning confidence, below the promised false-alarm rate */
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
#define RIM_ALARM_FLAG_LATCHED 0x02u
#define RIM_ALARM_FLAG_ACKNOWLEDGED 0x04u

typedef struct rim_alarm {
  double t_s; /* time of the observation that caused this record */
  double since_s;    /* estimated onset; for a region without onset the first visit */
  double since_sd_s; /* standard error of the onset; 0: not estimated */
  uint32_t seq; /* counts every record of this monitor from 1; 0: never raised */
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

/* The life of an alarm: persistence before it is raised and before it is cleared, updates no more
 * often than asked, and STALE when the input stops. One life per detector. */
typedef struct rim_alarm_life_config {
  uint32_t raise_steps; /* found in so many steps in a row: raised; 0: as 1 */
  uint32_t clear_steps; /* not found in so many steps in a row: cleared; 0: never, it latches */
  double inhibit_s;     /* least time between an UPDATED record and the one before; 0: none */
  double update_ratio;  /* relative change of ln_anom worth an update; 0: any change */
  double stale_s;       /* without a step for so long: STALE; 0: never */
} rim_alarm_life_config;

/* Private to the functions below; copy it to save it. All zero: as after init with an all-zero
 * configuration. */
typedef struct rim_alarm_life {
  rim_alarm_life_config config;
  rim_alarm last; /* the newest record emitted; state NONE: none since the last clear */
  double step_s;  /* newest step, to tell a stop of the input */
  uint32_t found; /* steps in a row with and without a finding, saturating */
  uint32_t missing;
  uint32_t seq;      /* records emitted */
  uint32_t bad_time; /* calls with a time that is not finite, saturating */
  uint8_t level;     /* of the standing alarm */
  bool active, stale, started;
} rim_alarm_life;

/* Sets up a life; config NULL: all zero. RIM_E_ARGUMENT life NULL; RIM_E_CONFIG a number negative
 * or not finite: unchanged. O(1). */
rim_status rim_alarm_life_init(rim_alarm_life *life, const rim_alarm_life_config *config);

/* Takes one step's finding and returns whether *out is a record to send: RAISED, UPDATED or
 * CLEARED, with seq counted from 1 and t_s = now_s. candidate is NULL, or has level OK, when
 * nothing was found; else its level is WARN or ERROR and its state and seq are ignored. A rise of
 * the level is an update at once; another channel, kind, detector or feature, or ln_anom moved by
 * update_ratio, after inhibit_s. The first step after STALE sends the alarm again (UPDATED) when it
 * still stands, or a record with state NONE and level OK when there is none. A clock that jumps
 * back ends an inhibition. NULL life or out, or a time not finite: false, *out unchanged, bad_time
 * counts. O(1). */
bool rim_alarm_life_step(rim_alarm_life *life, double now_s, const rim_alarm *candidate,
                         rim_alarm *out);

/* To be called when no observation came. Returns true once when the last step is stale_s ago: *out
 * is the standing alarm (state UPDATED) or an empty record (state NONE), with level STALE. O(1). */
bool rim_alarm_life_idle(rim_alarm_life *life, double now_s, rim_alarm *out);

#ifdef __cplusplus
}
#endif
#endif
