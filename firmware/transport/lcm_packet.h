/* SPDX-License-Identifier: MIT */
/* lcm_packet.h - LCM's UDP datagrams without liblcm: no heap, no system call, for any network
 * stack.
 *
 * A message: u32 0x4c433032 ("LC02"), u32 sequence, both big-endian; the channel's name, NUL; the
 * payload. A message that is too long for its sender's system travels in fragments (0x4c433033):
 * lcm_fragments.h puts them together. */
#ifndef LCM_PACKET_H
#define LCM_PACKET_H

#include <stddef.h>
#include <stdint.h>

#define LCM_PACKET_MAX_CHANNEL 63u /* characters, as liblcm has it */
#define LCM_PACKET_HEADER_BYTES (8u + LCM_PACKET_MAX_CHANNEL + 1u) /* at most */

typedef enum lcm_packet_kind {
  LCM_PACKET_MESSAGE,
  LCM_PACKET_FRAGMENT,
  LCM_PACKET_MALFORMED /* not LCM, cut, or a channel's name without an end */
} lcm_packet_kind;

/* Writes what stands before the payload and returns its length; 0 when the name is empty or too
 * long. O(name). */
size_t lcm_packet_header(uint8_t out[LCM_PACKET_HEADER_BYTES], const char *channel,
                         uint32_t sequence);

/* Takes a datagram apart: *channel (NUL-terminated) and *payload point into it, for a message
 * alone. Reads nothing beyond bytes. O(name). */
lcm_packet_kind lcm_packet_open(const uint8_t *datagram, size_t bytes, const char **channel,
                                const uint8_t **payload, size_t *payload_bytes);

#endif
