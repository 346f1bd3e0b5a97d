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

#endif
