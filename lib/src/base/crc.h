/* SPDX-License-Identifier: MIT */
/* base/crc.h - check sums of images and frames, and the digest of a replay.
 *
 * All are functions of bytes in memory order. CRCs and digests can be continued: f(f(start, a), b)
 * equals f(start, ab). data may be NULL when bytes is 0. Cost O(bytes), constant tables of 80
 * bytes, no state. */
#ifndef RIM_CRC_H
#define RIM_CRC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* FNV-1a 64 offset basis; rim/monitor.h has the same line, for applications. */
#define RIM_DIGEST_START UINT64_C(0xcbf29ce484222325)

/* Returns the CRC-32 of IEEE 802.3 (reflected 0x04c11db7, as zlib's crc32); start with crc 0. */
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes);

/* Returns the CRC-8 of SAE J1850 (0x1d, preset and final 0xff); start with crc 0. */
uint8_t rimi_crc8(uint8_t crc, const void *data, size_t bytes);

/* Returns the sum continued by `words` 32-bit words, data aligned to 4; start with any value. Each
 * word goes in by operations that can be undone, so damage inside one word always changes the sum,
 * and any other is missed once in 2^32, but for the highest bits of both words of a pair, which
 * cancel. It depends on where the data was cut into calls, so compare sums of the same cuts. By the
 * host's byte order: to find damage in memory, not for files. Some 3 instructions per word. */
uint32_t rimi_word_sum(uint32_t sum, const void *data, size_t words);
/* The same of the more significant halves of doubles. */
uint32_t rimi_upper_sum(uint32_t sum, const double *data, size_t doubles);
/* The same of bytes at any alignment, the last word filled up with zeroes. */
uint32_t rimi_byte_sum(uint32_t sum, const void *data, size_t bytes);

/* Returns the FNV-1a 64-bit hash; start with RIM_DIGEST_START. To compare runs, not to
 * authenticate. */
uint64_t rimi_digest(uint64_t hash, const void *data, size_t bytes);

/* Returns the digest continued by the 8 (4) bytes of a value in little-endian order, on any host.
 * Doubles are hashed bit by bit: -0 differs from 0, and NaNs by their payload. */
uint64_t rimi_digest_f64(uint64_t hash, double value);
uint64_t rimi_digest_u32(uint64_t hash, uint32_t value);

#ifdef __cplusplus
}
#endif
#endif
