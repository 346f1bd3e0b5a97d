/* SPDX-License-Identifier: MIT */
/* A table's entry of any bytes: where its check passes, its bits and its selector's lie within the
 * frame. Function by function: the sources are included. */
#include "any.h"

#include "../../../lib/src/wire/can_table.c"

/* The byte that turn i of take_bits reads. */
static size_t byte_of(uint32_t start, bool motorola, size_t i) {
  return motorola ? (start / 8u * 8u + (7u - start % 8u) + i) / 8u : (start + i) / 8u;
}

int main(void) {
  _Alignas(8) uint8_t entry[RIM_CAN_TABLE_SIGNAL_BYTES];
  const rim_can_table table = {.signal = entry, .signals = 1, .values = 1};
  const size_t bytes = any_size(64);
  const signal s = signal_at(&table, 0);
  if (check_signal(&table, &s, (uint32_t)bytes) != RIM_OK)
    return 0;
  const size_t i = any_size(63);
  __ESBMC_assert(s.bits >= 1 && s.bits <= 64 && s.selector_bits <= 32, "so many turns");
  if (i < s.bits)
    __ESBMC_assert(byte_of(s.start, s.motorola != 0, i) < bytes, "its bits inside");
  if (i < s.selector_bits)
    __ESBMC_assert(byte_of(s.selector_start, s.selector_motorola != 0, i) < bytes,
                   "its selector's bits inside");
  return 0;
}
