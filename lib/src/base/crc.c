/* SPDX-License-Identifier: MIT */
#include "base/crc.h"

#include "base/real.h"

#define FNV_PRIME UINT64_C(0x100000001b3)

/* By half bytes: entry i is the remainder of i under the reflected polynomial 0xedb88320. */
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes) {
  static const uint32_t table[16] = {
      0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
      0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
      0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
  };
  const uint8_t *p = data;
  crc = ~crc;
  for (size_t i = 0; i < bytes; ++i) {
    crc ^= p[i];
    crc = crc >> 4 ^ table[crc & 15u];
    crc = crc >> 4 ^ table[crc & 15u];
  }
  return ~crc;
}

/* By half bytes: entry i is the remainder of i x^8 under x^8 + x^4 + x^3 + x^2 + 1. */
uint8_t rimi_crc8(uint8_t crc, const void *data, size_t bytes) {
  static const uint8_t table[16] = {
      0x00, 0x1d, 0x3a, 0x27, 0x74, 0x69, 0x4e, 0x53,
      0xe8, 0xf5, 0xd2, 0xcf, 0x9c, 0x81, 0xa6, 0xbb,
  };
  const uint8_t *p = data;
  uint32_t c = (uint32_t)crc ^ 0xffu;
  for (size_t i = 0; i < bytes; ++i) {
    c ^= p[i];
    c = ((c << 4) & 0xffu) ^ table[c >> 4];
    c = ((c << 4) & 0xffu) ^ table[c >> 4];
  }
  return (uint8_t)(c ^ 0xffu);
}

#define WORD_SUM_FACTOR UINT32_C(0x9e3779b1) /* odd, so that multiplying loses nothing */

/* Turned, so that the highest bits reach the others: two damaged signs would cancel otherwise, as
 * they still do within one pair. The second word of a pair is added, by the instruction that
 * multiplies where there is one. */
static inline uint32_t take_pair(uint32_t sum, uint32_t first, uint32_t second) {
  return ((sum << 5 | sum >> 27) ^ first) * WORD_SUM_FACTOR + second;
}

/* Four sums beside each other: in one sum, a product has to wait for the one before it. They begin
 * anew in each call, so that they do not wait for the call before either. They are variables of
 * their own, not an array, so that no compiler makes vectors of them: many processors have no
 * product of vectors, and make it from shifts. */
typedef struct lanes {
  uint32_t a, b, c, d;
} lanes;
enum { AT_ONCE = 8 };

/* Each of the four can be found again from this, the sum and the other three. */
static inline uint32_t join(uint32_t sum, const lanes *l) {
  return take_pair(take_pair(take_pair(take_pair(sum, l->a, 0), l->b, 0), l->c, 0), l->d, 0);
}

/* Word by word: a copy of several goes through the stack where registers are few. */
static inline uint32_t aligned_word(const unsigned char *p) {
  uint32_t word;
  RIM_COPY(&word, __builtin_assume_aligned(p, 4), 4);
  return word;
}

/* Of words that lie `stride` bytes apart; inlined, so that the stride is a constant. */
static inline uint32_t sum_of(uint32_t sum, const unsigned char *p, size_t words, size_t stride) {
  if (words >= AT_ONCE) {
    lanes l = {1, 2, 3, 4};
    for (const unsigned char *end = p + words / AT_ONCE * AT_ONCE * stride; p != end;
         p += AT_ONCE * stride) {
      l.a = take_pair(l.a, aligned_word(p), aligned_word(p + stride));
      l.b = take_pair(l.b, aligned_word(p + 2 * stride), aligned_word(p + 3 * stride));
      l.c = take_pair(l.c, aligned_word(p + 4 * stride), aligned_word(p + 5 * stride));
      l.d = take_pair(l.d, aligned_word(p + 6 * stride), aligned_word(p + 7 * stride));
    }
    sum = join(sum, &l);
    words %= AT_ONCE;
  }
  for (; words >= 2; words -= 2, p += 2 * stride)
    sum = take_pair(sum, aligned_word(p), aligned_word(p + stride));
  return words > 0 ? take_pair(sum, aligned_word(p), 0) : sum;
}

uint32_t rimi_word_sum(uint32_t sum, const void *data, size_t words) {
  return sum_of(sum, data, words, 4);
}

uint32_t rimi_upper_sum(uint32_t sum, const double *data, size_t doubles) {
  const unsigned char *p = (const unsigned char *)data;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  return doubles > 0 ? sum_of(sum, p + 4, doubles, 8) : sum;
#else
  return sum_of(sum, p, doubles, 8);
#endif
}

uint32_t rimi_byte_sum(uint32_t sum, const void *data, size_t bytes) {
  const unsigned char *p = data;
  uint32_t w[2];
  for (; bytes >= 8; bytes -= 8, p += 8) {
    RIM_COPY(w, p, 8);
    sum = take_pair(sum, w[0], w[1]);
  }
  if (bytes >= 4) {
    RIM_COPY(w, p, 4);
    sum = take_pair(sum, w[0], 0);
    bytes -= 4;
    p += 4;
  }
  if (bytes == 0)
    return sum;
  uint32_t word = p[0];
  if (bytes > 1)
    word |= (uint32_t)p[1] << 8;
  if (bytes > 2)
    word |= (uint32_t)p[2] << 16;
  return take_pair(sum, word, 0);
}

uint64_t rimi_digest(uint64_t hash, const void *data, size_t bytes) {
  const uint8_t *p = data;
  for (size_t i = 0; i < bytes; ++i) {
    hash = (hash ^ p[i]) * FNV_PRIME;
  }
  return hash;
}

uint64_t rimi_digest_u32(uint64_t hash, uint32_t value) {
  for (int i = 0; i < 4; ++i) {
    hash = (hash ^ (value & 0xffu)) * FNV_PRIME;
    value >>= 8;
  }
  return hash;
}

uint64_t rimi_digest_f64(uint64_t hash, double value) {
  const uint64_t bits = rimi_bits(value);
  return rimi_digest_u32(rimi_digest_u32(hash, (uint32_t)bits), (uint32_t)(bits >> 32));
}
