/* SPDX-License-Identifier: MIT */
#include "base/rng.h"

#include "base/real.h"

#define ROUNDS 10
#define MULTIPLIER_0 UINT32_C(0xd2511f53)
#define MULTIPLIER_1 UINT32_C(0xcd9e8d57)
#define WEYL_0 UINT32_C(0x9e3779b9) /* golden ratio */
#define WEYL_1 UINT32_C(0xbb67ae85) /* sqrt(3) - 1 */

void rimi_rng_block(const uint32_t key[2], const uint32_t counter[4], uint32_t block[4]) {
  uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
  uint32_t k0 = key[0], k1 = key[1];
  for (int round = 0; round < ROUNDS; ++round) {
    const uint64_t p0 = (uint64_t)MULTIPLIER_0 * c0;
    const uint64_t p1 = (uint64_t)MULTIPLIER_1 * c2;
    c0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
    c1 = (uint32_t)p1;
    c2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
    c3 = (uint32_t)p0;
    k0 += WEYL_0;
    k1 += WEYL_1;
  }
  block[0] = c0;
  block[1] = c1;
  block[2] = c2;
  block[3] = c3;
}

void rimi_rng_seed(rim_rng *rng, uint64_t seed, uint64_t stream) {
  *rng = (rim_rng){0};
  rng->key[0] = (uint32_t)seed;
  rng->key[1] = (uint32_t)(seed >> 32);
  rng->counter[2] = (uint32_t)stream;
  rng->counter[3] = (uint32_t)(stream >> 32);
}

void rimi_rng_seek(rim_rng *rng, uint64_t block) {
  rng->counter[0] = (uint32_t)block;
  rng->counter[1] = (uint32_t)(block >> 32);
  rng->left = 0;
}

uint32_t rimi_rng_u32(rim_rng *rng) {
  if (rng->left == 0) {
    rimi_rng_block(rng->key, rng->counter, rng->block);
    rng->counter[0] += 1;
    rng->counter[1] += rng->counter[0] == 0;
    rng->left = 4;
  }
  const uint32_t word = rng->block[(4 - rng->left) & 3u];
  rng->left -= 1;
  return word;
}

double rimi_rng_uniform(rim_rng *rng) {
  const double high = (double)(rimi_rng_u32(rng) >> 6);
  const double low = (double)(rimi_rng_u32(rng) >> 6);
  return (high * 0x1p26 + low + 0.5) * 0x1p-52; /* below 2^52 + 1/2: every step exact */
}

double rimi_rng_normal(rim_rng *rng) { return rimi_normal_quantile(rimi_rng_uniform(rng)); }

uint32_t rimi_rng_below(rim_rng *rng, uint32_t n) {
  return (uint32_t)(((uint64_t)rimi_rng_u32(rng) * n) >> 32);
}
