/* SPDX-License-Identifier: MIT */
/* Every pass of the search over what was observed, by any mask, in any search whose counts are in
 * range: it ends after at most the blocks held, each block is one of them, and its row is its own
 * in the ring. For rings of up to RING blocks of 4 features: nothing in the pass depends on how
 * many there are. */
#include "any.h"
#include "search_private.h"

enum { FEATURES = 4 };

static uint8_t features[RING * FEATURES];
static rim_search search;

/* The one array that a pass looks at has memory of its own here: what leaves it is found. */
static void *search_at(const rim_search *s, uint32_t offset) {
  (void)s, (void)offset;
  return features;
}

int main(void) {
  rim_search any;
  search_mask mask;
  search = any;
  search.config.features = FEATURES;
  __ESBMC_assume(search.config.ring >= 1 && search.config.ring <= RING);
  __ESBMC_assume(search.held <= search.config.ring && search.head < search.config.ring);
  __ESBMC_assume(mask.dims <= 2 && mask.feature[0] < FEATURES && mask.feature[1] < FEATURES);
  uint32_t turns = 0;
  for (search_walk w = search_walk_from(&search, &mask); search_walk_next(&w); ++turns) {
    const size_t at = (size_t)(w.feature - features);
    __ESBMC_assert(w.i < search.held, "held");
    __ESBMC_assert(at == (size_t)search_slot(&search, w.i) * FEATURES, "its own row");
#ifdef WRONG /* a row less than there are: the proof has to fail */
    __ESBMC_assert(at / FEATURES + 1u < search.config.ring, "of the ring");
#else
    __ESBMC_assert(at / FEATURES < search.config.ring, "of the ring");
#endif
  }
  __ESBMC_assert(turns <= search.held, "it ends");
  return 0;
}
