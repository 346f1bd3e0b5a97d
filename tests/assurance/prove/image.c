/* SPDX-License-Identifier: MIT */
/* Any image of up to 160 bytes (six sections), whatever its check sums come to: what it says of a
 * section lies inside it and is aligned. */
#include "rim/image.h"
#include "any.h"

/* Any outcome: as if an attacker, or chance, had made it fit. */
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes);
uint32_t nondet_uint32(void);
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes) {
  (void)crc;
  (void)data;
  (void)bytes;
  return nondet_uint32();
}

int main(void) {
  _Alignas(8) uint8_t bytes[160];
  const size_t n = any_size(sizeof bytes);
  rim_image view;
  if (rim_image_open(&view, bytes, n) == RIM_OK) {
    const uint8_t *section;
    size_t size;
    if (rim_image_section(&view, nondet_uint32(), &section, &size) == RIM_OK) {
      __ESBMC_assert(section >= bytes && size <= n, "inside");
      __ESBMC_assert((size_t)(section - bytes) <= n - size, "to its end");
      __ESBMC_assert((size_t)(section - bytes) % RIM_IMAGE_ALIGN == 0, "aligned");
    }
  }
  return 0;
}
