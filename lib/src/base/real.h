/* SPDX-License-Identifier: MIT */
/* base/real.h - `double` arithmetic that gives the same bits on every target, without libm.
 *
 * Every function is a fixed sequence of IEEE 754 binary64 additions, multiplications and divisions
 * in round-to-nearest, so that equal inputs give equal bits on any conforming target; this needs
 * FLT_EVAL_METHOD == 0 and -ffp-contract=off. Errors below are in units in the last place (ULP) of
 * the correctly rounded result and are held by tests/lib/test_real.c. None has side effects or
 * raises an error: out of domain is NaN, overflow is infinity. Stack below 200 bytes each. */
#ifndef RIM_REAL_H
#define RIM_REAL_H

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#else
_Static_assert(FLT_EVAL_METHOD == 0,
               "double arithmetic must round to double after every operation");
#endif

#define RIM_LN_2 0x1.62e42fefa39efp-1 /* ln 2 */
#define RIM_LN_SQRT_2PI 0x1.d67f1c864beb5p-1
#define RIM_PI 0x1.921fb54442d18p+1        /* pi */
#define RIM_SQRT_2PI 0x1.40d931ff62706p+1  /* sqrt(2 pi) */
#define RIM_SQRT_HALF 0x1.6a09e667f3bcdp-1 /* sqrt(1/2) */
#define RIM_UNIFORM_SD 0.29                /* 1 / sqrt(12), of a range: what is anywhere in it */

/* memcpy of a few bytes, as a load or store: with -ffreestanding a compiler calls memcpy itself,
 * which costs more than the arithmetic around it. */
#ifdef __GNUC__
#define RIM_COPY __builtin_memcpy
#else
#define RIM_COPY memcpy
#endif

/* Returns the 64 bits of x, and the double with those bits. Exact. */
static inline uint64_t rimi_bits(double x) {
  uint64_t bits;
  RIM_COPY(&bits, &x, sizeof bits);
  return bits;
}

static inline double rimi_from_bits(uint64_t bits) {
  double x;
  RIM_COPY(&x, &bits, sizeof x);
  return x;
}

/* Returns whether x is neither NaN nor infinite, by its bits: holds whatever the compiler assumes.
 */
static inline bool rimi_is_finite(double x) {
  return (rimi_bits(x) & UINT64_C(0x7ff0000000000000)) != UINT64_C(0x7ff0000000000000);
}

/* Returns |x|; exact, clears the sign bit of zero and of NaN too. */
static inline double rimi_abs(double x) {
  return rimi_from_bits(rimi_bits(x) & UINT64_C(0x7fffffffffffffff));
}

/* Returns the smaller (larger) of a and b; b when either is NaN or when they compare equal. */
static inline double rimi_min(double a, double b) { return a < b ? a : b; }
static inline double rimi_max(double a, double b) { return a > b ? a : b; }

/* Returns x limited to [low, high], low when x is NaN. Needs low <= high. */
static inline double rimi_clamp(double x, double low, double high) {
  return x > low ? (x < high ? x : high) : low;
}

/* Returns the largest integer not above x; exact for every x. -0, infinities and NaN as they are.
 */
double rimi_floor(double x);

/* Returns the square root, correctly rounded (0.5 ULP) for every x including subnormals.
 * NaN below zero and for NaN; -0 for -0. */
double rimi_sqrt(double x);

/* Returns e^x within 1 ULP (2 ULP where the result is subnormal). Infinity above 709.79, 0 below
 * -745.14; NaN for NaN. */
double rimi_exp(double x);

/* Returns the natural logarithm within 1 ULP, subnormals included. -infinity for +-0; NaN below
 * zero and for NaN. */
double rimi_log(double x);

/* Returns the sine (cosine) of an angle in radians, with an absolute error below 1e-15 (1 + |x|).
 * NaN for NaN and infinities; |x| must stay below 1e15. */
double rimi_sin(double x);
double rimi_cos(double x);

/* Returns the standard normal distribution function P(N(0,1) <= x) with relative error below 2e-15
 * for x in [-37.5, inf): the lower tail is as good as the middle. 0 below -38.6 and 1 above 8.3;
 * NaN for NaN. For the upper tail use rimi_normal_cdf(-x). */
double rimi_normal_cdf(double x);

/* Returns the x with P(N(0,1) <= x) = p, with relative error below 2e-15 of x for p in [1e-300, 1).
 * -infinity at 0, infinity at 1; NaN outside [0, 1] and for NaN. No loop. */
double rimi_normal_quantile(double p);

#ifdef __cplusplus
}
#endif
#endif
