/* SPDX-License-Identifier: MIT */
/* Preloaded into a program: its monotonic clock goes on by a millisecond with every look at it, and
 * not otherwise. So how late something is follows from what was done, not from how fast. */
#define _GNU_SOURCE
#include <stdatomic.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static atomic_ulong looks;

int clock_gettime(clockid_t clock, struct timespec *now) {
  if (clock != CLOCK_MONOTONIC)
    return (int)syscall(SYS_clock_gettime, clock, now);
  const unsigned long ms = 1000000ul + ++looks;
  now->tv_sec = (time_t)(ms / 1000ul);
  now->tv_nsec = (long)(ms % 1000ul) * 1000000l;
  return 0;
}
