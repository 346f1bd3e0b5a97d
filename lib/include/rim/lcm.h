/* SPDX-License-Identifier: MIT */
/* rim/lcm.h - observations, alarms, health, counters, commands, plans and entries as LCM messages.
 *
 * liblcm is not needed. The bytes are those of lcm-gen's encoders for lib/wire/rim_*_t.lcm: an
 * 8-byte fingerprint, then the fields in order, big-endian, with arrays of fixed size. Unsigned
 * values travel as their bits in LCM's signed types. No function keeps state; stack below 200
 * bytes.
 *
 * Every pack function writes one message into out[0..bytes). RIM_E_ARGUMENT: a pointer is NULL;
 * RIM_E_SIZE: fewer bytes than the message has; RIM_E_RANGE: a count or code is out of range;
 * RIM_E_DATA: a number that must be finite is not. On an error out is unchanged.
 *
 * Every unpack function reads one message of exactly `bytes` bytes. RIM_E_ARGUMENT: a pointer is
 * NULL; RIM_E_TRUNCATED, RIM_E_SIZE: the message is shorter, longer; RIM_E_MAGIC: another type, or
 * another version of the type; RIM_E_RANGE: a count or code is out of range; RIM_E_DATA: a number
 * that must be finite is not. On an error the result has no meaning. All cost O(bytes). */
#ifndef RIM_LCM_H
#define RIM_LCM_H

#include <stddef.h>
#include <stdint.h>

#include "rim/alarm.h"
#include "rim/image.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_LCM_CHANNEL_OBSERVATION "RIM_OBSERVATION"
#define RIM_LCM_CHANNEL_ALARM "RIM_ALARM"
#define RIM_LCM_CHANNEL_HEALTH "RIM_HEALTH"
#define RIM_LCM_CHANNEL_COMMAND "RIM_COMMAND"
#define RIM_LCM_CHANNEL_COUNTERS "RIM_COUNTERS"
#define RIM_LCM_CHANNEL_PLAN "RIM_PLAN"
#define RIM_LCM_CHANNEL_ENTRY "RIM_ENTRY"
#define RIM_LCM_CHANNEL_MODEL "RIM_MODEL"

#define RIM_OBSERVATION_MAX_VALUES 128
#define RIM_PLAN_MAX_POSES 64u

/* Bytes of one message, fingerprint included. */
#define RIM_LCM_OBSERVATION_SIZE (8 + 8 + 4 + 4 + 8 * RIM_OBSERVATION_MAX_VALUES)
#define RIM_LCM_ALARM_SIZE (8 + 2 * 8 + 3 * 4 + 7 + 4 * 2 + 8 * 8 + 3 * 2 + 18 * 8 + 4 * 8)
#define RIM_LCM_HEALTH_SIZE (8 + 8 + 7 * 4 + 2)
#define RIM_LCM_COMMAND_SIZE (8 + 4 + 4 + 1)
#define RIM_LCM_COUNTERS_SIZE (8 + 4 * 31)
#define RIM_LCM_PLAN_SIZE (8 + 8 + 4 + 4 + 8 * 64 * (1 + 3 + 4))
#define RIM_LCM_ENTRY_SIZE (8 + 8 + 8 + 5 * 4 + 1)
#define RIM_LCM_MODEL_SIZE (8 + 7 * 4 + 2 + 12 * (64 + 8 + 2 * 8))

/* One row on the bus: the features, and where the image asks for it outcomes, means and sds. */
typedef struct rim_observation_message {
  int64_t t_us;                             /* time of the sample */
  uint32_t sequence;                        /* counts samples of the source */
  uint32_t count;                           /* values in use, 1..RIM_OBSERVATION_MAX_VALUES */
  double value[RIM_OBSERVATION_MAX_VALUES]; /* NaN: missing; the rest is 0 */
} rim_observation_message;

#define RIM_HEALTH_FLAG_REPLAY 0x01u
/* Memory was found damaged since the start; with level STALE it still is. */
#define RIM_HEALTH_FLAG_DAMAGED 0x02u

/* Counters saturate. All zero: nothing has happened yet. */
typedef struct rim_health_message {
  double t_s;            /* time of the newest observation */
  uint32_t sequence;     /* counts health messages from 1 */
  uint32_t model_id;     /* of the flight image */
  uint32_t observations; /* accepted since the start */
  uint32_t rejected;     /* of another length, not finite, or with a time that is not accepted */
  uint32_t gaps;         /* missing sequence numbers */
  uint32_t alarms;       /* alarm records sent */
  uint32_t dropped;      /* records that did not go out whole */
  uint8_t level;         /* rim_level of the vehicle */
  uint8_t flags;         /* RIM_HEALTH_FLAG_... */
} rim_health_message;

/* What a daemon refused, lost or repaired. Counters saturate; all zero: nothing yet. */
typedef struct rim_counters {
  uint32_t sequence;     /* counts these messages from 1 */
  uint32_t rows;         /* observations that the monitor used */
  uint32_t wrong_length; /* refused: another number of values than the image's */
  uint32_t not_finite;   /* refused: NaN or infinity, or an sd not above 0 */
  uint32_t time_back;    /* refused: the time did not increase */
  uint32_t future;       /* refused: the time was too far ahead */
  uint32_t gaps;         /* sequence numbers of the source, or times of rows, left out */
  uint32_t incomplete;   /* CAN rows without one of their signals */
  uint32_t clock_resets; /* times the source's clock moved for good */
  uint32_t stale;        /* times the input became stale */
  uint32_t overruns;     /* steps longer than the deadline */
  uint32_t step_us;      /* the longest step */
  uint32_t commands, commands_refused;
  uint32_t lcm_malformed; /* datagrams that are no LCM, or cut */
  uint32_t lcm_fragments; /* fragments refused, or of messages that were never complete */
  uint32_t lcm_other;     /* messages on channels that are not read */
  uint32_t lcm_refused;   /* messages of another type, version or length */
  uint32_t lcm_unsent;
  uint32_t can_frames;  /* read as input */
  uint32_t can_other;   /* frames with an identifier that is not read */
  uint32_t can_refused; /* frames of another length, or with a value out of range */
  uint32_t can_errors, can_bus_off, can_down, can_full; /* error frames, and states of the bus */
  uint32_t can_unsent;                                  /* frames given up */
  uint32_t input_lost;                                  /* in the queue of a socket */
  uint32_t state_failures;                              /* to write the state file */
  uint32_t restarts;                                    /* that went on from the state file */
  uint32_t state_refused; /* state files that a start found damaged, or of another image */
} rim_counters;

#define RIM_COUNTERS_FIELDS 31u
/* Returns the name of field i, "rows" for 1; NULL from RIM_COUNTERS_FIELDS on. O(1). */
const char *rim_counters_name(uint32_t i);
/* Returns the value of field i; 0 where there is none. O(1). */
uint32_t rim_counters_value(const rim_counters *counters, uint32_t i);

/* Where the vehicle is going: poses of rising time. */
typedef struct rim_pose {
  double after_s;        /* after the plan's time */
  double position[3];    /* m */
  double orientation[4]; /* unit quaternion w x y z */
} rim_pose;

typedef struct rim_plan {
  int64_t t_us;
  uint32_t sequence;
  uint32_t count; /* 1..RIM_PLAN_MAX_POSES */
  rim_pose pose[RIM_PLAN_MAX_POSES];
} rim_plan;

#define RIM_ENTRY_NEVER (-1.0)

/* When the plan leads into the region of an alarm (rim/plan/lookahead.h). */
typedef struct rim_entry {
  double t_s;
  double to_entry_s; /* 0: inside; RIM_ENTRY_NEVER: the plan does not enter */
  uint32_t sequence, alarm_sequence, plan_sequence, model_id;
  uint32_t pose; /* the one before the entry */
  uint8_t flags; /* RIM_ALARM_FLAG_REPLAY */
} rim_entry;

#define RIM_MODEL_QUANTITIES 12u /* of one message */
#define RIM_MODEL_NAME_BYTES 64u
#define RIM_MODEL_UNIT_BYTES 8u

typedef struct rim_model_quantity {
  char name[RIM_MODEL_NAME_BYTES]; /* terminated; a longer one is cut */
  char unit[RIM_MODEL_UNIT_BYTES]; /* terminated; empty: none */
  double low, high;                /* trained range of a feature; 0 and 0: an outcome's, none */
} rim_model_quantity;

/* Says what the indices in other messages mean: names, units and ranges of some of an image's
 * quantities, which are its features, then its outcomes. */
typedef struct rim_model_message {
  uint32_t model_id;
  uint32_t features, outcomes; /* of the image */
  uint32_t period_us;          /* between rows; 0: no rate */
  uint32_t block_rows;
  uint32_t first, count; /* of this part */
  bool external;         /* rows bring outcomes, means and standard deviations too */
  uint8_t flags;         /* RIM_ALARM_FLAG_REPLAY */
  rim_model_quantity quantity[RIM_MODEL_QUANTITIES];
} rim_model_message;

/* The values of an observation are not checked: NaN travels as it is. */
rim_status rim_lcm_pack_observation(uint8_t *out, size_t bytes, const rim_observation_message *in);
rim_status rim_lcm_unpack_observation(rim_observation_message *out, const uint8_t *in,
                                      size_t bytes);

/* Every number of a record must be finite. Unpacking also takes the first version of the type, 8
 * bytes shorter: since_sd_s is 0 then. */
rim_status rim_lcm_pack_alarm(uint8_t *out, size_t bytes, const rim_alarm *in);
rim_status rim_lcm_unpack_alarm(rim_alarm *out, const uint8_t *in, size_t bytes);

/* Packing does not check t_s; for unpacking it must be finite. */
rim_status rim_lcm_pack_health(uint8_t *out, size_t bytes, const rim_health_message *in);
rim_status rim_lcm_unpack_health(rim_health_message *out, const uint8_t *in, size_t bytes);

rim_status rim_lcm_pack_command(uint8_t *out, size_t bytes, const rim_command *in);
rim_status rim_lcm_unpack_command(rim_command *out, const uint8_t *in, size_t bytes);

rim_status rim_lcm_pack_counters(uint8_t *out, size_t bytes, const rim_counters *in);
rim_status rim_lcm_unpack_counters(rim_counters *out, const uint8_t *in, size_t bytes);

/* Unpacking also returns RIM_E_DATA where times fall, or the length of an orientation is not within
 * 1 % of 1. On an error *plan is unchanged. */
rim_status rim_lcm_pack_plan(uint8_t *out, size_t bytes, const rim_plan *plan);
rim_status rim_lcm_unpack_plan(rim_plan *plan, const uint8_t *in, size_t bytes);

/* RIM_E_DATA also for a time to entry below 0 that is not RIM_ENTRY_NEVER. */
rim_status rim_lcm_pack_entry(uint8_t *out, size_t bytes, const rim_entry *entry);
rim_status rim_lcm_unpack_entry(rim_entry *entry, const uint8_t *in, size_t bytes);

/* Packs the part of an open image that begins with quantity `first`: 0, RIM_MODEL_QUANTITIES, ...
 * below features + outcomes. RIM_E_RANGE: there is none, or the image has no configuration. A name
 * that the image does not carry is empty. O(names). */
rim_status rim_lcm_pack_model(uint8_t *out, size_t bytes, const rim_image *image, uint32_t first,
                              uint8_t flags);
rim_status rim_lcm_unpack_model(rim_model_message *out, const uint8_t *in, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
