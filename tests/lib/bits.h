/* SPDX-License-Identifier: MIT */
/* bits.h - a digest of numbers, for tests that results keep their bits: at every optimisation, on
 * every target, and from version to version, for recorded digests and calibrated thresholds hang on
 * them. A change that is meant says so in CHANGELOG.md and puts the digest printed in place. */
#ifndef BITS_H
#define BITS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/real.h"

#define BITS_START UINT64_C(0xcbf29ce484222325)

static inline void take_bits(uint64_t *digest, uint64_t bits) { /* FNV-1a */
  for (unsigned i = 0; i < 64; i += 8)
    *digest = (*digest ^ (bits >> i & 255u)) * UINT64_C(0x100000001b3);
}
/* -0 is 0. */
static inline void take_real(uint64_t *digest, double x) { take_bits(digest, rimi_bits(x + 0.0)); }
static inline void take_reals(uint64_t *digest, const double *x, size_t n) {
  for (size_t i = 0; i < n; ++i)
    take_real(digest, x[i]);
}

static inline void bits_are(uint64_t digest, uint64_t expected) {
  if (digest != expected)
    fail_msg("digest %016llx", (unsigned long long)digest);
}

#endif
