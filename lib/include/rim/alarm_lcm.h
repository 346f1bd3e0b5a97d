/* rim/alarm_lcm.h - observations, alarms and health as LCM messages, without liblcm.
 *
 * The bytes are those of lcm-gen's encoders for lib/wire/rim_*_t.lcm: an 8-byte fingerprint, then
 * the fields in order, big-endian, arrays of fixed size. Unsigned values travel as their bits in
 * LCM's signed types. No function keeps state or needs more than 64 bytes of stack. */
#ifndef RIM_ALARM_LCM_H
#define RIM_ALARM_LCM_H

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

#ifdef __cplusplus
}
#endif
#endif
