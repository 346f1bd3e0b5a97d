/* SPDX-License-Identifier: MIT */
/* rim/can.h - alarms, commands, heartbeats and entries as CAN frames.
 *
 *   0x180 + node  summary: 8 bytes, what a display or a limp-home switch needs
 *   0x280 + node  detail, classic CAN: RIM_CAN_DETAIL_FRAMES frames of 8 bytes, all of the record
 *   0x280 + node  detail, CAN FD: one frame of 64 bytes, the box instead of the ellipsoid
 *   0x200 + node  command to node: 8 bytes
 *   0x380 + node  entry into an alarmed region: 8 bytes
 *   0x700 + node  heartbeat: 8 bytes, cyclic; its absence is the only sign of a dead node
 *
 * Numbers are little-endian (Intel). lib/wire/rim.dbc describes summary and FD detail for other
 * programs. Every check sum begins with the frame's identifier (two bytes, little-endian), so that
 * a frame under another identifier is refused. Fields that do not fit saturate; seq and model_id
 * are cut to their low bits. */

/* clang-format off */
/* Summary:  0 level:2 state:2 detector:1 kind:3 | 1 seq | 2 model_id
 *           3..4 dims:2 latched:1 replay:1 ln_anom:12 (0.25) | 5..6 observations | 7 CRC-8
 * Segment:  0 seq | 1 index:7 last:1 | 2..7 six bytes of the record and its CRC-32, the rest 0
 * Record:   by byte offsets; as rim_alarm_t.lcm says, but feature[] stands before shift[]
 *             0 t_s f64 | 8 since_s f64 | 16 seq u32 | 20 model_id u32 | 24 observations u32
 *            28 detector u8 | 29 state u8 | 30 level u8 | 31 kind u8 | 32 flags u8 | 33 channels u8
 *            34 dims u8 | 35 channel u16[4] | 43 feature u16[3] | 49 shift f32[4]
 *            65 shift_sd f32[4] | 81 center f32[3] | 93 inverse_shape f32[9] | 129 lower f32[3]
 *           141 upper f32[3] | 153 ln_anom f32 | 157 threshold f32 | 161 p_value f32 | 165 CRC-32,
 *           begun with the identifier as two bytes, of bytes 0..164
 * FD:       0 as summary | 1 seq | 2..3 model_id | 4..7 t (ms) | 8..11 since (ms)
 *           12..15 observations | 16 dims:2 channels:3 latched:1 replay:1 | 17 0
 *           18..21 two channels | 22..27 three features | 28..31 shift (f32)
 *           32..35 its standard error | 36..47 lower | 48..59 upper (f32)
 *           60..61 ln_anom (1/16) | 62 -8 log2 p_value | 63 CRC-8 */
/* Command to 0x200 + node, 8 bytes:
 * Command:   0 command | 1 seq | 2 model_id (low bits; 0: any) | 3..6 0 | 7 CRC-8
 * Heartbeat: 0 level:2 replay:1 latched:1 acknowledged:1 | 1 sequence | 2 model_id
 *            3..4 observations (low bits: they count on) | 5 rejected | 6 dropped | 7 CRC-8 */
/* Entry into an alarmed region, 0x380 + node, 8 bytes:
 *   0..1 time to entry (10 ms; 65534: that or more, 65535: does not enter) | 2 sequence
 *   3 alarm's seq | 4 plan's sequence | 5 model_id | 6 flags | 7 CRC-8     (low bits) */
/* clang-format on */
#ifndef RIM_CAN_H
#define RIM_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/alarm.h"
#include "rim/lcm.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_CAN_SUMMARY_ID 0x180u
#define RIM_CAN_DETAIL_ID 0x280u
#define RIM_CAN_HEARTBEAT_ID 0x700u
#define RIM_CAN_COMMAND_ID 0x200u
#define RIM_CAN_ENTRY_ID 0x380u
#define RIM_CAN_MAX_NODE 127u

#define RIM_CAN_DETAIL_SIZE 165u /* bytes of the record without its CRC-32 */
#define RIM_CAN_DETAIL_FRAMES 29u

/* One frame. length 0..8, or up to 64 where fd; bytes beyond length are 0. */
typedef struct rim_can_frame {
  uint32_t id;
  uint8_t length;
  bool fd;
  uint8_t data[64];
} rim_can_frame;

/* What a summary says. */
typedef struct rim_can_summary {
  uint8_t node, level, state, detector, kind, flags;
  uint8_t seq, model_id; /* low bits */
  uint8_t dims;
  uint16_t observations; /* 65535: that many or more */
  double ln_anom;        /* 0..1023.75, steps of 0.25 */
} rim_can_summary;

/* Each writes frames for one record. RIM_E_ARGUMENT NULL; RIM_E_RANGE node above RIM_CAN_MAX_NODE,
 * or a count or code of the record out of range; RIM_E_DATA a number that is not finite. Nothing is
 * written on error. O(bytes); stack below 300 bytes. */
rim_status rim_can_pack_summary(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm);
rim_status rim_can_pack_detail(rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], uint32_t node,
                               const rim_alarm *alarm);
rim_status rim_can_pack_detail_fd(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm);

/* Read one frame. RIM_E_ARGUMENT NULL; RIM_E_MAGIC an identifier of another kind; RIM_E_SIZE
 * another length; RIM_E_CRC damaged; RIM_E_RANGE a code out of range. *summary has no meaning on
 * error. */
rim_status rim_can_unpack_summary(rim_can_summary *summary, const rim_can_frame *frame);

/* Read one FD frame. The region becomes the axis-aligned ellipsoid in the box; threshold is 0,
 * channels beyond the second and shifts beyond the first are gone (channels is cut to 2). Statuses
 * as above; RIM_E_DATA a number not finite, or a box without a middle. */
rim_status rim_can_unpack_detail_fd(rim_alarm *alarm, const rim_can_frame *frame);

/* Puts segments of one node together. All zero: none yet. */
typedef struct rim_can_assembly {
  uint8_t node;      /* whose frames it takes: set by the caller */
  uint8_t seq, next; /* of the record under way; next index expected, 0: none under way */
  uint32_t lost;     /* records given up: a segment missing, out of order, or damaged; saturating */
  uint8_t data[6 * RIM_CAN_DETAIL_FRAMES];
} rim_can_assembly;

/* Takes one frame. *complete tells whether *alarm is now a whole record. RIM_OK also for a segment
 * in the middle. RIM_E_ARGUMENT NULL; RIM_E_MAGIC not a segment, or of another node: nothing
 * changes; RIM_E_SIZE not 8 bytes: nothing changes. RIM_E_TRUNCATED a segment missing or out of
 * order (a first segment begins a new record); RIM_E_CRC, RIM_E_RANGE, RIM_E_DATA the whole record
 * refused: it is given up and counted. O(1), O(bytes) for the last. */
rim_status rim_can_take_detail(rim_can_assembly *assembly, const rim_can_frame *frame,
                               rim_alarm *alarm, bool *complete);

/* Each writes one frame; nothing on error. RIM_E_ARGUMENT NULL; RIM_E_RANGE an unknown command or
 * level, or a node above RIM_CAN_MAX_NODE. O(1), stack below 200 bytes. */
rim_status rim_can_pack_command(rim_can_frame *frame, uint32_t node, const rim_command *in);
/* alarm_flags: RIM_ALARM_FLAG_LATCHED of the standing alarm; acknowledged: nobody needs to look. */
rim_status rim_can_pack_heartbeat(rim_can_frame *frame, uint32_t node, const rim_health_message *in,
                                  uint8_t alarm_flags, bool acknowledged);

/* Read one frame. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED shorter, RIM_E_SIZE longer; RIM_E_MAGIC
 * another identifier; RIM_E_CRC damaged; RIM_E_RANGE an unknown command. *out has no meaning on
 * error. O(1). */
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

/* RIM_E_ARGUMENT, RIM_E_RANGE node, RIM_E_DATA a time to entry below 0 that is not
 * RIM_ENTRY_NEVER: nothing written. */
rim_status rim_can_pack_entry(rim_can_frame *frame, uint32_t node, const rim_entry *entry);

/* Reads a frame of any node: the numbers become the low bits, the time 10 ms steps (655.34: that or
 * more), t_s and pose 0. RIM_E_ARGUMENT NULL; RIM_E_MAGIC another identifier; RIM_E_TRUNCATED,
 * RIM_E_SIZE not 8 bytes; RIM_E_CRC damaged. *entry has no meaning on error. O(1). */
rim_status rim_can_unpack_entry(rim_entry *entry, const rim_can_frame *frame);

#ifdef __cplusplus
}
#endif
#endif
