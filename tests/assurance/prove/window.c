/* SPDX-License-Identifier: MIT */
/* A counter is good at most once, whatever the window was, and whatever came in between; one that
 * is above all others always is. */
#include "any.h"
#include "rimd/seal.h"

uint64_t nondet_uint64(void);

int main(void) {
  seal_window window;
  const uint64_t one = nondet_uint64(), other = nondet_uint64(), highest = window.highest;
  const bool good = seal_window_take(&window, one);
  __ESBMC_assert(good || one <= highest, "above all");
  (void)seal_window_take(&window, other);
  if (good)
    __ESBMC_assert(!seal_window_take(&window, one), "good once");
  return 0;
}
