/* SPDX-License-Identifier: MIT */
/* Any table of CAN signals of one frame and one signal. */
#include "any.h"
#include "rim/can_table.h"

int main(void) {
  uint8_t bytes[RIM_CAN_TABLE_HEADER_BYTES + RIM_CAN_TABLE_FRAME_BYTES +
                RIM_CAN_TABLE_SIGNAL_BYTES];
  rim_can_table table;
  __ESBMC_assume(bytes[4] <= 2 && bytes[5] == 0); /* values of a row */
  (void)rim_can_table_open(&table, bytes, any_size(sizeof bytes));
  return 0;
}
