/* SPDX-License-Identifier: MIT */
/* watchdog.h - tells systemd that the daemon still goes round its loop (sd_notify(3), WatchdogSec),
 * without libsystemd. Where nobody asks, nothing is sent. */
#ifndef WATCHDOG_H
#define WATCHDOG_H

#include <stdint.h>

typedef struct watchdog {
  int fd;               /* a connected socket; -1: nobody asks */
  uint64_t interval_ns; /* half of what systemd waits for */
  uint64_t next_ns;
} watchdog;

/* Reads NOTIFY_SOCKET and WATCHDOG_USEC of the environment. */
void watchdog_open(watchdog *dog);

/* To be called in every round of the loop: sends WATCHDOG=1 where it is time. Never waits. */
void watchdog_feed(watchdog *dog, uint64_t now_ns);

/* Milliseconds after which watchdog_feed() has to be called again; -1: never. */
int watchdog_wait_ms(const watchdog *dog, uint64_t now_ns);

void watchdog_close(watchdog *dog);

#endif
