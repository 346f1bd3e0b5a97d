/* SPDX-License-Identifier: MIT */
/* socketcan.h - a CAN interface of Linux: classic and FD frames, never blocking, never closed for
 * good.
 *
 * The interface may be down, gone, or off the bus, now or later: the instance goes on, counts, and
 * comes back with it. socketcan_tend() is to be called now and then. */
#ifndef SOCKETCAN_H
#define SOCKETCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/can.h"

#define SOCKETCAN_NAME_BYTES 16u
#define SOCKETCAN_MAX_FILTERS 64u
#define SOCKETCAN_EXTENDED 0x80000000u /* in an identifier: 29 bits */

/* Takes frames with (id & mask) == (wanted & mask), both with SOCKETCAN_EXTENDED where 29 bits. */
typedef struct socketcan_filter {
  uint32_t id, mask;
} socketcan_filter;

/* Saturating. */
typedef struct socketcan_counts {
  uint32_t frames;  /* data frames read */
  uint32_t refused; /* remote frames and frames of a wrong size */
  uint32_t errors;  /* error frames */
  uint32_t bus_off;
  uint32_t down; /* times that the interface went down or away */
  uint32_t full; /* sends refused for a full queue */
  uint32_t lost; /* frames that the kernel dropped before they were read */
} socketcan_counts;

typedef struct socketcan {
  char name[SOCKETCAN_NAME_BYTES];
  int fd;          /* -1: there is no such interface now */
  bool fd_wanted;  /* FD frames are asked for */
  bool fd_capable; /* and the interface takes them */
  bool is_down, is_bus_off;
  uint32_t overflow;
  size_t filters;
  socketcan_filter filter[SOCKETCAN_MAX_FILTERS];
  socketcan_counts counts;
} socketcan;

typedef enum socketcan_sent {
  SOCKETCAN_SENT,
  SOCKETCAN_FULL,    /* try later */
  SOCKETCAN_DOWN,    /* try later, with what is true by then */
  SOCKETCAN_REFUSED, /* never will: FD on a classic interface, or an error that is not foreseen */
} socketcan_sent;

/* Opens an interface that need not be there yet. filters 0: receives nothing but error frames.
 * Returns 0, or a negative errno: -EINVAL a name or count out of range, -EAFNOSUPPORT this kernel
 * has no CAN; what comes with the interface itself is not an error. */
int socketcan_open(socketcan *can, const char *name, const socketcan_filter *filter, size_t filters,
                   bool fd);
void socketcan_close(socketcan *can);

socketcan_sent socketcan_send(socketcan *can, const rim_can_frame *frame);

/* Takes the next frame that is waiting. 1: *frame, its id with SOCKETCAN_EXTENDED where 29 bits,
 * and *t_s, when the kernel received it (its clock of the day); 0: none waits; -1: something else
 * was counted, call again. */
int socketcan_receive(socketcan *can, rim_can_frame *frame, double *t_s);

/* Looks whether a missing interface has come. A few system calls, only while it is missing. */
void socketcan_tend(socketcan *can);

#endif
