/* SPDX-License-Identifier: MIT */
/* rim/can.h - alarms, commands, heartbeats and entries as CAN frames.
 *
 *   identifier    frame
 *   0x180 + node  summary: 8 bytes, all that a display or a limp-home switch needs
 *   0x200 + node  command to that node: 8 bytes
 *   0x280 + node  detail, classic CAN: RIM_CAN_DETAIL_FRAMES segments of 8 bytes hold the record
 *   0x280 + node  detail, CAN FD: one frame of 64 bytes, with a box instead of the ellipsoid
 *   0x480 + node  finding: up to RIM_CAN_FINDING_FRAMES frames of 8 bytes say what a DBC can show
 *   0x380 + node  entry into an alarmed region: 8 bytes
 *   0x700 + node  heartbeat: 8 bytes, cyclic; only its absence shows that a node is dead
 *
 * Numbers are little-endian (Intel). lib/wire/rim.dbc describes all but the segments for other
 * programs. Every check sum covers the frame's identifier first, as two bytes, so that a frame
 * under another identifier is refused. Fields that do not fit saturate; sequence numbers and the
 * model's id are cut to their low bits. Byte offsets come first below, bits after a colon. */

/* clang-format off */
/* Summary:   0 level:2 state:2 detector:1 kind:3 | 1 seq | 2 model_id
 *            3..4 dims:2 latched:1 replay:1 ln_anom:12 (0.25) | 5..6 observations | 7 CRC-8
 * Command:   0 command | 1 seq | 2 model_id (0: any) | 3..6 0 | 7 CRC-8
 * Heartbeat: 0 level:2 replay:1 latched:1 acknowledged:1 | 1 sequence | 2 model_id
 *            3..4 observations (low bits: they count on) | 5 rejected | 6 dropped | 7 CRC-8
 * Entry:     0..1 time to entry (10 ms; 65534: that or more, 65535: does not enter) | 2 sequence
 *            3 alarm's seq | 4 plan's sequence | 5 model_id | 6 flags | 7 CRC-8
 * Finding:   0 page | 1 seq | 2..5 what the page says, see rim_can_page | 6 0 | 7 CRC-8
 * Segment:   ISO 15765-2 (ISO-TP) without flow control: first frame 0x10, length, six bytes of the
 *            record; then 0x21, 0x22 .. 0x2f, 0x20 .. and seven bytes
 * Record:    0 layout u8: 2 | 1 t_s f64 | 9 since_s f64 | 17 seq u32 | 21 model_id u32
 *            25 observations u32 | 29 detector u8 | 30 state u8 | 31 level u8 | 32 kind u8
 *            33 flags u8 | 34 channels u8 | 35 dims u8 | 36 channel u16[4] | 44 feature u16[3]
 *            50 shift f32[4] | 66 shift_sd f32[4] | 82 center f32[3] | 94 inverse_shape f32[9]
 *            130 lower f32[3] | 142 upper f32[3] | 154 ln_anom f32 | 158 threshold f32
 *            162 p_value f32 | 166 since_sd_s f32
 *            170 CRC-32 of the identifier as two bytes and bytes 0..169
 * FD:        0 as summary | 1 seq | 2..3 model_id | 4..7 t (ms) | 8..11 since (ms)
 *            12..15 observations | 16 dims:2 channels:3 latched:1 replay:1 | 17 0
 *            18..21 two channels | 22..27 three features | 28..31 shift (f32)
 *            32..35 its standard error | 36..47 lower | 48..59 upper (f32)
 *            60..61 ln_anom (1/16) | 62 -8 log2 p_value | 63 CRC-8 */
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
#define RIM_CAN_COMMAND_ID 0x200u
#define RIM_CAN_DETAIL_ID 0x280u
#define RIM_CAN_ENTRY_ID 0x380u
#define RIM_CAN_FINDING_ID 0x480u
#define RIM_CAN_HEARTBEAT_ID 0x700u
#define RIM_CAN_MAX_NODE 127u

#define RIM_CAN_DETAIL_LAYOUT 2u
#define RIM_CAN_DETAIL_SIZE 170u /* bytes of the record without its CRC-32 */
#define RIM_CAN_DETAIL_FRAMES 25u
#define RIM_CAN_FINDING_FRAMES 14u /* at most, of one record */

/* One frame. length 0..8, or up to 64 where fd; bytes beyond length are 0. */
typedef struct rim_can_frame {
  uint32_t id;
  uint8_t length;
  bool fd;
  uint8_t data[64];
} rim_can_frame;

typedef struct rim_can_summary {
  uint8_t node, level, state, detector, kind, flags;
  uint8_t seq, model_id; /* low bits */
  uint8_t dims;
  uint16_t observations; /* 65535: that many or more */
  double ln_anom;        /* 0..1023.75, steps of 0.25 */
} rim_can_summary;

typedef struct rim_can_heartbeat {
  uint8_t node, level, flags; /* flags: RIM_ALARM_FLAG_... */
  bool acknowledged;
  uint8_t sequence, model_id; /* low bits */
  uint16_t observations;      /* low bits */
  uint8_t rejected, dropped;  /* 255: that many or more */
} rim_can_heartbeat;

/* What a finding frame says: one number of the record, so that a table of signals (a DBC) shows the
 * finding on classic CAN. */
typedef enum rim_can_page {
  RIM_CAN_PAGE_OUTCOME = 0,  /* 2..3 channel[0]; 4 kind:3 dims:2 channels:3; 5 -8 log2 p_value */
  RIM_CAN_PAGE_SHIFT = 1,    /* 2..5 f32, in the outcome's unit: see rim_kind */
  RIM_CAN_PAGE_SHIFT_SD = 2, /* 2..5 f32 */
  RIM_CAN_PAGE_AGE = 3,      /* 2..5 u32, ms: time of the record less its onset */
  RIM_CAN_PAGE_AGE_SD = 4,   /* 2..5 f32, s; 0: not estimated */
  RIM_CAN_PAGE_FEATURE = 5,  /* of feature d of the region: + 3 d: 2..3 its index */
  RIM_CAN_PAGE_LOWER = 6,    /* + 3 d: 2..5 f32, of the box around the region */
  RIM_CAN_PAGE_UPPER = 7     /* + 3 d: 2..5 f32 */
} rim_can_page;

typedef struct rim_can_finding {
  uint8_t node, seq;            /* seq: low bits */
  uint8_t page;                 /* rim_can_page */
  uint8_t kind, dims, channels; /* page OUTCOME; else 0 */
  uint16_t index;               /* pages OUTCOME and FEATURE; else 0 */
  double value; /* of the other pages, AGE in s; of OUTCOME the p-value; of FEATURE 0 */
} rim_can_finding;

/* Each writes the frames of one record. RIM_E_ARGUMENT: NULL; RIM_E_RANGE: node above
 * RIM_CAN_MAX_NODE, or a count or code of the record out of range (FD: or a feature named twice);
 * RIM_E_DATA: a number is not finite. On an error nothing is written. A box too narrow for f32 is
 * widened to the next numbers. O(bytes); stack below 300 bytes. */
rim_status rim_can_pack_summary(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm);
rim_status rim_can_pack_detail(rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], uint32_t node,
                               const rim_alarm *alarm);
rim_status rim_can_pack_detail_fd(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm);
/* The pages of a record, 5 and 3 for each feature of its region; *count of them. */
rim_status rim_can_pack_finding(rim_can_frame frame[RIM_CAN_FINDING_FRAMES], uint32_t *count,
                                uint32_t node, const rim_alarm *alarm);

/* Each writes one frame. RIM_E_ARGUMENT: NULL; RIM_E_RANGE: node above RIM_CAN_MAX_NODE, or an
 * unknown command or level; RIM_E_DATA: a time to entry below 0 that is not RIM_ENTRY_NEVER.
 * On an error nothing is written. alarm_flags: RIM_ALARM_FLAG_... of the standing alarm;
 * acknowledged: as rim_alarm_status has it. O(1). */
rim_status rim_can_pack_command(rim_can_frame *frame, uint32_t node, const rim_command *in);
rim_status rim_can_pack_heartbeat(rim_can_frame *frame, uint32_t node, const rim_health_message *in,
                                  uint8_t alarm_flags, bool acknowledged);
rim_status rim_can_pack_entry(rim_can_frame *frame, uint32_t node, const rim_entry *entry);

/* Each reads one frame, of any node but for a command. RIM_E_ARGUMENT: NULL; RIM_E_MAGIC: an
 * identifier of another kind; RIM_E_TRUNCATED, RIM_E_SIZE: another length (summary and detail:
 * always RIM_E_SIZE); RIM_E_CRC: the frame is damaged; RIM_E_RANGE: a code is out of range. On an
 * error the result has no meaning. O(1).
 *
 * An FD detail holds less than the record. The region becomes the axis-aligned ellipsoid in the
 * box; threshold is 0; channels beyond the second and shifts beyond the first are lost (channels is
 * at most 2). RIM_E_DATA: a number is not finite, or the box has no interior. An entry and a
 * command hold the low bits of their numbers. In an entry t_s and pose are 0, and a to_entry_s of
 * 655.34 s means that or more. */
rim_status rim_can_unpack_summary(rim_can_summary *summary, const rim_can_frame *frame);
rim_status rim_can_unpack_finding(rim_can_finding *out, const rim_can_frame *frame);
rim_status rim_can_unpack_detail_fd(rim_alarm *alarm, const rim_can_frame *frame);
rim_status rim_can_unpack_command(rim_command *out, uint32_t node, const rim_can_frame *frame);
rim_status rim_can_unpack_heartbeat(rim_can_heartbeat *out, const rim_can_frame *frame);
rim_status rim_can_unpack_entry(rim_entry *entry, const rim_can_frame *frame);

/* Joins the segments of one node's records. All zero but for the node: nothing yet. */
typedef struct rim_can_assembly {
  uint8_t node;  /* whose frames are taken: set by the caller */
  uint8_t next;  /* index of the segment expected next; 0: a first segment */
  uint32_t lost; /* records given up: a segment missing, out of order or damaged; saturating */
  uint8_t data[RIM_CAN_DETAIL_SIZE + 4];
} rim_can_assembly;

/* Takes one segment. *complete becomes true when *alarm is a whole record; RIM_OK also for a
 * segment in the middle. RIM_E_ARGUMENT: NULL; RIM_E_MAGIC: not a segment, or of another node;
 * RIM_E_SIZE: not 8 bytes; RIM_E_VERSION: a first segment of another length; nothing changes on
 * these errors. RIM_E_TRUNCATED: a segment is missing or out of order (a first segment begins a new
 * record); RIM_E_CRC, RIM_E_RANGE, RIM_E_DATA, RIM_E_VERSION: the whole record is refused. On these
 * the record is given up and counted. O(1), and O(bytes) for the last segment. */
rim_status rim_can_take_detail(rim_can_assembly *assembly, const rim_can_frame *frame,
                               rim_alarm *alarm, bool *complete);

#ifdef __cplusplus
}
#endif
#endif
