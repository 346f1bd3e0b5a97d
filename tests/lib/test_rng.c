/* SPDX-License-Identifier: MIT */
/* Known answers of Philox4x32-10 (Salmon et al., Random123 kat_vectors), and what the draws
 * promise. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"

#define SEED 20260101u

static void known_answers(void **state) {
  (void)state;
  static const struct {
    uint32_t counter[4], key[2], block[4];
  } vectors[3] = {
      {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
      {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
       {0xffffffff, 0xffffffff},
       {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
      {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
       {0xa4093822, 0x299f31d0},
       {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
  };
  for (size_t i = 0; i < 3; ++i) {
    uint32_t block[4];
    rimi_rng_block(vectors[i].key, vectors[i].counter, block);
    assert_memory_equal(block, vectors[i].block, sizeof block);
  }
}

static void words_are_the_blocks_in_order(void **state) {
  (void)state;
  const uint64_t seed = UINT64_C(0x0123456789abcdef), stream = UINT64_C(0xfedcba9876543210);
  rim_rng rng;
  rimi_rng_seed(&rng, seed, stream);
  for (uint32_t b = 0; b < 5; ++b) {
    const uint32_t key[2] = {0x89abcdef, 0x01234567};
    const uint32_t counter[4] = {b, 0, 0x76543210, 0xfedcba98};
    uint32_t block[4];
    rimi_rng_block(key, counter, block);
    for (int i = 0; i < 4; ++i) {
      assert_int_equal(rimi_rng_u32(&rng), block[i]);
    }
  }
}

static void seek_and_carry(void **state) {
  (void)state;
  rim_rng a, b;
  rimi_rng_seed(&a, SEED, 7);
  rimi_rng_seed(&b, SEED, 7);
  for (int i = 0; i < 4 * 9; ++i) {
    (void)rimi_rng_u32(&a);
  }
  (void)rimi_rng_u32(&b); /* seek forgets a block begun */
  rimi_rng_seek(&b, 9);
  for (int i = 0; i < 10; ++i) {
    assert_int_equal(rimi_rng_u32(&a), rimi_rng_u32(&b));
  }
  rimi_rng_seek(&a, UINT64_C(0xffffffff));
  for (int i = 0; i < 4; ++i) {
    (void)rimi_rng_u32(&a);
  }
  rimi_rng_seek(&b, UINT64_C(0x100000000));
  assert_int_equal(rimi_rng_u32(&a), rimi_rng_u32(&b));
}

static void streams_differ(void **state) {
  (void)state;
  rim_rng a, b, c;
  rimi_rng_seed(&a, SEED, 0);
  rimi_rng_seed(&b, SEED, 1);
  rimi_rng_seed(&c, SEED + 1, 0);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const uint32_t x = rimi_rng_u32(&a);
    equal += x == rimi_rng_u32(&b);
    equal += x == rimi_rng_u32(&c);
  }
  assert_int_equal(equal, 0);
}

static void uniform_is_open_and_even(void **state) {
  (void)state;
  enum { N = 100000, CELLS = 64 };
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 2);
  double sum = 0.0, square = 0.0, chi2 = 0.0;
  int count[CELLS] = {0};
  for (int i = 0; i < N; ++i) {
    const double u = rimi_rng_uniform(&rng);
    assert_true(u > 0.0 && u < 1.0);
    sum += u;
    square += u * u;
    count[(int)(u * CELLS)] += 1;
  }
  for (int i = 0; i < CELLS; ++i) {
    chi2 += pow(count[i] - (double)N / CELLS, 2.0) / ((double)N / CELLS);
  }
  assert_true(fabs(sum / N - 0.5) < 4.0 * sqrt(1.0 / 12.0 / N));
  assert_true(fabs(square / N - 1.0 / 3.0) < 4.0 * sqrt(4.0 / 45.0 / N));
  assert_true(chi2 < 63.0 + 4.0 * sqrt(2.0 * 63.0));
}

static void uniform_at_its_ends(void **state) {
  (void)state;
  rim_rng rng = {.block = {0, 0, 0xffffffff, 0xffffffff}, .left = 4};
  assert_true(rimi_rng_uniform(&rng) == 0x1p-53);
  assert_true(rimi_rng_uniform(&rng) == 1.0 - 0x1p-53);
}

static void normal_has_its_moments(void **state) {
  (void)state;
  enum { N = 200000 };
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 3);
  double m[5] = {0};
  for (int i = 0; i < N; ++i) {
    const double z = rimi_rng_normal(&rng);
    assert_true(fabs(z) <= 8.21);
    for (int k = 1; k <= 4; ++k) {
      m[k] += pow(z, k) / N;
    }
  }
  assert_true(fabs(m[1]) < 4.0 / sqrt(N));
  assert_true(fabs(m[2] - 1.0) < 4.0 * sqrt(2.0 / N));
  assert_true(fabs(m[3]) < 4.0 * sqrt(15.0 / N));
  assert_true(fabs(m[4] - 3.0) < 4.0 * sqrt(96.0 / N));
}

static void below_is_below_and_even(void **state) {
  (void)state;
  enum { N = 70000 };
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 4);
  int count[7] = {0};
  for (int i = 0; i < N; ++i) {
    const uint32_t k = rimi_rng_below(&rng, 7);
    assert_true(k < 7);
    count[k] += 1;
  }
  for (int i = 0; i < 7; ++i) {
    assert_true(abs(count[i] - N / 7) < 400);
  }
  assert_int_equal(rimi_rng_below(&rng, 0), 0);
  assert_int_equal(rimi_rng_below(&rng, 1), 0);
  rim_rng end = {.block = {0, 0, 0, 0xffffffff}, .left = 1};
  assert_int_equal(rimi_rng_below(&end, 0xffffffff), 0xfffffffe);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(known_answers),
      cmocka_unit_test(words_are_the_blocks_in_order),
      cmocka_unit_test(seek_and_carry),
      cmocka_unit_test(streams_differ),
      cmocka_unit_test(uniform_is_open_and_even),
      cmocka_unit_test(uniform_at_its_ends),
      cmocka_unit_test(normal_has_its_moments),
      cmocka_unit_test(below_is_below_and_even),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
