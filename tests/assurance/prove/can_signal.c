/* SPDX-License-Identifier: MIT */
/* A table's entry of any bytes: where its check passes, its bits and its selector's lie within the
 * frame. Function by function: the sources are included. */
#include "any.h"

#include "../../../lib/src/wire/can_table.c"

int main(void) {
  _Alignas(8) uint8_t entry[RIM_CAN_TABLE_SIGNAL_BYTES];
  const rim_can_table table = {.signal = entry, .signals = 1, .values = 1};
  const size_t bytes = any_size(64);
  const signal s = signal_at(&table, 0);
  if (check_signal(&table, &s, (uint32_t)bytes) != RIM_OK)
    return 0;
  uint8_t data[64];
  if (s.selector_bits != 0) {
    __ESBMC_assert(s.selector_bits <= 32, "a selector of 32 bits");
    (void)take_bits(data + 64 - bytes, s.selector_start, s.selector_bits,
                    s.selector_motorola != 0);
  }
  (void)take_bits(data + 64 - bytes, s.start, s.bits, s.motorola != 0);
  return 0;
}
