/* SPDX-License-Identifier: MIT */
#include "search/search.h"

#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "search/search_private.h"

#define FEATURE_SCORE 22.0 /* per logarithm: tells ratios apart by a twentieth, up to 100,000 */

static size_t round8(size_t n) { return (n + 7u) & ~(size_t)7u; }

static bool config_fits(const search_config *c) {
  return c->features >= 1 && c->features <= SEARCH_MAX_FEATURES && c->channels >= 1 &&
         c->channels <= SEARCH_MAX_CHANNELS && c->outcomes >= 1 && c->channels >= c->outcomes &&
         c->ring >= 8 && c->ring <= SEARCH_MAX_RING && c->noise != NULL && c->cuts != NULL &&
         c->noise->channels == c->channels && c->noise->raw == NOISE_RAW_FIRST + (uint32_t)c->means;
}

/* Places every array; returns the bytes of all. */
static size_t lay_out(search_layout *at, const search_config *c) {
  const size_t ring = c->ring;
  size_t bytes = round8(sizeof(rim_search));
  const size_t fields = c->noise->fields;
  at->gram = (uint32_t)bytes;
  bytes += round8(4u * (c->channels * (fields * (fields + 1u) / 2u + fields) + c->outcomes));
  at->state = (uint32_t)bytes;
  bytes += round8(sizeof(channel_state) * (size_t)c->channels);
  at->time = (uint32_t)bytes;
  bytes += round8(4u * ring);
  at->work = (uint32_t)bytes;
  at->fields = (uint32_t)(bytes + 12u * ring);
  at->fields_per_block = (uint32_t)fields;
  bytes += round8(4u * ring * (3u + fields));
  at->z = (uint32_t)bytes;
  const size_t fine = search_fine_of(c);
  bytes += round8(2u * ring * fine);
  at->coarse = (uint32_t)bytes;
  bytes += round8(ring * (c->channels - fine));
  at->feature = (uint32_t)bytes;
  bytes += round8(ring * c->features);
  at->mean = (uint32_t)bytes;
  bytes += round8(ring * c->means);
  at->predicted = (uint32_t)bytes;
  bytes += round8(ring * fine);
  at->activity = (uint32_t)bytes;
  bytes += round8(2u * ring);
  at->apart = (uint32_t)bytes;
  bytes += round8(ring);
  at->score = (uint32_t)bytes;
  bytes += round8((size_t)c->channels * c->features);
  at->scatter = (uint32_t)bytes;
  bytes += round8(c->outcomes);
  at->level = (uint32_t)bytes;
  bytes += round8(sizeof(noise_level) * fine);
  return bytes;
}

size_t rimi_search_size(const search_config *config) {
  if (config == NULL || !config_fits(config))
    return 0;
  search_layout at;
  return lay_out(&at, config);
}

rim_status rimi_search_init(rim_search **search, void *memory, size_t bytes,
                            const search_config *config) {
  if (!config_fits(config))
    return RIM_E_CONFIG;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  if (bytes < rimi_search_size(config))
    return RIM_E_SIZE;
  rim_search *s = memory;
  memset(s, 0, sizeof *s);
  s->config = *config;
  (void)lay_out(&s->at, config);
  rimi_search_reset(s);
  *search = s;
  return RIM_OK;
}

void rimi_search_attach(rim_search *s, const search_config *config) { s->config = *config; }

static void forget(search_hypothesis *h) {
  memset(h, 0, sizeof *h);
  h->score = SEARCH_NONE;
  h->onset = SEARCH_FROM_START;
}

void rimi_search_reset(rim_search *s) {
  s->count = 0;
  s->held = s->head = 0;
  s->channel = s->next_channel = s->stage = s->next_pair = 0;
  s->fresh = s->favour = false;
  s->placed_channel = 0;
  forget(&s->placed);
  for (uint32_t c = 0; c < s->config.channels; ++c) {
    channel_state *state = search_state(s, c);
    forget(&state->time);
    forget(&state->region);
  }
  memset(search_gram(s, 0), 0, sizeof(float) * search_gram_floats(s) * s->config.channels);
  memset(search_before(s), 0, sizeof(float) * s->config.outcomes);
  memset(search_feature_scores(s, 0), 0, (size_t)s->config.channels * s->config.features);
  memset(search_newest_scatter(s), 0, s->config.outcomes);
  memset(search_levels(s), 0, sizeof(noise_level) * search_fine(s));
  memset(s->excludes, 0, sizeof s->excludes);
}

static int8_t to_byte(double x) {
  const double scaled = rimi_clamp(x, -4.0, 4.0) / SEARCH_BYTE_STEP;
  return (int8_t)rimi_floor(scaled + 0.5);
}

static int8_t to_coarse(double z) {
  return (int8_t)rimi_floor(rimi_clamp(z / SEARCH_COARSE_STEP, -127.0, 127.0) + 0.5);
}

double rimi_search_limited(double scatter, double before) {
  return rimi_clamp(scatter, rimi_min(before, 0.0) - SEARCH_ALONE,
                    rimi_max(before, 0.0) + SEARCH_ALONE);
}

static void store_residual(rim_search *s, uint32_t slot, uint32_t channel, double z, bool unknown) {
  const uint32_t fine = search_fine(s);
  if (channel < fine)
    search_fine_residuals(s, slot)[channel] =
        unknown ? SEARCH_UNKNOWN
                : (int16_t)rimi_floor(rimi_clamp(z / SEARCH_Z_STEP, -32000.0, 32000.0) + 0.5);
  else
    search_coarse_residuals(s, slot)[channel - fine] =
        unknown ? SEARCH_COARSE_UNKNOWN : to_coarse(z);
}

/* A block and the one before it, in whatever channel. */
typedef struct block_pair {
  uint32_t slot, before;
  bool first, apart; /* after no other; after a gap */
  double raw[NOISE_MAX_RAW], raw_before[NOISE_MAX_RAW];
} block_pair;

static block_pair pair_at(const rim_search *s, uint32_t slot) {
  block_pair pair = {.slot = slot, .before = slot == 0 ? s->config.ring - 1u : slot - 1u};
  pair.first = search_apart(s)[slot] == SEARCH_FIRST;
  pair.apart = search_apart(s)[slot] == SEARCH_APART;
  rimi_search_raw_fields(s, slot, pair.raw);
  if (!pair.first)
    rimi_search_raw_fields(s, pair.before, pair.raw_before);
  return pair;
}

/* The part of the residual before that is not new in a block; *w, the weight of a residual, becomes
 * that of what is new. */
static double past_of(const rim_search *s, const block_pair *n, uint32_t channel, double rho,
                      double *w) {
  if (n->first || !search_is_known(s, channel, n->before)) { /* with nothing before it */
    *w *= rimi_sqrt(1.0 - rho * rho);
    return 0.0;
  }
  *w *= n->apart ? rimi_noise_gap_weight(rho) : 1.0;
  return rho;
}

/* What counts of residual z of a channel that has a limit. */
static double limited(const rim_search *s, const block_pair *n, const noise_channel *c,
                      uint32_t channel, double z) {
  double w = rimi_search_scale(s, c, channel, n->slot), kept = 0.0;
  const double past = past_of(s, n, channel, rimi_search_rho(s, c, n->slot), &w);
  if (past > 0.0)
    kept = past * search_residual(s, channel, n->before);
  const double fresh = (z - kept) * w;
  return kept + rimi_noise_counted(fresh, (double)c->limit, search_levels(s) + channel) / w;
}

static void store_channel(rim_search *s, const block_pair *n, const search_block *b,
                          uint32_t channel) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  const bool unknown = b->unknown != NULL && b->unknown[channel];
  double z = (b->residual[channel] - (double)c.mean) / (double)c.s;
  if (channel / s->config.outcomes == RIM_CHANNEL_SCATTER) {
    int8_t *newest = search_newest_scatter(s) + channel % s->config.outcomes;
    const double before = b->apart ? 0.0 : (double)*newest * SEARCH_COARSE_STEP;
    *newest = to_coarse(z);
    z = rimi_search_limited(z, before);
  } else if (channel / s->config.outcomes == RIM_CHANNEL_STEP) {
    z = rimi_clamp(z, -SEARCH_STEP_MOST, SEARCH_STEP_MOST);
  } else if (channel < search_fine(s) && c.limit > 0.0f && !unknown) {
    z = limited(s, n, &c, channel, z);
  }
  store_residual(s, n->slot, channel, z, unknown);
}

/* Adds sign times what a block is to G = B'WB and u = B'Wr of a channel. */
static void accumulate(rim_search *s, block_pair *n, double sign, uint32_t channel) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  const uint32_t k = c.fields;
  const uint32_t raw_count = s->config.noise->raw;
  double white[NOISE_MAX_FIELDS];
  n->raw[1] = search_raw_prediction(s, n->slot, channel);
  double w = rimi_search_weight(s, &c, channel, n->slot);
  if (!(w > 0.0))
    return;
  const double past = past_of(s, n, channel, rimi_search_rho(s, &c, n->slot), &w);
  double e = search_residual(s, channel, n->slot);
  if (past > 0.0) {
    n->raw_before[1] = search_raw_prediction(s, n->before, channel);
    e -= past * search_residual(s, channel, n->before);
  }
  for (uint32_t j = 0; j < k; ++j) {
    const uint8_t *combination = c.combination + 4u * (size_t)j * raw_count;
    double now = 0.0, then = 0.0;
    for (uint32_t r = 0; r < raw_count; ++r) {
      const double of = (double)rimi_le_f32(combination, r);
      now += of * n->raw[r];
      then += of * n->raw_before[r];
    }
    white[j] = w * (now - past * then);
  }
  float *gram = search_gram(s, channel);
  float *u = gram + k * (k + 1u) / 2u;
  for (uint32_t i = 0; i < k; ++i) {
    for (uint32_t j = 0; j <= i; ++j, ++gram)
      *gram = (float)((double)*gram + sign * white[i] * white[j]);
    u[i] = (float)((double)u[i] + sign * white[i] * w * e);
  }
}

static void store_activity(rim_search *s, uint32_t slot, const search_block *b) {
  const bool has_before = s->count > 0 && !b->apart;
  const double activity = has_before ? rimi_noise_activity(s->config.noise, b->predicted,
                                                           search_before(s), s->config.outcomes)
                                     : NOISE_APART;
  search_activities(s)[slot] =
      (int8_t)rimi_floor(rimi_clamp(activity / SEARCH_ACTIVITY_STEP, -127.0, 127.0) + 0.5);
  for (uint32_t o = 0; o < s->config.outcomes; ++o)
    search_before(s)[o] = (float)b->predicted[o];
}

rim_status rimi_search_observe(rim_search *s, const search_block *b) {
  const search_config *c = &s->config;
  if (!rimi_is_finite(b->t_s) || !rimi_is_finite(b->disturbance) ||
      !all_finite(b->mean, c->means) || !all_finite(b->predicted, search_fine(s)) ||
      !all_finite(b->residual, c->channels))
    return RIM_E_DATA;
  const uint32_t slot = s->head;
  search_times(s)[slot] = (float)b->t_s;
  memcpy(search_features(s, slot), b->feature, c->features);
  store_activity(s, slot, b);
  const double disturbance = (b->disturbance - SEARCH_CALMEST) / SEARCH_DISTURBANCE_STEP;
  search_disturbances(s)[slot] = (uint8_t)rimi_floor(rimi_clamp(disturbance, 0.0, 255.0) + 0.5);
  for (uint32_t m = 0; m < c->means; ++m)
    search_means(s, slot)[m] = to_byte(b->mean[m]);
  for (uint32_t i = 0; i < search_fine(s); ++i) {
    const noise_channel n = rimi_noise_channel(c->noise, i);
    search_predictions(s, slot)[i] =
        to_byte((b->predicted[i] - (double)n.p_center) / (double)n.p_scale);
  }
  search_apart(s)[slot] = (uint8_t)(s->count == 0 ? SEARCH_FIRST : b->apart ? SEARCH_APART : 0);
  block_pair newest = pair_at(s, slot);
  for (uint32_t i = 0; i < c->channels; ++i)
    store_channel(s, &newest, b, i);
  for (uint32_t i = 0; i < c->channels; ++i)
    accumulate(s, &newest, 1.0, i);
  s->head = (uint16_t)(slot + 1u == c->ring ? 0u : slot + 1u);
  if (s->held < c->ring)
    ++s->held;
  ++s->count;
  s->fresh = false;
  return RIM_OK;
}

/* ---- what is no evidence any more ---- */

static bool is_active(const rim_search *s, uint32_t channel) {
  return rimi_noise_channel(s->config.noise, channel).active > 0.5f;
}

static bool excludes(const rim_search *s, uint32_t channel) {
  return (s->excludes[channel / 32u] >> (channel % 32u) & 1u) != 0;
}

bool rimi_search_exclude(rim_search *s, uint32_t from, uint32_t to) {
  const uint32_t oldest = s->count - s->held;
  from = from > oldest ? from : oldest;
  to = to < s->count ? to : s->count;
  if (from >= to)
    return false;
  for (uint32_t c = 0; c < s->config.channels; ++c) {
    if (excludes(s, c))
      return false;
  }
  forget(&s->placed);
  s->excluded_from = from;
  s->excluded_to = to;
  for (uint32_t c = 0; c < s->config.channels; ++c) {
    channel_state *state = search_state(s, c);
    forget(&state->time);
    forget(&state->region);
    if (is_active(s, c))
      s->excludes[c / 32u] |= UINT32_C(1) << (c % 32u);
  }
  s->fresh = false;
  s->stage = 0;
  return true;
}

/* G and u keep what leaves the ring: the block after the oldest, whose innovation takes both, goes
 * while the oldest is still there to say what it was. */
void rimi_search_let_go(rim_search *s, const search_hypothesis *h) {
  const uint32_t oldest = s->count - s->held;
  if (s->held < s->config.ring || h->family == SEARCH_FIELD)
    return;
  const uint32_t slot = search_slot(s, 1u);
  search_hypothesis where = *h;
  if (h->shape == SEARCH_KEPT) /* it deviates outside as well */
    where.family = SEARCH_SINCE;
  if (!rimi_search_inside(s, &where, search_features(s, search_slot(s, 0)), oldest) &&
      !rimi_search_inside(s, &where, search_features(s, slot), oldest + 1u))
    return;
  block_pair pair = pair_at(s, slot);
  for (uint32_t c = 0; c < s->config.channels; ++c)
    accumulate(s, &pair, -1.0, c);
  s->fresh = false;
}

/* The excluded blocks leave G and u of the channel, and their residuals are unknown from then on.
 * So does what they left in the innovation of the block after them, which then follows on nothing
 * that is known. What the oldest block of a full ring is to G is not known any more, and stays. */
void rimi_search_take_out(rim_search *s, uint32_t channel) {
  if (!excludes(s, channel))
    return;
  s->excludes[channel / 32u] &= ~(UINT32_C(1) << (channel % 32u));
  const uint32_t oldest = s->count - s->held, to = s->excluded_to;
  const uint32_t from = s->excluded_from > oldest ? s->excluded_from : oldest;
  if (from >= to)
    return;
  const bool has_next = to < s->count;
  for (uint32_t n = from; n < to + (has_next ? 1u : 0u); ++n) {
    block_pair pair = pair_at(s, search_slot(s, n - oldest));
    if (n > oldest || oldest == 0)
      accumulate(s, &pair, -1.0, channel);
  }
  for (uint32_t n = from; n < to; ++n)
    store_residual(s, search_slot(s, n - oldest), channel, 0.0, true);
  if (has_next) {
    block_pair next = pair_at(s, search_slot(s, to - oldest));
    accumulate(s, &next, 1.0, channel);
  }
}

void rimi_search_note(rim_search *s, uint32_t channel, const search_hypothesis *h) {
  if (s->maxima != NULL && h->score > SEARCH_NONE) {
    float *most = s->maxima + (size_t)channel * NOISE_FAMILIES + h->family;
    if (h->ln_ratio > *most)
      *most = h->ln_ratio;
  }
  channel_state *state = search_state(s, channel);
  search_hypothesis *best = h->family <= SEARCH_FIELD ? &state->time : &state->region;
  if (h->score > best->score)
    *best = *h;
  if (channel == s->placed_channel && search_dims(h) > 0 &&
      rimi_search_worth(s, channel, h) > rimi_search_worth(s, channel, &s->placed))
    s->placed = *h;
}

const search_hypothesis *rimi_search_region(const rim_search *s, uint32_t channel) {
  const search_hypothesis *region = &search_state(s, channel)->region;
  const bool is_time = region->family == SEARCH_DURING && region->score > SEARCH_NONE;
  return is_time && channel == s->placed_channel ? &s->placed : region;
}

const search_hypothesis *rimi_search_best(const rim_search *s, uint32_t channel) {
  const channel_state *state = search_state(s, channel);
  return state->region.score > state->time.score ? &state->region : &state->time;
}

/* A channel that is not known in the newest block is not judged. The ring holds ever fewer of its
 * blocks, and they would be judged as if nothing else had been known of the run. */
static bool is_watched(const rim_search *s, uint32_t channel) {
  return is_active(s, channel) &&
         (s->held == 0 || search_is_known(s, channel, search_slot(s, s->held - 1u)));
}

/* The channel of the next turn: every other one goes to the best, the others go round. The number
 * of channels: none is watched. */
static uint32_t choose_channel(rim_search *s) {
  s->favour = !s->favour;
  if (s->favour) {
    uint32_t best = s->config.channels;
    for (uint32_t c = 0; c < s->config.channels; ++c) {
      if (is_watched(s, c) && (best == s->config.channels ||
                               rimi_search_best(s, c)->score > rimi_search_best(s, best)->score))
        best = c;
    }
    if (best < s->config.channels) {
      if (best != s->placed_channel)
        forget(&s->placed);
      s->placed_channel = (uint16_t)best;
      return best;
    }
  }
  for (uint32_t i = 0; i < s->config.channels; ++i) {
    const uint32_t c = s->next_channel;
    s->next_channel = (uint16_t)(c + 1u == s->config.channels ? 0u : c + 1u);
    if (is_watched(s, c))
      return c;
  }
  return s->config.channels;
}

/* What was found earlier, judged with the newest blocks, and moved where that is better. */
static void renew(rim_search *s, search_hypothesis *found) {
  search_hypothesis h = *found;
  found->score = SEARCH_NONE;
  if (h.score <= SEARCH_NONE)
    return;
  rimi_search_evaluate(s, &h);
  if (h.family == SEARCH_DURING) {
    rimi_search_refine_during(s, &h);
    rimi_search_note(s, s->channel, &h);
    return;
  }
  const bool two = search_dims(&h) == 2u;
  rimi_search_refine_edges(s, &h, 0);
  if (two)
    rimi_search_refine_edges(s, &h, 1);
  if (h.onset != SEARCH_FROM_START) {
    const search_mask mask = rimi_search_mask_of(s, &h, -1);
    rimi_search_scan_onset(s, &mask, &h, NULL);
  }
  rimi_search_note(s, s->channel, &h);
}

static void renew_regions(rim_search *s) {
  channel_state *state = search_state(s, s->channel);
  const bool is_placed = s->channel == s->placed_channel;
  if (is_placed && state->region.family != SEARCH_DURING) /* it is the region itself */
    s->placed.score = SEARCH_NONE;
  renew(s, &state->region);
  if (is_placed && state->region.family == SEARCH_DURING)
    renew(s, &s->placed);
}

bool rimi_search_is_own(const rim_search *s, uint32_t feature) {
  const search_config *c = &s->config;
  return c->region != NULL && c->outcome_feature != NULL &&
         rimi_le_u16(c->region, 2u * (size_t)feature + 1u) == SEARCH_AS_MEASURED &&
         rimi_le_u16(c->region, 2u * (size_t)feature) ==
             rimi_le_u16(c->outcome_feature, (size_t)s->channel % c->outcomes);
}

static void scan_feature(rim_search *s, uint32_t feature) {
  uint8_t *scores = search_feature_scores(s, s->channel);
  scores[feature] = 0;
  if (feature == 0)
    s->top_feature = 0;
  if (rimi_search_is_own(s, feature))
    return;
  search_mask mask;
  memset(&mask, 0, sizeof mask);
  search_hypothesis h;
  forget(&h);
  h.family = SEARCH_INTERVAL;
  rimi_search_scan_interval(s, &mask, feature, &h, 0);
  const double order =
      h.score > SEARCH_NONE ? FEATURE_SCORE * rimi_log(1.0 + (double)h.ln_ratio) : 0.0;
  scores[feature] = (uint8_t)rimi_min(order, 255.0);
  if (scores[feature] > scores[s->top_feature] || rimi_search_is_own(s, s->top_feature))
    s->top_feature = (uint8_t)feature;
  rimi_search_note(s, s->channel, &h);
}

/* An interval of the best feature since an onset: each given the other, from both sides. */
static void scan_interval_since(rim_search *s) {
  const channel_state *state = search_state(s, s->channel);
  search_hypothesis h;
  if (rimi_search_is_own(s, s->top_feature))
    return;
  forget(&h);
  h.family = SEARCH_INTERVAL_SINCE;
  h.onset = state->time.onset;
  search_mask mask = rimi_search_mask_of(s, &h, 0);
  rimi_search_scan_interval(s, &mask, s->top_feature, &h, 0);
  for (uint32_t round = 0; round < 2 && h.score > SEARCH_NONE; ++round) {
    mask = rimi_search_mask_of(s, &h, -1);
    rimi_search_scan_onset(s, &mask, &h, NULL);
    rimi_search_refine_edges(s, &h, 0);
  }
  rimi_search_note(s, s->channel, &h);
}

/* What came and went: wherever in time, and since the best onset of what would go on. */
static void scan_during(rim_search *s) {
  search_hypothesis h;
  rimi_search_scan_during(s, &h);
  rimi_search_note(s, s->channel, &h);
  forget(&h);
  h.family = SEARCH_DURING;
  h.onset = s->in_time[SEARCH_SINCE].onset;
  rimi_search_scan_end(s, &h);
  rimi_search_note(s, s->channel, &h);
}

static void scan_pair(rim_search *s) {
  const uint32_t n = s->config.features;
  uint32_t x = s->top_feature;
  uint32_t y = s->next_pair % n;
  if ((s->next_pair & 1u) != 0) /* every other pair without regard to what single features say */
    x = (s->next_pair / n) % n;
  ++s->next_pair;
  if (x == y || rimi_search_is_own(s, x) || rimi_search_is_own(s, y))
    return;
  search_hypothesis h;
  rimi_search_scan_box(s, x < y ? x : y, x < y ? y : x, &h);
  if (h.score <= SEARCH_NONE)
    return;
  rimi_search_note(s, s->channel, &h);
  h.family = SEARCH_BOX_SINCE;
  const search_mask mask = rimi_search_mask_of(s, &h, -1);
  rimi_search_scan_onset(s, &mask, &h, NULL);
  rimi_search_note(s, s->channel, &h);
}

/* A channel that is not watched gets no turn. It lets go here of the blocks that are excluded:
 * until all channels have, none other can be, and nobody checks the ring. */
static bool take_out_unwatched(rim_search *s) {
  for (uint32_t c = 0; c < s->config.channels; ++c) {
    if (excludes(s, c) && !is_watched(s, c)) {
      rimi_search_take_out(s, c);
      return true;
    }
  }
  return false;
}

/* A turn of a channel: its residuals made ready and its onsets judged; its region renewed; every
 * single feature; the best of them since an onset; what came and went; some pairs. */
static void work_unit(rim_search *s) {
  const uint32_t features = s->config.features;
  const uint32_t stage = s->stage;
  if (stage == 0 && take_out_unwatched(s))
    return;
  if (stage == 0 || !s->fresh || s->shape != SEARCH_CONSTANT) {
    const uint32_t channel = stage == 0 ? choose_channel(s) : s->channel;
    if (channel == s->config.channels)
      return;
    rimi_search_refresh(s, channel);
    if (stage == 0)
      s->stage = 1;
    return;
  }
  s->stage = (uint16_t)(stage + 1u);
  if (stage == 1)
    renew_regions(s);
  else if (stage < 2u + features)
    scan_feature(s, stage - 2u);
  else if (stage == 2u + features)
    scan_interval_since(s);
  else if (stage == 3u + features)
    scan_during(s);
  else if (features > 1u && stage < 4u + features + s->config.cells_per_turn)
    scan_pair(s);
  else
    s->stage = 0;
}

void rimi_search_work(rim_search *s, uint32_t units) {
  if (s->held < 2u * SEARCH_LEAST)
    return;
  for (uint32_t i = 0; i < units; ++i)
    work_unit(s);
}

uint32_t rimi_search_blocks(const rim_search *s) { return s->count; }
uint32_t rimi_search_oldest(const rim_search *s) { return s->count - s->held; }

double rimi_search_time_of(const rim_search *s, uint32_t block) {
  const uint32_t oldest = s->count - s->held;
  if (s->held == 0)
    return 0.0;
  uint32_t i = block > oldest ? block - oldest : 0u;
  if (i >= s->held)
    i = s->held - 1u;
  return (double)search_times(s)[search_slot(s, i)];
}

void rimi_search_keep_maxima(rim_search *s, float *maxima) { s->maxima = maxima; }

void rimi_search_ready(rim_search *s, uint32_t channel) {
  if (!s->fresh || s->channel != channel || s->shape != SEARCH_CONSTANT)
    rimi_search_refresh(s, channel);
}

bool rimi_search_evaluate_channel(rim_search *s, uint32_t channel, search_hypothesis *h) {
  rimi_search_ready(s, channel);
  rimi_search_evaluate(s, h);
  return h->score > SEARCH_NONE;
}
