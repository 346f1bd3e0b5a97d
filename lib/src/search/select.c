/* SPDX-License-Identifier: MIT */
#include "search/select.h"

#include <float.h>
#include <stddef.h>
#include <string.h>

#include "base/ellipsoid.h"
#include "base/real.h"
#include "base/usable.h"
#include "rim/image.h"
#include "search/select_private.h"

/* Nats above the logarithm of the number of alternatives at which nominal runs of 250 observations
 * have their largest ln anom, by features: intervals, ellipses. */
#define PENALTY_INTERVAL 1.5
#define PENALTY_ELLIPSE 3.5
#define MAGIC 0x53454c31u

rim_select_config rimi_select_filled(const rim_select_config *config) {
  rim_select_config c = *config;
  RIM_OR_DEFAULT(c.channels, 1);
  RIM_OR_DEFAULT(c.ring, RIM_SELECT_DEFAULT_RING);
  RIM_OR_DEFAULT(c.bins, RIM_SELECT_DEFAULT_BINS);
  RIM_OR_DEFAULT(c.grid, RIM_SELECT_DEFAULT_GRID);
  RIM_OR_DEFAULT(c.pairs, RIM_SELECT_DEFAULT_PAIRS);
  RIM_OR_DEFAULT(c.scans, RIM_SELECT_DEFAULT_SCANS);
  RIM_OR_DEFAULT(c.edges, RIM_SELECT_DEFAULT_EDGES);
  RIM_OR_DEFAULT(c.moves, RIM_SELECT_DEFAULT_MOVES);
  return c;
}

static bool counts_are_valid(const rim_select_config *c) {
  return c->features >= 1 && c->features <= RIM_SELECT_MAX_FEATURES &&
         c->channels <= RIM_SELECT_MAX_CHANNELS && c->ring >= 16 &&
         c->ring <= RIM_SELECT_MAX_RING && c->bins >= 4 && c->bins <= RIM_SELECT_MAX_BINS &&
         c->grid >= 8 && c->grid <= RIM_SELECT_MAX_GRID && c->pairs <= RIM_SELECT_MAX_PAIRS;
}

static bool values_are_valid(const rim_select_config *c) {
  for (size_t i = 0; i < c->channels; ++i) {
    if (c->a != NULL && !(rimi_is_finite((double)c->a[i]) && c->a[i] > 0.0f))
      return false;
    if (c->b != NULL && !(rimi_is_finite((double)c->b[i]) && c->b[i] >= 0.0f))
      return false;
  }
  return true;
}

/* In the small profile a pair has fewer ellipses, and none is corrected by the ring. */
static uint32_t chains_of(bool small) { return small ? SMALL_CHAINS : RIM_SELECT_CHAINS; }
static size_t pair_bytes(bool small) {
  return small ? RIM_SELECT_ROUND8(offsetof(pair_state, chain) + SMALL_CHAINS * sizeof(chain))
               : RIM_SELECT_PAIR_BYTES;
}
static size_t cell_bytes(bool small, size_t grid) {
  return small ? 0u : RIM_SELECT_ROUND8(2u * grid * grid);
}
static size_t row_bytes(bool small, size_t features) {
  return 4u * ((features + select_in_word(small) - 1u) / select_in_word(small));
}
static size_t link_bytes(bool small, size_t ring) {
  return small ? 0u : RIM_SELECT_ROUND8(2u * ring);
}

static size_t ring_bytes(bool small, const rim_select_config *c) {
  return RIM_SELECT_ROUND8(c->ring * row_bytes(small, c->features));
}

static size_t size_of(const rim_select_config *c) {
  const size_t most =
      RIM_SELECT_SIZE(c->features, c->channels, c->ring, c->bins, c->grid, c->pairs);
  const size_t unused = cell_bytes(false, c->grid) - cell_bytes(c->small, c->grid) +
                        link_bytes(false, c->ring) - link_bytes(c->small, c->ring) +
                        ring_bytes(false, c) - ring_bytes(c->small, c);
  return most - unused - c->pairs * (RIM_SELECT_PAIR_BYTES - pair_bytes(c->small));
}

rim_status rimi_select_size(const rim_select_config *config, size_t *bytes) {
  if (config == NULL || bytes == NULL)
    return RIM_E_ARGUMENT;
  const rim_select_config c = rimi_select_filled(config);
  if (!counts_are_valid(&c))
    return RIM_E_CONFIG;
  *bytes = size_of(&c);
  return RIM_OK;
}

static void lay_out(rim_select *e) {
  const size_t d = e->features;
  const size_t channels = e->channels;
  size_t at = RIM_SELECT_HEADER_BYTES;
  e->sum_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(4u * d * e->bins * channels);
  e->count_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(2u * d * e->bins);
  e->ring_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8((size_t)e->ring * 4u * e->words);
  e->residual_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(2u * e->ring * channels);
  e->mask_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(2u * (size_t)e->ring);
  e->slice_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(8u * d * channels);
  e->channel_at = (uint32_t)at;
  at += RIM_SELECT_ROUND8(48u * channels);
  e->pair_at = (uint32_t)at;
  e->pair_bytes = (uint32_t)pair_bytes(e->small);
  at += e->pair_bytes * (size_t)e->pairs;
  e->cell_at = (uint32_t)at;
  at += cell_bytes(e->small, e->grid);
  e->link_at = (uint32_t)at;
  at += link_bytes(e->small, e->ring);
  e->grid_at = (uint32_t)at;
}

static void set_penalties(rim_select *e) {
  const double d = (double)e->features;
  e->penalty[0] = 0.0f;
  e->penalty[1] = (float)(PENALTY_INTERVAL + rimi_log(d));
  e->penalty[2] = (float)(PENALTY_ELLIPSE + rimi_log(d > 1.0 ? 0.5 * d * (d - 1.0) : 1.0));
}

rim_status rimi_select_init(rim_select **engine, void *memory, size_t bytes,
                            const rim_select_config *config) {
  if (engine == NULL || memory == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  if ((uintptr_t)memory % 8u != 0)
    return RIM_E_ALIGN;
  const rim_select_config c = rimi_select_filled(config);
  if (!counts_are_valid(&c))
    return RIM_E_CONFIG;
  if (bytes < size_of(&c))
    return RIM_E_SIZE;
  if (!values_are_valid(&c))
    return RIM_E_RANGE;
  memset(memory, 0, size_of(&c));
  rim_select *e = (rim_select *)memory;
  e->magic = MAGIC;
  e->features = c.features;
  e->channels = c.channels;
  e->ring = c.ring;
  e->bins = c.bins;
  e->grid = c.grid;
  e->pairs = c.pairs; /* of one feature none is ever in use */
  e->scans = c.scans;
  e->edges = c.edges;
  e->moves = c.moves;
  e->small = c.small;
  e->chains = (uint16_t)chains_of(c.small);
  e->words = (uint16_t)(row_bytes(c.small, c.features) / 4u);
  e->seed = c.seed;
  lay_out(e);
  set_penalties(e);
  for (uint32_t k = 0; k <= SELECT_ROOTS; ++k) {
    const double z = (double)k / (double)SELECT_ROOTS;
    e->root[k] = (uint16_t)((double)SELECT_ROOT_ONE * rimi_sqrt(1.0 - z * z) + 0.5);
  }
  for (uint32_t i = 0; i < c.channels; ++i) {
    channel_state *state = select_channel(e, i);
    state->a = c.a != NULL ? c.a[i] : 1.0f;
    state->b = c.b != NULL ? c.b[i] : 0.0f;
    state->scale = 1.0f;
  }
  rimi_select_reset(e);
  *engine = e;
  return RIM_OK;
}

void rimi_select_reset(rim_select *e) {
  const rim_bins table = select_bins(e);
  rimi_bins_clear(&table);
  memset(select_at(e, e->slice_at), 0, 8u * (size_t)e->features * e->channels);
  for (uint32_t c = 0; c < e->channels; ++c) {
    channel_state *state = select_channel(e, c);
    state->sum = 0.0;
    state->score = 0.0f;
    state->best_feature = 0;
    state->best_interval = 0.0f;
    e->scores[c] = 0.0f;
  }
  memset(select_at(e, e->pair_at), 0, (size_t)e->pair_bytes * e->pairs);
  e->head = 0;
  e->held = 0;
  e->leader = e->pairs;
  e->turn = 0;
  e->sweeps = 0;
  e->next_feature = e->features;
  e->next_slice = 0;
  e->waits = false;
  e->count = 0;
  e->total = 0;
  memset(&e->effort, 0, sizeof e->effort);
  rimi_rng_seed(&e->rng, e->seed, 0x73656c65u);
}

rim_status rimi_select_set_channel_scale(rim_select *e, const float *scale, const float *offset) {
  if (e == NULL)
    return RIM_E_ARGUMENT;
  for (uint32_t c = 0; c < e->channels; ++c) {
    if (scale != NULL && !(rimi_is_finite((double)scale[c]) && scale[c] > 0.0f))
      return RIM_E_RANGE;
    if (offset != NULL && !rimi_is_finite((double)offset[c]))
      return RIM_E_RANGE;
  }
  for (uint32_t c = 0; c < e->channels; ++c) {
    channel_state *state = select_channel(e, c);
    state->scale = scale != NULL ? scale[c] : 1.0f;
    state->offset = offset != NULL ? offset[c] : 0.0f;
  }
  return RIM_OK;
}

static int16_t quantised(double r) {
  const double clipped = rimi_clamp(r, -RIM_SELECT_CLIP, RIM_SELECT_CLIP) / SELECT_RESIDUAL_STEP;
  return (int16_t)(clipped >= 0.0 ? clipped + 0.5 : clipped - 0.5);
}

/* ln anom of the hypothesis without features. */
static double everywhere(const rim_select *e, const channel_state *state) {
  return select_ln_anom(state->sum, (double)e->count, (double)state->a, (double)state->b);
}

static void update_scores(rim_select *e) {
  for (uint32_t c = 0; c < e->channels; ++c) {
    channel_state *state = select_channel(e, c);
    double best = everywhere(e, state) - (double)e->penalty[0];
    best = rimi_max(best, (double)state->best_interval - (double)e->penalty[1]);
    state->score = (float)rimi_max(best, 0.0);
    e->scores[c] = state->score;
  }
  double leading = -DBL_MAX;
  uint16_t leader = e->pairs;
  for (uint16_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active)
      continue;
    const channel_state *state = select_channel(e, p->channel);
    const double value = (double)rimi_select_pair_best(e, p, NULL) - (double)e->penalty[2];
    if (value > (double)e->scores[p->channel])
      e->scores[p->channel] = (float)value;
    const double priority = select_priority(state, value);
    if (priority > leading) {
      leading = priority;
      leader = i;
    }
  }
  e->leader = leader;
}

/* Once in 30000 observations: what was seen so far weighs one half from now on. */
static void halve(rim_select *e) {
  const rim_bins table = select_bins(e);
  rimi_bins_halve(&table);
  for (uint32_t c = 0; c < e->channels; ++c)
    select_channel(e, c)->sum *= 0.5;
  e->count /= 2u;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    const rim_grid grid = select_grid(e, i);
    rimi_grid_halve(&grid);
    if (select_pair(e, i)->active)
      rimi_select_pool_refresh(e, i);
  }
}

/* Into the ring; and each feature's bin. */
static void keep_levels(rim_select *e, uint32_t slot, const double *u, uint8_t *bin) {
  const uint32_t bits = select_level_bits(e);
  const uint32_t full = bits * select_in_word(e->small);
  uint32_t *row = select_row(e, slot);
  uint32_t word = 0;
  uint32_t shift = 0;
  for (uint32_t f = 0; f < e->features; ++f) {
    const uint32_t byte = rimi_bins_cell(u[f], 256);
    bin[f] = (uint8_t)((byte * e->bins) >> 8);
    word |= (byte >> (8u - bits)) << shift;
    shift += bits;
    if (shift == full || f + 1u == e->features) {
      *row++ = word;
      word = 0;
      shift = 0;
    }
  }
}

rim_status rimi_select_observe(rim_select *e, const double *u, const double *r) {
  if (e == NULL || u == NULL || r == NULL)
    return RIM_E_ARGUMENT;
  if (!all_finite(u, e->features) || !all_finite(r, e->channels))
    return RIM_E_DATA;
  const rim_bins table = select_bins(e);
  if (e->count >= RIM_BINS_MAX_COUNT)
    halve(e);
  const uint16_t slot = e->head;
  if (e->held == e->ring)
    rimi_select_pool_forget(e, slot);
  uint8_t bin[RIM_SELECT_MAX_FEATURES];
  keep_levels(e, slot, u, bin);
  int16_t *stored = select_residual(e, slot);
  for (uint32_t c = 0; c < e->channels; ++c) {
    stored[c] = quantised(r[c]);
    select_channel(e, c)->sum += (double)stored[c] * SELECT_RESIDUAL_STEP;
  }
  rimi_bins_add(&table, bin, stored);
  e->head = (uint16_t)(slot + 1u == e->ring ? 0u : slot + 1u);
  if (e->held < e->ring)
    ++e->held;
  ++e->count;
  ++e->total;
  ++e->effort.observations;
  rimi_select_pool_observe(e, slot);
  update_scores(e);
  return RIM_OK;
}

void rimi_select_work(rim_select *e, uint32_t budget) {
  if (e->count == 0)
    return;
  for (uint32_t unit = 0; unit < budget; ++unit) {
    ++e->effort.units;
    e->entered = 0;
    rimi_select_scan(e, e->scans);
    if (e->pairs > 0) {
      rimi_select_sweep(e, select_unit_work(e, e->edges));
      update_scores(e);
      if (!e->small || e->entered == 0)
        rimi_select_pool_move(e, select_unit_work(e, e->moves));
    }
    update_scores(e);
  }
}

const float *rimi_select_channel_scores(const rim_select *e) { return e->scores; }
uint32_t rimi_select_observations(const rim_select *e) { return e->total; }
rim_select_effort rimi_select_get_effort(const rim_select *e) { return e->effort; }

/* Index, counted from the first observation, of what a ring slot holds. */
static uint32_t index_of(const rim_select *e, uint32_t slot) {
  const uint32_t newest = e->head == 0 ? e->ring - 1u : e->head - 1u;
  const uint32_t age = newest >= slot ? newest - slot : newest + e->ring - slot;
  return e->total - 1u - age;
}

/* From the oldest on: the first one inside is the earliest. */
static uint32_t earliest_inside(const rim_select *e, const rim_candidate *candidate) {
  double u[RIM_SELECT_MAX_FEATURES];
  memset(u, 0, sizeof u);
  uint32_t slot = e->held < e->ring ? 0u : e->head;
  for (uint32_t i = 0; i < e->held; ++i) {
    for (uint32_t k = 0; k < candidate->dims; ++k) {
      const uint16_t f = candidate->region.unit.feature[k];
      const ring_column levels = select_column(e, f);
      u[f] = ((double)select_byte(&levels, slot) + 0.5) / 256.0;
    }
    if (rimi_unit_region_contains(&candidate->region, u))
      return index_of(e, slot);
    slot = slot + 1u == e->ring ? 0u : slot + 1u;
  }
  return UINT32_MAX;
}

static void interval_region(const rim_select *e, uint16_t feature, const slice *s,
                            rim_region *region) {
  const double low = (double)s->first / (double)e->bins;
  const double high = ((double)s->last + 1.0) / (double)e->bins;
  rimi_region_from_box(region, 1, &feature, &low, &high);
}

static void ellipse_region(const pair_state *p, const ellipse *shape, rim_region *region) {
  const double a = (double)shape->a / (double)SELECT_ONE;
  const double b = (double)shape->b / (double)SELECT_ONE;
  const double c = (double)shape->c / (double)SELECT_ONE;
  memset(region, 0, sizeof *region);
  region->dims = 2;
  region->feature[0] = p->x;
  region->feature[1] = p->y;
  region->center[0] = (double)shape->cx / (double)SELECT_ONE;
  region->center[1] = (double)shape->cy / (double)SELECT_ONE;
  /* (x, y) = centre + (b z1 + c z2, a z1): A^-1 = L^-T L^-1 */
  region->inverse_shape[0] = 1.0 / (c * c);
  region->inverse_shape[1] = -b / (a * c * c);
  region->inverse_shape[2] = region->inverse_shape[1];
  region->inverse_shape[3] = 1.0 / (a * a) + b * b / (a * a * c * c);
  rim_region_bounds(region);
}

/* All of the best hypothesis of a channel but `since`. */
static void find_best(const rim_select *e, uint32_t channel, rim_candidate *out) {
  const channel_state *state = select_channel(e, channel);
  memset(out, 0, sizeof *out);
  out->channel = (uint16_t)channel;
  out->n = (double)e->count;
  out->s = state->sum;
  out->ln_anom = everywhere(e, state);
  double best = out->ln_anom - (double)e->penalty[0];
  if ((double)state->best_interval - (double)e->penalty[1] > best) {
    const slice *s = select_slice(e, channel, state->best_feature);
    double sum[RIM_SELECT_MAX_BINS + 1];
    double count[RIM_SELECT_MAX_BINS + 1];
    const rim_bins table = select_bins(e);
    rimi_bins_prefix(&table, state->best_feature, (uint16_t)channel, sum, count);
    out->dims = 1;
    out->n = count[s->last + 1] - count[s->first];
    out->s = sum[s->last + 1] - sum[s->first];
    out->ln_anom = (double)s->ln_anom;
    best = out->ln_anom - (double)e->penalty[1];
    interval_region(e, state->best_feature, s, &out->region.unit);
  }
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active || p->channel != channel)
      continue;
    uint32_t which = 0;
    const double ln_anom = (double)rimi_select_pair_best(e, p, &which);
    if (ln_anom - (double)e->penalty[2] <= best)
      continue;
    best = ln_anom - (double)e->penalty[2];
    out->dims = 2;
    out->n = (double)p->chain[which].n;
    out->s = (double)p->chain[which].s;
    out->ln_anom = ln_anom;
    ellipse_region(p, &p->chain[which].shape, &out->region.unit);
  }
  if (out->n > 0.0)
    out->shift = out->s / out->n;
  out->score = select_priority(state, best);
  out->since = UINT32_MAX;
}

bool rimi_select_best_of_channel(const rim_select *e, uint16_t channel, rim_candidate *out) {
  if (e == NULL || out == NULL || channel >= e->channels || e->count == 0)
    return false;
  find_best(e, channel, out);
  out->since = earliest_inside(e, out);
  return true;
}

bool rimi_select_shift_of_channel(const rim_select *e, uint16_t channel, rim_candidate *out) {
  if (e == NULL || out == NULL || channel >= e->channels || e->count == 0)
    return false;
  find_best(e, channel, out);
  return true;
}

static uint32_t best_channel(const rim_select *e) {
  uint32_t best = 0;
  double value = -DBL_MAX;
  for (uint32_t c = 0; c < e->channels; ++c) {
    const channel_state *state = select_channel(e, c);
    const double score = select_priority(state, (double)e->scores[c]);
    if (score > value) {
      value = score;
      best = c;
    }
  }
  return best;
}

bool rimi_select_best(const rim_select *e, rim_candidate *out) {
  if (e == NULL || out == NULL || e->count == 0)
    return false;
  find_best(e, best_channel(e), out);
  out->since = earliest_inside(e, out);
  return true;
}

double rimi_select_membership(const rim_select *e, uint16_t channel, const double *u) {
  if (e == NULL || u == NULL || channel >= e->channels || e->count == 0)
    return 0.0;
  rim_candidate best;
  find_best(e, channel, &best);
  if (best.dims < 2)
    return rimi_unit_region_contains(&best.region, u) ? 1.0 : 0.0;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    const pair_state *p = select_pair(e, i);
    if (p->active && p->channel == best.channel && p->x == best.region.unit.feature[0] &&
        p->y == best.region.unit.feature[1]) {
      return rimi_select_pair_membership(e, p, u[p->x], u[p->y]);
    }
  }
  return 0.0;
}

_Static_assert(sizeof(rim_select) <= RIM_SELECT_HEADER_BYTES, "header");
_Static_assert(sizeof(pair_state) <= RIM_SELECT_PAIR_BYTES, "pair");
_Static_assert(sizeof(channel_state) <= 48, "channel");
_Static_assert(sizeof(slice) == 8, "slice");
