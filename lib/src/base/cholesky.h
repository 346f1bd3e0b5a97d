/* SPDX-License-Identifier: MIT */
/* Cholesky factors of small symmetric matrices, packed by rows of the lower triangle: element (i,
 * j), j <= i, at i(i+1)/2 + j. Private to lib/. */
#ifndef RIM_SRC_CHOLESKY_H
#define RIM_SRC_CHOLESKY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/real.h"

/* A pivot must keep this part of its diagonal element: below it, what is left is rounding. */
#define CHOLESKY_MIN_PIVOT 1e-14

static inline uint32_t packed_row(uint32_t i) { return i * (i + 1) / 2; }

/* Replaces A by L, A = L L^T; false, with A spoilt, where A is not positive definite or not finite.
 */
static inline bool cholesky_factor(uint32_t n, double *a) {
  for (uint32_t i = 0; i < n; ++i) {
    double *row = a + packed_row(i);
    const double diagonal = row[i];
    for (uint32_t j = 0; j <= i; ++j) {
      const double *other = a + packed_row(j);
      double sum = row[j];
      for (uint32_t k = 0; k < j; ++k) {
        sum -= row[k] * other[k];
      }
      if (j < i) {
        row[j] = sum / other[j];
      } else if (sum > CHOLESKY_MIN_PIVOT * diagonal) { /* sum <= diagonal: above 0, and finite */
        row[i] = rimi_sqrt(sum);
      } else {
        return false;
      }
    }
  }
  return true;
}

/* Replaces b by L^-1 b. */
static inline void cholesky_forward(uint32_t n, const double *l, double *b) {
  for (uint32_t i = 0; i < n; ++i) {
    const double *row = l + packed_row(i);
    double sum = b[i];
    for (uint32_t k = 0; k < i; ++k) {
      sum -= row[k] * b[k];
    }
    b[i] = sum / row[i];
  }
}

/* Replaces b by L^-T b. */
static inline void cholesky_backward(uint32_t n, const double *l, double *b) {
  for (uint32_t i = n; i-- > 0;) {
    double sum = b[i];
    for (uint32_t k = i + 1; k < n; ++k) {
      sum -= l[packed_row(k) + i] * b[k];
    }
    b[i] = sum / l[packed_row(i) + i];
  }
}

/* Replaces L by L^-1. */
static inline void cholesky_invert_factor(uint32_t n, double *l) {
  for (uint32_t j = 0; j < n; ++j) {
    const double inverse = 1.0 / l[packed_row(j) + j];
    for (uint32_t i = j + 1; i < n; ++i) {
      const double *row = l + packed_row(i);
      double sum = row[j] * inverse;
      for (uint32_t k = j + 1; k < i; ++k) {
        sum += row[k] * l[packed_row(k) + j];
      }
      l[packed_row(i) + j] = -sum / row[i];
    }
    l[packed_row(j) + j] = inverse;
  }
}

/* Replaces L^-1 by A^-1 = L^-T L^-1, whose element (i, j), j <= i, is the sum over k >= i of
 * L^-1(k, i) L^-1(k, j): by rows from the top, what is overwritten is not needed again. */
static inline void cholesky_square_inverse(uint32_t n, double *l) {
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (uint32_t k = i; k < n; ++k) {
        sum += l[packed_row(k) + i] * l[packed_row(k) + j];
      }
      l[packed_row(i) + j] = sum;
    }
  }
}

#endif
