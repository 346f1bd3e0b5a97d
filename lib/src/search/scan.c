/* SPDX-License-Identifier: MIT */
/* Regions: intervals of a feature (App. A, p. 115), boxes of two, with or without an onset. */
#include <string.h>

#include "base/real.h"
#include "search/search_private.h"

void rimi_search_edges(const rim_search *s, uint32_t feature, uint32_t first, uint32_t last,
                       uint32_t *low, uint32_t *high) {
  const uint8_t *cuts = s->config.cuts + (size_t)feature * SEARCH_CUTS;
  *low = first == 0 ? 0u : cuts[first - 1u];
  *high = last >= SEARCH_BINS - 1u ? 255u : (uint32_t)cuts[last] - (cuts[last] > 0 ? 1u : 0u);
}

search_mask rimi_search_mask_of(const rim_search *s, const search_hypothesis *h, int without) {
  search_mask mask;
  memset(&mask, 0, sizeof mask);
  const uint32_t dims = search_dims(h);
  for (uint32_t k = 0; k < dims; ++k) {
    if ((int)k == without)
      continue;
    uint32_t low, high;
    rimi_search_edges(s, h->feature[k], h->first[k], h->last[k], &low, &high);
    mask.feature[mask.dims] = h->feature[k];
    mask.low[mask.dims] = (uint8_t)low;
    mask.high[mask.dims++] = (uint8_t)high;
  }
  const uint32_t oldest = s->count - s->held;
  if (h->onset != SEARCH_FROM_START && h->onset > oldest)
    mask.from = h->onset - oldest;
  if (h->end != 0)
    mask.to = h->end > oldest ? h->end - oldest : 0u;
  if (h->end != 0 && h->end <= oldest) /* it left the ring */
    mask.from = s->held;
  return mask;
}

/* Adds what block i is to a hypothesis to the sums; `later`: of search_together(). */
static inline void add_block(const rim_search *s, uint32_t i, double later, search_sums *sums) {
  sums->n += 1.0;
  sums->d += (double)search_q(s)[i];
  sums->a += (double)search_a0(s)[i] + search_together(s, i, later);
  search_add_fields(s->fields, sums->g, search_g(s, i));
}

void rimi_search_sum(rim_search *s, const search_hypothesis *h, search_sums *sums) {
  rimi_search_take_shape(s, (search_shape)h->shape);
  if (h->family == SEARCH_RAMP || h->family == SEARCH_GAIN) {
    rimi_search_sum_in_time(s, h, sums);
    return;
  }
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  memset(sums, 0, sizeof *sums);
  double later = 0.0;
  for (search_walk w = search_walk_from(s, &mask); search_walk_next(&w);) {
    const bool counts = w.inside && search_a0(s)[w.i] > 0.0f;
    if (counts)
      add_block(s, w.i, later, sums);
    later = search_later(s, w.i, counts, later);
  }
}

double rimi_search_kept_mean(const rim_search *s, const search_hypothesis *h) {
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  double kept = 0.0, sum = 0.0, n = 0.0; /* what a block adds to the later ones inside: as many */
  for (search_walk w = search_walk_from(s, &mask); search_walk_next(&w);) {
    kept = SEARCH_KEEPS * kept + (w.inside ? 1.0 : 0.0);
    sum += w.inside ? kept : 0.0;
    n += w.inside ? 1.0 : 0.0;
  }
  return n > 0.0 ? sum / n : 0.0;
}

void rimi_search_evaluate(rim_search *s, search_hypothesis *h) {
  search_sums sums;
  rimi_search_sum(s, h, &sums);
  rimi_search_judge(s, &sums, h);
}

/* Of each byte of a feature its bin, or, of fewer, its cell: `count` of equal numbers of bins. */
static void bins_of_bytes(const rim_search *s, uint32_t feature, uint32_t count, uint8_t *bin) {
  const uint8_t *cuts = s->config.cuts + (size_t)feature * SEARCH_CUTS;
  uint32_t byte = 0;
  for (uint32_t k = 0; k < SEARCH_BINS; ++k) {
    const uint32_t end = k < SEARCH_CUTS ? cuts[k] : 256u;
    if (end > byte)
      memset(bin + byte, (int)(k * count / SEARCH_BINS), end - byte);
    byte = end > byte ? end : byte;
  }
}

/* As a feature that a scan of bins takes: the block's age. */
#define BY_TIME UINT32_MAX

static inline void add_to_bin(const rim_search *s, uint32_t i, float a, search_bin *to) {
  to->n += 1.0f;
  to->d += search_q(s)[i];
  to->a += a;
  search_add_floats(s->fields, to->g, search_g(s, i));
}

static uint32_t pair_of(uint32_t x, uint32_t y) {
  const uint32_t lo = x < y ? x : y, hi = x < y ? y : x;
  return hi * (hi + 1u) / 2u + lo;
}

/* Of SEARCH_KEPT: every block goes together with all later ones, bin by bin. */
static void fill_kept(rim_search *s, const search_mask *mask, uint32_t feature,
                      const uint8_t *bin) {
  search_bins *bins = &s->bins;
  const float *a0 = search_a0(s), *a1 = search_a1(s);
  double later[SEARCH_BINS] = {0.0};
  for (search_walk w = search_walk_from(s, mask); search_walk_next(&w);) {
    const bool counts = w.inside && a0[w.i] > 0.0f;
    const uint32_t own = bin[w.feature[feature]];
    for (uint32_t k = 0; k < SEARCH_BINS; ++k) {
      later[k] *= SEARCH_KEEPS;
      if (counts)
        bins->pair[pair_of(own, k)] += (float)later[k];
    }
    if (!counts)
      continue;
    add_to_bin(s, w.i, a0[w.i], &bins->bin[own]);
    later[own] += (double)a1[w.i];
  }
}

static void fill_neighbours(rim_search *s, const search_mask *mask, uint32_t feature,
                            const uint8_t *bin) {
  search_bins *bins = &s->bins;
  const float *a0 = search_a0(s), *a1 = search_a1(s);
  uint32_t next = SEARCH_BINS; /* bin of the block after this one, where it is inside */
  for (search_walk w = search_walk_from(s, mask); search_walk_next(&w);) {
    if (!w.inside || !(a0[w.i] > 0.0f)) {
      next = SEARCH_BINS;
      continue;
    }
    const uint32_t own = feature == BY_TIME ? w.i * SEARCH_BINS / s->held : bin[w.feature[feature]];
    add_to_bin(s, w.i, a0[w.i], &bins->bin[own]);
    if (next < SEARCH_BINS)
      bins->pair[pair_of(own, next)] += a1[w.i];
    next = own;
  }
}

/* Sums per bin; pair[hi (hi + 1) / 2 + lo]: what blocks in the bins lo..hi and in hi add to A
 * together. */
static void fill_bins(rim_search *s, const search_mask *mask, uint32_t feature) {
  search_bins *bins = &s->bins;
  uint8_t bin[256];
  memset(bins, 0, sizeof *bins);
  if (feature != BY_TIME)
    bins_of_bytes(s, feature, SEARCH_BINS, bin);
  if (s->shape == SEARCH_KEPT)
    fill_kept(s, mask, feature, bin);
  else
    fill_neighbours(s, mask, feature, bin);
  for (uint32_t hi = 1; hi < SEARCH_BINS; ++hi) {
    if (!(bins->bin[hi].n > 0.0f))
      continue; /* all 0: no interval ends there */
    float *row = bins->pair + hi * (hi + 1u) / 2u;
    for (uint32_t lo = hi; lo-- > 0;)
      row[lo] += row[lo + 1u];
  }
}

/* The best interval of the bins that ends before `ends`; *last is SEARCH_BINS where there is none.
 */
static void best_interval(const rim_search *s, uint32_t ends, uint32_t *best_first,
                          uint32_t *best_last) {
  const search_bins *bins = &s->bins;
  const uint32_t fields = s->fields;
  uint8_t used[SEARCH_BINS]; /* bins with data, ascending */
  uint32_t count = 0;
  double best = 0.0;
  *best_first = 0;
  *best_last = SEARCH_BINS;
  for (uint32_t k = 0; k < ends; ++k) {
    if (bins->bin[k].n > 0.0f)
      used[count++] = (uint8_t)k;
  }
  for (uint32_t i = 0; i < count; ++i) {
    const float *pair = bins->pair + used[i];
    search_sums sums = {0};
    for (uint32_t j = i; j < count; ++j) {
      const uint32_t last = used[j];
      search_add_bin(fields, &sums, &bins->bin[last]);
      sums.a += (double)pair[last * (last + 1u) / 2u];
      const double a = search_unexplained(fields, sums.a, sums.g);
      if (sums.n < (double)SEARCH_LEAST || !(a > 1e-6 * sums.a) || !(sums.d * sums.d > best * a))
        continue;
      best = sums.d * sums.d / a;
      *best_first = used[i];
      *best_last = last;
    }
  }
}

void rimi_search_scan_interval(rim_search *s, const search_mask *mask, uint32_t feature,
                               search_hypothesis *h, uint32_t which) {
  const search_bins *bins = &s->bins;
  uint32_t best_first, best_last;
  fill_bins(s, mask, feature);
  best_interval(s, SEARCH_BINS, &best_first, &best_last);
  h->feature[which] = (uint8_t)feature;
  if (best_last == SEARCH_BINS) {
    h->score = SEARCH_NONE;
    return;
  }
  /* An edge with no data beyond it is only where the data ends: open. */
  uint32_t k = best_first;
  while (k > 0 && !(bins->bin[k - 1u].n > 0.0f))
    --k;
  h->first[which] = (uint8_t)(k == 0 ? 0 : best_first);
  k = best_last;
  while (k + 1u < SEARCH_BINS && !(bins->bin[k + 1u].n > 0.0f))
    ++k;
  h->last[which] = (uint8_t)(k + 1u == SEARCH_BINS ? SEARCH_BINS - 1u : best_last);
  rimi_search_evaluate(s, h);
}

void rimi_search_scan_during(rim_search *s, search_hypothesis *h) {
  const uint32_t oldest = s->count - s->held;
  search_mask mask;
  uint32_t first, last;
  memset(&mask, 0, sizeof mask);
  memset(h, 0, sizeof *h);
  h->family = SEARCH_DURING;
  h->score = SEARCH_NONE;
  fill_bins(s, &mask, BY_TIME);
  best_interval(s, SEARCH_BINS - 1u, &first, &last);
  if (last == SEARCH_BINS)
    return;
  h->onset = oldest + (first * s->held + SEARCH_BINS - 1u) / SEARCH_BINS;
  h->end = oldest + ((last + 1u) * s->held + SEARCH_BINS - 1u) / SEARCH_BINS;
  rimi_search_evaluate(s, h);
  rimi_search_refine_during(s, h);
}

void rimi_search_refine_during(rim_search *s, search_hypothesis *h) {
  if (h->score <= SEARCH_NONE)
    return;
  search_hypothesis tried = *h;
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  rimi_search_scan_onset(s, &mask, &tried, NULL);
  rimi_search_scan_end(s, &tried);
  if (tried.score > h->score)
    *h = tried;
}

#define CELLS SEARCH_CELLS

static void fill_cells(rim_search *s, uint32_t x, uint32_t y) {
  uint8_t cell_x[256], cell_y[256];
  memset(s->cells, 0, sizeof s->cells);
  bins_of_bytes(s, x, SEARCH_CELLS, cell_x);
  bins_of_bytes(s, y, SEARCH_CELLS, cell_y);
  const search_mask all = {0};
  uint32_t next = CELLS * CELLS;
  for (search_walk w = search_walk_from(s, &all); search_walk_next(&w);) {
    if (!(search_a0(s)[w.i] > 0.0f)) {
      next = CELLS * CELLS;
      continue;
    }
    const uint32_t k = (uint32_t)cell_x[w.feature[x]] * CELLS + cell_y[w.feature[y]];
    const float a = search_a0(s)[w.i] + (next == k ? search_a1(s)[w.i] : 0.0f);
    add_to_bin(s, w.i, a, &s->cells[k]);
    next = k;
  }
}

/* Adds column x of the cells to the strip; false where there is nothing in it. */
static bool add_column(const rim_search *s, uint32_t x, search_sums *strip) {
  bool any = false;
  for (uint32_t y = 0; y < CELLS; ++y) {
    const search_bin *cell = &s->cells[x * CELLS + y];
    any = any || cell->n > 0.0f;
    search_add_bin(s->fields, &strip[y], cell);
  }
  return any;
}

typedef struct box {
  double ratio;
  uint32_t x0, x1, y0, y1;
} box;

static void scan_strip(const rim_search *s, const search_sums *strip, uint32_t x0, uint32_t x1,
                       box *best) {
  const uint32_t fields = s->fields;
  for (uint32_t y0 = 0; y0 < CELLS; ++y0) {
    search_sums sums = {0};
    for (uint32_t y1 = y0; y1 < CELLS; ++y1) {
      if (!(strip[y1].n > 0.0))
        continue;
      search_add_sums(fields, &sums, &strip[y1]);
      const double a = search_unexplained(fields, sums.a, sums.g);
      if (y1 - y0 + 1u == CELLS || sums.n < (double)SEARCH_LEAST || !(a > 1e-6 * sums.a) ||
          !(sums.d * sums.d > best->ratio * a))
        continue;
      *best = (box){sums.d * sums.d / a, x0, x1, y0, y1};
    }
  }
}

static uint8_t first_bin(uint32_t cell) {
  return (uint8_t)((cell * SEARCH_BINS + CELLS - 1u) / CELLS);
}

/* Boxes of whole cells, then each side exactly given the other. */
void rimi_search_scan_box(rim_search *s, uint32_t x, uint32_t y, search_hypothesis *h) {
  fill_cells(s, x, y);
  box best = {0.0, 0, 0, 0, 0};
  for (uint32_t x0 = 0; x0 < CELLS; ++x0) {
    search_sums strip[CELLS];
    memset(strip, 0, sizeof strip);
    for (uint32_t x1 = x0; x1 < CELLS; ++x1) {
      const bool is_wider = add_column(s, x1, strip);
      if (x1 - x0 + 1u < CELLS && is_wider)
        scan_strip(s, strip, x0, x1, &best);
    }
  }
  memset(h, 0, sizeof *h);
  h->family = SEARCH_BOX;
  h->onset = SEARCH_FROM_START;
  h->score = SEARCH_NONE;
  if (!(best.ratio > 0.0))
    return;
  h->feature[0] = (uint8_t)x;
  h->feature[1] = (uint8_t)y;
  h->first[0] = first_bin(best.x0);
  h->last[0] = (uint8_t)(first_bin(best.x1 + 1u) - 1u);
  h->first[1] = first_bin(best.y0);
  h->last[1] = (uint8_t)(first_bin(best.y1 + 1u) - 1u);
  rimi_search_evaluate(s, h);
  for (uint32_t which = 0; which < 2; ++which)
    rimi_search_refine_edges(s, h, which);
}

void rimi_search_refine_edges(rim_search *s, search_hypothesis *h, uint32_t which) {
  search_hypothesis tried = *h;
  const search_mask mask = rimi_search_mask_of(s, h, (int)which);
  rimi_search_scan_interval(s, &mask, h->feature[which], &tried, which);
  if (tried.score > h->score)
    *h = tried;
}

bool rimi_search_inside(const rim_search *s, const search_hypothesis *h, const uint8_t *feature,
                        uint32_t block) {
  if ((h->onset != SEARCH_FROM_START && block < h->onset) || (h->end != 0 && block >= h->end))
    return false;
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  for (uint32_t k = 0; k < mask.dims; ++k) {
    const uint8_t f = feature[mask.feature[k]];
    if (f < mask.low[k] || f > mask.high[k])
      return false;
  }
  return true;
}

uint32_t rimi_search_first_inside(const rim_search *s, const search_hypothesis *h) {
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  uint32_t first = s->held;
  for (search_walk w = search_walk_from(s, &mask); search_walk_next(&w);)
    first = w.inside && search_a0(s)[w.i] > 0.0f ? w.i : first;
  return s->count - s->held + first;
}
