/* SPDX-License-Identifier: MIT */
/* One more fragment of any bytes for messages under way in any state that lcm_fragments_take can
 * have left, so whatever number of fragments: every copy lies inside, and such a state is left
 * again. The copies themselves are checked and not carried out: their bytes are anything. */
#include "any.h"

#include <string.h>

static void checked_copy(void *to, const void *from, size_t bytes);
#define memcpy(to, from, bytes) checked_copy(to, from, bytes)
#include "../../../firmware/transport/lcm_fragments.c"

static lcm_fragments f;
static const uint8_t *datagram; /* of any bytes */
static size_t datagram_bytes;

static _Bool inside(const uint8_t *at, size_t bytes, const uint8_t *begin, size_t all) {
  return at >= begin && at <= begin + all && bytes <= (size_t)(begin + all - at);
}

static void checked_copy(void *to, const void *from, size_t bytes) {
  _Bool good = 0;
  for (uint32_t i = 0; i < LCM_FRAGMENTS_MESSAGES; i++)
    good = good || inside(to, bytes, f.message[i].data, LCM_FRAGMENTS_BYTES) ||
           inside(to, bytes, (const uint8_t *)f.message[i].channel, LCM_PACKET_MAX_CHANNEL + 1);
  __ESBMC_assert(good, "copied into the message");
  __ESBMC_assert(inside(from, bytes, datagram, datagram_bytes), "copied from the datagram");
}

/* What is so of every message under way. */
static _Bool holds(const lcm_fragments_message *m) {
  return m->have == 0 || (m->total > 0 && m->total <= LCM_FRAGMENTS_BYTES && m->parts > 0 &&
                          m->parts <= LCM_FRAGMENTS_PARTS);
}

uint64_t nondet_uint64(void);
uint32_t nondet_uint32(void);

int main(void) {
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  uint32_t lost = nondet_uint32();
  lcm_fragments any;
  uint8_t any_bytes[BYTES];
  f = any;
  datagram = any_bytes;
  for (uint32_t i = 0; i < LCM_FRAGMENTS_MESSAGES; i++)
    __ESBMC_assume(holds(&f.message[i]));
  datagram_bytes = any_size(BYTES);
  const lcm_fragments_answer answer =
      lcm_fragments_take(&f, nondet_uint64(), datagram, datagram_bytes, &channel, &payload,
                         &payload_bytes, &lost);
  if (answer == LCM_FRAGMENTS_COMPLETE) {
    __ESBMC_assert(payload_bytes <= LCM_FRAGMENTS_BYTES, "no longer than its room");
#ifdef REACHED
    __ESBMC_assert(0, "reached");
#endif
  }
  const uint32_t k = nondet_uint32() % LCM_FRAGMENTS_MESSAGES;
  __ESBMC_assert(holds(&f.message[k]), "a state as before");
  return 0;
}
