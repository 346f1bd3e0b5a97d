/* SPDX-License-Identifier: MIT */
/* lcm_fragments.h - LCM messages that come in several datagrams, put together in fixed memory.
 *
 * liblcm cuts a message that does not fit one datagram: on Linux above 64 kB, elsewhere above
 * 1.4 kB. A fragment: u32 0x4c433033 ("LC03"), u32 sequence, u32 bytes of the whole payload, u32
 * offset, u16 number, u16 how many, all big-endian; in number 0 the channel's name and NUL; data.
 *
 * A message is known by its sender and sequence. A few may be under way at once; a new one takes
 * the place of the one that has waited longest for its rest. No heap, no clock, no system call. */
#ifndef LCM_FRAGMENTS_H
#define LCM_FRAGMENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/lcm_packet.h"

#define LCM_FRAGMENTS_MESSAGES 4u /* under way at once */
#define LCM_FRAGMENTS_BYTES 8192u /* of a payload: twice the longest that rimd reads */
#define LCM_FRAGMENTS_PARTS 64u   /* of a message */

typedef struct lcm_fragments_message {
  uint64_t sender, have; /* have: a bit a fragment; 0: free */
  uint32_t sequence, total, touched;
  uint32_t parts;
  uint16_t offset[LCM_FRAGMENTS_PARTS], bytes[LCM_FRAGMENTS_PARTS]; /* of each fragment */
  char channel[LCM_PACKET_MAX_CHANNEL + 1];
  uint8_t data[LCM_FRAGMENTS_BYTES];
} lcm_fragments_message;

/* All zero: nothing is under way. */
typedef struct lcm_fragments {
  uint32_t taken; /* fragments so far: gives the age of messages */
  lcm_fragments_message message[LCM_FRAGMENTS_MESSAGES];
} lcm_fragments;

typedef enum lcm_fragments_answer {
  LCM_FRAGMENTS_WAIT,     /* the rest is to come */
  LCM_FRAGMENTS_COMPLETE, /* *channel, *payload: until the next call */
  LCM_FRAGMENTS_REFUSED   /* cut, too long, overlapping, or at odds with what came before: its
                             message is forgotten */
} lcm_fragments_answer;

/* Takes a datagram that lcm_packet_open called a fragment. sender: anything that tells senders
 * apart. *lost is increased by one for a message that had to make room. A fragment that came before
 * changes nothing. O(bytes). */
lcm_fragments_answer lcm_fragments_take(lcm_fragments *fragments, uint64_t sender,
                                        const uint8_t *datagram, size_t bytes, const char **channel,
                                        const uint8_t **payload, size_t *payload_bytes,
                                        uint32_t *lost);

#endif
