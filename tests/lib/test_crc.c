/* SPDX-License-Identifier: MIT */
/* Check values of the catalogue of CRCs and of the FNV page; slow bitwise forms; continuation. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/rng.h"

#define SEED 77u

static uint8_t data[4096];

static uint32_t slow_crc32(const uint8_t *p, size_t n) {
  uint32_t crc = 0xffffffff;
  for (size_t i = 0; i < n; ++i) {
    crc ^= p[i];
    for (int b = 0; b < 8; ++b) {
      crc = (crc & 1u) != 0 ? crc >> 1 ^ UINT32_C(0xedb88320) : crc >> 1;
    }
  }
  return ~crc;
}

static uint8_t slow_crc8(const uint8_t *p, size_t n) {
  unsigned crc = 0xff;
  for (size_t i = 0; i < n; ++i) {
    crc ^= p[i];
    for (int b = 0; b < 8; ++b) {
      crc = (crc & 0x80u) != 0 ? (crc << 1 ^ 0x11du) : crc << 1;
    }
  }
  return (uint8_t)(crc ^ 0xffu);
}

static void check_values(void **state) {
  (void)state;
  assert_int_equal(rimi_crc32(0, "123456789", 9), 0xcbf43926);
  assert_int_equal(rimi_crc8(0, "123456789", 9), 0x4b);
  assert_true(rimi_digest(RIM_DIGEST_START, "a", 1) == UINT64_C(0xaf63dc4c8601ec8c));
  assert_true(rimi_digest(RIM_DIGEST_START, "foobar", 6) == UINT64_C(0x85944171f73967e8));
}

static void nothing_changes_nothing(void **state) {
  (void)state;
  assert_int_equal(rimi_crc32(0, NULL, 0), 0);
  assert_int_equal(rimi_crc8(0, NULL, 0), 0);
  assert_true(rimi_digest(RIM_DIGEST_START, NULL, 0) == RIM_DIGEST_START);
}

static void equals_the_slow_form_and_continues(void **state) {
  (void)state;
  for (size_t n = 0; n < sizeof data; n += 37) {
    const size_t cut = n / 3;
    const uint32_t crc = rimi_crc32(0, data, n);
    assert_int_equal(crc, slow_crc32(data, n));
    assert_int_equal(rimi_crc32(rimi_crc32(0, data, cut), data + cut, n - cut), crc);
    assert_int_equal(rimi_crc8(0, data, n), slow_crc8(data, n));
    assert_int_equal(rimi_crc8(rimi_crc8(0, data, cut), data + cut, n - cut), slow_crc8(data, n));
    assert_true(rimi_digest(rimi_digest(RIM_DIGEST_START, data, cut), data + cut, n - cut) ==
                rimi_digest(RIM_DIGEST_START, data, n));
  }
}

static void numbers_are_hashed_little_endian(void **state) {
  (void)state;
  static const uint8_t minus_two[8] = {0, 0, 0, 0, 0, 0, 0, 0xc0}, word[4] = {4, 3, 2, 1};
  assert_true(rimi_digest_f64(RIM_DIGEST_START, -2.0) ==
              rimi_digest(RIM_DIGEST_START, minus_two, 8));
  assert_true(rimi_digest_u32(RIM_DIGEST_START, 0x01020304) ==
              rimi_digest(RIM_DIGEST_START, word, 4));
  assert_true(rimi_digest_f64(RIM_DIGEST_START, 0.0) != rimi_digest_f64(RIM_DIGEST_START, -0.0));
}

static void every_flipped_bit_shows(void **state) {
  (void)state;
  const uint32_t crc = rimi_crc32(0, data, 64);
  const uint8_t small = rimi_crc8(0, data, 15);
  for (size_t bit = 0; bit < 64 * 8; ++bit) {
    data[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_not_equal(rimi_crc32(0, data, 64), crc);
    assert_true(bit >= 15 * 8 || rimi_crc8(0, data, 15) != small);
    data[bit / 8] ^= (uint8_t)(1u << bit % 8);
  }
}

static uint32_t sum_of(int which, uint32_t start, const double *at, size_t words) {
  return which == 0   ? rimi_word_sum(start, at, words)
         : which == 1 ? rimi_upper_sum(start, at, words / 2u)
                      : rimi_byte_sum(start, at, words);
}

/* Of every length, so that each word goes through every way of taking it; and the start counts. */
static void sums_show_every_flipped_bit_of_a_word(void **state) {
  (void)state;
  double aligned[24];
  memcpy(aligned, data, sizeof aligned);
  uint8_t *byte = (uint8_t *)aligned;
  const uint16_t one = 1;
  const size_t upper = *(const uint8_t *)&one == 1 ? 4 : 0;
  for (size_t n = 1; n <= 48; ++n) {
    for (int which = 0; which < 3; ++which) {
      const uint32_t sum = sum_of(which, 7, aligned, n);
      const size_t bytes = which == 0 ? 4 * n : which == 1 ? n / 2 * 8 : n;
      assert_true(bytes == 0 || sum_of(which, 8, aligned, n) != sum);
      for (size_t bit = 0; bit < 8 * sizeof aligned; ++bit) {
        const bool counts =
            bit / 8 < bytes && (which != 1 || (bit / 8 % 8 >= upper && bit / 8 % 8 < upper + 4));
        byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_int_equal(sum_of(which, 7, aligned, n) != sum, counts);
        byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
      }
    }
  }
}

static uint32_t pair_after(uint32_t sum, uint32_t first, uint32_t second) {
  return ((sum << 5 | sum >> 27) ^ first) * UINT32_C(0x9e3779b1) + second;
}

/* Eight words by the four sums that base/crc.c describes, joined in their order. */
static void eight_words_go_into_four_sums(void **state) {
  (void)state;
  uint32_t word[8], lane[4];
  memcpy(word, data, sizeof word);
  for (uint32_t k = 0; k < 4; ++k)
    lane[k] = pair_after(1u + k, word[2 * k], word[2 * k + 1]);
  uint32_t sum = 7;
  for (uint32_t k = 0; k < 4; ++k)
    sum = pair_after(sum, lane[k], 0);
  assert_int_equal(rimi_word_sum(7, word, 8), sum);
  assert_int_equal(rimi_byte_sum(7, word, 8), pair_after(7, word[0], word[1])); /* or one by one */
}

/* Two words that change places, and two flips in the highest bit of two words: what a plain sum or
 * an exclusive or would miss. Of the two words of a pair it is missed, which base/crc.h says. */
static void sums_show_two_damaged_words(void **state) {
  (void)state;
  uint32_t word[40];
  memcpy(word, data, sizeof word);
  const uint32_t sum = rimi_word_sum(0, word, 40);
  for (size_t i = 0; i < 40; ++i) {
    for (size_t k = i + 1; k < 40; ++k) {
      const uint32_t first = word[i], second = word[k];
      word[i] = second;
      word[k] = first;
      assert_int_not_equal(rimi_word_sum(0, word, 40), sum);
      word[i] = first ^ UINT32_C(0x80000000);
      word[k] = second ^ UINT32_C(0x80000000);
      assert_true(rimi_word_sum(0, word, 40) != sum || (i % 2 == 0 && k == i + 1));
      word[i] = first;
      word[k] = second;
    }
  }
  assert_int_equal(rimi_word_sum(0, word, 40), sum);
}

int main(void) {
  printf("seed %u\n", SEED);
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 0);
  for (size_t i = 0; i < sizeof data; ++i) {
    data[i] = (uint8_t)rimi_rng_u32(&rng);
  }
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(check_values),
      cmocka_unit_test(nothing_changes_nothing),
      cmocka_unit_test(equals_the_slow_form_and_continues),
      cmocka_unit_test(numbers_are_hashed_little_endian),
      cmocka_unit_test(every_flipped_bit_shows),
      cmocka_unit_test(sums_show_every_flipped_bit_of_a_word),
      cmocka_unit_test(eight_words_go_into_four_sums),
      cmocka_unit_test(sums_show_two_damaged_words),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
