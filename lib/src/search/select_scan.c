/* SPDX-License-Identifier: MIT */
/* One-dimensional part of the search: intervals (App. A, p. 115) and the edge sweep H3 (eq. 4.5).
 */
#include <float.h>

#include "base/real.h"
#include "search/select_private.h"

#define WAIT_BONUS 0.5        /* nats per sweep that a base has waited, */
#define WAIT_MAX 24           /* for at most this many sweeps */
#define NEAR_ENOUGH 6.0       /* nats below the pool's bar: the most that shear was seen to add */
#define GROWTH_AT_EDGE 0.35   /* of the interval's width */
#define ELLIPSE_OVER_BOX 1.15 /* 2 / sqrt pi = 1.13 gives equal areas */

typedef struct prefix {
  double n[RIM_SELECT_MAX_BINS + 1];
  double s[RIM_SELECT_MAX_BINS + 1];
  double v[RIM_SELECT_MAX_BINS + 1]; /* sum n_k b_k */
} prefix;

typedef struct found {
  double ln_anom;
  uint32_t first, last;
} found;

/* Ends of intervals: statistics before a bin and up to its end, for bins of one sign. */
typedef struct ends {
  double n0[RIM_SELECT_MAX_BINS], s0[RIM_SELECT_MAX_BINS], v0[RIM_SELECT_MAX_BINS];
  double n1[RIM_SELECT_MAX_BINS], s1[RIM_SELECT_MAX_BINS], v1[RIM_SELECT_MAX_BINS];
  uint8_t bin[RIM_SELECT_MAX_BINS];
  uint32_t count;
} ends;

static void find_ends(const prefix *p, uint32_t bins, double a, bool negative, ends *out) {
  uint32_t n = 0;
  for (uint32_t k = 0; k < bins; ++k) {
    const double s = p->s[k + 1] - p->s[k];
    if (!(negative ? s < 0.0 : s > 0.0))
      continue;
    out->n0[n] = p->n[k];
    out->s0[n] = p->s[k];
    out->v0[n] = p->v[k] - a;
    out->n1[n] = p->n[k + 1];
    out->s1[n] = p->s[k + 1];
    out->v1[n] = p->v[k + 1];
    out->bin[n] = (uint8_t)k;
    ++n;
  }
  out->count = n;
}

/* [i]: no interval from end i on has a larger S^2 / (n (a + b n)): it is at most the sum of the
 * bins' own S^2 / (n a) (Cauchy), bins of the other sign take away. Rounded up. */
static void bounds_from(const ends *e, double a, double *within) {
  double sum = 0.0;
  for (uint32_t i = e->count; i-- > 0;) {
    const double s = e->s1[i] - e->s0[i];
    sum += s * s / (e->n1[i] - e->n0[i]);
    within[i] = sum / a * (1.0 + 1e-9);
  }
}

/* The most anomalous interval (App. A, Alg. 8, p. 116). Only intervals whose first and last bin
 * deviate the same way are weighed: without an end bin that does not, |S| is no smaller and Var(S)
 * no larger. Compared by cross-multiplication; at most bins (bins + 1) / 2 intervals. Of equals the
 * first stays: those that deviate downwards before those that deviate upwards. */
static found most_anomalous(const prefix *p, uint32_t bins, double a) {
  double best_s2 = 0.0;
  double best_var = 1.0;
  found best = {0.0, 0, 0};
  for (uint32_t sign = 0; sign < 2; ++sign) {
    ends e;
    find_ends(p, bins, a, sign == 0, &e);
    double within[RIM_SELECT_MAX_BINS];
    bounds_from(&e, a, within);
    for (uint32_t i = 0; i < e.count && within[i] * best_var > best_s2; ++i) {
      const double n0 = e.n0[i];
      const double s0 = e.s0[i];
      const double v0 = e.v0[i];
      for (uint32_t j = i; j < e.count; ++j) {
        const double s = e.s1[j] - s0;
        const double var = (e.n1[j] - n0) * (e.v1[j] - v0);
        const double s2 = s * s;
        if (s2 * best_var <= best_s2 * var)
          continue;
        best_s2 = s2;
        best_var = var;
        best.first = e.bin[i];
        best.last = e.bin[j];
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
  rimi_bins_prefix(&table, (uint16_t)f, (uint16_t)c, p.s, p.n);
  for (uint32_t k = 0; k <= e->bins; ++k)
    p.v[k] = (double)state->b * p.n[k]; /* cppcheck-suppress uninitvar */
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

void rimi_select_scan(rim_select *e, uint32_t budget) {
  const uint32_t slices = (uint32_t)e->features * e->channels;
  const uint32_t todo = budget < slices ? budget : slices;
  for (uint32_t i = 0; i < todo; ++i) {
    const uint32_t c = e->next_slice / e->features;
    scan_slice(e, c, e->next_slice - c * e->features);
    e->next_slice = e->next_slice + 1u == slices ? 0u : e->next_slice + 1u;
  }
}

/* The next base: the most anomalous interval, with a bonus for those that have waited, so that
 * weaker ones get their turn too. O(features * channels), once per sweep. */
static void choose_base(rim_select *e) {
  double best = -DBL_MAX;
  ++e->sweeps;
  for (uint32_t c = 0; c < e->channels; ++c) {
    const channel_state *state = select_channel(e, c);
    const slice *s = select_slice(e, c, 0);
    for (uint32_t f = 0; f < e->features; ++f) {
      const uint16_t waited = (uint16_t)(e->sweeps - s[f].swept);
      const double bonus = WAIT_BONUS * (double)(waited < WAIT_MAX ? waited : WAIT_MAX);
      const double value = select_priority(state, (double)s[f].ln_anom + bonus);
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

/* The ring's slots inside the base interval. */
static uint32_t fill_mask(const rim_select *e, uint16_t *mask) {
  uint32_t n = 0;
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const uint32_t bin = ((uint32_t)select_row(e, slot)[e->base_feature] * e->bins) >> 8;
    if (bin >= e->base_first && bin <= e->base_last)
      mask[n++] = (uint16_t)slot;
  }
  return n;
}

/* No interval of these bins has more evidence: S^2 / n <= sum of s_k^2 / n_k (Cauchy), over the
 * bins of one sign, since those of the other only take away. For b > 0 less still. Rounded up by
 * more than 16 sums in single precision lose. */
static double evidence_bound(const channel_state *state, const int32_t *n, const int32_t *s) {
  float up = 0.0f;
  float down = 0.0f;
  for (uint32_t k = 0; k < EDGE_BINS; ++k) {
    if (n[k] == 0)
      continue;
    const float sum = (float)s[k];
    const float part = sum * sum / (float)n[k];
    if (s[k] > 0)
      up += part;
    else
      down += part;
  }
  const double best = (double)(up > down ? up : down) * (1.0 + 1e-5);
  return 0.5 * SELECT_RESIDUAL_STEP * SELECT_RESIDUAL_STEP * best / (double)state->a;
}

/* Sums of the ring's observations in EDGE_BINS bins, in steps: below 4096 * 32768 = 2^27. */
typedef struct histogram {
  int32_t n[EDGE_BINS], s[EDGE_BINS];
} histogram;

static found best_of(const channel_state *state, const histogram *h) {
  prefix p;
  p.n[0] = p.s[0] = p.v[0] = 0.0;
  for (uint32_t k = 0; k < EDGE_BINS; ++k) {
    p.n[k + 1] = p.n[k] + (double)h->n[k];
    p.s[k + 1] = p.s[k] + (double)h->s[k] * SELECT_RESIDUAL_STEP;
    p.v[k + 1] = (double)state->b * p.n[k + 1];
  }
  return most_anomalous(&p, EDGE_BINS, (double)state->a);
}

/* Where the base interval has its middle, in bytes: there shear moves nothing. */
static int32_t middle_of_base(const rim_select *e) {
  return ((int32_t)e->base_first + e->base_last + 1) * 256 / (2 * e->bins);
}

/* Bin of f + shear / 64 * (base - middle). */
static uint32_t sheared_bin(const rim_select *e, const uint8_t *row, uint16_t f, int32_t shear,
                            int32_t middle) {
  int32_t g = row[f];
  if (shear != 0) {
    g += (((int32_t)row[e->base_feature] - middle) * shear) / 64;
    g = g < 0 ? 0 : g > 255 ? 255 : g;
  }
  return ((uint32_t)g * EDGE_BINS) >> 8;
}

/* The most anomalous interval of f + shear / 64 * (base - its middle) among the masked: H3 with
 * shear 0; with others a parallelogram, since an oblique region has no good rectangle. Its ln_anom
 * is -1 where it is certainly below `least`. */
static found conditional(rim_select *e, const uint16_t *mask, uint32_t masked, uint16_t f,
                         int32_t shear, double least) {
  const channel_state *state = select_channel(e, e->base_channel);
  const int32_t middle = middle_of_base(e);
  const uint8_t *ring = select_row(e, 0);
  const int16_t *residual = select_residual(e, 0) + e->base_channel;
  histogram h = {0};
  for (uint32_t i = 0; i < masked; ++i) {
    const uint8_t *row = ring + (size_t)mask[i] * e->features;
    const uint32_t k = sheared_bin(e, row, f, shear, middle);
    ++h.n[k];
    h.s[k] += residual[(size_t)mask[i] * e->channels];
  }
  ++e->effort.edges;
  if (evidence_bound(state, h.n, h.s) < least)
    return (found){-1.0, 0, 0};
  return best_of(state, &h);
}

/* The most anomalous interval of the base where the sheared f lies in the interval `given`. */
static found base_given(rim_select *e, uint16_t f, int32_t shear, const found *given) {
  const int32_t middle = middle_of_base(e);
  histogram h = {0};
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const uint8_t *row = select_row(e, slot);
    const uint32_t k = sheared_bin(e, row, f, shear, middle);
    if (k < given->first || k > given->last)
      continue;
    const uint32_t b = ((uint32_t)row[e->base_feature] * EDGE_BINS) >> 8;
    ++h.n[b];
    h.s[b] += select_residual(e, slot)[e->base_channel];
  }
  ++e->effort.edges;
  return best_of(select_channel(e, e->base_channel), &h);
}

/* Two opposite sides of a parallelogram, in unit features. */
typedef struct sides {
  double low, high;
} sides;

/* A side on the edge of the range is moved outwards: what lies beyond is unknown, and an ellipse
 * that ends there would cut the corners. */
static sides sides_of(uint32_t first, uint32_t last, uint32_t bins) {
  sides s = {(double)first / (double)bins, ((double)last + 1.0) / (double)bins};
  const double grown = GROWTH_AT_EDGE * (s.high - s.low);
  if (first == 0)
    s.low -= grown;
  if (last + 1u == bins)
    s.high += grown;
  return s;
}

/* The parallelogram as an offer to the pool: half sides, and the matrix A of the ellipse that
 * touches it (a little larger). f's sides are those in the middle of the base's. */
static select_offer offer_of(const rim_select *e, uint16_t f, const sides *base, const sides *other,
                             int32_t shear, double h3) {
  const double half[2] = {0.5 * (base->high - base->low), 0.5 * (other->high - other->low)};
  const double center[2] = {0.5 * (base->low + base->high), 0.5 * (other->low + other->high)};
  const double wide = half[0] * ELLIPSE_OVER_BOX;
  const double tall = half[1] * ELLIPSE_OVER_BOX;
  const double slope = -(double)shear / 64.0;
  const double base_base = wide * wide;
  const double f_f = slope * slope * base_base + tall * tall;
  const bool swap = e->base_feature > f;
  return (select_offer){
      .x = swap ? f : e->base_feature,
      .y = swap ? e->base_feature : f,
      .channel = e->base_channel,
      .center = {center[swap ? 1 : 0], center[swap ? 0 : 1]},
      .half = {half[swap ? 1 : 0], half[swap ? 0 : 1]},
      .shape = {swap ? f_f : base_base, slope * base_base, swap ? base_base : f_f},
      .h3 = h3,
  };
}

/* Offers what was found of (base, f); before it, but in the small profile, the base gets the
 * interval that is best there: its own was found over all values of f. */
static void offer_edge(rim_select *e, uint16_t f, const found *best, int32_t shear) {
  sides base = sides_of(e->base_first, e->base_last, e->bins);
  sides other = sides_of(best->first, best->last, EDGE_BINS);
  double h3 = best->ln_anom;
  if (!e->small) {
    const found refined = base_given(e, f, shear, best);
    if (refined.ln_anom > h3) {
      const double middle = base.low + base.high;
      base = sides_of(refined.first, refined.last, EDGE_BINS);
      const double moved = 0.5 * (base.low + base.high - middle) * (double)shear / 64.0;
      other.low -= moved;
      other.high -= moved;
      h3 = refined.ln_anom;
    }
  }
  const select_offer offer = offer_of(e, f, &base, &other, shear, h3);
  rimi_select_pool_offer(e, &offer);
}

/* One edge (base, f). Shears are tried only where the plain H3 comes near what the pool asks.
 * Returns the conditional intervals used: 1 or SELECT_EDGE_INTERVALS. */
static uint32_t try_edge(rim_select *e, const uint16_t *mask, uint32_t masked, uint16_t f) {
  static const int32_t shears[SHEARS] = {32, -32, 64, -64};
  const channel_state *state = select_channel(e, e->base_channel);
  const double bar = rimi_select_pool_bar(e, NULL);
  /* In nats of this channel, what the plain H3 may lack at most. */
  const double lacks = e->small ? 0.0 : NEAR_ENOUGH;
  const double least = (bar + (double)state->offset) / (double)state->scale - lacks;
  found best = conditional(e, mask, masked, f, 0, least);
  const double nearly = select_priority(state, best.ln_anom + NEAR_ENOUGH);
  if (best.ln_anom < 0.0 || nearly < bar)
    return 1;
  int32_t shear = 0;
  for (uint32_t i = 0; i < SHEARS; ++i) {
    const found other = conditional(e, mask, masked, f, shears[i], best.ln_anom);
    if (other.ln_anom <= best.ln_anom)
      continue;
    best = other;
    shear = shears[i];
  }
  offer_edge(e, f, &best, shear);
  return SELECT_EDGE_INTERVALS(e->small);
}

void rimi_select_sweep(rim_select *e, uint32_t budget) {
  uint16_t *mask = (uint16_t *)select_at(e, e->mask_at);
  uint32_t done = 0;
  for (uint32_t bases = 0; bases < BASES_A_UNIT && done < budget; ++bases) {
    if (e->next_feature >= e->features)
      choose_base(e);
    const uint32_t masked = fill_mask(e, mask);
    for (; e->next_feature < e->features && done < budget; ++e->next_feature) {
      if (e->next_feature == e->base_feature)
        continue;
      done += try_edge(e, mask, masked, e->next_feature);
    }
  }
  rimi_select_pool_enter(e);
}
