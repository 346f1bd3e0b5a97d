/* SPDX-License-Identifier: MIT */
#include "transport/lcm_fragments.h"

#include <string.h>

#define HEADER 20u

_Static_assert(LCM_FRAGMENTS_BYTES <= UINT16_MAX, "offsets are kept in 16 bits");
_Static_assert(LCM_FRAGMENTS_PARTS <= 64, "a bit a fragment");

/* What a fragment says of itself; its data points into the datagram. */
typedef struct part {
  uint32_t sequence, total, offset, number, parts;
  const char *channel; /* of number 0 */
  const uint8_t *data;
  uint32_t bytes;
} part;

static uint32_t get_u16(const uint8_t *at) { return (uint32_t)at[0] << 8 | at[1]; }
static uint32_t get_u32(const uint8_t *at) { return get_u16(at) << 16 | get_u16(at + 2); }

static bool open_part(part *p, const uint8_t *datagram, size_t bytes) {
  if (bytes < HEADER)
    return false;
  *p = (part){.sequence = get_u32(datagram + 4),
              .total = get_u32(datagram + 8),
              .offset = get_u32(datagram + 12),
              .number = get_u16(datagram + 16),
              .parts = get_u16(datagram + 18)};
  size_t at = HEADER;
  if (p->number == 0) {
    const size_t rest = bytes - HEADER;
    const size_t most = rest < LCM_PACKET_MAX_CHANNEL + 1 ? rest : LCM_PACKET_MAX_CHANNEL + 1;
    const uint8_t *end = most > 0 ? memchr(datagram + HEADER, 0, most) : NULL;
    if (end == NULL || end == datagram + HEADER)
      return false;
    p->channel = (const char *)datagram + HEADER;
    at = (size_t)(end - datagram) + 1;
  }
  p->data = datagram + at;
  p->bytes = (uint32_t)(bytes - at);
  return p->total > 0 && p->total <= LCM_FRAGMENTS_BYTES && p->parts > 0 &&
         p->parts <= LCM_FRAGMENTS_PARTS && p->number < p->parts && p->offset <= p->total &&
         bytes - at <= p->total - p->offset;
}

/* The message that a fragment belongs to; a new one where there is none. */
static lcm_fragments_message *message_of(lcm_fragments *f, uint64_t sender, const part *p,
                                         uint32_t *lost) {
  lcm_fragments_message *place = &f->message[0];
  for (uint32_t i = 0; i < LCM_FRAGMENTS_MESSAGES; ++i) {
    lcm_fragments_message *m = &f->message[i];
    if (m->have != 0 && m->sender == sender && m->sequence == p->sequence)
      return m;
    const bool older = f->taken - m->touched > f->taken - place->touched;
    if (place->have != 0 && (m->have == 0 || older))
      place = m;
  }
  if (place->have != 0 && *lost != UINT32_MAX)
    ++*lost;
  memset(place, 0, sizeof *place);
  place->sender = sender;
  place->sequence = p->sequence;
  place->total = p->total;
  place->parts = p->parts;
  return place;
}

/* Whether the fragments follow each other without a hole and without overlapping. */
static bool is_whole(const lcm_fragments_message *m) {
  uint32_t at = 0;
  for (uint32_t i = 0; i < m->parts; ++i) {
    if (m->offset[i] != at)
      return false;
    at += m->bytes[i];
  }
  return at == m->total;
}

lcm_fragments_answer lcm_fragments_take(lcm_fragments *f, uint64_t sender, const uint8_t *datagram,
                                        size_t bytes, const char **channel, const uint8_t **payload,
                                        size_t *payload_bytes, uint32_t *lost) {
  part p;
  if (!open_part(&p, datagram, bytes))
    return LCM_FRAGMENTS_REFUSED;
  lcm_fragments_message *m = message_of(f, sender, &p, lost);
  const uint64_t bit = UINT64_C(1) << p.number;
  if (m->total != p.total || m->parts != p.parts) {
    m->have = 0;
    return LCM_FRAGMENTS_REFUSED;
  }
  m->touched = ++f->taken;
  if ((m->have & bit) != 0)
    return LCM_FRAGMENTS_WAIT;
  m->have |= bit;
  memcpy(m->data + p.offset, p.data, p.bytes);
  m->offset[p.number] = (uint16_t)p.offset;
  m->bytes[p.number] = (uint16_t)p.bytes;
  if (p.channel != NULL)
    memcpy(m->channel, p.channel, strlen(p.channel) + 1);
  const uint64_t all = UINT64_MAX >> (64u - m->parts);
  if (m->have != all)
    return LCM_FRAGMENTS_WAIT;
  m->have = 0;
  if (!is_whole(m))
    return LCM_FRAGMENTS_REFUSED;
  *channel = m->channel;
  *payload = m->data;
  *payload_bytes = m->total;
  return LCM_FRAGMENTS_COMPLETE;
}
