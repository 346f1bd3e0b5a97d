/* SPDX-License-Identifier: MIT */
#include "transport/lcm_packet.h"

#include <string.h>

static const uint8_t message_magic[4] = {'L', 'C', '0', '2'};
static const uint8_t fragment_magic[4] = {'L', 'C', '0', '3'};

size_t lcm_packet_header(uint8_t out[LCM_PACKET_HEADER_BYTES], const char *channel,
                         uint32_t sequence) {
  size_t length = 0;
  while (length <= LCM_PACKET_MAX_CHANNEL && channel[length] != '\0')
    length++;
  if (length == 0 || length > LCM_PACKET_MAX_CHANNEL)
    return 0;
  memcpy(out, message_magic, sizeof message_magic);
  for (unsigned i = 0; i < 4; ++i)
    out[4 + i] = (uint8_t)(sequence >> (24u - 8u * i));
  memcpy(out + 8, channel, length + 1);
  return 8 + length + 1;
}

lcm_packet_kind lcm_packet_open(const uint8_t *datagram, size_t bytes, const char **channel,
                                const uint8_t **payload, size_t *payload_bytes) {
  if (bytes < 8)
    return LCM_PACKET_MALFORMED;
  if (memcmp(datagram, fragment_magic, sizeof fragment_magic) == 0)
    return LCM_PACKET_FRAGMENT;
  if (memcmp(datagram, message_magic, sizeof message_magic) != 0)
    return LCM_PACKET_MALFORMED;
  const size_t rest = bytes - 8;
  const size_t most = rest < LCM_PACKET_MAX_CHANNEL + 1 ? rest : LCM_PACKET_MAX_CHANNEL + 1;
  size_t length = 0;
  while (length < most && datagram[8 + length] != 0)
    length++;
  if (length == 0 || length == most)
    return LCM_PACKET_MALFORMED;
  *channel = (const char *)datagram + 8;
  *payload = datagram + 8 + length + 1;
  *payload_bytes = rest - length - 1;
  return LCM_PACKET_MESSAGE;
}
