/* SPDX-License-Identifier: MIT */
/* A state file of any length and any bytes, opened, read and closed with any success: what is read
 * goes into the scratch memory, what is copied comes from what was read, and the parts of the state
 * are written only where the whole file was taken, each to its own length. The loop of reading ends
 * where each read brings a byte; here after at most READS of them. */
#define _POSIX_C_SOURCE 200809L
#include "any.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#include "base/crc.h"

uint32_t nondet_uint32(void);
int nondet_int(void);
_Bool nondet_bool(void);

static uint8_t scratch[BYTES], daemon_memory[BYTES], monitor_memory[BYTES];
static size_t scratch_bytes, daemon_bytes, monitor_bytes;
static size_t written; /* of the parts */
static unsigned reads;

static void copied(void *to, const void *from, size_t bytes);
static int compared(const void *a, const void *b, size_t bytes);
static int opened(void) { return nondet_int(); }
static ssize_t read_any(int fd, void *to, size_t bytes) {
  const ssize_t got = (ssize_t)nondet_int();
  (void)fd;
  if (__ESBMC_same_object(to, scratch))
    is_inside_of(to, bytes, scratch, scratch_bytes);
  else
    __ESBMC_assert(bytes == 1, "one more");
  __ESBMC_assume(got >= -1 && (got < 0 || (size_t)got <= bytes));
  __ESBMC_assume(++reads <= READS || got <= 0);
  return got;
}
/* What the checker's own headers lack, for functions that are not called here. */
struct any_param {
  int sched_priority;
};
#define sched_param any_param
#define pthread_attr_setschedparam(attributes, param) ((void)(param), 0)
#undef SCHED_OTHER
#define SCHED_OTHER 0
#define open(...) opened()
#define read(fd, to, bytes) read_any(fd, to, bytes)
#define close(fd) ((void)(fd), 0)
static const char *text_of(int why) { return why != 0 ? "why" : "nothing"; }
#define strerror(why) text_of(why)
#define snprintf(to, bytes, ...) ((int)nondet_uint32())
#define memcpy(to, from, bytes) copied(to, from, bytes)
#define memcmp(a, b, bytes) compared(a, b, bytes)
#define memset(to, value, bytes) copied(to, NULL, bytes)
static uint32_t crc_of_any(const void *data, size_t bytes) {
  is_inside_of(data, bytes, scratch, scratch_bytes);
  return nondet_uint32();
}
#define rimi_crc32(crc, data, bytes) crc_of_any(data, bytes)
#include "rimd/state.c"

static void copied(void *to, const void *from, size_t bytes) {
  if (from != NULL && __ESBMC_same_object(from, scratch))
    is_inside_of(from, bytes, scratch, scratch_bytes);
  if (__ESBMC_same_object(to, scratch)) {
    is_inside_of(to, bytes, scratch, scratch_bytes);
  } else if (__ESBMC_same_object(to, daemon_memory)) {
    __ESBMC_assert(to == daemon_memory && bytes == daemon_bytes, "the daemon's memory");
    written += bytes;
  } else if (__ESBMC_same_object(to, monitor_memory)) {
    __ESBMC_assert(to == monitor_memory && bytes == monitor_bytes, "the monitor's memory");
    written += bytes;
  } else {
    __ESBMC_assert(bytes <= sizeof(head), "a header or a part of one: any value, as it was");
  }
}
static int compared(const void *a, const void *b, size_t bytes) {
  __ESBMC_assert(a != b && bytes <= sizeof((head *)0)->version, "a field of a header");
  return nondet_int();
}

int main(void) {
  daemon_bytes = any_size(BYTES);
  monitor_bytes = any_size(BYTES);
  const state_parts parts = {.daemon = daemon_memory,
                             .monitor = monitor_memory,
                             .daemon_bytes = (uint32_t)daemon_bytes,
                             .monitor_bytes = (uint32_t)monitor_bytes,
                             .model_id = nondet_uint32(),
                             .image_crc = nondet_uint32()};
  scratch_bytes = state_bytes(&parts);
  __ESBMC_assume(scratch_bytes <= BYTES);
  const char *why = state_load("", &parts, scratch);
  __ESBMC_assert(why == NULL ? written == daemon_bytes + monitor_bytes : written == 0,
                 "all of it or nothing");
  return 0;
}
