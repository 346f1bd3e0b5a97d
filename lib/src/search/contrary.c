/* SPDX-License-Identifier: MIT */
/* A run has effects of its own (an offset, a gain), so what reads low in one part of a run and
 * what reads high in the rest explain nearly the same. They differ in the baseline that they leave:
 * one of them needs run effects that healthy runs do not have. A shift is meant against nominal, so
 * that one is the wrong way round. */
#include "base/bytes.h"
#include "base/cholesky.h"
#include "base/real.h"
#include "search/search_private.h"

#define IMPOSSIBLE 2.0  /* nats: a baseline that no healthy run has */
#define SAID_FIRST 0.05 /* of its score: the nats more that it takes to turn a sign that was said */
#define MUCH_LIKELIER 0.3 /* share of these nats that the contrary's baseline may have */
#define AS_GOOD 0.5       /* of the score: what the contrary explains at least */
#define CONTRARY 4u
#define CLEARLY 4.0 /* nats that the contrary is likelier by, its baseline counted ... */
#define BY_BASELINE 2.0 /* ... of which so many by that: ratios also differ by their shapes */

double rimi_search_baseline(rim_search *s, const search_hypothesis *h) {
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
  return rimi_search_surprise(k, s->config.noise->runs, q) /
         (double)rimi_le_f32(c.phi, SEARCH_FIELD);
}

/* What may say the same of the rest of the run, at most CONTRARY: what lies beside h, in h's shape;
 * of a shift also the best region, what lies beside that, and what came and went. */
static uint32_t contraries(rim_search *s, uint32_t channel, const search_hypothesis *h,
                           search_hypothesis other[CONTRARY]) {
  if (h->shape != SEARCH_CONSTANT) {
    if (rimi_search_beside(s, channel, h, &other[0]))
      rimi_search_place(s, channel, &other[0]);
    return 1u;
  }
  other[0] = *rimi_search_region(s, channel);
  (void)rimi_search_beside(s, channel, h, &other[1]);
  (void)rimi_search_passed(s, channel, NULL, &other[2]);
  if (!(other[0].score > SEARCH_NONE))
    return 3u;
  (void)rimi_search_beside(s, channel, &other[0], &other[3]);
  return CONTRARY;
}

bool rimi_search_against_nominal(rim_search *s, uint32_t channel, search_hypothesis *h,
                                 bool is_known, double *onset_sd) {
  rimi_search_ready(s, channel);
  if (h->family == SEARCH_GAIN || h->family == SEARCH_FIELD)
    return false;
  rimi_search_take_shape(s, (search_shape)h->shape);
  const double nats = rimi_search_baseline(s, h);
  if (nats < IMPOSSIBLE + (is_known ? SAID_FIRST * (double)h->score : 0.0))
    return false;
  search_hypothesis other[CONTRARY];
  const uint32_t count = contraries(s, channel, h, other);
  const search_hypothesis *best = NULL;
  double least = nats;
  for (uint32_t i = 0; i < count; ++i) {
    if (!(other[i].score > SEARCH_NONE) || (double)other[i].score < AS_GOOD * (double)h->score)
      continue;
    const double left = rimi_search_baseline(s, &other[i]);
    const bool is_likelier =
        left <= MUCH_LIKELIER * nats ||
        (!is_known && nats - left >= BY_BASELINE &&
         (double)other[i].score - left >= (double)h->score - nats + CLEARLY);
    if (is_likelier && left < least) {
      least = left;
      best = &other[i];
    }
  }
  if (best == NULL)
    return false;
  *h = *best;
  *onset_sd = rimi_search_sd_of_onset(s, h);
  return true;
}
