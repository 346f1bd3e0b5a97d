/* SPDX-License-Identifier: MIT */
/* Of the search over rows with predictions: what monitor/guard.h sums, and what must hold of it. */
#include "base/crc.h"
#include "base/real.h"
#include "search/select_private.h"

const void *rimi_select_control(const rim_select *e, size_t *bytes) {
  *bytes = offsetof(struct rim_select, root);
  return e;
}

uint32_t rimi_select_held(const rim_select *e) { return e->held; }
uint32_t rimi_select_next_slot(const rim_select *e) { return e->head; }

uint32_t rimi_select_slot_sum(const rim_select *e, uint32_t slot) {
  const uint32_t sum = rimi_byte_sum(slot + 1u, select_row(e, slot), 4u * (size_t)e->words);
  return rimi_byte_sum(sum, select_residual(e, slot), 2u * (size_t)e->channels);
}

uint32_t rimi_select_tables_sum(const rim_select *e) {
  return rimi_word_sum(0, e->root, sizeof e->root / 4u);
}

bool rimi_select_bins_hold(const rim_select *e, uint32_t feature) {
  const rim_bins table = select_bins(e);
  const size_t first = (size_t)feature * e->bins;
  uint32_t count = 0;
  for (uint32_t b = 0; b < e->bins; ++b)
    count += table.count[first + b];
  /* Every halving rounds each bin towards 0, and halves what those before it lost. */
  const uint32_t rounded = e->total > RIM_BINS_MAX_COUNT ? e->bins : 0u;
  if (e->count - count > rounded)
    return false;
  for (uint32_t c = 0; c < e->channels; ++c) {
    double steps = 0.0;
    for (uint32_t b = 0; b < e->bins; ++b)
      steps += (double)table.sum[(first + b) * e->channels + c];
    const double off = rimi_abs(steps - select_channel(e, c)->sum / SELECT_RESIDUAL_STEP);
    if (!(off <= (double)rounded))
      return false;
  }
  return true;
}

bool rimi_select_indices_hold(const rim_select *e) {
  bool hold = true;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    const pair_state *p = select_pair(e, i);
    hold = hold && p->active <= 1u && p->exact <= 1u && p->x < e->features && p->y < e->features &&
           p->channel < e->channels && p->cursor < e->chains && p->which < e->chains;
  }
  for (uint32_t c = 0; hold && c < e->channels; ++c) {
    const uint32_t feature = select_channel(e, c)->best_feature;
    hold = feature < e->features && select_slice(e, c, feature)->first < e->bins &&
           select_slice(e, c, feature)->last < e->bins;
  }
  return hold;
}
