/* SPDX-License-Identifier: MIT */
/* Any payload of up to one byte more than the message has. */
#include "any.h"
#include "rim/lcm.h"

int main(void) {
  uint8_t bytes[RIM_LCM_COUNTERS_SIZE + 1];
  rim_counters out;
  (void)rim_lcm_unpack_counters(&out, bytes, any_size(sizeof bytes));
  return 0;
}
