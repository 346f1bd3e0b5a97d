/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include <string.h>

#include "base/crc.h"
#include "base/real.h"

/* lcm-gen's fingerprints; test_alarm_entry holds them to the generated code. */
#define HASH_PLAN UINT64_C(0xa8d9218a1738b880)
#define HASH_ENTRY UINT64_C(0x38f2a03f923c1681)

#define NEVER_10MS 65535u

/* Big-endian, as LCM has it. */
static uint8_t *put_u32(uint8_t *at, uint32_t value) {
  for (unsigned i = 0; i < 4; i++)
    at[i] = (uint8_t)(value >> (24u - 8u * i));
  return at + 4;
}

static uint8_t *put_u64(uint8_t *at, uint64_t value) {
  return put_u32(put_u32(at, (uint32_t)(value >> 32)), (uint32_t)value);
}

static uint8_t *put_f64(uint8_t *at, double value) { return put_u64(at, rimi_bits(value)); }

static uint32_t get_u32(const uint8_t *at) {
  return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

static uint64_t get_u64(const uint8_t *at) { return (uint64_t)get_u32(at) << 32 | get_u32(at + 4); }

static double get_f64(const uint8_t *at) { return rimi_from_bits(get_u64(at)); }

static rim_status check_message(const uint8_t *in, size_t bytes, size_t size, uint64_t hash) {
  if (bytes < size)
    return RIM_E_TRUNCATED;
  if (get_u64(in) != hash)
    return RIM_E_MAGIC;
  return bytes > size ? RIM_E_SIZE : RIM_OK;
}

static rim_status check_poses(const rim_plan *plan) {
  for (uint32_t i = 0; i < plan->count; i++) {
    const rim_pose *p = &plan->pose[i];
    double length2 = 0.0;
    for (size_t k = 0; k < 4; k++)
      length2 += p->orientation[k] * p->orientation[k];
    for (size_t k = 0; k < 3; k++)
      if (!rimi_is_finite(p->position[k]))
        return RIM_E_DATA;
    if (!rimi_is_finite(p->after_s) || !(length2 > 0.98 && length2 < 1.02) ||
        (i > 0 && p->after_s < plan->pose[i - 1].after_s))
      return RIM_E_DATA;
  }
  return RIM_OK;
}

rim_status rim_lcm_unpack_plan(rim_plan *plan, const uint8_t *in, size_t bytes) {
  if (plan == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_message(in, bytes, RIM_LCM_PLAN_SIZE, HASH_PLAN);
  if (status != RIM_OK)
    return status;
  memset(plan, 0, sizeof *plan);
  plan->t_us = (int64_t)get_u64(in + 8);
  plan->sequence = get_u32(in + 16);
  plan->count = get_u32(in + 20);
  if (plan->count == 0 || plan->count > RIM_PLAN_MAX_POSES)
    return RIM_E_RANGE;
  const uint8_t *after = in + 24;
  const uint8_t *position = after + 8 * RIM_PLAN_MAX_POSES;
  const uint8_t *orientation = position + 24 * RIM_PLAN_MAX_POSES;
  for (uint32_t i = 0; i < plan->count; i++) {
    rim_pose *p = &plan->pose[i];
    p->after_s = get_f64(after + 8 * (size_t)i);
    for (size_t k = 0; k < 3; k++)
      p->position[k] = get_f64(position + 24 * (size_t)i + 8 * k);
    for (size_t k = 0; k < 4; k++)
      p->orientation[k] = get_f64(orientation + 32 * (size_t)i + 8 * k);
  }
  return check_poses(plan);
}

rim_status rim_lcm_pack_plan(uint8_t *out, size_t bytes, const rim_plan *plan) {
  if (out == NULL || plan == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_PLAN_SIZE)
    return RIM_E_SIZE;
  if (plan->count == 0 || plan->count > RIM_PLAN_MAX_POSES)
    return RIM_E_RANGE;
  uint8_t *at = put_u64(out, HASH_PLAN);
  at = put_u64(at, (uint64_t)plan->t_us);
  at = put_u32(at, plan->sequence);
  at = put_u32(at, plan->count);
  memset(at, 0, RIM_LCM_PLAN_SIZE - 24);
  uint8_t *position = at + 8 * RIM_PLAN_MAX_POSES;
  uint8_t *orientation = position + 24 * RIM_PLAN_MAX_POSES;
  for (uint32_t i = 0; i < plan->count; i++) {
    const rim_pose *p = &plan->pose[i];
    at = put_f64(at, p->after_s);
    for (size_t k = 0; k < 3; k++)
      position = put_f64(position, p->position[k]);
    for (size_t k = 0; k < 4; k++)
      orientation = put_f64(orientation, p->orientation[k]);
  }
  return RIM_OK;
}

static bool is_entry(const rim_entry *e) {
  return rimi_is_finite(e->t_s) && rimi_is_finite(e->to_entry_s) &&
         (e->to_entry_s >= 0.0 ||
          !(e->to_entry_s > RIM_ENTRY_NEVER || e->to_entry_s < RIM_ENTRY_NEVER));
}

rim_status rim_lcm_pack_entry(uint8_t *out, size_t bytes, const rim_entry *entry) {
  if (out == NULL || entry == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_ENTRY_SIZE)
    return RIM_E_SIZE;
  if (!is_entry(entry))
    return RIM_E_DATA;
  uint8_t *at = put_u64(out, HASH_ENTRY);
  at = put_f64(at, entry->t_s);
  at = put_f64(at, entry->to_entry_s);
  at = put_u32(at, entry->sequence);
  at = put_u32(at, entry->alarm_sequence);
  at = put_u32(at, entry->plan_sequence);
  at = put_u32(at, entry->model_id);
  at = put_u32(at, entry->pose);
  at[0] = entry->flags;
  return RIM_OK;
}

rim_status rim_lcm_unpack_entry(rim_entry *entry, const uint8_t *in, size_t bytes) {
  if (entry == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_message(in, bytes, RIM_LCM_ENTRY_SIZE, HASH_ENTRY);
  if (status != RIM_OK)
    return status;
  entry->t_s = get_f64(in + 8);
  entry->to_entry_s = get_f64(in + 16);
  entry->sequence = get_u32(in + 24);
  entry->alarm_sequence = get_u32(in + 28);
  entry->plan_sequence = get_u32(in + 32);
  entry->model_id = get_u32(in + 36);
  entry->pose = get_u32(in + 40);
  entry->flags = in[44];
  return is_entry(entry) ? RIM_OK : RIM_E_DATA;
}

static uint8_t check_sum(const rim_can_frame *frame) {
  const uint8_t name[2] = {(uint8_t)frame->id, (uint8_t)(frame->id >> 8)};
  return rimi_crc8(rimi_crc8(0, name, sizeof name), frame->data, 7);
}

rim_status rim_can_pack_entry(rim_can_frame *frame, uint32_t node, const rim_entry *entry) {
  if (frame == NULL || entry == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE)
    return RIM_E_RANGE;
  if (!is_entry(entry))
    return RIM_E_DATA;
  memset(frame, 0, sizeof *frame);
  frame->id = RIM_CAN_ENTRY_ID + node;
  frame->length = 8;
  const uint32_t time = entry->to_entry_s < 0.0 ? NEVER_10MS
                                                : (uint32_t)rimi_clamp(entry->to_entry_s * 100.0,
                                                                       0.0, NEVER_10MS - 1.0);
  const uint8_t data[7] = {(uint8_t)time,
                           (uint8_t)(time >> 8),
                           (uint8_t)entry->sequence,
                           (uint8_t)entry->alarm_sequence,
                           (uint8_t)entry->plan_sequence,
                           (uint8_t)entry->model_id,
                           entry->flags};
  memcpy(frame->data, data, sizeof data);
  frame->data[7] = check_sum(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_entry(rim_entry *entry, const rim_can_frame *frame) {
  if (entry == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  if (frame->id < RIM_CAN_ENTRY_ID || frame->id - RIM_CAN_ENTRY_ID > RIM_CAN_MAX_NODE)
    return RIM_E_MAGIC;
  if (frame->length != 8)
    return frame->length < 8 ? RIM_E_TRUNCATED : RIM_E_SIZE;
  if (frame->data[7] != check_sum(frame))
    return RIM_E_CRC;
  const uint32_t time = frame->data[0] | (uint32_t)frame->data[1] << 8;
  memset(entry, 0, sizeof *entry);
  entry->to_entry_s = time == NEVER_10MS ? RIM_ENTRY_NEVER : 0.01 * time;
  entry->sequence = frame->data[2];
  entry->alarm_sequence = frame->data[3];
  entry->plan_sequence = frame->data[4];
  entry->model_id = frame->data[5];
  entry->flags = frame->data[6];
  return RIM_OK;
}
