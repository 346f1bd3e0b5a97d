/* SPDX-License-Identifier: MIT */
/* A run has effects of its own (an offset, a gain), so what reads low in one part of a run and
 * what reads high in the rest explain nearly the same. They differ in the baseline that they leave:
 * one of them needs run effects that healthy runs do not have. A shift is meant against nominal, so
 * that one is the wrong way round. */
#include "base/bytes.h"
#include "base/cholesky.h"
#include "base/real.h"
#include "search/search_private.h"

#define IMPOSSIBLE 2.0    /* nats: a baseline that no healthy run has */
#define MUCH_LIKELIER 0.3 /* of these nats: the contrary's baseline has at most so many */
#define AS_GOOD 0.5       /* of the score: what the contrary explains at least */

double rimi_search_baseline(const rim_search *s, const search_hypothesis *h) {
  const noise_channel c = rimi_noise_channel(s->config.noise, s->channel);
  const uint32_t k = c.fields;
  double l[NOISE_MAX_FIELDS * (NOISE_MAX_FIELDS + 1) / 2], b[NOISE_MAX_FIELDS];
  search_sums sums;
  if (k == 0 || h->family == SEARCH_FIELD)
    return 0.0;
  rimi_search_effects(s, &c, l, b);
  rimi_search_sum(s, h, &sums);
  cholesky_backward(k, l, sums.g);
  double q = 0.0;
  for (uint32_t i = 0; i < k; ++i) {
    const double left = b[i] - (double)h->shift * sums.g[i];
    q += left * left * (double)rimi_le_f32(c.inverse_prior, i);
  }
  if (!(q > (double)k) || !rimi_is_finite(q))
    return 0.0;
  return rimi_search_surprise(k, q) / (double)rimi_le_f32(c.phi, SEARCH_FIELD);
}

/* Whether it has the other sign, explains as much, and leaves a baseline of fewer nats. */
static bool is_better(const rim_search *s, const search_hypothesis *h, double nats,
                      const search_hypothesis *contrary) {
  return contrary->score > SEARCH_NONE && (double)contrary->shift * (double)h->shift < 0.0 &&
         (double)contrary->score >= AS_GOOD * (double)h->score &&
         rimi_search_baseline(s, contrary) <= MUCH_LIKELIER * nats;
}

bool rimi_search_against_nominal(rim_search *s, uint32_t channel, search_hypothesis *h) {
  rimi_search_ready(s, channel);
  if (h->family == SEARCH_GAIN || h->family == SEARCH_FIELD)
    return false;
  const double nats = rimi_search_baseline(s, h);
  if (nats < IMPOSSIBLE)
    return false;
  const search_hypothesis region = search_state(s, channel)->region;
  search_hypothesis contrary = region;
  bool found = is_better(s, h, nats, &contrary) ||
               (rimi_search_beside(s, channel, h, &contrary) && is_better(s, h, nats, &contrary)) ||
               (region.score > SEARCH_NONE && rimi_search_beside(s, channel, &region, &contrary) &&
                is_better(s, h, nats, &contrary));
  if (!found) {
    contrary = s->in_time[SEARCH_FIELD];
    found = is_better(s, h, nats, &contrary);
  }
  if (found)
    *h = contrary;
  return found;
}
