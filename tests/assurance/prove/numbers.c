/* SPDX-License-Identifier: MIT */
/* What readers.c relies on: numbers_are_finite() and numbers_are_positive() read `count` numbers
 * and no other. For counts up to MOST: nothing in their loops depends on how often they turn. */
#include "any.h"
#include "base/bytes.h"
#include "base/real.h"

float nondet_float(void);
_Bool nondet_bool(void);

static size_t count; /* of what may be read */

static float read_f32(const uint8_t *array, size_t i) {
  (void)array;
#ifdef WRONG
  __ESBMC_assert(i + 1u < count, "of these numbers");
#else
  __ESBMC_assert(i < count, "of these numbers");
#endif
  return nondet_float();
}
#define rimi_le_f32 read_f32
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#define count count_up /* a function there */
#include "base/usable.h"
#undef count

int main(void) {
  static const uint8_t section[4];
  count = any_size(MOST);
  (void)numbers_are_finite(section, count);
  (void)numbers_are_positive(section, count);
  return 0;
}
