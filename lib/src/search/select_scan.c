/* SPDX-License-Identifier: MIT */
/* One-dimensional part of the search: intervals (App. A, p. 115) and the edge sweep H3 (eq. 4.5).
 */
#include <float.h>

#include "base/real.h"
#include "search/select_private.h"

#define WAIT_BONUS 0.5        /* nats per sweep that a base has waited, */
#define WAIT_MAX 12           /* for at most this many sweeps */
#define NEAR_ENOUGH 4.0       /* nats below the pool's bar at which shears are tried */
#define NEARLY_THERE 2.0      /* ... at which the base's own interval is sought again */
#define GROWTH_AT_EDGE 0.35   /* of the interval's width */
#define ELLIPSE_OVER_BOX 1.15 /* 2 / sqrt pi = 1.13 gives equal areas */

#define SHEAR_STEPS 64
static const int32_t shears[SHEARS] = {32, -32, 64, -64};

_Static_assert(SHEARS <= SELECT_AT_ONCE && SMALL_IN_WORD <= SELECT_AT_ONCE &&
                   LEVELS_IN_WORD <= SELECT_AT_ONCE,
               "packed_bins");

typedef struct prefix {
  double n[RIM_SELECT_MAX_BINS + 1];
  double s[RIM_SELECT_MAX_BINS + 1];
} prefix;

typedef struct found {
  double ln_anom;
  uint32_t first, last;
} found;

/* Bins of one sign, as ends of intervals; sum of s^2 / n of those before each and, last, of all. */
typedef struct ends {
  double evidence[RIM_SELECT_MAX_BINS + 1];
  uint8_t bin[RIM_SELECT_MAX_BINS];
  uint32_t count;
} ends;

static void find_ends(const prefix *p, uint32_t bins, ends *down, ends *up) {
  down->evidence[0] = up->evidence[0] = 0.0;
  down->count = up->count = 0;
  for (uint32_t k = 0; k < bins; ++k) {
    const double s = p->s[k + 1] - p->s[k];
    const double n = p->n[k + 1] - p->n[k];
    if (!(s < 0.0 || s > 0.0))
      continue;
    ends *of = s < 0.0 ? down : up;
    const uint32_t i = of->count++;
    of->bin[i] = (uint8_t)k;
    of->evidence[i + 1u] = of->evidence[i] + s * s / n;
  }
}

/* The best interval so far, S^2 / Var(S), and less than any better one's ends have of S^2 / n. */
typedef struct best_interval {
  double s2, var;
  double evidence;
  uint32_t first, last;
} best_interval;

static void set_best(best_interval *best, double s2, double var, double a) {
  best->s2 = s2;
  best->var = var;
  best->evidence = s2 * a / var * (1.0 - 1e-9); /* of rounding */
}

/* Those between two ends of one sign. Bins from one end to another have at most the sum of their
 * own S^2 / (n a) (Cauchy), since those of the other sign take away. So the later an interval
 * begins, the later must it end: `nearest` only grows. */
static void try_ends(const prefix *p, const ends *e, double a, double b, best_interval *best) {
  uint32_t nearest = 0;
  for (uint32_t i = 0; i < e->count; ++i) {
    if (e->evidence[e->count] - e->evidence[i] <= best->evidence)
      break;
    while (nearest < i || e->evidence[nearest + 1u] - e->evidence[i] <= best->evidence)
      ++nearest;
    const double n0 = p->n[e->bin[i]];
    const double s0 = p->s[e->bin[i]];
    for (uint32_t j = nearest; j < e->count; ++j) {
      const double s = p->s[e->bin[j] + 1u] - s0;
      const double n = p->n[e->bin[j] + 1u] - n0;
      const double var = n * (a + b * n);
      const double s2 = s * s;
      if (s2 * best->var <= best->s2 * var)
        continue;
      set_best(best, s2, var, a);
      best->first = e->bin[i];
      best->last = e->bin[j];
    }
  }
}

/* The most anomalous interval (App. A, Alg. 8, p. 116); its ln_anom is `least` (0 or more) where
 * none has more. Only intervals whose first and last bin deviate the same way are weighed: without
 * an end bin that does not, |S| is no smaller and Var(S) no larger. Compared by
 * cross-multiplication; at most bins (bins + 1) / 2 intervals. Of equals the first stays: those
 * that deviate downwards before those that deviate upwards. */
static found most_anomalous(const prefix *p, uint32_t bins, double a, double b, double least) {
  ends down;
  ends up;
  find_ends(p, bins, &down, &up);
  best_interval best = {.first = 0};
  set_best(&best, 2.0 * least, 1.0, a);
  try_ends(p, &down, a, b, &best);
  try_ends(p, &up, a, b, &best);
  return (found){best.s2 / (2.0 * best.var), best.first, best.last};
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

/* A little less than the interval that a slice had has now: hard to beat, and found again in its
 * turn. */
static double nearly_had(const rim_select *e, const slice *s, const prefix *p, double a, double b) {
  if (s->first > s->last || s->last >= e->bins) /* an upset */
    return 0.0;
  const double n = p->n[s->last + 1u] - p->n[s->first];
  const double sum = p->s[s->last + 1u] - p->s[s->first];
  return select_ln_anom(sum, n, a, b) * (1.0 - 1e-9);
}

static void scan_slice(rim_select *e, uint32_t c, uint32_t f) {
  channel_state *state = select_channel(e, c);
  const rim_bins table = select_bins(e);
  prefix p;
  rimi_bins_prefix(&table, (uint16_t)f, (uint16_t)c, p.s, p.n);
  slice *s = select_slice(e, c, f);
  const double a = (double)state->a;
  const double b = (double)state->b;
  const found best = most_anomalous(&p, e->bins, a, b, nearly_had(e, s, &p, a, b));
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
typedef struct base_mask {
  const uint16_t *slot;
  uint32_t count;
} base_mask;

/* The lowest level whose bin is at least `bin`: of those up to it, one more than all. */
static uint32_t level_of_bin(const ring_column *f, uint32_t bin, uint32_t bins) {
  const uint32_t byte = (bin * 256u + bins - 1u) / bins;
  const uint32_t middle = (1u << f->up) >> 1;
  return byte <= middle ? 0u : (byte - middle + (1u << f->up) - 1u) >> f->up;
}

static base_mask mask_of_base(const rim_select *e) {
  uint16_t *mask = (uint16_t *)select_at(e, e->mask_at);
  const ring_column base = select_column(e, e->base_feature);
  const uint32_t low = level_of_bin(&base, e->base_first, e->bins);
  const uint32_t levels = level_of_bin(&base, e->base_last + 1u, e->bins) - low;
  const uint32_t held = e->held;
  uint32_t n = 0;
  for (uint32_t slot = 0; slot < held; ++slot) {
    if (select_level(&base, slot) - low < levels)
      mask[n++] = (uint16_t)slot;
  }
  return (base_mask){mask, n};
}

/* Of the ring's observations in bins; residuals in steps: |s| below 4096 * 32768 = 2^27. `most`: no
 * interval has a larger s^2 / n than the sum of the bins' own (Cauchy), over those of one sign,
 * since those of the other only take away. For b > 0 less still. */
typedef struct histogram {
  int32_t s[EDGE_BINS];
  uint16_t n[EDGE_BINS]; /* RIM_SELECT_MAX_RING at most */
  float most;
} histogram;

/* Of several histograms, n and s in one word, s * 256 + n, for so few observations: one addition
 * keeps both. */
#define PACKED_MAX 255u
#define PACKED_ROW 8u /* more than SELECT_AT_ONCE, to be found by a shift */
typedef int32_t packed_bins[EDGE_BINS][PACKED_ROW];

static int32_t packed(int32_t residual) { return residual * 256 + 1; }

/* Adds one of them to h, or, if these observations are its first, sets it. */
static void unpack(int32_t (*from)[PACKED_ROW], uint32_t which, bool first, histogram *h) {
  float up = 0.0f;
  float down = 0.0f;
  for (uint32_t k = 0; k < EDGE_BINS; ++k) {
    const uint32_t both = (uint32_t)from[k][which];
    uint32_t n = both & 255u;
    int32_t s = (int32_t)((both + 0x80000000u) >> 8) - 0x800000;
    if (!first) {
      n += h->n[k];
      s += h->s[k];
    }
    h->n[k] = (uint16_t)n;
    h->s[k] = s;
    if (s == 0)
      continue;
    const float sum = (float)s;
    const float part = sum * sum / (float)n;
    if (s > 0)
      up += part;
    else
      down += part;
  }
  h->most = up > down ? up : down;
}

/* In nats, rounded up by more than 16 sums in single precision lose. */
static double evidence_bound(const channel_state *state, const histogram *h) {
  return 0.5 * SELECT_RESIDUAL_STEP * SELECT_RESIDUAL_STEP * (1.0 + 1e-5) * (double)h->most /
         (double)state->a;
}

static found best_of(const channel_state *state, const histogram *h, double least) {
  prefix p;
  p.n[0] = p.s[0] = 0.0;
  for (uint32_t k = 0; k < EDGE_BINS; ++k) {
    p.n[k + 1] = p.n[k] + (double)h->n[k];
    p.s[k + 1] = p.s[k] + (double)h->s[k] * SELECT_RESIDUAL_STEP;
  }
  return most_anomalous(&p, EDGE_BINS, (double)state->a, (double)state->b, least);
}

/* The most anomalous interval of a histogram; its ln_anom is `least` where none has more, or none
 * can have as much as is `asked` for. */
static found conditional(rim_select *e, const histogram *h, double asked, double least) {
  const channel_state *state = select_channel(e, e->base_channel);
  ++e->effort.edges;
  if (evidence_bound(state, h) < asked)
    return (found){least, 0, 0};
  return best_of(state, h, rimi_max(least, 0.0));
}

/* At most PACKED_MAX of them, from one on. */
static base_mask part_of(base_mask mask, uint32_t from) {
  const uint32_t left = mask.count - from;
  return (base_mask){mask.slot + from, left < PACKED_MAX ? left : PACKED_MAX};
}

/* Every feature of a word of the ring. Most of a sweep's time goes here: with `bits` and `count`
 * known to the compiler nothing is left of them. */
static inline void add_word(const rim_select *e, base_mask part, uint32_t word, uint32_t bits,
                            uint32_t count, int32_t (*h)[PACKED_ROW]) {
  const uint32_t *ring = select_row(e, 0) + word;
  const int16_t *residual = select_residual(e, 0) + e->base_channel;
  const uint32_t words = e->words;
  const uint32_t channels = e->channels;
  const uint32_t of_bin = bits - 4u; /* a bin is the upper four bits of a level */
  for (uint32_t i = 0; i < part.count; ++i) {
    const uint32_t levels = ring[part.slot[i] * words] >> of_bin;
    const int32_t r = packed(residual[part.slot[i] * channels]);
    h[levels & 15u][0] += r;
    h[(levels >> bits) & 15u][1] += r;
    h[(levels >> 2u * bits) & 15u][2] += r;
    h[(levels >> 3u * bits) & 15u][3] += r;
    if (count > 4u) {
      h[(levels >> 4u * bits) & 15u][4] += r;
      h[(levels >> 5u * bits) & 15u][5] += r;
    }
  }
}
_Static_assert(EDGE_BINS == 16u && LEVELS_IN_WORD == 4u && SMALL_IN_WORD == 6u, "add_word");

/* Of the features first..end - 1 in a word of the ring. */
static void plain_histograms(const rim_select *e, base_mask mask, uint32_t word, uint32_t first,
                             uint32_t end, histogram *h) {
  uint32_t from = 0;
  do {
    const base_mask part = part_of(mask, from);
    packed_bins sums = {{0}};
    if (e->small)
      add_word(e, part, word, SMALL_LEVEL_BITS, SMALL_IN_WORD, sums);
    else
      add_word(e, part, word, LEVEL_BITS, LEVELS_IN_WORD, sums);
    for (uint32_t k = first; k < end; ++k)
      unpack(sums, k, from == 0, &h[k]);
    from += PACKED_MAX;
  } while (from < mask.count);
}

/* Where the base interval has its middle, in bytes: there shear moves nothing. */
static int32_t middle_of_base(const rim_select *e) {
  return ((int32_t)e->base_first + e->base_last + 1) * 256 / (2 * e->bins);
}

/* f + shear / SHEAR_STEPS * (base - its middle), a byte. */
static uint32_t sheared(int32_t byte, int32_t from_middle, int32_t shear) {
  const int32_t g = byte + from_middle * shear / SHEAR_STEPS;
  return (uint32_t)(g < 0 ? 0 : g > 255 ? 255 : g);
}

static void add_sheared(const rim_select *e, base_mask part, uint16_t f, int32_t (*h)[PACKED_ROW]) {
  const int32_t middle = middle_of_base(e);
  const ring_column base = select_column(e, e->base_feature);
  const ring_column other = select_column(e, f);
  for (uint32_t i = 0; i < part.count; ++i) {
    const uint32_t slot = part.slot[i];
    const int32_t r = packed(select_residual(e, slot)[e->base_channel]);
    const int32_t byte = (int32_t)select_byte(&other, slot);
    const int32_t from_middle = (int32_t)select_byte(&base, slot) - middle;
    for (uint32_t k = 0; k < SHEARS; ++k)
      h[(sheared(byte, from_middle, shears[k]) * EDGE_BINS) >> 8][k] += r;
  }
}

/* Of f in every shear. An oblique region has no good rectangle; an interval of a sheared feature
 * makes a parallelogram. */
static void sheared_histograms(const rim_select *e, base_mask mask, uint16_t f, histogram *h) {
  uint32_t from = 0;
  do {
    packed_bins sums = {{0}};
    add_sheared(e, part_of(mask, from), f, sums);
    for (uint32_t k = 0; k < SHEARS; ++k)
      unpack(sums, k, from == 0, &h[k]);
    from += PACKED_MAX;
  } while (from < mask.count);
}

/* The most anomalous interval of the base where the sheared f lies in the interval `given`. */
static found base_given(rim_select *e, uint16_t f, int32_t shear, const found *given) {
  const int32_t middle = middle_of_base(e);
  const ring_column of_base = select_column(e, e->base_feature);
  const ring_column other = select_column(e, f);
  histogram h = {.most = 0.0f};
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const int32_t base = (int32_t)select_byte(&of_base, slot);
    const int32_t byte = (int32_t)select_byte(&other, slot);
    const uint32_t k = (sheared(byte, base - middle, shear) * EDGE_BINS) >> 8;
    if (k < given->first || k > given->last)
      continue;
    const uint32_t bin = ((uint32_t)base * EDGE_BINS) >> 8;
    ++h.n[bin];
    h.s[bin] += select_residual(e, slot)[e->base_channel];
  }
  ++e->effort.edges;
  return best_of(select_channel(e, e->base_channel), &h, 0.0);
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
  const double slope = -(double)shear / (double)SHEAR_STEPS;
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

/* Offers what was found of (base, f). Where it nearly reaches the bar, the base gets the interval
 * that is best there first: its own was found over all values of f. */
static void offer_edge(rim_select *e, uint16_t f, const found *best, int32_t shear, double bar) {
  sides base = sides_of(e->base_first, e->base_last, e->bins);
  sides other = sides_of(best->first, best->last, EDGE_BINS);
  double h3 = best->ln_anom;
  if (h3 > bar - NEARLY_THERE) {
    const found refined = base_given(e, f, shear, best);
    if (refined.ln_anom > h3) {
      const double middle = base.low + base.high;
      base = sides_of(refined.first, refined.last, EDGE_BINS);
      const double moved =
          0.5 * (base.low + base.high - middle) * (double)shear / (double)SHEAR_STEPS;
      other.low -= moved;
      other.high -= moved;
      h3 = refined.ln_anom;
    }
  }
  const select_offer offer = offer_of(e, f, &base, &other, shear, h3);
  rimi_select_pool_offer(e, &offer);
}

/* What the pool asks, in nats of the base's channel. */
static double pool_bar(const rim_select *e) {
  const channel_state *state = select_channel(e, e->base_channel);
  return (rimi_select_pool_bar(e, NULL) + (double)state->offset) / (double)state->scale;
}

/* One edge (base, f), whose plain histogram is given: H3. Shears are tried only where it comes near
 * the pool's bar. Returns the conditional intervals used: 1 or SELECT_EDGE_INTERVALS. */
static uint32_t try_edge(rim_select *e, base_mask mask, uint16_t f, const histogram *plain,
                         double bar) {
  const double least = bar - NEAR_ENOUGH;
  found best = conditional(e, plain, e->small ? bar : least, least);
  if (best.ln_anom <= least)
    return 1;
  int32_t shear = 0;
  histogram h[SHEARS];
  sheared_histograms(e, mask, f, h);
  for (uint32_t i = 0; i < SHEARS; ++i) {
    const found other = conditional(e, &h[i], best.ln_anom, best.ln_anom);
    if (other.ln_anom <= best.ln_anom)
      continue;
    best = other;
    shear = shears[i];
  }
  offer_edge(e, f, &best, shear, bar);
  return SELECT_EDGE_INTERVALS;
}

/* Edges of the base from next_feature on, as many as its word of the ring has left, but no more
 * than the budget asks for. Returns the conditional intervals used. */
static uint32_t try_edges(rim_select *e, base_mask mask, uint32_t budget) {
  histogram plain[SELECT_AT_ONCE];
  const uint32_t word = (uint32_t)e->next_feature / select_in_word(e->small);
  const uint32_t before = word * select_in_word(e->small);
  const uint32_t first = e->next_feature - before;
  uint32_t end = e->features - before;
  end = end < select_in_word(e->small) ? end : select_in_word(e->small);
  end = end < first + budget ? end : first + budget;
  plain_histograms(e, mask, word, first, end, plain);
  double bar = pool_bar(e);
  uint32_t done = 0;
  for (uint32_t k = first; k < end && done < budget; ++k, ++e->next_feature) {
    if (e->next_feature == e->base_feature)
      continue;
    const uint32_t used = try_edge(e, mask, e->next_feature, &plain[k], bar);
    done += used;
    if (used > 1u) /* it was offered */
      bar = pool_bar(e);
  }
  return done;
}

void rimi_select_sweep(rim_select *e, uint32_t budget) {
  uint32_t done = 0;
  for (uint32_t bases = 0; bases < BASES_A_UNIT && done < budget; ++bases) {
    if (e->next_feature >= e->features)
      choose_base(e);
    const base_mask mask = mask_of_base(e);
    while (e->next_feature < e->features && done < budget)
      done += try_edges(e, mask, budget - done);
  }
  rimi_select_pool_enter(e);
}
