/* SPDX-License-Identifier: MIT */
/* A table of any bytes, of up to 2 frames and 2 signals: opening it reads inside, and what is
 * accepted names only signals that it has. What a signal says of bits is can_signal's. */
#include "any.h"
#include "base/real.h"

/* Any answer to whether a number is finite: what is safe for all answers is safe for the true
 * one. */
_Bool nondet_bool(void);
#define rimi_is_finite(x) ((void)(x), nondet_bool())

#include "../../../lib/src/wire/can_table.c"

int main(void) {
  enum { MOST = RIM_CAN_TABLE_HEADER_BYTES + 2 * (RIM_CAN_TABLE_FRAME_BYTES + 48) };
  _Alignas(8) uint8_t bytes[MOST];
  rim_can_table t;
  const size_t n = any_size(sizeof bytes);
  if (rim_can_table_open(&t, bytes, n) != RIM_OK)
    return 0;
  __ESBMC_assert(t.frames >= 1 && t.values >= 1, "something");
  __ESBMC_assert(t.frame >= bytes && t.signal + RIM_CAN_TABLE_SIGNAL_BYTES * t.signals == bytes + n,
                 "inside");
  for (size_t i = 0; i < t.frames; i++) {
    const uint8_t *entry = frame_at(&t, i);
    __ESBMC_assert(rimi_le_u16(entry, 3) + rimi_le_u16(entry, 4) <= t.signals, "signals it has");
  }
  return 0;
}
