/* SPDX-License-Identifier: MIT */
/* Fragments of LCM, function by function (PART). 1: what a datagram of any 0..BYTES bytes says of
 * itself. 2: what is copied, for any message under way and any fragment as 1 allows it; such a
 * message is left again, so the proof is of any number of fragments. 3: whether the parts follow
 * each other. The functions that prove.sh names are replaced by what 1 and 3 prove of them; which
 * message a fragment belongs to (message_of) is one that `holds`, or one that was just begun. */
#include "any.h"

#include <string.h>

uint64_t nondet_uint64(void);
uint32_t nondet_uint32(void);
_Bool nondet_bool(void);

#if PART == 2
static void checked_copy(void *to, const void *from, size_t bytes);
#define memcpy(to, from, bytes) checked_copy(to, from, bytes)
static size_t name_bytes; /* of the channel, with its NUL */
#define strlen(name) ((void)(name), name_bytes - 1u)
#endif
#include "lcm_fragments.c"

/* What is so of every message under way. */
static _Bool holds(const lcm_fragments_message *m) {
  return m->have == 0 || (m->total > 0 && m->total <= LCM_FRAGMENTS_BYTES && m->parts > 0 &&
                          m->parts <= LCM_FRAGMENTS_PARTS);
}

/* What is so of every fragment that is taken. */
static _Bool fits(const part *p) {
  return p->total > 0 && p->total <= LCM_FRAGMENTS_BYTES && p->parts > 0 &&
         p->parts <= LCM_FRAGMENTS_PARTS && p->number < p->parts && p->offset <= p->total &&
         p->bytes <= p->total - p->offset;
}

#if PART == 1
int main(void) {
  uint8_t datagram[BYTES];
  part p;
  const size_t n = any_size(BYTES);
  if (open_part(&p, datagram, n)) {
    __ESBMC_assert(fits(&p), "fits");
    __ESBMC_assert(p.data >= datagram && p.data + p.bytes == datagram + n, "its data inside");
    if (p.number == 0) {
      const uint8_t *name = (const uint8_t *)p.channel;
      __ESBMC_assert(name == datagram + HEADER && p.data > name + 1 && p.data[-1] == 0, "a name");
      __ESBMC_assert(p.data - name <= LCM_PACKET_MAX_CHANNEL + 1, "not too long");
    }
  }
  return 0;
}
#elif PART == 2
static lcm_fragments f;
static uint8_t datagram[1];
static part taken;

static bool open_part(part *p, const uint8_t *from, size_t bytes) {
  part any;
  (void)from, (void)bytes;
  __ESBMC_assume(fits(&any));
  any.data = datagram;
  any.channel = any.number == 0 ? (const char *)datagram : NULL;
  *p = taken = any;
  return nondet_bool();
}
static lcm_fragments_message *message_of(lcm_fragments *all, uint64_t sender, const part *p,
                                         uint32_t *lost) {
  (void)sender, (void)lost;
  lcm_fragments_message *m = &all->message[0];
  __ESBMC_assume(holds(m) && (m->have != 0 || (m->total == p->total && m->parts == p->parts)));
  return m;
}
static bool is_whole(const lcm_fragments_message *m) { return m->total != 0 && nondet_bool(); }

static void checked_copy(void *to, const void *from, size_t bytes) {
  const lcm_fragments_message *m = &f.message[0];
  const size_t at = (size_t)__ESBMC_POINTER_OFFSET(to);
  const size_t data = (size_t)__ESBMC_POINTER_OFFSET(m->data);
  const size_t name = (size_t)__ESBMC_POINTER_OFFSET(m->channel);
  __ESBMC_assert(__ESBMC_same_object(to, &f) && from == datagram, "into the messages");
  if (at >= data)
    __ESBMC_assert(at - data <= LCM_FRAGMENTS_BYTES && bytes <= LCM_FRAGMENTS_BYTES - (at - data) &&
                       bytes == taken.bytes,
                   "into its data, what came");
  else
    __ESBMC_assert(at == name && bytes <= LCM_PACKET_MAX_CHANNEL + 1 && bytes == name_bytes,
                   "into its name");
}

int main(void) {
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  uint32_t lost = nondet_uint32();
  lcm_fragments any;
  f = any;
  __ESBMC_assume(holds(&f.message[0]));
  name_bytes = 1u + any_size(LCM_PACKET_MAX_CHANNEL);
  const lcm_fragments_answer answer = lcm_fragments_take(
      &f, nondet_uint64(), datagram, nondet_size(), &channel, &payload, &payload_bytes, &lost);
  if (answer == LCM_FRAGMENTS_COMPLETE)
    __ESBMC_assert(payload_bytes <= LCM_FRAGMENTS_BYTES, "no longer than its room");
  __ESBMC_assert(holds(&f.message[0]), "a state as before");
  return 0;
}
#else
int main(void) {
  lcm_fragments_message m;
  __ESBMC_assume(m.have != 0 && holds(&m));
  (void)is_whole(&m);
  return 0;
}
#endif
