/* SPDX-License-Identifier: MIT */
/* What readers.c relies on: values_ok() and finite_numbers() read `count` numbers from `first` on
 * and no other. For counts up to MOST: nothing in their loops depends on how often they turn. */
#include "any.h"
#include "base/bytes.h"
#include "base/real.h"

float nondet_float(void);
_Bool nondet_bool(void);

static size_t first_word, count; /* of what may be read */

static float read_f32(const uint8_t *array, size_t i) {
  (void)array;
#ifdef WRONG
  __ESBMC_assert(i > first_word, "of these numbers");
#else
  __ESBMC_assert(i >= first_word && i - first_word < count, "of these numbers");
#endif
  return nondet_float();
}
#define rimi_le_f32 read_f32
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#define rimi_exp(x) ((void)(x), 0.0)
#define rimi_log(x) ((void)(x), 0.0)
#define rimi_sqrt(x) ((void)(x), 0.0)
#if SECTION == 3
#include "../../../lib/src/image/nominal.c"
#else
#include "../../../lib/src/image/basis.c"
#endif

int main(void) {
  static const uint8_t section[4];
  count = any_size(MOST);
#if SECTION == 3
  first_word = any_size((size_t)1 << 40);
  const rim_nominal m = {.section = section};
  (void)values_ok(&m, first_word, count, nondet_bool());
#else
  (void)finite_numbers(section, count, nondet_bool());
#endif
  return 0;
}
