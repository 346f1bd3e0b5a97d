/* SPDX-License-Identifier: MIT */
/* any.h - what the harness of a proof knows of its input: nothing. ESBMC takes a variable that is
 * not initialised as any value, so a proof is over every byte and length up to the one named. */
#ifndef ANY_H
#define ANY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

uint8_t nondet_uint8(void);
size_t nondet_size(void);
void __ESBMC_assume(_Bool condition);
void __ESBMC_assert(_Bool condition, const char *text);

/* 0..most */
static inline size_t any_size(size_t most) {
  const size_t n = nondet_size();
  __ESBMC_assume(n <= most);
  return n;
}

/* The bytes at..at+bytes-1 lie in this memory of `most` bytes. */
static inline void is_inside_of(const void *at, size_t bytes, const void *memory, size_t most) {
  const size_t offset = (size_t)__ESBMC_POINTER_OFFSET(at);
  __ESBMC_assert(__ESBMC_same_object(at, memory), "of this memory");
#ifdef WRONG /* a byte less than there are: the proof has to fail */
  __ESBMC_assert(bytes == 0 || offset + bytes < most, "inside");
#else
  __ESBMC_assert(offset <= most && bytes <= most - offset, "inside");
#endif
}

#endif
