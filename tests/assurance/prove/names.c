/* SPDX-License-Identifier: MIT */
/* Section NAMES of any 0..BYTES bytes (PART 1): a name lies in it and ends before a line's end. The
 * unit of any name of 0..BYTES characters (PART 2): a text that ends. Where the section lies is
 * what the proof `image` is of. */
#include "any.h"
#include "rim/image.h"

uint32_t nondet_uint32(void);
_Bool nondet_bool(void);

static uint8_t section[BYTES + 1];
static size_t section_bytes;

static rim_status any_section(const uint8_t **at, size_t *bytes) {
  *at = section;
  *bytes = section_bytes;
  return nondet_bool() ? RIM_OK : RIM_E_RANGE;
}
#define rim_image_section(view, kind, at, bytes) any_section(at, bytes)
#include "../../../lib/src/image/names.c"

int main(void) {
  uint8_t any[BYTES + 1];
  for (size_t i = 0; i <= BYTES; ++i)
    section[i] = any[i];
  section_bytes = any_size(BYTES);
#if PART == 1
  const char *text;
  size_t length;
  if (rim_image_name(NULL, nondet_uint32(), &text, &length) == RIM_OK) {
    const uint8_t *at = (const uint8_t *)text;
    __ESBMC_assert(at >= section && at <= section + section_bytes, "inside");
#ifdef WRONG
    __ESBMC_assert((size_t)(at - section) + length + 1 < section_bytes, "and its line's end");
#else
    __ESBMC_assert((size_t)(at - section) + length < section_bytes, "and its line's end");
#endif
    __ESBMC_assert(at[length] == '\n', "which is there");
  }
#else
  /* The name's last byte is the last that may be read. */
  const char *name = (const char *)section + (BYTES + 1 - section_bytes);
#ifdef WRONG
  const char *unit = rim_unit_of_name(name, section_bytes + 1);
#else
  const char *unit = rim_unit_of_name(name, section_bytes);
#endif
  size_t i = 0;
  while (i < sizeof((rimi_unit *)0)->text && unit[i] != '\0')
    ++i;
  __ESBMC_assert(i < sizeof((rimi_unit *)0)->text, "it ends");
#endif
  return 0;
}
