/* SPDX-License-Identifier: MIT */
/* For libFuzzer: make fuzz. With FUZZ_DECODER=K in the environment every input is for decoder K,
 * whatever its first byte, and the search is that decoder's alone. */
#include "fuzz_decoders.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes) {
  static const char *only;
  static uint8_t copy[1 << 16];
  if (only == NULL)
    only = getenv("FUZZ_DECODER") != NULL ? getenv("FUZZ_DECODER") : "";
  if (only[0] == '\0' || bytes == 0 || bytes > sizeof copy) {
    fuzz_one(data, bytes);
    return 0;
  }
  memcpy(copy, data, bytes);
  copy[0] = (uint8_t)strtoul(only, NULL, 10);
  fuzz_one(copy, bytes);
  return 0;
}
