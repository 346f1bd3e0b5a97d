/* rim/alarm_control.h - what goes on beside the alarms: commands back to the monitor, the
 * heartbeat, and counters of what was refused or lost.
 *
 * LCM: the bytes of lcm-gen's encoders for lib/wire/rim_command_t.lcm and rim_counters_t.lcm, on
 * the channels named below. CAN, numbers little-endian, check sums as in rim/alarm_can.h:
 *
 *   0x200 + node  command to node: 8 bytes
 *   0x700 + node  heartbeat: 8 bytes, cyclic; its absence is the only sign of a dead node */

/* clang-format off */
/* Command:   0 command | 1 seq | 2 model_id (low bits; 0: any) | 3..6 0 | 7 CRC-8
 * Heartbeat: 0 level:2 replay:1 latched:1 acknowledged:1 | 1 sequence | 2 model_id
 *            3..4 observations (low bits: they count on) | 5 rejected | 6 dropped | 7 CRC-8 */
/* clang-format on */
#ifndef RIM_ALARM_CONTROL_H
#define RIM_ALARM_CONTROL_H

#include <stddef.h>
#include <stdint.h>

#include "rim/alarm_can.h"
#include "rim/alarm_lcm.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_LCM_CHANNEL_COMMAND "RIM_COMMAND"
#define RIM_LCM_CHANNEL_COUNTERS "RIM_COUNTERS"
#define RIM_CAN_COMMAND_ID 0x200u

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

/* Each writes one message or frame; nothing on error. RIM_E_ARGUMENT NULL; RIM_E_SIZE capacity
 * below the message's; RIM_E_RANGE an unknown command or level, or a node above RIM_CAN_MAX_NODE.
 * O(bytes), stack below 200 bytes. */
rim_status rim_lcm_pack_command(uint8_t *out, size_t bytes, const rim_command *in);
rim_status rim_lcm_pack_counters(uint8_t *out, size_t bytes, const rim_counters *in);
rim_status rim_can_pack_command(rim_can_frame *frame, uint32_t node, const rim_command *in);
/* alarm_flags: RIM_ALARM_FLAG_LATCHED of the standing alarm; acknowledged: nobody needs to look. */
rim_status rim_can_pack_heartbeat(rim_can_frame *frame, uint32_t node, const rim_health_message *in,
                                  uint8_t alarm_flags, bool acknowledged);

/* Read one message of exactly bytes bytes, or one frame. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED
 * shorter, RIM_E_SIZE longer; RIM_E_MAGIC another type or identifier; RIM_E_CRC damaged;
 * RIM_E_RANGE an unknown command. *out has no meaning on error. O(bytes). */
rim_status rim_lcm_unpack_command(rim_command *out, const uint8_t *in, size_t bytes);
rim_status rim_lcm_unpack_counters(rim_counters *out, const uint8_t *in, size_t bytes);
/* Takes frames to `node` alone. sequence and model_id become the low bits. */
rim_status rim_can_unpack_command(rim_command *out, uint32_t node, const rim_can_frame *frame);

typedef struct rim_can_heartbeat {
  uint8_t node, level, flags; /* flags: rim_alarm's */
  bool acknowledged;
  uint8_t sequence, model_id; /* low bits */
  uint16_t observations;      /* low bits */
  uint8_t rejected, dropped;  /* 255: that many or more */
} rim_can_heartbeat;
rim_status rim_can_unpack_heartbeat(rim_can_heartbeat *out, const rim_can_frame *frame);

#ifdef __cplusplus
}
#endif
#endif
