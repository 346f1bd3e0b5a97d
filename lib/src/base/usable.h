/* SPDX-License-Identifier: MIT */
/* Numbers that may be calculated with, and counters that stay at their largest. Private to
 * lib/. */
#ifndef RIM_SRC_USABLE_H
#define RIM_SRC_USABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
