/* SPDX-License-Identifier: MIT */
/* rim/lcm.h - observations, alarms, health, commands, counters, plans and entries as LCM messages, without liblcm.
 *
 * The bytes are those of lcm-gen's encoders for lib/wire/rim_*_t.lcm: an 8-byte fingerprint, then
 * the fields in order, big-endian, arrays of fixed size. Unsigned values travel as their bits in
 * LCM's signed types. No function keeps state or needs more than 64 bytes of stack. */
#ifndef RIM_LCM_H
#define RIM_LCM_H

#include <stddef.h>
#include <stdint.h>

#include "rim/alarm.h"
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

#define RIM_OBSERVATION_MAX_VALUES 128

/* Bytes of one message, fingerprint included. */
#define RIM_LCM_OBSERVATION_SIZE (8 + 8 + 4 + 4 + 8 * RIM_OBSERVATION_MAX_VALUES)
#define RIM_LCM_ALARM_SIZE (8 + 2 * 8 + 3 * 4 + 7 + 4 * 2 + 8 * 8 + 3 * 2 + 18 * 8 + 3 * 8)
#define RIM_LCM_HEALTH_SIZE (8 + 8 + 7 * 4 + 2)

typedef struct rim_observation_message {
  int64_t t_us;                             /* time of the sample */
  uint32_t sequence;                        /* counts samples of the source */
  uint32_t count;                           /* values in use, 1..RIM_OBSERVATION_MAX_VALUES */
  double value[RIM_OBSERVATION_MAX_VALUES]; /* NaN: missing; the rest is 0 */
} rim_observation_message;

#define RIM_HEALTH_FLAG_REPLAY 0x01u

/* Counters saturate. All zero: nothing has happened yet. */
typedef struct rim_health_message {
  double t_s;            /* time of the newest observation */
  uint32_t sequence;     /* counts health records from 1 */
  uint32_t model_id;     /* of the flight image */
  uint32_t observations; /* accepted since the start */
  uint32_t rejected;     /* wrong length, not finite, time not increasing */
  uint32_t gaps;         /* missing sequence numbers */
  uint32_t alarms;       /* alarm records emitted */
  uint32_t dropped;      /* records that the transport did not take */
  uint8_t level;         /* rim_level of the vehicle */
  uint8_t flags;
} rim_health_message;

/* Write one message into out, of bytes capacity. RIM_E_ARGUMENT NULL; RIM_E_SIZE capacity below the
 * message's size; RIM_E_RANGE a count or code out of range; RIM_E_DATA an alarm with a number that
 * is not finite, which no receiver would take. out is unchanged on error. Values of an observation
 * and of health are not looked at: NaN travels as it is. Cost O(bytes). */
rim_status rim_lcm_pack_observation(uint8_t *out, size_t bytes, const rim_observation_message *in);
rim_status rim_lcm_pack_alarm(uint8_t *out, size_t bytes, const rim_alarm *in);
rim_status rim_lcm_pack_health(uint8_t *out, size_t bytes, const rim_health_message *in);

/* Read one message of exactly bytes bytes. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED shorter than the
 * message, RIM_E_SIZE longer; RIM_E_MAGIC another fingerprint: another type or another version of
 * it; RIM_E_RANGE a count or code out of range; RIM_E_DATA a time, or in an alarm any number, not
 * finite. Values of an observation may be NaN. out has no meaning on error. Cost O(bytes). */
rim_status rim_lcm_unpack_observation(rim_observation_message *out, const uint8_t *in,
                                      size_t bytes);
rim_status rim_lcm_unpack_alarm(rim_alarm *out, const uint8_t *in, size_t bytes);
rim_status rim_lcm_unpack_health(rim_health_message *out, const uint8_t *in, size_t bytes);

/* Saturating; all zero: nothing has happened yet. In the order of rim_counters_t.lcm, which says
 * what each counts. */
typedef struct rim_counters {
  uint32_t sequence;
  uint32_t rows, wrong_length, not_finite, time_back, future, gaps, incomplete, clock_resets, stale;
  uint32_t overruns, step_us;
  uint32_t commands, commands_refused;
  uint32_t lcm_malformed, lcm_fragments, lcm_other, lcm_refused, lcm_unsent;
  uint32_t can_frames, can_other, can_refused, can_errors, can_bus_off, can_down, can_full;
  uint32_t can_unsent;
  uint32_t input_lost, state_failures, restarts;
} rim_counters;

#define RIM_COUNTERS_FIELDS 30u
/* "rows", "can_full", ... of field i of rim_counters; NULL from RIM_COUNTERS_FIELDS on. */
const char *rim_counters_name(uint32_t i);
/* Its value; 0 where there is none. */
uint32_t rim_counters_value(const rim_counters *counters, uint32_t i);

#define RIM_LCM_COMMAND_SIZE (8 + 4 + 4 + 1)
#define RIM_LCM_COUNTERS_SIZE (8 + 4 * 30)

/* Each writes one message; nothing on error. RIM_E_ARGUMENT NULL; RIM_E_SIZE capacity below the
 * message's; RIM_E_RANGE an unknown command. O(bytes), stack below 200 bytes. */
rim_status rim_lcm_pack_command(uint8_t *out, size_t bytes, const rim_command *in);
rim_status rim_lcm_pack_counters(uint8_t *out, size_t bytes, const rim_counters *in);

/* Read one message of exactly bytes bytes. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED shorter, RIM_E_SIZE
 * longer; RIM_E_MAGIC another type; RIM_E_RANGE an unknown command. *out has no meaning on error.
 * O(bytes). */
rim_status rim_lcm_unpack_command(rim_command *out, const uint8_t *in, size_t bytes);
rim_status rim_lcm_unpack_counters(rim_counters *out, const uint8_t *in, size_t bytes);

/* Where the vehicle is going, and whether that leads into an alarmed region. */
#define RIM_PLAN_MAX_POSES 64u
#define RIM_LCM_PLAN_SIZE (8 + 8 + 4 + 4 + 8 * 64 * (1 + 3 + 4))
#define RIM_LCM_ENTRY_SIZE (8 + 8 + 8 + 5 * 4 + 1)
#define RIM_ENTRY_NEVER (-1.0)

typedef struct rim_pose {
  double after_s;
  double position[3];    /* m */
  double orientation[4]; /* unit quaternion w x y z */
} rim_pose;

typedef struct rim_plan {
  int64_t t_us;
  uint32_t sequence;
  uint32_t count; /* 1..RIM_PLAN_MAX_POSES */
  rim_pose pose[RIM_PLAN_MAX_POSES];
} rim_plan;

typedef struct rim_entry {
  double t_s;
  double to_entry_s; /* 0: inside; RIM_ENTRY_NEVER: does not enter */
  uint32_t sequence, alarm_sequence, plan_sequence, model_id;
  uint32_t pose;
  uint8_t flags; /* RIM_ALARM_FLAG_REPLAY */
} rim_entry;

/* Read a plan. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED, RIM_E_SIZE another length; RIM_E_MAGIC another
 * type; RIM_E_RANGE count; RIM_E_DATA a number not finite, times that fall, an orientation whose
 * length is not within 1 % of 1. *plan has no meaning on error. O(count). */
rim_status rim_lcm_unpack_plan(rim_plan *plan, const uint8_t *in, size_t bytes);
/* RIM_E_ARGUMENT, RIM_E_SIZE capacity, RIM_E_RANGE count: nothing written. */
rim_status rim_lcm_pack_plan(uint8_t *out, size_t bytes, const rim_plan *plan);

/* As above; RIM_E_DATA also a time to entry below 0 that is not RIM_ENTRY_NEVER. */
rim_status rim_lcm_pack_entry(uint8_t *out, size_t bytes, const rim_entry *entry);
rim_status rim_lcm_unpack_entry(rim_entry *entry, const uint8_t *in, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
