/* SPDX-License-Identifier: MIT */
/* rim/crc.h - check sums of images and frames, and the digest of a replay.
 *
 * All are functions of bytes in memory order and can be continued: f(f(start, a), b) equals
 * f(start, ab). data may be NULL when bytes is 0. Cost O(bytes), constant tables of 80 bytes, no
 * state. */
#ifndef RIM_CRC_H
#define RIM_CRC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_DIGEST_START UINT64_C(0xcbf29ce484222325) /* FNV-1a 64 offset basis */

/* Returns the CRC-32 of IEEE 802.3 (reflected 0x04c11db7, as zlib's crc32); start with crc 0. */
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes);

/* Returns the CRC-8 of SAE J1850 (0x1d, preset and final 0xff); start with crc 0. */
uint8_t rimi_crc8(uint8_t crc, const void *data, size_t bytes);

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
