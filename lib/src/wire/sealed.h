/* SPDX-License-Identifier: MIT */
/* wire/sealed.h - private: where counter and tag stand in messages of a sender that has a key.
 *
 * Layout alone: who has the key (rimd, rim command) computes the tag, over all bytes before it; the
 * library knows no cipher. A sealed message is the plain one with a fingerprint of its own, then
 * the counter and the tag (lib/wire/rim_sealed_*_t.lcm). On CAN a frame of 8 bytes has no room for
 * them: a sealed command is one FD frame of 48 bytes under the identifier of commands:
 * 0 layout: 1 | 1 node | 2 command | 3 0 | 4..7 seq | 8..11 model_id | 12..19 counter
 * 20..35 tag | 36..46 0 | 47 CRC-8. Costs O(bytes). */
#ifndef RIM_WIRE_SEALED_H
#define RIM_WIRE_SEALED_H

#include "wire/message.h"

#define RIMI_TAG_BYTES 16u
#define RIMI_SEAL_BYTES (8u + RIMI_TAG_BYTES) /* what sealing adds to an LCM message */
#define RIMI_SEALED_FRAME_BYTES 48u
#define RIMI_SEALED_FRAME_BODY 20u /* authenticated; the tag follows */
#define RIMI_SEALED_FRAME_LAYOUT 1u

/* Fingerprints of a plain type and of its sealed one, and the length of the plain one. */
typedef struct rimi_sealed_type {
  uint64_t plain, sealed;
  size_t bytes;
} rimi_sealed_type;

static inline rimi_sealed_type rimi_sealed_command(void) {
  const rimi_sealed_type type = {UINT64_C(0xcc00c5ee86601789), UINT64_C(0xf07fc184ec6ad328),
                                 RIM_LCM_COMMAND_SIZE};
  return type;
}

static inline rimi_sealed_type rimi_sealed_observation(void) {
  const rimi_sealed_type type = {UINT64_C(0xefc23e26e7c61f20), UINT64_C(0x42399a362208529c),
                                 RIM_LCM_OBSERVATION_SIZE};
  return type;
}

/* Writes plain[0..type.bytes) as a sealed message of RIMI_SEAL_BYTES more, its tag zero, and
 * returns where the tag belongs. */
static inline uint8_t *rimi_lcm_seal(uint8_t *out, const uint8_t *plain, rimi_sealed_type type,
                                     uint64_t counter) {
  uint8_t *at = rimi_be_put_u64(out, type.sealed);
  memcpy(at, plain + 8, type.bytes - 8);
  at = rimi_be_put_u64(at + type.bytes - 8, counter);
  memset(at, 0, RIMI_TAG_BYTES);
  return at;
}

/* The plain message of type.bytes in a sealed one, its counter, and where its tag stands: the bytes
 * before it are authenticated by it. Returns as the unpack functions of rim/lcm.h; the contents are
 * for the plain type's own. */
static inline rim_status rimi_lcm_unseal(uint8_t *plain, const uint8_t *in, size_t bytes,
                                         rimi_sealed_type type, uint64_t *counter,
                                         const uint8_t **tag) {
  const rim_status status =
      check_message(plain, in, bytes, type.bytes + RIMI_SEAL_BYTES, type.sealed);
  if (status != RIM_OK)
    return status;
  memcpy(rimi_be_put_u64(plain, type.plain), in + 8, type.bytes - 8);
  *counter = rimi_be_u64(in + type.bytes);
  *tag = in + type.bytes + 8;
  return RIM_OK;
}

/* The frame without its tag: that is made over data[0..RIMI_SEALED_FRAME_BODY). */
static inline void rimi_can_seal(rim_can_frame *frame, uint32_t node, const rim_command *command,
                                 uint64_t counter) {
  begin_frame(frame, RIM_CAN_COMMAND_ID + node, RIMI_SEALED_FRAME_BYTES);
  frame->data[0] = RIMI_SEALED_FRAME_LAYOUT;
  frame->data[1] = (uint8_t)node;
  frame->data[2] = command->command;
  uint8_t *at = rimi_le_put_u32(frame->data + 4, command->sequence);
  (void)rimi_le_put_u64(rimi_le_put_u32(at, command->model_id), counter);
}

/* Puts the tag in. */
static inline void rimi_can_seal_finish(rim_can_frame *frame, const uint8_t *tag) {
  memcpy(frame->data + RIMI_SEALED_FRAME_BODY, tag, RIMI_TAG_BYTES);
  finish_frame(frame);
}

/* Returns as rim_can_unpack_command. The tag stands at data + RIMI_SEALED_FRAME_BODY. */
static inline rim_status rimi_can_unseal(rim_command *out, uint32_t node,
                                         const rim_can_frame *frame, uint64_t *counter) {
  if (frame->id != RIM_CAN_COMMAND_ID + node)
    return RIM_E_MAGIC;
  const rim_status status = check_frame(frame, RIMI_SEALED_FRAME_BYTES);
  if (status != RIM_OK)
    return status;
  if (frame->data[0] != RIMI_SEALED_FRAME_LAYOUT || frame->data[1] != node)
    return RIM_E_VERSION;
  out->command = frame->data[2];
  out->sequence = rimi_le_u32(frame->data, 1);
  out->model_id = rimi_le_u32(frame->data, 2);
  *counter = rimi_le_u64(frame->data + 12, 0);
  return out->command >= RIM_COMMAND_ACKNOWLEDGE && out->command <= RIM_COMMAND_DESCRIBE
             ? RIM_OK
             : RIM_E_RANGE;
}

#endif
