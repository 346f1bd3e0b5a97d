/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include <string.h>

#include "wire/message.h"

/* lcm-gen's fingerprints; test_control holds them to the generated code. */
#define HASH_COMMAND UINT64_C(0xcc00c5ee86601789)
#define HASH_COUNTERS UINT64_C(0x58e3031b5a5c3ef2)

#define FRAME_SIZE 8u
#define HEART_REPLAY 0x04u /* bits of the heartbeat's byte 0 */
#define HEART_LATCHED 0x08u
#define HEART_ACKNOWLEDGED 0x10u

_Static_assert(sizeof(rim_counters) == 4u * RIM_COUNTERS_FIELDS, "nothing but 32-bit counters");
_Static_assert(RIM_LCM_COUNTERS_SIZE == 8u + 4u * RIM_COUNTERS_FIELDS, "one message, all counters");

static bool is_command(uint8_t code) {
  return code >= RIM_COMMAND_ACKNOWLEDGE && code <= RIM_COMMAND_DESCRIBE;
}

rim_status rim_lcm_pack_command(uint8_t *out, size_t bytes, const rim_command *in) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_COMMAND_SIZE)
    return RIM_E_SIZE;
  if (!is_command(in->command))
    return RIM_E_RANGE;
  uint8_t *at = rimi_be_put_u64(out, HASH_COMMAND);
  at = rimi_be_put_u32(at, in->sequence);
  at = rimi_be_put_u32(at, in->model_id);
  at[0] = in->command;
  return RIM_OK;
}

rim_status rim_lcm_unpack_command(rim_command *out, const uint8_t *in, size_t bytes) {
  const rim_status status = check_message(out, in, bytes, RIM_LCM_COMMAND_SIZE, HASH_COMMAND);
  if (status != RIM_OK)
    return status;
  out->sequence = rimi_be_u32(in + 8);
  out->model_id = rimi_be_u32(in + 12);
  out->command = in[16];
  return is_command(out->command) ? RIM_OK : RIM_E_RANGE;
}

rim_status rim_lcm_pack_counters(uint8_t *out, size_t bytes, const rim_counters *in) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_COUNTERS_SIZE)
    return RIM_E_SIZE;
  uint32_t value[RIM_COUNTERS_FIELDS];
  memcpy(value, in, sizeof value);
  uint8_t *at = rimi_be_put_u64(out, HASH_COUNTERS);
  for (size_t i = 0; i < RIM_COUNTERS_FIELDS; ++i)
    at = rimi_be_put_u32(at, value[i]);
  return RIM_OK;
}

rim_status rim_lcm_unpack_counters(rim_counters *out, const uint8_t *in, size_t bytes) {
  const rim_status status = check_message(out, in, bytes, RIM_LCM_COUNTERS_SIZE, HASH_COUNTERS);
  if (status != RIM_OK)
    return status;
  uint32_t value[RIM_COUNTERS_FIELDS];
  for (size_t i = 0; i < RIM_COUNTERS_FIELDS; ++i)
    value[i] = rimi_be_u32(in + 8 + 4 * i);
  memcpy(out, value, sizeof value);
  return RIM_OK;
}

const char *rim_counters_name(uint32_t i) {
  static const char name[RIM_COUNTERS_FIELDS][18] = {
      "sequence",      "rows",        "wrong_length", "not_finite",       "time_back",
      "future",        "gaps",        "incomplete",   "clock_resets",     "stale",
      "overruns",      "step_us",     "commands",     "commands_refused", "lcm_malformed",
      "lcm_fragments", "lcm_other",   "lcm_refused",  "lcm_unsent",       "can_frames",
      "can_other",     "can_refused", "can_errors",   "can_bus_off",      "can_down",
      "can_full",      "can_unsent",  "input_lost",   "state_failures",   "restarts",
      "state_refused"};
  return i < RIM_COUNTERS_FIELDS ? name[i] : NULL;
}

uint32_t rim_counters_value(const rim_counters *counters, uint32_t i) {
  uint32_t value[RIM_COUNTERS_FIELDS];
  if (counters == NULL || i >= RIM_COUNTERS_FIELDS)
    return 0;
  memcpy(value, counters, sizeof value);
  return value[i];
}

rim_status rim_can_pack_command(rim_can_frame *frame, uint32_t node, const rim_command *in) {
  if (frame == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE || !is_command(in->command))
    return RIM_E_RANGE;
  begin_frame(frame, RIM_CAN_COMMAND_ID + node, FRAME_SIZE);
  frame->data[0] = in->command;
  frame->data[1] = (uint8_t)in->sequence;
  frame->data[2] = (uint8_t)in->model_id;
  finish_frame(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_command(rim_command *out, uint32_t node, const rim_can_frame *frame) {
  if (out == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE || frame->id != RIM_CAN_COMMAND_ID + node)
    return RIM_E_MAGIC;
  const rim_status status = check_frame(frame, FRAME_SIZE);
  if (status != RIM_OK)
    return status;
  out->command = frame->data[0];
  out->sequence = frame->data[1];
  out->model_id = frame->data[2];
  return is_command(out->command) ? RIM_OK : RIM_E_RANGE;
}

static uint8_t saturated(uint32_t count) { return (uint8_t)(count < 255u ? count : 255u); }

rim_status rim_can_pack_heartbeat(rim_can_frame *frame, uint32_t node, const rim_health_message *in,
                                  uint8_t alarm_flags, bool acknowledged) {
  if (frame == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (node > RIM_CAN_MAX_NODE || in->level > RIM_LEVEL_STALE)
    return RIM_E_RANGE;
  begin_frame(frame, RIM_CAN_HEARTBEAT_ID + node, FRAME_SIZE);
  uint8_t *data = frame->data;
  data[0] = (uint8_t)(in->level | ((in->flags & RIM_HEALTH_FLAG_REPLAY) != 0 ? HEART_REPLAY : 0u) |
                      ((alarm_flags & RIM_ALARM_FLAG_LATCHED) != 0 ? HEART_LATCHED : 0u) |
                      (acknowledged ? HEART_ACKNOWLEDGED : 0u));
  data[1] = (uint8_t)in->sequence;
  data[2] = (uint8_t)in->model_id;
  data[3] = (uint8_t)in->observations;
  data[4] = (uint8_t)(in->observations >> 8);
  data[5] = saturated(in->rejected);
  data[6] = saturated(in->dropped);
  finish_frame(frame);
  return RIM_OK;
}

rim_status rim_can_unpack_heartbeat(rim_can_heartbeat *out, const rim_can_frame *frame) {
  if (out == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  if (frame->id < RIM_CAN_HEARTBEAT_ID || frame->id - RIM_CAN_HEARTBEAT_ID > RIM_CAN_MAX_NODE)
    return RIM_E_MAGIC;
  const rim_status status = check_frame(frame, FRAME_SIZE);
  if (status != RIM_OK)
    return status;
  const uint8_t *data = frame->data;
  out->node = (uint8_t)(frame->id - RIM_CAN_HEARTBEAT_ID);
  out->level = data[0] & 3u;
  out->flags = (uint8_t)(((data[0] & HEART_REPLAY) != 0 ? RIM_ALARM_FLAG_REPLAY : 0u) |
                         ((data[0] & HEART_LATCHED) != 0 ? RIM_ALARM_FLAG_LATCHED : 0u));
  out->acknowledged = (data[0] & HEART_ACKNOWLEDGED) != 0;
  out->sequence = data[1];
  out->model_id = data[2];
  out->observations = (uint16_t)(data[3] | (uint32_t)data[4] << 8);
  out->rejected = data[5];
  out->dropped = data[6];
  return RIM_OK;
}
