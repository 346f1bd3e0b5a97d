/* SPDX-License-Identifier: MIT */
/* Numbers that may be calculated with, and counters that stay at their largest. Private to
 * lib/. */
#ifndef RIM_SRC_USABLE_H
#define RIM_SRC_USABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/real.h"

#define LARGEST_VALUE 1e150 /* squares and products with weights stay finite */

static inline void count(uint32_t *counter) { *counter += *counter < UINT32_MAX; }

static inline bool all_finite(const double *x, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    if (!rimi_is_finite(x[i]))
      return false;
  }
  return true;
}

/* Of numbers in bytes (rimi_le_f32): whether each of them is finite, and above 0. */
static inline bool numbers_are_finite(const uint8_t *array, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    if (!rimi_is_finite((double)rimi_le_f32(array, i)))
      return false;
  }
  return true;
}

static inline bool numbers_are_positive(const uint8_t *array, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    if (!(rimi_le_f32(array, i) > 0.0f))
      return false;
  }
  return numbers_are_finite(array, count);
}

/* A configuration's field of 0, of any type, takes its default. NaN stays, to be refused. */
#define RIM_OR_DEFAULT(field, value)                                                               \
  do {                                                                                             \
    if ((field) == 0)                                                                              \
      (field) = (value);                                                                           \
  } while (0)

/* False for NaN too. */
static inline bool is_usable(double v) { return rimi_abs(v) <= LARGEST_VALUE; }

static inline bool all_usable(const double *v, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    if (!is_usable(v[i]))
      return false;
  }
  return true;
}

#endif
