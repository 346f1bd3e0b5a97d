/* SPDX-License-Identifier: MIT */
/* One more datagram of any 0..40 bytes for an assembly in any state that lcm_fragments_take can
 * have left: so whatever number of them. It leaves such a state again. With 2 messages of 16
 * bytes in 4 parts instead of 4 of 8192 in 64: nothing depends on how many. */
#include "any.h"

#define LCM_FRAGMENTS_MESSAGES 2u
#define LCM_FRAGMENTS_BYTES 16u
#define LCM_FRAGMENTS_PARTS 4u
#include "../../../firmware/transport/lcm_fragments.c"

static bool can_be(const lcm_fragments_message *m) {
  return m->total <= LCM_FRAGMENTS_BYTES && m->parts <= LCM_FRAGMENTS_PARTS &&
         (m->have == 0 || (m->total > 0 && m->parts > 0));
}

int main(void) {
  static lcm_fragments f;
  lcm_fragments_message any[2];
  uint8_t bytes[40];
  const size_t n = any_size(sizeof bytes);
  f.message[0] = any[0];
  f.message[1] = any[1];
  __ESBMC_assume(can_be(&f.message[0]) && can_be(&f.message[1]));
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  uint32_t lost = 0;
  if (lcm_fragments_take(&f, nondet_size(), bytes, n, &channel, &payload, &payload_bytes, &lost) ==
      LCM_FRAGMENTS_COMPLETE)
    __ESBMC_assert(payload_bytes <= LCM_FRAGMENTS_BYTES, "a payload of its size");
  __ESBMC_assert(can_be(&f.message[0]) && can_be(&f.message[1]), "a state as before");
  return 0;
}
