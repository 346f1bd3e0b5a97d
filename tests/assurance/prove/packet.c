/* SPDX-License-Identifier: MIT */
/* Any datagram of up to 80 bytes, 8 more than the longest header: what is said to be the payload
 * lies inside it, and the channel's name ends before. */
#include "any.h"
#include "transport/lcm_packet.h"

int main(void) {
  uint8_t bytes[80];
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  const size_t n = any_size(sizeof bytes);
  if (lcm_packet_open(bytes, n, &channel, &payload, &payload_bytes) == LCM_PACKET_MESSAGE) {
    __ESBMC_assert(payload > bytes && payload + payload_bytes == bytes + n, "inside");
    __ESBMC_assert(payload[-1] == 0 && (const uint8_t *)channel == bytes + 8, "ended");
  }
  return 0;
}
