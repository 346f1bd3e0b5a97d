/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include <float.h>
#include <string.h>

#include "base/crc.h"
#include "wire/alarm_bytes.h"

#define SUMMARY_SIZE 8u
#define FD_SIZE 64u
#define SEGMENT_BYTES 6u
#define LAST_SEGMENT 0x80u
#define FD_CHANNELS 2u
#define SUMMARY_LATCHED 4u /* bits of the word at byte 3 */
#define SUMMARY_REPLAY 8u
#define FD_LATCHED 0x20u /* bits of byte 16 */
#define FD_REPLAY 0x40u

_Static_assert((RIM_CAN_DETAIL_SIZE + 4 + SEGMENT_BYTES - 1) / SEGMENT_BYTES ==
                   RIM_CAN_DETAIL_FRAMES,
               "the frames hold the record and its check sum");

/* Little-endian writers and readers; each returns the place behind what it wrote or read. */
static uint8_t *put_u16(uint8_t *at, uint32_t value) {
  at[0] = (uint8_t)value;
  at[1] = (uint8_t)(value >> 8);
  return at + 2;
}

static uint8_t *put_u32(uint8_t *at, uint32_t value) {
  return put_u16(put_u16(at, value & 0xffffu), value >> 16);
}

/* Saturates: a double beyond the range of float has no conversion. */
static uint8_t *put_f32(uint8_t *at, const double *value, size_t count) {
  for (size_t i = 0; i < count; i++) {
    const float f = (float)rimi_clamp(value[i], -(double)FLT_MAX, (double)FLT_MAX);
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    at = put_u32(at, bits);
  }
  return at;
}

static uint8_t *put_f64(uint8_t *at, double value) {
  const uint64_t bits = rimi_bits(value);
  return put_u32(put_u32(at, (uint32_t)bits), (uint32_t)(bits >> 32));
}

static uint16_t get_u16(const uint8_t *at) { return (uint16_t)(at[0] | ((uint32_t)at[1] << 8)); }

static uint32_t get_u32(const uint8_t *at) {
  return get_u16(at) | ((uint32_t)get_u16(at + 2) << 16);
}

static const uint8_t *get_f32(const uint8_t *at, double *value, size_t count) {
  for (size_t i = 0; i < count; i++, at += 4) {
    const uint32_t bits = get_u32(at);
    float f;
    memcpy(&f, &bits, sizeof f);
    value[i] = (double)f;
  }
  return at;
}

static double get_f64(const uint8_t *at) {
  return rimi_from_bits(get_u32(at) | ((uint64_t)get_u32(at + 4) << 32));
}

/* x rounded into 0..limit; limit below 2^32. */
static uint32_t whole(double x, double limit) {
  return (uint32_t)rimi_floor(rimi_clamp(x, 0.0, limit) + 0.5);
}

static uint8_t frame_crc8(uint32_t id, const uint8_t *data, size_t bytes) {
  uint8_t name[2];
  put_u16(name, id);
  return rimi_crc8(rimi_crc8(0, name, sizeof name), data, bytes);
}

static uint32_t record_crc32(uint32_t id, const uint8_t *record) {
  uint8_t name[2];
  put_u16(name, id);
  return rimi_crc32(rimi_crc32(0, name, sizeof name), record, RIM_CAN_DETAIL_SIZE);
}

static rim_status check_record(const void *frame, uint32_t node, const rim_alarm *alarm) {
  if (frame == NULL || alarm == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE || !alarm_codes_in_range(alarm))
    return RIM_E_RANGE;
  return alarm_is_finite(alarm) ? RIM_OK : RIM_E_DATA;
}

static uint8_t head_of(const rim_alarm *a) {
  return (uint8_t)((uint32_t)a->level | ((uint32_t)a->state << 2) | ((uint32_t)a->detector << 4) |
                   ((uint32_t)a->kind << 5));
}

/* The flags as the bits that a frame has for them, and back. */
static uint32_t flag_bits(const rim_alarm *a, uint32_t latched, uint32_t replay) {
  return ((a->flags & RIM_ALARM_FLAG_LATCHED) != 0 ? latched : 0u) |
         ((a->flags & RIM_ALARM_FLAG_REPLAY) != 0 ? replay : 0u);
}

static uint8_t flags_of(uint32_t bits, uint32_t latched, uint32_t replay) {
  return (uint8_t)(((bits & latched) != 0 ? RIM_ALARM_FLAG_LATCHED : 0u) |
                   ((bits & replay) != 0 ? RIM_ALARM_FLAG_REPLAY : 0u));
}

rim_status rim_can_pack_summary(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm) {
  const rim_status status = check_record(frame, node, alarm);
  if (status != RIM_OK)
    return status;
  memset(frame, 0, sizeof *frame);
  frame->id = RIM_CAN_SUMMARY_ID + node;
  frame->length = SUMMARY_SIZE;
  uint8_t *data = frame->data;
  data[0] = head_of(alarm);
  data[1] = (uint8_t)alarm->seq;
  data[2] = (uint8_t)alarm->model_id;
  put_u16(data + 3, alarm->region.dims | flag_bits(alarm, SUMMARY_LATCHED, SUMMARY_REPLAY) |
                        (whole(alarm->ln_anom * 4.0, 4095.0) << 4));
  put_u16(data + 5, alarm->observations < 0xffffu ? alarm->observations : 0xffffu);
  data[7] = frame_crc8(frame->id, data, SUMMARY_SIZE - 1);
  return RIM_OK;
}

/* The checks that summary and FD detail share. */
static rim_status check_frame(const rim_can_frame *frame, uint32_t first_id, uint8_t length) {
  if (frame->id < first_id || frame->id - first_id > RIM_CAN_MAX_NODE)
    return RIM_E_MAGIC;
  if (frame->length != length)
    return RIM_E_SIZE;
  const uint8_t crc = frame_crc8(frame->id, frame->data, length - 1u);
  return crc == frame->data[length - 1u] ? RIM_OK : RIM_E_CRC;
}

rim_status rim_can_unpack_summary(rim_can_summary *summary, const rim_can_frame *frame) {
  if (summary == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_frame(frame, RIM_CAN_SUMMARY_ID, SUMMARY_SIZE);
  if (status != RIM_OK)
    return status;
  const uint8_t *data = frame->data;
  const uint32_t packed = get_u16(data + 3);
  summary->node = (uint8_t)(frame->id - RIM_CAN_SUMMARY_ID);
  summary->level = data[0] & 3u;
  summary->state = (data[0] >> 2) & 3u;
  summary->detector = (data[0] >> 4) & 1u;
  summary->kind = data[0] >> 5;
  summary->flags = flags_of(packed, SUMMARY_LATCHED, SUMMARY_REPLAY);
  summary->seq = data[1];
  summary->model_id = data[2];
  summary->dims = (uint8_t)(packed & 3u);
  summary->observations = get_u16(data + 5);
  summary->ln_anom = 0.25 * (double)(packed >> 4);
  return summary->kind <= RIM_KIND_PUSHED ? RIM_OK : RIM_E_RANGE;
}

/* The offsets are public: rim/can.h. */
static void put_record(uint8_t *at, const rim_alarm *a) {
  const rim_region *region = &a->region;
  const uint8_t code[7] = {a->detector, a->state,    a->level,    a->kind,
                           a->flags,    a->channels, region->dims};
  at = put_f64(at, a->t_s);
  at = put_f64(at, a->since_s);
  at = put_u32(at, a->seq);
  at = put_u32(at, a->model_id);
  at = put_u32(at, a->observations);
  memcpy(at, code, sizeof code);
  at += sizeof code;
  for (size_t i = 0; i < RIM_ALARM_MAX_CHANNELS; i++)
    at = put_u16(at, a->channel[i]);
  for (size_t i = 0; i < RIM_REGION_MAX_DIMS; i++)
    at = put_u16(at, region->feature[i]);
  at = put_f32(at, a->shift, RIM_ALARM_MAX_CHANNELS);
  at = put_f32(at, a->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = put_f32(at, region->center, RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->lower, RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->upper, RIM_REGION_MAX_DIMS);
  at = put_f32(at, &a->ln_anom, 1);
  at = put_f32(at, &a->threshold, 1);
  put_f32(at, &a->p_value, 1);
}

static rim_status get_record(rim_alarm *a, const uint8_t *at) {
  rim_region *region = &a->region;
  memset(a, 0, sizeof *a);
  a->t_s = get_f64(at);
  a->since_s = get_f64(at + 8);
  a->seq = get_u32(at + 16);
  a->model_id = get_u32(at + 20);
  a->observations = get_u32(at + 24);
  a->detector = at[28];
  a->state = at[29];
  a->level = at[30];
  a->kind = at[31];
  a->flags = at[32];
  a->channels = at[33];
  region->dims = at[34];
  at += 35;
  for (size_t i = 0; i < RIM_ALARM_MAX_CHANNELS; i++, at += 2)
    a->channel[i] = get_u16(at);
  for (size_t i = 0; i < RIM_REGION_MAX_DIMS; i++, at += 2)
    region->feature[i] = get_u16(at);
  at = get_f32(at, a->shift, RIM_ALARM_MAX_CHANNELS);
  at = get_f32(at, a->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = get_f32(at, region->center, RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->lower, RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->upper, RIM_REGION_MAX_DIMS);
  at = get_f32(at, &a->ln_anom, 1);
  at = get_f32(at, &a->threshold, 1);
  get_f32(at, &a->p_value, 1);
  if (!alarm_codes_in_range(a))
    return RIM_E_RANGE;
  return alarm_is_finite(a) ? RIM_OK : RIM_E_DATA;
}

rim_status rim_can_pack_detail(rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], uint32_t node,
                               const rim_alarm *alarm) {
  uint8_t record[SEGMENT_BYTES * RIM_CAN_DETAIL_FRAMES] = {0};
  const rim_status status = check_record(frame, node, alarm);
  if (status != RIM_OK)
    return status;
  put_record(record, alarm);
  put_u32(record + RIM_CAN_DETAIL_SIZE, record_crc32(RIM_CAN_DETAIL_ID + node, record));
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; i++) {
    memset(&frame[i], 0, sizeof frame[i]);
    frame[i].id = RIM_CAN_DETAIL_ID + node;
    frame[i].length = 8;
    frame[i].data[0] = (uint8_t)alarm->seq;
    frame[i].data[1] = (uint8_t)(i | (i + 1 == RIM_CAN_DETAIL_FRAMES ? LAST_SEGMENT : 0u));
    memcpy(frame[i].data + 2, record + SEGMENT_BYTES * i, SEGMENT_BYTES);
  }
  return RIM_OK;
}

static rim_status give_up(rim_can_assembly *assembly, rim_status why) {
  assembly->next = 0;
  if (assembly->lost < UINT32_MAX)
    assembly->lost++;
  return why;
}

rim_status rim_can_take_detail(rim_can_assembly *assembly, const rim_can_frame *frame,
                               rim_alarm *alarm, bool *complete) {
  if (assembly == NULL || frame == NULL || alarm == NULL || complete == NULL)
    return RIM_E_ARGUMENT;
  *complete = false;
  if (assembly->node > RIM_CAN_MAX_NODE || frame->id != RIM_CAN_DETAIL_ID + assembly->node)
    return RIM_E_MAGIC;
  if (frame->length != 8)
    return RIM_E_SIZE;
  const uint32_t index = frame->data[1] & (uint32_t)~LAST_SEGMENT;
  const bool last = (frame->data[1] & LAST_SEGMENT) != 0;
  rim_status status = RIM_OK;
  if (index == 0) {
    /* The one under way is lost, the new one begins. */
    if (assembly->next != 0)
      status = give_up(assembly, RIM_E_TRUNCATED);
    assembly->seq = frame->data[0];
  } else if (assembly->next == 0) {
    return RIM_E_TRUNCATED; /* its beginning was not heard, or it was given up: counted once */
  } else if (index != assembly->next || frame->data[0] != assembly->seq) {
    return give_up(assembly, RIM_E_TRUNCATED);
  }
  /* index < RIM_CAN_DETAIL_FRAMES: it equals next, which never passes the last. */
  if (last != (index + 1 == RIM_CAN_DETAIL_FRAMES))
    return give_up(assembly, RIM_E_RANGE);
  memcpy(assembly->data + SEGMENT_BYTES * index, frame->data + 2, SEGMENT_BYTES);
  assembly->next = (uint8_t)(index + 1);
  if (!last)
    return status;
  if (get_u32(assembly->data + RIM_CAN_DETAIL_SIZE) != record_crc32(frame->id, assembly->data))
    return give_up(assembly, RIM_E_CRC);
  status = get_record(alarm, assembly->data);
  if (status != RIM_OK)
    return give_up(assembly, status);
  assembly->next = 0;
  *complete = true;
  return RIM_OK;
}

/* The region's box as it was given, or computed where it was not. */
static rim_status box_of(rim_region *box, const rim_region *region) {
  *box = *region;
  for (uint8_t d = 0; d < region->dims; d++)
    if (!(region->lower[d] < region->upper[d]))
      return rim_region_bounds(box) == RIM_OK ? RIM_OK : RIM_E_DATA;
  return RIM_OK;
}

rim_status rim_can_pack_detail_fd(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm) {
  rim_region box;
  rim_status status = check_record(frame, node, alarm);
  if (status == RIM_OK)
    status = box_of(&box, &alarm->region);
  if (status != RIM_OK)
    return status;
  const uint32_t channels = alarm->channels < FD_CHANNELS ? alarm->channels : FD_CHANNELS;
  const double bits = alarm->p_value > 0.0 ? -rimi_log(alarm->p_value) * (8.0 / RIM_LN_2) : 255.0;
  memset(frame, 0, sizeof *frame);
  frame->id = RIM_CAN_DETAIL_ID + node;
  frame->length = FD_SIZE;
  frame->fd = true;
  uint8_t *data = frame->data;
  data[0] = head_of(alarm);
  data[1] = (uint8_t)alarm->seq;
  uint8_t *at = put_u16(data + 2, alarm->model_id & 0xffffu);
  at = put_u32(at, whole(alarm->t_s * 1000.0, 4294967294.0));
  at = put_u32(at, whole(alarm->since_s * 1000.0, 4294967294.0));
  at = put_u32(at, alarm->observations);
  at = put_u16(at, box.dims | (channels << 2) | flag_bits(alarm, FD_LATCHED, FD_REPLAY));
  for (uint32_t i = 0; i < FD_CHANNELS; i++)
    at = put_u16(at, i < channels ? alarm->channel[i] : 0u);
  for (uint32_t d = 0; d < RIM_REGION_MAX_DIMS; d++)
    at = put_u16(at, d < box.dims ? box.feature[d] : 0u);
  at = put_f32(at, alarm->shift, 1);
  at = put_f32(at, alarm->shift_sd, 1);
  at = put_f32(at, box.lower, RIM_REGION_MAX_DIMS);
  at = put_f32(at, box.upper, RIM_REGION_MAX_DIMS);
  at = put_u16(at, whole(alarm->ln_anom * 16.0, 65535.0));
  at[0] = (uint8_t)whole(bits, 255.0);
  at[1] = frame_crc8(frame->id, data, FD_SIZE - 1);
  return RIM_OK;
}

rim_status rim_can_unpack_detail_fd(rim_alarm *alarm, const rim_can_frame *frame) {
  uint16_t feature[RIM_REGION_MAX_DIMS];
  double bound[2 * RIM_REGION_MAX_DIMS];
  if (alarm == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_frame(frame, RIM_CAN_DETAIL_ID, FD_SIZE);
  if (status != RIM_OK)
    return status;
  const uint8_t *data = frame->data;
  memset(alarm, 0, sizeof *alarm);
  alarm->level = data[0] & 3u;
  alarm->state = (data[0] >> 2) & 3u;
  alarm->detector = (data[0] >> 4) & 1u;
  alarm->kind = data[0] >> 5;
  alarm->flags = flags_of(data[16], FD_LATCHED, FD_REPLAY);
  alarm->seq = data[1];
  alarm->model_id = get_u16(data + 2);
  alarm->t_s = (double)get_u32(data + 4) * 1e-3;
  alarm->since_s = (double)get_u32(data + 8) * 1e-3;
  alarm->observations = get_u32(data + 12);
  alarm->channels = (data[16] >> 2) & 7u;
  if (alarm->channels > FD_CHANNELS || alarm->kind > RIM_KIND_PUSHED)
    return RIM_E_RANGE;
  for (uint32_t i = 0; i < FD_CHANNELS; i++)
    alarm->channel[i] = get_u16(data + 18 + 2 * i);
  for (uint32_t d = 0; d < RIM_REGION_MAX_DIMS; d++)
    feature[d] = get_u16(data + 22 + 2 * d);
  get_f32(data + 28, alarm->shift, 1);
  get_f32(data + 32, alarm->shift_sd, 1);
  get_f32(data + 36, bound, 2 * RIM_REGION_MAX_DIMS);
  alarm->ln_anom = (double)get_u16(data + 60) / 16.0;
  alarm->p_value = rimi_exp((double)data[62] * (-RIM_LN_2 / 8.0));
  if (!alarm_is_finite(alarm))
    return RIM_E_DATA;
  return rimi_region_from_box(&alarm->region, data[16] & 3u, feature, bound,
                              bound + RIM_REGION_MAX_DIMS);
}
