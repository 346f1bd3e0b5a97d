/* SPDX-License-Identifier: MIT */
/* Any payload of up to one byte more than the message has. */
#include "any.h"
#include "rim/lcm.h"

int main(void) {
  uint8_t bytes[RIM_LCM_HEALTH_SIZE + 1];
  rim_health_message out;
  (void)rim_lcm_unpack_health(&out, bytes, any_size(sizeof bytes));
  return 0;
}
