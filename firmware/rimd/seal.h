/* SPDX-License-Identifier: MIT */
/* seal.h - who may command: tags by a shared key (BLAKE2b of libsodium, 16 bytes), and counters
 * that are good once.
 *
 * Built without libsodium (SEAL_SODIUM undefined) rimd knows no key, and a configuration that names
 * one is refused. No heap, no system call but for reading the key. */
#ifndef SEAL_H
#define SEAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/can.h"

#define SEAL_KEY_BYTES 32u
#define SEAL_LATE 63u /* counters that may come after a higher one */

/* Counters used so far: a bit for the highest and each of the SEAL_LATE before it. All zero: none.
 * Kept across a restart. */
typedef struct seal_window {
  uint64_t highest, seen;
} seal_window;

/* Saturating. */
typedef struct seal_counts {
  uint32_t unsealed; /* messages without a tag, or of a type that has none, while there is a key */
  uint32_t forged;   /* the tag is not that of this key: another sender, or damage */
  uint32_t replayed; /* a good tag whose counter was used before, or is older than the window */
} seal_counts;

typedef struct seal {
  bool has_key;
  uint8_t key[SEAL_KEY_BYTES];
} seal;

/* Reads a key: a regular file of 64 hexadecimal digits and a line end, to which nobody but its
 * owner, this user or root, has any access. Returns NULL, or what is wrong with it. */
const char *seal_read_key(seal *s, const char *path);

/* Whether the counter is good: it was not used, and is not older than the window. Only then it
 * counts as used. */
bool seal_window_take(seal_window *window, uint64_t counter);

/* Opens the sealed form of the plain LCM type that `out` of `out_bytes` holds: a command or an
 * observation, told apart by their lengths. False: refused and counted. */
bool seal_open_lcm(const seal *s, seal_window *window, seal_counts *counts, const uint8_t *in,
                   size_t bytes, uint8_t *out, size_t out_bytes);

/* The same of a CAN FD frame. */
bool seal_open_can(const seal *s, seal_window *window, seal_counts *counts,
                   const rim_can_frame *frame, uint32_t node, rim_command *command);

#endif
