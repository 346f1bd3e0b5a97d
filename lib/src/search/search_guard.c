/* SPDX-License-Identifier: MIT */
/* Of both searches: what monitor/guard.h sums, and what must hold of it. */
#include "base/crc.h"
#include "base/real.h"
#include "search/search_private.h"

#define CHANNELS_A_ROW 3u

const void *rimi_search_control(const rim_search *s, size_t *bytes) {
  *bytes = offsetof(struct rim_search, bins);
  return s;
}

uint32_t rimi_search_held(const rim_search *s) { return s->held; }
uint32_t rimi_search_next_slot(const rim_search *s) { return s->head; }

uint32_t rimi_search_slot_sum(const rim_search *s, uint32_t slot) {
  const uint32_t fine = search_fine(s);
  const uint8_t few[4] = {(uint8_t)search_activities(s)[slot], search_disturbances(s)[slot],
                          search_apart(s)[slot], 0};
  uint32_t first[2];
  RIM_COPY(first, &search_times(s)[slot], 4);
  RIM_COPY(first + 1, few, 4);
  uint32_t sum = rimi_word_sum(slot + 1u, first, 2);
  sum = rimi_byte_sum(sum, search_features(s, slot), s->config.features);
  sum = rimi_byte_sum(sum, search_means(s, slot), s->config.means);
  sum = rimi_byte_sum(sum, search_predictions(s, slot), fine);
  sum = rimi_byte_sum(sum, search_fine_residuals(s, slot), 2u * (size_t)fine);
  return rimi_byte_sum(sum, search_coarse_residuals(s, slot), s->config.channels - fine);
}

uint32_t rimi_search_effects_sum(const rim_search *s) {
  const size_t floats = (size_t)search_gram_floats(s) * s->config.channels + s->config.outcomes;
  return rimi_word_sum(0, search_gram(s, 0), floats); /* with search_before() */
}

static bool is_hypothesis(const rim_search *s, const search_hypothesis *h) {
  return h->family <= SEARCH_DURING && h->shape <= SEARCH_KEPT &&
         h->feature[0] < s->config.features && h->feature[1] < s->config.features &&
         h->first[0] < SEARCH_BINS && h->first[1] < SEARCH_BINS && h->last[0] < SEARCH_BINS &&
         h->last[1] < SEARCH_BINS;
}

bool rimi_search_indices_hold(const rim_search *s) {
  for (uint32_t i = 0; i < CHANNELS_A_ROW; ++i) {
    const uint32_t channel = ((uint32_t)s->channel + i) % s->config.channels;
    const channel_state *state = search_state(s, channel);
    if (!is_hypothesis(s, &state->time) || !is_hypothesis(s, &state->region))
      return false;
  }
  return is_hypothesis(s, &s->placed) && s->top_feature < s->config.features &&
         s->p_at < search_fine(s);
}

bool rimi_search_is_taking_out(const rim_search *s) {
  uint32_t any = 0;
  for (uint32_t i = 0; i < SEARCH_MAX_CHANNELS / 32u; ++i)
    any |= s->excludes[i];
  return any != 0;
}
