/* One-dimensional part of the search: intervals (App. A) and the edge sweep H3 (eq. 4.5). */
#include <string.h>

#include "rim/image.h"
#include "rim/real.h"
#include "select_private.h"

typedef struct prefix {
  double n[RIM_SELECT_MAX_BINS + 1];
  double s[RIM_SELECT_MAX_BINS + 1];
  double v[RIM_SELECT_MAX_BINS + 1]; /* sum n_k b_k */
} prefix;

typedef struct found {
  double ln_anom;
  uint32_t first, last;
} found;

/* The most anomalous interval of bins: all bins (bins + 1) / 2 are weighed, by cross-multiplication. */
static found most_anomalous(const prefix *p, uint32_t bins, double a) {
  double best_s2 = 0.0;
  double best_var = 1.0;
  found best = {0.0, 0, 0};
  for (uint32_t i = 0; i < bins; ++i) {
    const double n0 = p->n[i];
    const double s0 = p->s[i];
    const double v0 = p->v[i];
    for (uint32_t j = i + 1; j <= bins; ++j) {
      const double n = p->n[j] - n0;
      const double s = p->s[j] - s0;
      const double var = n * (a + (p->v[j] - v0));
      const double s2 = s * s;
      if (s2 * best_var > best_s2 * var && n >= 1.0) {
        best_s2 = s2;
        best_var = var;
        best.first = i;
        best.last = j - 1;
      }
    }
  }
  best.ln_anom = best_s2 / (2.0 * best_var);
  return best;
}

static void rescan_channel(rim_select *e, uint32_t c) {
  channel_state *state = select_channel(e, c);
  const slice *s = select_slice(e, c, 0);
  state->best_interval = -1.0f;
  for (uint32_t f = 0; f < e->features; ++f) {
    if (s[f].ln_anom > state->best_interval) {
      state->best_interval = s[f].ln_anom;
      state->best_feature = (uint16_t)f;
    }
  }
}

static void scan_slice(rim_select *e, uint32_t c, uint32_t f) {
  channel_state *state = select_channel(e, c);
  const rim_bins table = select_bins(e);
  prefix p;
  rim_bins_prefix(&table, (uint16_t)f, (uint16_t)c, p.s, p.n);
  if (e->bin_b == NULL) {
    for (uint32_t k = 0; k <= e->bins; ++k) p.v[k] = (double)state->b * p.n[k];
  } else {
    const size_t first = ((size_t)c * e->features + f) * e->bins;
    p.v[0] = 0.0;
    for (uint32_t k = 0; k < e->bins; ++k) {
      p.v[k + 1] =
          p.v[k] + (p.n[k + 1] - p.n[k]) * (double)rim_image_f32(e->bin_b, first + k);
    }
  }
  const found best = most_anomalous(&p, e->bins, (double)state->a);
  slice *s = select_slice(e, c, f);
  s->ln_anom = (float)best.ln_anom;
  s->first = (uint8_t)best.first;
  s->last = (uint8_t)best.last;
  ++e->effort.scans;
  if (s->ln_anom >= state->best_interval) {
    state->best_interval = s->ln_anom;
    state->best_feature = (uint16_t)f;
  } else if (state->best_feature == f) {
    rescan_channel(e, c);
  }
}

void select_scan(rim_select *e, uint32_t budget) {
  const uint32_t slices = (uint32_t)e->features * e->channels;
  const uint32_t todo = budget < slices ? budget : slices;
  for (uint32_t i = 0; i < todo; ++i) {
    const uint32_t c = e->next_slice / e->features;
    scan_slice(e, c, e->next_slice - c * e->features);
    e->next_slice = e->next_slice + 1u == slices ? 0u : e->next_slice + 1u;
  }
}

#ifndef P_RECENCY
#define P_RECENCY 0.5
#endif
#ifndef P_RECMAX
#define P_RECMAX 24
#endif
/* The next base: the most anomalous interval, with a bonus for those that have waited. */
static void choose_base(rim_select *e) {
  double best = -1e300;
  ++e->sweeps;
  for (uint32_t c = 0; c < e->channels; ++c) {
    const channel_state *state = select_channel(e, c);
    for (uint32_t f = 0; f < e->features; ++f) {
      slice *s = select_slice(e, c, f);
      const uint16_t waited = (uint16_t)(e->sweeps - s->swept);
      const double bonus = P_RECENCY * (double)(waited < P_RECMAX ? waited : P_RECMAX);
      const double value =
          (double)s->ln_anom * (double)state->scale - (double)state->offset + bonus;
      if (value > best) {
        best = value;
        e->base_channel = (uint16_t)c;
        e->base_feature = (uint16_t)f;
      }
    }
  }
  slice *s = select_slice(e, e->base_channel, e->base_feature);
  s->swept = e->sweeps;
  e->base_first = s->first;
  e->base_last = s->last;
  e->next_feature = 0;
}

static uint32_t fill_mask(const rim_select *e, uint16_t *mask) {
  uint32_t n = 0;
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const uint32_t bin = ((uint32_t)select_row(e, slot)[e->base_feature] * e->bins) >> 8;
    if (bin >= e->base_first && bin <= e->base_last) mask[n++] = (uint16_t)slot;
  }
  return n;
}

#ifndef P_EDGEBINS
#define P_EDGEBINS 16
#endif
#ifndef P_NEAR
#define P_NEAR 6.0
#endif
#ifndef P_SHEARS
#define P_SHEARS 4
#endif
/* H3 along f + shear (base - middle). */
static found conditional(const rim_select *e, const uint16_t *mask, uint32_t masked, uint16_t f,
                         int32_t shear) {
  const channel_state *state = select_channel(e, e->base_channel);
  const uint32_t bins = P_EDGEBINS;
  prefix p;
  memset(&p, 0, sizeof p);
  const int32_t middle = ((int32_t)e->base_first + e->base_last + 1) * 256 / (2 * e->bins);
  for (uint32_t i = 0; i < masked; ++i) {
    const uint8_t *row = select_row(e, mask[i]);
    int32_t g = (int32_t)row[f] + (((int32_t)row[e->base_feature] - middle) * shear) / 64;
    g = g < 0 ? 0 : g > 255 ? 255 : g;
    const uint32_t k = (((uint32_t)g * bins) >> 8) + 1u;
    p.n[k] += 1.0;
    p.s[k] += (double)select_residual(e, mask[i])[e->base_channel] * SELECT_RESIDUAL_STEP;
  }
  for (uint32_t k = 0; k < bins; ++k) {
    p.n[k + 1] += p.n[k];
    p.s[k + 1] += p.s[k];
    p.v[k + 1] = (double)state->b * p.n[k + 1];
  }
  return most_anomalous(&p, bins, (double)state->a);
}

static void try_edge(rim_select *e, const uint16_t *mask, uint32_t masked, uint16_t f) {
  static const int32_t shears[6] = {32, -32, 64, -64, 96, -96};
  const uint32_t bins = P_EDGEBINS;
  found best = conditional(e, mask, masked, f, 0);
  int32_t shear = 0;
  ++e->effort.edges;
  uint32_t weakest = 0;
  const channel_state *state = select_channel(e, e->base_channel);
  const double bar = (select_pool_bar(e, &weakest) + (double)state->offset) / (double)state->scale;
  if (best.ln_anom < bar - P_NEAR) return;
  for (uint32_t i = 0; i < P_SHEARS; ++i) {
    const found other = conditional(e, mask, masked, f, shears[i]);
    ++e->effort.edges;
    if (other.ln_anom <= best.ln_anom) continue;
    best = other;
    shear = shears[i];
  }
  double low[2] = {(double)e->base_first / (double)e->bins, (double)best.first / (double)bins};
  double high[2] = {((double)e->base_last + 1.0) / (double)e->bins,
                    ((double)best.last + 1.0) / (double)bins};
  uint16_t x = e->base_feature;
  uint16_t y = f;
  const double half = 0.5 * (high[0] - low[0]) * 1.15;
  const double tall = 0.5 * (high[1] - low[1]) * 1.15;
  const double slope = -(double)shear / 64.0;
  const double sxx = half * half;
  const double sxy = slope * sxx;
  const double syy = slope * slope * sxx + tall * tall;
  if (x > y) {
    const double l = low[0];
    const double h = high[0];
    low[0] = low[1];
    high[0] = high[1];
    low[1] = l;
    high[1] = h;
    x = f;
    y = e->base_feature;
  }
  select_pool_offer(e, x, y, e->base_channel, low, high, best.ln_anom, x == f ? syy : sxx, sxy,
                    x == f ? sxx : syy);
}

void select_sweep(rim_select *e, uint32_t budget) {
  uint16_t *mask = (uint16_t *)select_at(e, e->mask_at);
  uint32_t done = 0;
  for (uint32_t bases = 0; bases < 3 && done < budget; ++bases) {
    if (e->next_feature >= e->features) choose_base(e);
    const uint32_t masked = fill_mask(e, mask);
    for (; e->next_feature < e->features && done < budget; ++e->next_feature) {
      if (e->next_feature == e->base_feature) continue;
      try_edge(e, mask, masked, e->next_feature);
      ++done;
    }
  }
}
