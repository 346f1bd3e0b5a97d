/* SPDX-License-Identifier: MIT */
/* A sealed command of any 0..size + 1 bytes, and a sealed frame of any length, are read inside. */
#include "any.h"
#include "wire/sealed.h"

int main(void) {
  uint8_t bytes[RIM_LCM_COMMAND_SIZE + RIMI_SEAL_BYTES + 1], plain[RIM_LCM_COMMAND_SIZE];
  const size_t n = any_size(sizeof bytes);
  uint64_t counter;
  const uint8_t *tag;
  if (rimi_lcm_unseal(plain, bytes, n, rimi_sealed_command(), &counter, &tag) == RIM_OK)
    __ESBMC_assert(tag + RIMI_TAG_BYTES == bytes + n, "the tag is the end");
  rim_can_frame frame;
  rim_command command;
  __ESBMC_assume(frame.length <= 64);
  (void)rimi_can_unseal(&command, 5, &frame, &counter);
  return 0;
}
