/* SPDX-License-Identifier: MIT */
/* wire/message.h - private: what messages and frames share: what makes an alarm record well formed,
 * the beginning and length of an LCM message, the check sum of a CAN frame. */
#ifndef RIM_WIRE_MESSAGE_H
#define RIM_WIRE_MESSAGE_H

#include <float.h>
#include <string.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "base/real.h"
#include "base/usable.h"
#include "rim/alarm.h"
#include "rim/can.h"

static inline bool alarm_codes_in_range(const rim_alarm *a) {
  return a->detector <= RIM_DETECTOR_INTERFERENCE && a->state <= RIM_ALARM_CLEARED &&
         a->level <= RIM_LEVEL_STALE && a->kind <= RIM_KIND_PUSHED &&
         a->channels <= RIM_ALARM_MAX_CHANNELS && a->region.dims <= RIM_REGION_MAX_DIMS;
}

/* Every number that the record uses or that a reader might show. */
static inline bool alarm_is_finite(const rim_alarm *a) {
  const double single[6] = {a->t_s,     a->since_s,   a->since_sd_s,
                            a->ln_anom, a->threshold, a->p_value};
  return all_finite(single, 6) && all_finite(a->shift, RIM_ALARM_MAX_CHANNELS) &&
         all_finite(a->shift_sd, RIM_ALARM_MAX_CHANNELS) &&
         all_finite(a->region.center, RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.lower, RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.upper, RIM_REGION_MAX_DIMS);
}

#define ALARM_CODE_BYTES 7u

/* The codes of a record, a byte each, in the order of every message. */
static inline uint8_t *put_alarm_codes(uint8_t *at, const rim_alarm *a) {
  const uint8_t code[ALARM_CODE_BYTES] = {a->detector, a->state,    a->level,      a->kind,
                                          a->flags,    a->channels, a->region.dims};
  memcpy(at, code, sizeof code);
  return at + sizeof code;
}

static inline const uint8_t *get_alarm_codes(const uint8_t *at, rim_alarm *a) {
  a->detector = at[0];
  a->state = at[1];
  a->level = at[2];
  a->kind = at[3];
  a->flags = at[4];
  a->channels = at[5];
  a->region.dims = at[6];
  return at + ALARM_CODE_BYTES;
}

/* What a record that was read is. */
static inline rim_status check_alarm(const rim_alarm *a) {
  if (!alarm_codes_in_range(a))
    return RIM_E_RANGE;
  return alarm_is_finite(a) ? RIM_OK : RIM_E_DATA;
}

/* Whether `in` is an LCM message of the type with this fingerprint and size: another type is
 * RIM_E_MAGIC whatever its length, unless there are not even the 8 bytes of a fingerprint.
 * RIM_E_ARGUMENT: it is NULL, or `out`, where its contents go. */
static inline rim_status check_message(const void *out, const uint8_t *in, size_t bytes,
                                       size_t size, uint64_t fingerprint) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < 8)
    return RIM_E_TRUNCATED;
  if (rimi_be_u64(in) != fingerprint)
    return RIM_E_MAGIC;
  if (bytes != size)
    return bytes < size ? RIM_E_TRUNCATED : RIM_E_SIZE;
  return RIM_OK;
}

/* CRC-8 of a frame's identifier and all of its bytes but the last, which holds it. */
static inline uint8_t frame_crc8(const rim_can_frame *frame) {
  uint8_t name[2];
  (void)rimi_le_put_u16(name, frame->id);
  return rimi_crc8(rimi_crc8(0, name, sizeof name), frame->data, frame->length - 1u);
}

static inline void begin_frame(rim_can_frame *frame, uint32_t id, uint8_t length) {
  memset(frame, 0, sizeof *frame);
  frame->id = id;
  frame->length = length;
  frame->fd = length > 8u;
}

static inline void finish_frame(rim_can_frame *frame) {
  frame->data[frame->length - 1u] = frame_crc8(frame);
}

/* Length and check sum of a received frame. */
static inline rim_status check_frame(const rim_can_frame *frame, uint8_t length) {
  if (frame->length != length)
    return frame->length < length ? RIM_E_TRUNCATED : RIM_E_SIZE;
  return frame->data[length - 1u] == frame_crc8(frame) ? RIM_OK : RIM_E_CRC;
}

/* Saturates: a double beyond the range of float has no conversion. */
static inline float as_f32(double x) {
  return (float)rimi_clamp(x, -(double)FLT_MAX, (double)FLT_MAX);
}

static inline uint8_t *put_f32(uint8_t *at, const double *value, size_t count) {
  for (size_t i = 0; i < count; ++i)
    at = rimi_le_put_f32(at, as_f32(value[i]));
  return at;
}

static inline const uint8_t *get_f32(const uint8_t *at, double *value, size_t count) {
  for (size_t i = 0; i < count; i++, at += 4)
    value[i] = (double)rimi_le_f32(at, 0);
  return at;
}

/* x rounded into 0..limit; limit below 2^32. */
static inline uint32_t whole(double x, double limit) {
  return (uint32_t)rimi_floor(rimi_clamp(x, 0.0, limit) + 0.5);
}

static inline rim_status check_record(const void *frame, uint32_t node, const rim_alarm *alarm) {
  if (frame == NULL || alarm == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE || !alarm_codes_in_range(alarm))
    return RIM_E_RANGE;
  return alarm_is_finite(alarm) ? RIM_OK : RIM_E_DATA;
}

/* Identifier, length and check sum of a frame that any node may have sent. RIM_E_SIZE: any other
 * length. */
static inline rim_status check_sent(const rim_can_frame *frame, uint32_t first_id, uint8_t length) {
  if (frame->id < first_id || frame->id - first_id > RIM_CAN_MAX_NODE)
    return RIM_E_MAGIC;
  return frame->length != length ? RIM_E_SIZE : check_frame(frame, length);
}

static inline bool has_box(const rim_region *region) {
  for (uint8_t d = 0; d < region->dims; ++d)
    if (!(region->lower[d] < region->upper[d]))
      return false;
  return true;
}

/* The region's box as it was given, or computed where it was not. Bounds that would be one number
 * as f32 move out to the next ones, so that whoever reads them finds an interior. */
static inline rim_status box_of(rim_region *box, const rim_region *region) {
  *box = *region;
  if (!has_box(region) && rim_region_bounds(box) != RIM_OK)
    return RIM_E_DATA;
  for (uint8_t d = 0; d < box->dims; ++d) {
    const double both = (double)as_f32(box->lower[d]);
    const double step = rimi_abs(both) * (double)FLT_EPSILON + (double)FLT_MIN;
    if (both < (double)as_f32(box->upper[d]))
      continue;
    box->lower[d] = both - step;
    box->upper[d] = both + step;
  }
  return RIM_OK;
}

#endif
