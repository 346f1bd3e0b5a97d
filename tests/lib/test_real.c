/* SPDX-License-Identifier: MIT */
/* Accuracy is measured against libm in long double (80 bit or better; skipped elsewhere) and held
 * to what base/real.h states; the largest error found is printed. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/real.h"
#include "base/rng.h"

#define SEED 3u
#define WIDE (LDBL_MANT_DIG >= 64)

static rim_rng rng;

/* Error of y in units in the last place of the wide reference. */
static double ulps(double y, long double reference) {
  int exponent = 0;
  (void)frexpl(reference, &exponent);
  const long double unit = ldexpl(1.0L, exponent - 53 < -1074 ? -1074 : exponent - 53);
  return (double)(fabsl((long double)y - reference) / unit);
}

static double between(double low, double high) {
  return low + (high - low) * rimi_rng_uniform(&rng);
}

/* Any positive finite double, by its bits: all magnitudes alike, subnormals included. */
static double any_positive(void) {
  for (;;) {
    const uint64_t high = rimi_rng_u32(&rng) & 0x7fffffffu;
    const double x = rimi_from_bits(high << 32 | rimi_rng_u32(&rng));
    if (rimi_is_finite(x) && x > 0.0) {
      return x;
    }
  }
}

static void finite_abs_min_max(void **state) {
  (void)state;
  assert_true(rimi_is_finite(0.0) && rimi_is_finite(-DBL_MAX) && rimi_is_finite(5e-324));
  assert_false(rimi_is_finite(INFINITY) || rimi_is_finite(-INFINITY) || rimi_is_finite(NAN));
  assert_true(rimi_abs(-2.5) == 2.5 && rimi_bits(rimi_abs(-0.0)) == 0);
  assert_true(rimi_min(1.0, 2.0) == 1.0 && rimi_max(1.0, 2.0) == 2.0);
  assert_true(rimi_min(NAN, 2.0) == 2.0 && rimi_max(NAN, 2.0) == 2.0);
  assert_true(rimi_clamp(3.0, 0.0, 1.0) == 1.0 && rimi_clamp(-3.0, 0.0, 1.0) == 0.0);
  assert_true(rimi_clamp(0.5, 0.0, 1.0) == 0.5 && rimi_clamp(NAN, 0.0, 1.0) == 0.0);
}

static void floor_is_exact(void **state) {
  (void)state;
  static const double special[] = {0.0,    -0.0,    0.5,  -0.5,         1.0,
                                   -1.0,   0x1p52,  -0.1, 0x1p52 - 0.5, -0x1p52 + 0.5,
                                   5e-324, -5e-324, -1.5, INFINITY};
  for (size_t i = 0; i < sizeof special / sizeof special[0]; ++i) {
    assert_true(rimi_bits(rimi_floor(special[i])) == rimi_bits(floor(special[i])));
  }
  assert_true(isnan(rimi_floor(NAN)));
  for (int i = 0; i < 200000; ++i) {
    const double x = i % 2 == 0 ? between(-1e4, 1e4) : any_positive() * (i % 4 == 1 ? 1.0 : -1.0);
    assert_true(rimi_bits(rimi_floor(x)) == rimi_bits(floor(x)));
  }
}

static void sqrt_is_correctly_rounded(void **state) {
  (void)state;
  static const double special[] = {0.0, -0.0, 1.0, 2.0, 4.0, 5e-324, DBL_MIN, DBL_MAX, INFINITY};
  for (size_t i = 0; i < sizeof special / sizeof special[0]; ++i) {
    assert_true(rimi_bits(rimi_sqrt(special[i])) == rimi_bits(sqrt(special[i])));
  }
  assert_true(isnan(rimi_sqrt(-1.0)) && isnan(rimi_sqrt(NAN)) && isnan(rimi_sqrt(-INFINITY)));
  for (int i = 0; i < 1000000; ++i) {
    const double x = any_positive();
    assert_true(rimi_bits(rimi_sqrt(x)) == rimi_bits(sqrt(x)));
  }
  /* Squares, and the doubles next to squares of halves: the hardest to round. */
  for (int i = 0; i < 200000; ++i) {
    const double r = between(1.0, 2.0);
    for (int k = -2; k <= 2; ++k) {
      const double x = rimi_from_bits(rimi_bits(r * r) + (uint64_t)(int64_t)k);
      assert_true(rimi_bits(rimi_sqrt(x)) == rimi_bits(sqrt(x)));
    }
  }
  for (int i = 0; i < 4096; ++i) {
    const double x = rimi_from_bits((UINT64_C(1023) << 52) - 2048 + (uint64_t)i);
    assert_true(rimi_bits(rimi_sqrt(x)) == rimi_bits(sqrt(x)));
    assert_true(rimi_bits(rimi_sqrt(2.0 * x)) == rimi_bits(sqrt(2.0 * x)));
  }
}

static void exp_within_its_bound(void **state) {
  (void)state;
  assert_true(rimi_exp(0.0) == 1.0 && rimi_exp(-0.0) == 1.0);
  assert_true(rimi_exp(710.0) == INFINITY && rimi_exp(INFINITY) == INFINITY &&
              rimi_exp(709.78) < INFINITY);
  assert_true(rimi_exp(0x1.62e42fefa39efp+9) < INFINITY); /* the logarithm of the largest double */
  assert_true(rimi_exp(-746.0) == 0.0 && rimi_exp(-INFINITY) == 0.0 && rimi_exp(-745.13) == 5e-324);
  assert_true(isnan(rimi_exp(NAN)));
  if (!WIDE) {
    skip();
  }
  double worst = 0.0, worst_subnormal = 0.0;
  for (int i = 0; i < 1000000; ++i) {
    const double x = i % 2 == 0 ? between(-708.0, 709.7) : between(-2.0, 2.0);
    worst = fmax(worst, ulps(rimi_exp(x), expl((long double)x)));
  }
  for (int i = 0; i < 50000; ++i) {
    const double x = between(-745.0, -708.5);
    worst_subnormal = fmax(worst_subnormal, ulps(rimi_exp(x), expl((long double)x)));
    const double tiny = ldexp(between(-1.0, 1.0), -(i % 70));
    worst = fmax(worst, ulps(rimi_exp(tiny), expl((long double)tiny)));
  }
  printf("rimi_exp: %.3f ULP, subnormal %.3f ULP\n", worst, worst_subnormal);
  assert_true(worst < 1.0 && worst_subnormal < 2.0);
}

static void log_within_its_bound(void **state) {
  (void)state;
  assert_true(rimi_log(1.0) == 0.0 && rimi_log(0.0) == -INFINITY && rimi_log(-0.0) == -INFINITY);
  assert_true(rimi_log(INFINITY) == INFINITY);
  assert_true(isnan(rimi_log(-1.0)) && isnan(rimi_log(NAN)) && isnan(rimi_log(-INFINITY)));
  if (!WIDE) {
    skip();
  }
  double worst = 0.0;
  for (int i = 0; i < 1000000; ++i) {
    const double x = i % 2 == 0 ? any_positive() : between(0.25, 4.0);
    worst = fmax(worst, ulps(rimi_log(x), logl((long double)x)));
    const double near = 1.0 + ldexp(between(-1.0, 1.0), -(i % 53));
    worst = fmax(worst, ulps(rimi_log(near), logl((long double)near)));
  }
  printf("rimi_log: %.3f ULP\n", worst);
  assert_true(worst < 1.0);
}

static long double wide_cdf(double x) { return 0.5L * erfcl(-(long double)x / sqrtl(2.0L)); }

static void normal_cdf_within_its_bound(void **state) {
  (void)state;
  assert_true(rimi_normal_cdf(0.0) == 0.5);
  assert_true(rimi_normal_cdf(INFINITY) == 1.0 && rimi_normal_cdf(-INFINITY) == 0.0);
  assert_true(rimi_normal_cdf(9.0) == 1.0 && rimi_normal_cdf(-40.0) == 0.0);
  assert_true(isnan(rimi_normal_cdf(NAN)));
  /* The values of Abramowitz and Stegun, table 26.1 and 26.2, do not come from libm. */
  assert_true(fabs(rimi_normal_cdf(1.0) - 0.841344746068543) < 1e-15);
  assert_true(fabs(rimi_normal_cdf(-5.0) / 2.866515718791939e-7 - 1.0) < 1e-14);
  if (!WIDE) {
    skip();
  }
  double worst = 0.0;
  for (int i = 0; i < 400000; ++i) {
    const double x = i % 2 == 0 ? between(-37.5, 9.0) : between(-6.0, 6.0);
    const long double reference = wide_cdf(x);
    worst = fmax(worst, (double)fabsl((long double)rimi_normal_cdf(x) / reference - 1.0L));
  }
  printf("rimi_normal_cdf: relative error %.3g\n", worst);
  assert_true(worst < 2e-15);
}

static void normal_quantile_within_its_bound(void **state) {
  (void)state;
  assert_true(rimi_normal_quantile(0.5) == 0.0);
  assert_true(rimi_normal_quantile(0.0) == -INFINITY && rimi_normal_quantile(1.0) == INFINITY);
  assert_true(isnan(rimi_normal_quantile(-0.1)) && isnan(rimi_normal_quantile(1.1)));
  assert_true(isnan(rimi_normal_quantile(NAN)));
  assert_true(fabs(rimi_normal_quantile(0.975) - 1.959963984540054) < 4e-15);
  if (!WIDE) {
    skip();
  }
  double worst = 0.0;
  for (int i = 0; i < 400000; ++i) {
    const double p = i % 3 == 0   ? pow(10.0, between(-300.0, 0.0))
                     : i % 3 == 1 ? between(0.0, 1.0)
                                  : 0.5 + ldexp(between(-1.0, 1.0), -2 - i % 45);
    const double x = rimi_normal_quantile(p);
    if (x == 0.0) {
      continue;
    }
    /* One Newton step in wide arithmetic finds the error: (cdf(x) - p) / density, in the lower
     * tail. */
    const long double wide = -fabsl((long double)x);
    const long double density = expl(-0.5L * wide * wide) * 0.398942280401432677939946L;
    const long double tail = p < 0.5 ? (long double)p : 1.0L - (long double)p;
    const long double error = (0.5L * erfcl(-wide / sqrtl(2.0L)) - tail) / density;
    worst = fmax(worst, (double)fabsl(error / wide));
  }
  printf("rimi_normal_quantile: relative error %.3g\n", worst);
  assert_true(worst < 2e-15);
}

static void they_are_monotone_and_inverse(void **state) {
  (void)state;
  for (int i = 0; i < 100000; ++i) {
    const double x = between(-30.0, 5.0);
    assert_true(rimi_normal_cdf(x) <= rimi_normal_cdf(x + 1e-6));
    assert_true(fabs(rimi_normal_quantile(rimi_normal_cdf(x)) - x) < 1e-9);
    const double y = any_positive();
    assert_true(fabs(rimi_exp(rimi_log(y)) / y - 1.0) < 1e-12 || y < DBL_MIN);
  }
}

static void sine_and_cosine_are_those_of_libm(void **state) {
  (void)state;
  for (int i = -4000; i <= 4000; ++i) {
    const double x = 0.0137 * i * (i % 3 == 0 ? 100.0 : 1.0);
    assert_true(fabs(rimi_sin(x) - sin(x)) < 1e-15 * (1.0 + fabs(x)));
    assert_true(fabs(rimi_cos(x) - cos(x)) < 1e-15 * (1.0 + fabs(x)));
  }
  assert_true(rimi_sin(0.0) == 0.0 && rimi_cos(0.0) == 1.0);
  assert_true(rimi_sin(NAN) != rimi_sin(NAN) && rimi_cos(INFINITY) != rimi_cos(INFINITY));
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(sine_and_cosine_are_those_of_libm),
      cmocka_unit_test(finite_abs_min_max),
      cmocka_unit_test(floor_is_exact),
      cmocka_unit_test(sqrt_is_correctly_rounded),
      cmocka_unit_test(exp_within_its_bound),
      cmocka_unit_test(log_within_its_bound),
      cmocka_unit_test(normal_cdf_within_its_bound),
      cmocka_unit_test(normal_quantile_within_its_bound),
      cmocka_unit_test(they_are_monotone_and_inverse),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
