/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include <string.h>

#include "wire/message.h"

/* lcm-gen's fingerprints; test_entry holds them to the generated code. */
#define HASH_PLAN UINT64_C(0xa8d9218a1738b880)
#define HASH_ENTRY UINT64_C(0x38f2a03f923c1681)

#define NEVER_10MS 65535u
#define ENTRY_FRAME_SIZE 8u

/* Pose i of a message, whatever its bytes say. */
static rim_pose read_pose(const uint8_t *in, size_t i) {
  const uint8_t *after = in + 24;
  const uint8_t *position = after + 8 * RIM_PLAN_MAX_POSES;
  const uint8_t *orientation = position + 24 * RIM_PLAN_MAX_POSES;
  rim_pose p;
  p.after_s = rimi_be_f64(after + 8 * i);
  for (size_t k = 0; k < 3; ++k)
    p.position[k] = rimi_be_f64(position + 24 * i + 8 * k);
  for (size_t k = 0; k < 4; ++k)
    p.orientation[k] = rimi_be_f64(orientation + 32 * i + 8 * k);
  return p;
}

static bool is_pose(const rim_pose *p) {
  double length2 = 0.0;
  for (size_t k = 0; k < 4; ++k)
    length2 += p->orientation[k] * p->orientation[k];
  for (size_t k = 0; k < 3; ++k)
    if (!rimi_is_finite(p->position[k]))
      return false;
  return rimi_is_finite(p->after_s) && length2 > 0.98 && length2 < 1.02;
}

static rim_status check_poses(const uint8_t *in, uint32_t count) {
  double before_s = 0.0;
  for (uint32_t i = 0; i < count; ++i) {
    const rim_pose p = read_pose(in, i);
    if (!is_pose(&p) || (i > 0 && p.after_s < before_s))
      return RIM_E_DATA;
    before_s = p.after_s;
  }
  return RIM_OK;
}

rim_status rim_lcm_unpack_plan(rim_plan *plan, const uint8_t *in, size_t bytes) {
  rim_status status = check_message(plan, in, bytes, RIM_LCM_PLAN_SIZE, HASH_PLAN);
  if (status != RIM_OK)
    return status;
  const uint32_t count = rimi_be_u32(in + 20);
  if (count == 0 || count > RIM_PLAN_MAX_POSES)
    return RIM_E_RANGE;
  status = check_poses(in, count); /* all of it, before anything of the plan before is gone */
  if (status != RIM_OK)
    return status;
  memset(plan, 0, sizeof *plan);
  plan->t_us = (int64_t)rimi_be_u64(in + 8);
  plan->sequence = rimi_be_u32(in + 16);
  plan->count = count;
  for (uint32_t i = 0; i < count; ++i)
    plan->pose[i] = read_pose(in, i);
  return RIM_OK;
}

rim_status rim_lcm_pack_plan(uint8_t *out, size_t bytes, const rim_plan *plan) {
  if (out == NULL || plan == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_PLAN_SIZE)
    return RIM_E_SIZE;
  if (plan->count == 0 || plan->count > RIM_PLAN_MAX_POSES)
    return RIM_E_RANGE;
  uint8_t *at = rimi_be_put_u64(out, HASH_PLAN);
  at = rimi_be_put_u64(at, (uint64_t)plan->t_us);
  at = rimi_be_put_u32(at, plan->sequence);
  at = rimi_be_put_u32(at, plan->count);
  memset(at, 0, RIM_LCM_PLAN_SIZE - 24);
  uint8_t *position = at + 8 * RIM_PLAN_MAX_POSES;
  uint8_t *orientation = position + 24 * RIM_PLAN_MAX_POSES;
  for (uint32_t i = 0; i < plan->count; ++i) {
    const rim_pose *p = &plan->pose[i];
    at = rimi_be_put_f64(at, p->after_s);
    for (size_t k = 0; k < 3; ++k)
      position = rimi_be_put_f64(position, p->position[k]);
    for (size_t k = 0; k < 4; ++k)
      orientation = rimi_be_put_f64(orientation, p->orientation[k]);
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
  uint8_t *at = rimi_be_put_u64(out, HASH_ENTRY);
  at = rimi_be_put_f64(at, entry->t_s);
  at = rimi_be_put_f64(at, entry->to_entry_s);
  at = rimi_be_put_u32(at, entry->sequence);
  at = rimi_be_put_u32(at, entry->alarm_sequence);
  at = rimi_be_put_u32(at, entry->plan_sequence);
  at = rimi_be_put_u32(at, entry->model_id);
  at = rimi_be_put_u32(at, entry->pose);
  at[0] = entry->flags;
  return RIM_OK;
}

rim_status rim_lcm_unpack_entry(rim_entry *entry, const uint8_t *in, size_t bytes) {
  const rim_status status = check_message(entry, in, bytes, RIM_LCM_ENTRY_SIZE, HASH_ENTRY);
  if (status != RIM_OK)
    return status;
  entry->t_s = rimi_be_f64(in + 8);
  entry->to_entry_s = rimi_be_f64(in + 16);
  entry->sequence = rimi_be_u32(in + 24);
  entry->alarm_sequence = rimi_be_u32(in + 28);
  entry->plan_sequence = rimi_be_u32(in + 32);
  entry->model_id = rimi_be_u32(in + 36);
  entry->pose = rimi_be_u32(in + 40);
  entry->flags = in[44];
  return is_entry(entry) ? RIM_OK : RIM_E_DATA;
}

rim_status rim_can_pack_entry(rim_can_frame *frame, uint32_t node, const rim_entry *entry) {
  if (frame == NULL || entry == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE)
    return RIM_E_RANGE;
  if (!is_entry(entry))
    return RIM_E_DATA;
  begin_frame(frame, RIM_CAN_ENTRY_ID + node, ENTRY_FRAME_SIZE);
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
  finish_frame(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_entry(rim_entry *entry, const rim_can_frame *frame) {
  if (entry == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  if (frame->id < RIM_CAN_ENTRY_ID || frame->id - RIM_CAN_ENTRY_ID > RIM_CAN_MAX_NODE)
    return RIM_E_MAGIC;
  const rim_status status = check_frame(frame, ENTRY_FRAME_SIZE);
  if (status != RIM_OK)
    return status;
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
