/* SPDX-License-Identifier: MIT */
/* Constants printed by tests/lib/generate_real_constants.py; AS 241's are its published decimals.
 */
#include "base/real.h"

#define SIGN UINT64_C(0x8000000000000000)
#define FRACTION UINT64_C(0x000fffffffffffff)
#define HIDDEN UINT64_C(0x0010000000000000)
#define INFINITE UINT64_C(0x7ff0000000000000)
#define NOT_A_NUMBER UINT64_C(0x7ff8000000000000)
#define LEAST_NORMAL 0x1p-1022

/* ln 2 in two parts: k * LN_2_HIGH is exact for |k| < 2^20, for it has 32 bits. */
#define LN_2_HIGH 0x1.62e42feep-1
#define LN_2_LOW 0x1.a39ef35793c76p-33
#define INVERSE_LN_2 0x1.71547652b82fep+0

double rimi_floor(double x) {
  const uint64_t bits = rimi_bits(x);
  const int32_t exponent = (int32_t)(bits >> 52 & 0x7ff) - 1023;
  if (exponent >= 52 || (bits & ~SIGN) == 0) {
    return x;
  }
  if (exponent < 0) {
    return (bits & SIGN) != 0 ? -1.0 : 0.0;
  }
  const uint64_t below_one = FRACTION >> exponent;
  if ((bits & below_one) == 0) {
    return x;
  }
  /* Magnitude grows by less than one unit before the cut; a carry into the exponent is right. */
  return rimi_from_bits(((bits & SIGN) != 0 ? bits + below_one : bits) & ~below_one);
}

/* An approximation of sqrt(m) for m in [1, 4), within 4 units of 2^-52 (3 seen): a seed of
 * 1/sqrt(m) from the bits (3.5 %), four Newton steps (each squares the error and multiplies by
 * 3/2: 1.8e-3, 5e-6, 4e-11, rounding). */
static double sqrt_near(double m) {
  const double half = 0.5 * m;
  double y = rimi_from_bits(UINT64_C(0x5fe6eb50c7b537a9) - (rimi_bits(m) >> 1));
  for (int i = 0; i < 4; ++i) {
    y = y * (1.5 - half * y * y);
  }
  return rimi_clamp(m * y, 1.0, 0x1.fffffffffffffp+0); /* as the root of a double in [1, 4) is */
}

double rimi_sqrt(double x) {
  if (!(x > 0.0) || rimi_bits(x) == INFINITE) {
    return x < 0.0 ? rimi_from_bits(NOT_A_NUMBER) : x;
  }
  int32_t exponent = -1023;
  if (x < LEAST_NORMAL) {
    x *= 0x1p54;
    exponent -= 54;
  }
  const uint64_t bits = rimi_bits(x);
  const uint64_t fraction = bits & FRACTION;
  exponent += (int32_t)(bits >> 52);
  const uint32_t odd = (uint32_t)exponent & 1u;
  const double m = rimi_from_bits((UINT64_C(1023) + odd) << 52 | fraction);
  /* Look for the integer r, 2^52 <= r < 2^53, next to the root of M = m 2^104. It is right when
   * (r - 1/2)^2 < M < (r + 1/2)^2, for integers -r < M - r^2 <= r. The candidate is a few units
   * off, so that |M - r^2| < 2^58: the difference modulo 2^64, read as signed, is exact. */
  uint64_t root = (rimi_bits(sqrt_near(m)) & FRACTION) | HIDDEN;
  uint64_t rest = ((HIDDEN | fraction) << (52 + odd)) - root * root;
  for (int i = 0; i < 8; ++i) {
    if ((rest & SIGN) == 0 && rest > root) {
      rest -= 2 * root + 1;
      root += 1;
    } else if ((rest & SIGN) != 0 && UINT64_C(0) - rest >= root) {
      rest += 2 * root - 1;
      root -= 1;
    } else {
      break;
    }
  }
  const uint64_t biased = (uint64_t)((exponent - (int32_t)odd) / 2 + 1023);
  return rimi_from_bits(biased << 52 | (root & FRACTION));
}

/* y * 2^k for y in (1/2, 2), k in [-1080, 1024]; one rounding where the result is subnormal. */
static double scale(double y, int32_t k) {
  if (k > 1023) {
    return y * 2.0 * 0x1p1023;
  }
  if (k < -1021) {
    return y * rimi_from_bits((uint64_t)(k + 1000 + 1023) << 52) * 0x1p-1000;
  }
  return y * rimi_from_bits((uint64_t)(k + 1023) << 52);
}

/* x = k ln 2 + r, |r| <= 0.3466, r = high - low; e^r = 1 + r + r^2 q(r) by Taylor's series to r^13,
 * which leaves 4e-18. The last sum rounds once at 1/2 ULP; the one before, of size below 0.42, at
 * 1/4. */
double rimi_exp(double x) {
  static const double q[12] = {
      0x1p-1,
      0x1.5555555555555p-3,
      0x1.5555555555555p-5,
      0x1.1111111111111p-7,
      0x1.6c16c16c16c17p-10,
      0x1.a01a01a01a01ap-13,
      0x1.a01a01a01a01ap-16,
      0x1.71de3a556c734p-19,
      0x1.27e4fb7789f5cp-22,
      0x1.ae64567f544e4p-26,
      0x1.1eed8eff8d898p-29,
      0x1.6124613a86d09p-33,
  }; /* 1/2!, 1/3! ... 1/13! */
  if (!(x <= 0x1.62e42fefa39efp+9)) {
    return x > 0.0 ? rimi_from_bits(INFINITE) : x;
  }
  if (x < -745.2) {
    return 0.0;
  }
  const int32_t k = (int32_t)(x * INVERSE_LN_2 + (x < 0.0 ? -0.5 : 0.5));
  const double high = x - (double)k * LN_2_HIGH;
  const double low = (double)k * LN_2_LOW;
  const double r = high - low;
  double sum = q[11];
  for (int i = 10; i >= 0; --i) {
    sum = sum * r + q[i];
  }
  return scale(1.0 + (high - (low - r * r * sum)), k);
}

/* x = 2^k (1 + f), 1 + f in [sqrt 1/2, sqrt 2]. With s = f / (2 + f), ln(1 + f) = 2 artanh s = 2s +
 * s R, R = 2 s^2/3 + 2 s^4/5 + ... to s^20, which leaves 7e-19; as 2s = f - s f and s f = f^2/2 - s
 * f^2/2 it is f - (f^2/2 - s (f^2/2 + R)): the exact f, less what is small. */
double rimi_log(double x) {
  static const double r[10] = {
      0x1.5555555555555p-1, 0x1.999999999999ap-2, 0x1.2492492492492p-2, 0x1.c71c71c71c71cp-3,
      0x1.745d1745d1746p-3, 0x1.3b13b13b13b14p-3, 0x1.1111111111111p-3, 0x1.e1e1e1e1e1e1ep-4,
      0x1.af286bca1af28p-4, 0x1.8618618618618p-4,
  }; /* 2/3, 2/5 ... 2/21 */
  if (!(x > 0.0)) {
    return x == 0.0 ? rimi_from_bits(SIGN | INFINITE) : rimi_from_bits(NOT_A_NUMBER);
  }
  if (rimi_bits(x) >= INFINITE) {
    return x;
  }
  int32_t k = -1023;
  if (x < LEAST_NORMAL) {
    x *= 0x1p54;
    k -= 54;
  }
  k += (int32_t)(rimi_bits(x) >> 52);
  double m = rimi_from_bits((rimi_bits(x) & FRACTION) | UINT64_C(1023) << 52);
  if (m > 2.0 * RIM_SQRT_HALF) {
    m *= 0.5;
    k += 1;
  }
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double sum = r[9];
  for (int i = 8; i >= 0; --i) {
    sum = sum * z + r[i];
  }
  sum *= z;
  const double half_square = 0.5 * f * f;
  const double small = s * (half_square + sum) + (double)k * LN_2_LOW;
  return (double)k * LN_2_HIGH - ((half_square - small) - f);
}

/* P(N(0,1) > a), a >= 0: the density times Mills' ratio M. (a + 1) M(a) is smooth in t = (a - 5)/(a
 * + 5): 24 Chebyshev coefficients leave 2e-17. a^2 is split, a = h + l with h a multiple of 1/256
 * so that h^2 is exact; else the rounding of a^2 would be amplified by a^2 / 2. */
static double upper_tail(double a) {
  static const double mills[24] = {
      0x1.2872883be576dp+0,   -0x1.4e87ca9274ba0p-3,  -0x1.c05e76eee2edap-7,
      0x1.f8fcd6b64802cp-6,   -0x1.09bfeac807c0fp-6,  0x1.7018703a390e4p-8,
      -0x1.728339587dc9bp-10, 0x1.066b573675334p-12,  -0x1.9e36c22e087e5p-16,
      -0x1.0f55666e3c92cp-20, 0x1.926841bcf91aap-21,  -0x1.466de63a54510p-24,
      -0x1.8db4c42ccef91p-27, 0x1.ca231c26da138p-29,  0x1.4b86c7f988e9bp-34,
      -0x1.e85eb5a834d32p-34, 0x1.ede1d4eb50e8bp-39,  0x1.03a00a4999b3cp-38,
      -0x1.0732be7247a5fp-42, -0x1.2adab42f3d38bp-43, 0x1.6577984b5d358p-47,
      0x1.7c2d1d2b7c8c7p-48,  -0x1.84e4456174c0bp-52, -0x1.06ea870cd1c51p-52};
  const double t = (a - 5.0) / (a + 5.0);
  double b0 = 0.0, b1 = 0.0;
  for (int i = 23; i >= 0; --i) {
    const double b2 = b1;
    b1 = b0;
    b0 = 2.0 * t * b1 - b2 + mills[i];
  }
  const double h = rimi_floor(256.0 * a) * 0x1p-8;
  const double l = a - h;
  const double ratio = (b0 - t * b1) / (a + 1.0);
  const double density = rimi_exp(-0.5 * l * (a + h)) * (1.0 / RIM_SQRT_2PI);
  return rimi_exp(-0.5 * h * h) * (density * ratio);
}

double rimi_normal_cdf(double x) {
  if (!(rimi_abs(x) <= 39.0)) {
    return x > 0.0 ? 1.0 : x < 0.0 ? 0.0 : x;
  }
  return x <= 0.0 ? upper_tail(-x) : 1.0 - upper_tail(x);
}

/* Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988) 477-484: numerators and
 * denominators, lowest power first, for |p - 1/2| <= 0.425 and, in sqrt(-ln p), up to 5 and beyond.
 */
static const double middle_over[8] = {
    0x1.b18d91e9eef75p+1,  0x1.0a4888b1a436ep+7,  0x1.ece5d2213c0ccp+10, 0x1.ad1d8cd4ee71dp+13,
    0x1.66c3e869b752ap+15, 0x1.06c1c55b78f20p+16, 0x1.052d26b2e45e4p+15, 0x1.39a296f7d925ep+11};
static const double middle_under[8] = {0x1p+0,
                                       0x1.5281b386e1ab5p+5,
                                       0x1.5797efdc8b3f7p+9,
                                       0x1.512322e75c89fp+12,
                                       0x1.4b772d5d65266p+14,
                                       0x1.3317caa64f4bep+15,
                                       0x1.c0e457cb1ae76p+14,
                                       0x1.46a7eca984b69p+12};
static const double near_over[8] = {
    0x1.6c665fde9526ap+0, 0x1.2857748cab19bp+2, 0x1.713f71462256ap+2, 0x1.d2ecb1a3d02c4p+1,
    0x1.453cc085375b2p+0, 0x1.ef2abb9b85c37p-3, 0x1.744eb6c45ec67p-6, 0x1.9615ac0b7ace9p-11};
static const double near_under[8] = {0x1p+0,
                                     0x1.06cefbb46a449p+1,
                                     0x1.ad278e6526633p+0,
                                     0x1.61292f23385c9p-1,
                                     0x1.2f5123394f040p-3,
                                     0x1.f207a7eab17bfp-7,
                                     0x1.1f18cbfdf2728p-11,
                                     0x1.20d3f686439e4p-30};
static const double far_over[8] = {
    0x1.aa1b1c13ee526p+2, 0x1.5daea6e875003p+2,  0x1.c8ea6461fa445p+0,  0x1.2fad9315255cfp-2,
    0x1.b2b41193b4ee7p-6, 0x1.45c1908425345p-10, 0x1.c6ec6cc59e02ap-16, 0x1.afb74d693bf93p-23};
static const double far_under[8] = {0x1p+0,
                                    0x1.331d34fc7d77fp-1,
                                    0x1.186eb183443fbp-3,
                                    0x1.e76f93215462ap-7,
                                    0x1.9c8bc979dc5d7p-11,
                                    0x1.35c2c496374bfp-16,
                                    0x1.31446f740b9e0p-23,
                                    0x1.269bff1f8c190p-49};

static double rational(const double over[8], const double under[8], double r) {
  double a = over[7], b = under[7];
  for (int i = 6; i >= 0; --i) {
    a = a * r + over[i];
    b = b * r + under[i];
  }
  return a / b;
}

double rimi_normal_quantile(double p) {
  if (!(p > 0.0 && p < 1.0)) {
    return p == 0.0   ? rimi_from_bits(SIGN | INFINITE)
           : p == 1.0 ? rimi_from_bits(INFINITE)
                      : rimi_from_bits(NOT_A_NUMBER);
  }
  const double q = p - 0.5;
  if (rimi_abs(q) <= 0.425) {
    return q * rational(middle_over, middle_under, 0.180625 - q * q);
  }
  const double r = rimi_sqrt(-rimi_log(q < 0.0 ? p : 1.0 - p));
  const double x =
      r <= 5.0 ? rational(near_over, near_under, r - 1.6) : rational(far_over, far_under, r - 5.0);
  return q < 0.0 ? -x : x;
}

/* x = quarter_turns pi/2 + rest, |rest| <= pi/4. pi/2 in two parts, so that the rest is exact where
 * the number of turns is moderate. */
static double reduced(double x, int *quarter) {
  const double turns = rimi_floor(x * (2.0 / RIM_PI) + 0.5);
  *quarter = (int)(turns - 4.0 * rimi_floor(0.25 * turns));
  return (x - turns * 1.57079632673412561417) - turns * 6.07710050650619224932e-11;
}

/* Taylor series; the first term left out is below 1e-17 for |r| <= pi/4. */
static double sine_near_zero(double r) {
  const double s = r * r;
  double sum = 1.0;
  for (int k = 17; k >= 3; k -= 2)
    sum = 1.0 - s * sum / (double)(k * (k - 1));
  return r * sum;
}

static double cosine_near_zero(double r) {
  const double s = r * r;
  double sum = 1.0;
  for (int k = 18; k >= 2; k -= 2)
    sum = 1.0 - s * sum / (double)(k * (k - 1));
  return sum;
}

static double sine_of_quarter(double r, int quarter) {
  const double size = (quarter & 1) != 0 ? cosine_near_zero(r) : sine_near_zero(r);
  return (quarter & 2) != 0 ? -size : size;
}

double rimi_sin(double x) {
  if (!rimi_is_finite(x))
    return x - x;
  int quarter;
  const double r = reduced(x, &quarter);
  return sine_of_quarter(r, quarter);
}

double rimi_cos(double x) {
  if (!rimi_is_finite(x))
    return x - x;
  int quarter;
  const double r = reduced(x, &quarter);
  return sine_of_quarter(r, quarter + 1);
}
