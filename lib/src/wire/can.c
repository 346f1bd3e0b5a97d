/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include <string.h>

#include "base/ellipsoid.h"
#include "wire/message.h"

#define SUMMARY_SIZE 8u
#define FD_SIZE 64u
#define FIRST_BYTES 6u /* of the record in the first segment, in every further one */
#define SEGMENT_BYTES 7u
#define RECORD_BYTES (RIM_CAN_DETAIL_SIZE + 4u)
#define FIRST_SEGMENT 0x10u /* ISO 15765-2: high bits of a frame's first byte */
#define NEXT_SEGMENT 0x20u
#define FD_CHANNELS 2u
#define SUMMARY_LATCHED 4u /* bits of the word at byte 3 */
#define SUMMARY_REPLAY 8u
#define FD_LATCHED 0x20u /* bits of byte 16 */
#define FD_REPLAY 0x40u
#define ANY_FEATURE 0x10000u /* every index that the frame has room for is below it */

_Static_assert(FIRST_BYTES + SEGMENT_BYTES * (RIM_CAN_DETAIL_FRAMES - 1u) == RECORD_BYTES,
               "the frames hold the record and its check sum, and no padding");

static uint32_t record_crc32(uint32_t id, const uint8_t *record) {
  uint8_t name[2];
  rimi_le_put_u16(name, id);
  return rimi_crc32(rimi_crc32(0, name, sizeof name), record, RIM_CAN_DETAIL_SIZE);
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
  begin_frame(frame, RIM_CAN_SUMMARY_ID + node, SUMMARY_SIZE);
  uint8_t *data = frame->data;
  data[0] = head_of(alarm);
  data[1] = (uint8_t)alarm->seq;
  data[2] = (uint8_t)alarm->model_id;
  rimi_le_put_u16(data + 3, alarm->region.dims | flag_bits(alarm, SUMMARY_LATCHED, SUMMARY_REPLAY) |
                                (whole(alarm->ln_anom * 4.0, 4095.0) << 4));
  rimi_le_put_u16(data + 5, alarm->observations < 0xffffu ? alarm->observations : 0xffffu);
  finish_frame(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_summary(rim_can_summary *summary, const rim_can_frame *frame) {
  if (summary == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_sent(frame, RIM_CAN_SUMMARY_ID, SUMMARY_SIZE);
  if (status != RIM_OK)
    return status;
  const uint8_t *data = frame->data;
  const uint32_t packed = rimi_le_u16(data + 3, 0);
  summary->node = (uint8_t)(frame->id - RIM_CAN_SUMMARY_ID);
  summary->level = data[0] & 3u;
  summary->state = (data[0] >> 2) & 3u;
  summary->detector = (data[0] >> 4) & 1u;
  summary->kind = data[0] >> 5;
  summary->flags = flags_of(packed, SUMMARY_LATCHED, SUMMARY_REPLAY);
  summary->seq = data[1];
  summary->model_id = data[2];
  summary->dims = (uint8_t)(packed & 3u);
  summary->observations = rimi_le_u16(data + 5, 0);
  summary->ln_anom = 0.25 * (double)(packed >> 4);
  return summary->kind <= RIM_KIND_PUSHED ? RIM_OK : RIM_E_RANGE;
}

/* The offsets are public: rim/can.h. */
static void put_record(uint8_t *at, const rim_alarm *a) {
  const rim_region *region = &a->region;
  at[0] = RIM_CAN_DETAIL_LAYOUT;
  at = rimi_le_put_f64(at + 1, a->t_s);
  at = rimi_le_put_f64(at, a->since_s);
  at = rimi_le_put_u32(at, a->seq);
  at = rimi_le_put_u32(at, a->model_id);
  at = rimi_le_put_u32(at, a->observations);
  at = put_alarm_codes(at, a);
  for (size_t i = 0; i < RIM_ALARM_MAX_CHANNELS; ++i)
    at = rimi_le_put_u16(at, a->channel[i]);
  for (size_t i = 0; i < RIM_REGION_MAX_DIMS; ++i)
    at = rimi_le_put_u16(at, region->feature[i]);
  at = put_f32(at, a->shift, RIM_ALARM_MAX_CHANNELS);
  at = put_f32(at, a->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = put_f32(at, region->center, RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->lower, RIM_REGION_MAX_DIMS);
  at = put_f32(at, region->upper, RIM_REGION_MAX_DIMS);
  at = put_f32(at, &a->ln_anom, 1);
  at = put_f32(at, &a->threshold, 1);
  at = put_f32(at, &a->p_value, 1);
  put_f32(at, &a->since_sd_s, 1);
}

static rim_status get_record(rim_alarm *a, const uint8_t *at) {
  rim_region *region = &a->region;
  if (at[0] != RIM_CAN_DETAIL_LAYOUT)
    return RIM_E_VERSION;
  at++;
  memset(a, 0, sizeof *a);
  a->t_s = rimi_le_f64(at, 0);
  a->since_s = rimi_le_f64(at + 8, 0);
  a->seq = rimi_le_u32(at + 16, 0);
  a->model_id = rimi_le_u32(at + 20, 0);
  a->observations = rimi_le_u32(at + 24, 0);
  at = get_alarm_codes(at + 28, a);
  for (size_t i = 0; i < RIM_ALARM_MAX_CHANNELS; i++, at += 2)
    a->channel[i] = rimi_le_u16(at, 0);
  for (size_t i = 0; i < RIM_REGION_MAX_DIMS; i++, at += 2)
    region->feature[i] = rimi_le_u16(at, 0);
  at = get_f32(at, a->shift, RIM_ALARM_MAX_CHANNELS);
  at = get_f32(at, a->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = get_f32(at, region->center, RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->lower, RIM_REGION_MAX_DIMS);
  at = get_f32(at, region->upper, RIM_REGION_MAX_DIMS);
  at = get_f32(at, &a->ln_anom, 1);
  at = get_f32(at, &a->threshold, 1);
  at = get_f32(at, &a->p_value, 1);
  get_f32(at, &a->since_sd_s, 1);
  return check_alarm(a);
}

rim_status rim_can_pack_detail(rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], uint32_t node,
                               const rim_alarm *alarm) {
  uint8_t record[RECORD_BYTES];
  const rim_status status = check_record(frame, node, alarm);
  if (status != RIM_OK)
    return status;
  put_record(record, alarm);
  rimi_le_put_u32(record + RIM_CAN_DETAIL_SIZE, record_crc32(RIM_CAN_DETAIL_ID + node, record));
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
    begin_frame(&frame[i], RIM_CAN_DETAIL_ID + node, 8);
  frame[0].data[0] = FIRST_SEGMENT | (RECORD_BYTES >> 8);
  frame[0].data[1] = RECORD_BYTES & 0xffu;
  memcpy(frame[0].data + 2, record, FIRST_BYTES);
  for (uint32_t i = 1; i < RIM_CAN_DETAIL_FRAMES; ++i) {
    frame[i].data[0] = (uint8_t)(NEXT_SEGMENT | (i & 15u));
    memcpy(frame[i].data + 1, record + FIRST_BYTES + SEGMENT_BYTES * (i - 1u), SEGMENT_BYTES);
  }
  return RIM_OK;
}

static rim_status give_up(rim_can_assembly *assembly, rim_status why) {
  assembly->next = 0;
  if (assembly->lost < UINT32_MAX)
    assembly->lost++;
  return why;
}

static rim_status take_first(rim_can_assembly *assembly, const uint8_t *data) {
  if (data[0] != (FIRST_SEGMENT | (RECORD_BYTES >> 8)) || data[1] != (RECORD_BYTES & 0xffu))
    return RIM_E_VERSION;
  /* The one under way is lost, the new one begins. */
  const rim_status status = assembly->next != 0 ? give_up(assembly, RIM_E_TRUNCATED) : RIM_OK;
  memcpy(assembly->data, data + 2, FIRST_BYTES);
  assembly->next = 1;
  return status;
}

static rim_status finish_record(rim_can_assembly *assembly, uint32_t id, rim_alarm *alarm) {
  if (rimi_le_u32(assembly->data + RIM_CAN_DETAIL_SIZE, 0) != record_crc32(id, assembly->data))
    return give_up(assembly, RIM_E_CRC);
  const rim_status status = get_record(alarm, assembly->data);
  if (status != RIM_OK)
    return give_up(assembly, status);
  assembly->next = 0;
  return RIM_OK;
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
  const uint8_t *data = frame->data;
  if ((data[0] & 0xf0u) == FIRST_SEGMENT)
    return take_first(assembly, data);
  if ((data[0] & 0xf0u) != NEXT_SEGMENT)
    return RIM_E_MAGIC;
  if (assembly->next == 0)
    return RIM_E_TRUNCATED; /* its beginning was not heard, or it was given up: counted once */
  if ((data[0] & 15u) != (assembly->next & 15u) || assembly->next >= RIM_CAN_DETAIL_FRAMES)
    return give_up(assembly, RIM_E_TRUNCATED);
  memcpy(assembly->data + FIRST_BYTES + SEGMENT_BYTES * (assembly->next - 1u), data + 1,
         SEGMENT_BYTES);
  if (++assembly->next < RIM_CAN_DETAIL_FRAMES)
    return RIM_OK;
  const rim_status status = finish_record(assembly, frame->id, alarm);
  *complete = status == RIM_OK;
  return status;
}

rim_status rim_can_pack_detail_fd(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm) {
  rim_region box;
  rim_status status = check_record(frame, node, alarm);
  if (status == RIM_OK)
    status = box_of(&box, &alarm->region);
  if (status == RIM_OK && !rimi_region_names_features(&box, ANY_FEATURE))
    status = RIM_E_RANGE; /* one twice: nobody could unpack it */
  if (status != RIM_OK)
    return status;
  const uint32_t channels = alarm->channels < FD_CHANNELS ? alarm->channels : FD_CHANNELS;
  const double bits = alarm->p_value > 0.0 ? -rimi_log(alarm->p_value) * (8.0 / RIM_LN_2) : 255.0;
  begin_frame(frame, RIM_CAN_DETAIL_ID + node, FD_SIZE);
  uint8_t *data = frame->data;
  data[0] = head_of(alarm);
  data[1] = (uint8_t)alarm->seq;
  uint8_t *at = rimi_le_put_u16(data + 2, alarm->model_id & 0xffffu);
  at = rimi_le_put_u32(at, whole(alarm->t_s * 1000.0, 4294967294.0));
  at = rimi_le_put_u32(at, whole(alarm->since_s * 1000.0, 4294967294.0));
  at = rimi_le_put_u32(at, alarm->observations);
  at = rimi_le_put_u16(at, box.dims | (channels << 2) | flag_bits(alarm, FD_LATCHED, FD_REPLAY));
  for (uint32_t i = 0; i < FD_CHANNELS; ++i)
    at = rimi_le_put_u16(at, i < channels ? alarm->channel[i] : 0u);
  for (uint32_t d = 0; d < RIM_REGION_MAX_DIMS; ++d)
    at = rimi_le_put_u16(at, d < box.dims ? box.feature[d] : 0u);
  at = put_f32(at, alarm->shift, 1);
  at = put_f32(at, alarm->shift_sd, 1);
  at = put_f32(at, box.lower, RIM_REGION_MAX_DIMS);
  at = put_f32(at, box.upper, RIM_REGION_MAX_DIMS);
  at = rimi_le_put_u16(at, whole(alarm->ln_anom * 16.0, 65535.0));
  at[0] = (uint8_t)whole(bits, 255.0);
  finish_frame(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_detail_fd(rim_alarm *alarm, const rim_can_frame *frame) {
  uint16_t feature[RIM_REGION_MAX_DIMS];
  double bound[2 * RIM_REGION_MAX_DIMS];
  if (alarm == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_sent(frame, RIM_CAN_DETAIL_ID, FD_SIZE);
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
  alarm->model_id = rimi_le_u16(data + 2, 0);
  alarm->t_s = (double)rimi_le_u32(data + 4, 0) * 1e-3;
  alarm->since_s = (double)rimi_le_u32(data + 8, 0) * 1e-3;
  alarm->observations = rimi_le_u32(data + 12, 0);
  alarm->channels = (data[16] >> 2) & 7u;
  if (alarm->channels > FD_CHANNELS || alarm->kind > RIM_KIND_PUSHED)
    return RIM_E_RANGE;
  for (uint32_t i = 0; i < FD_CHANNELS; ++i)
    alarm->channel[i] = rimi_le_u16(data + 18 + 2 * i, 0);
  for (uint32_t d = 0; d < RIM_REGION_MAX_DIMS; ++d)
    feature[d] = rimi_le_u16(data + 22 + 2 * d, 0);
  get_f32(data + 28, alarm->shift, 1);
  get_f32(data + 32, alarm->shift_sd, 1);
  get_f32(data + 36, bound, 2 * RIM_REGION_MAX_DIMS);
  alarm->ln_anom = (double)rimi_le_u16(data + 60, 0) / 16.0;
  alarm->p_value = rimi_exp((double)data[62] * (-RIM_LN_2 / 8.0));
  if (!alarm_is_finite(alarm))
    return RIM_E_DATA;
  return rimi_region_from_box(&alarm->region, data[16] & 3u, feature, bound,
                              bound + RIM_REGION_MAX_DIMS);
}
