/* SPDX-License-Identifier: MIT */
/* lcm_udp.h - LCM over UDP multicast on Linux, without liblcm and without heap.
 *
 * One socket sends, one receives; neither ever blocks. What cannot be sent or understood is
 * counted. Interoperates with liblcm in both directions. */
#ifndef LCM_UDP_H
#define LCM_UDP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/lcm_fragments.h"

#define LCM_UDP_BUFFER 65536u

/* Host byte order. */
typedef struct lcm_udp_address {
  uint32_t group;     /* 224.0.0.0 to 239.255.255.255 */
  uint32_t interface; /* address of the interface; 0: the one that the multicast route says */
  uint16_t port;
  uint8_t ttl; /* of what is sent, in hops: 0 stays on this computer. What is received it does not
                  limit: the interface does */
} lcm_udp_address;

/* Saturating. */
typedef struct lcm_udp_counts {
  uint32_t malformed; /* datagrams */
  uint32_t fragments; /* refused, and messages of which the rest never came */
  uint32_t lost;      /* dropped by the kernel: the receive buffer was full */
  uint32_t unsent;
} lcm_udp_counts;

typedef struct lcm_udp {
  int in, out; /* descriptors; -1: none */
  lcm_udp_address address;
  uint32_t sequence;
  uint32_t overflow; /* the kernel's own count of drops */
  lcm_udp_counts counts;
  uint8_t buffer[LCM_UDP_BUFFER];
  lcm_fragments fragments;
} lcm_udp;

typedef struct lcm_udp_message {
  const char *channel; /* both point into the instance: until the next receive */
  const uint8_t *payload;
  size_t bytes;
} lcm_udp_message;

/* Reads udpm://GROUP:PORT[?ttl=N]. Returns NULL, or what is wrong with it; *address is then
 * unchanged. Its interface is 0. */
const char *lcm_udp_parse(lcm_udp_address *address, const char *url);

/* Opens both sockets, the receiving one only when asked. Returns 0, or a negative errno and in
 * *what the step that failed; nothing is left open then. */
int lcm_udp_open(lcm_udp *lcm, const lcm_udp_address *address, bool receive, const char **what);
void lcm_udp_close(lcm_udp *lcm);

/* Sends one message and returns 0, or a negative errno: -EAGAIN, -ENOBUFS the network takes no more
 * now; others, the network is not there (counted, nothing is closed: it may come back); -EINVAL the
 * channel's name. */
int lcm_udp_send(lcm_udp *lcm, const char *channel, const uint8_t *payload, size_t bytes);

/* Takes the next datagram that is waiting. 1: *message; 0: none waits; -1: one that is no message
 * was counted, or is part of one, or the socket had an error to tell: call again. */
int lcm_udp_receive(lcm_udp *lcm, lcm_udp_message *message);

#endif
