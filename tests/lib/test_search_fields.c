/* SPDX-License-Identifier: MIT */
/* Sums over a channel's fields: the usual number of them is written out, and must give the bits of
 * the loop that the others are. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "search/search_private.h"

/* No two alike, and none whose sums or squares are exact. */
static float number(uint32_t j) { return 1.1f / (float)(3u * j + 7u); }

static void every_field_is_added_once(void **state) {
  (void)state;
  for (uint32_t k = 0; k <= NOISE_MAX_FIELDS; ++k) {
    float g[NOISE_MAX_FIELDS], sum[NOISE_MAX_FIELDS];
    double fields[NOISE_MAX_FIELDS];
    for (uint32_t j = 0; j < NOISE_MAX_FIELDS; ++j) {
      g[j] = number(j);
      sum[j] = number(j + 10u);
      fields[j] = (double)number(j + 20u);
    }
    search_add_floats(k, sum, g);
    search_add_fields(k, fields, g);
    for (uint32_t j = 0; j < NOISE_MAX_FIELDS; ++j) {
      const float one = j < k ? number(j + 10u) + number(j) : number(j + 10u);
      const double other = (double)number(j + 20u) + (j < k ? (double)number(j) : 0.0);
      assert_memory_equal(&sum[j], &one, sizeof one);
      assert_memory_equal(&fields[j], &other, sizeof other);
    }
  }
}

static void what_every_field_explains_is_taken_off_in_order(void **state) {
  (void)state;
  double g[NOISE_MAX_FIELDS];
  for (uint32_t j = 0; j < NOISE_MAX_FIELDS; ++j)
    g[j] = 3.3 / (3.0 * (double)j + 7.0); /* of all 53 bits, so that squares are rounded */
  for (uint32_t start = 0; start < 50; ++start) { /* two orders often round alike */
    double left = (double)number(start);
    for (uint32_t k = 0; k <= NOISE_MAX_FIELDS; ++k) {
      const double told = search_unexplained(k, (double)number(start), g);
      assert_memory_equal(&told, &left, sizeof left);
      if (k < NOISE_MAX_FIELDS)
        left -= g[k] * g[k];
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_field_is_added_once),
      cmocka_unit_test(what_every_field_explains_is_taken_off_in_order)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
