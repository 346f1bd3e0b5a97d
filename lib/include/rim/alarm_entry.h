/* rim/alarm_entry.h - where the vehicle is going, and whether that leads into an alarmed region.
 *
 * LCM: the bytes of lcm-gen's encoders for lib/wire/rim_plan_t.lcm and rim_entry_t.lcm.
 * CAN, little-endian, check sum as in rim/alarm_can.h: 0x380 + node, 8 bytes:
 *   0..1 time to entry (10 ms; 65534: that or more, 65535: does not enter) | 2 sequence
 *   3 alarm's seq | 4 plan's sequence | 5 model_id | 6 flags | 7 CRC-8     (low bits) */
#ifndef RIM_ALARM_ENTRY_H
#define RIM_ALARM_ENTRY_H

#include <stddef.h>
#include <stdint.h>

#include "rim/alarm_can.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_LCM_CHANNEL_PLAN "RIM_PLAN"
#define RIM_LCM_CHANNEL_ENTRY "RIM_ENTRY"
#define RIM_CAN_ENTRY_ID 0x380u
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
rim_status rim_can_pack_entry(rim_can_frame *frame, uint32_t node, const rim_entry *entry);

/* Reads a frame of any node: the numbers become the low bits, the time 10 ms steps (655.34: that or
 * more), t_s and pose 0. RIM_E_ARGUMENT NULL; RIM_E_MAGIC another identifier; RIM_E_TRUNCATED,
 * RIM_E_SIZE not 8 bytes; RIM_E_CRC damaged. *entry has no meaning on error. O(1). */
rim_status rim_can_unpack_entry(rim_entry *entry, const rim_can_frame *frame);

#ifdef __cplusplus
}
#endif
#endif
