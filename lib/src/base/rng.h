/* SPDX-License-Identifier: MIT */
/* rim/rng.h - random numbers from an explicit seed and a counter: Philox4x32-10 (Salmon et al., SC
 * 2011).
 *
 * Word i of stream t under seed s is a pure function of (s, t, i): equal on every target,
 * independent of what other streams drew, and reachable without drawing the words before it. 2^64
 * streams of 2^66 words for each of 2^64 seeds; distinct (seed, stream) never share a block. Not
 * for cryptography. */
#ifndef RIM_RNG_H
#define RIM_RNG_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* State of one stream: copy it to fork it. All zero is the stream 0 of seed 0. */
typedef struct rim_rng {
  uint32_t key[2];     /* seed, low word first */
  uint32_t counter[4]; /* [0..1] next block, [2..3] stream, low words first */
  uint32_t block[4];   /* words of the block last made */
  uint32_t left;       /* words of it not drawn yet, 0..4 */
} rim_rng;

/* Makes the four words of one block: the bijection itself, for tables and tests. O(1). */
void rimi_rng_block(const uint32_t key[2], const uint32_t counter[4], uint32_t block[4]);

/* Puts the generator at word 0 of a stream. Any two values are good. */
void rimi_rng_seed(rim_rng *rng, uint64_t seed, uint64_t stream);

/* Puts the generator at word 4 * block of its stream. */
void rimi_rng_seek(rim_rng *rng, uint64_t block);

/* Returns the next word, uniform over all 2^32. */
uint32_t rimi_rng_u32(rim_rng *rng);

/* Returns a number in the open interval (0, 1): (i + 1/2) 2^-52 with i uniform over 52 bits, so it
 * is exact, symmetric about 1/2, never 0 and never 1. Draws two words. */
double rimi_rng_uniform(rim_rng *rng);

/* Returns a standard normal number, |x| <= 8.21, by inverting the distribution function: two words,
 * no rejection, the same count of draws whatever comes out. */
double rimi_rng_normal(rim_rng *rng);

/* Returns an integer in [0, n) as the upper half of word * n: one word, no rejection. Each value
 * has probability within 2^-32 of 1/n. 0 when n is 0. */
uint32_t rimi_rng_below(rim_rng *rng, uint32_t n);

#ifdef __cplusplus
}
#endif
#endif
