/* SPDX-License-Identifier: MIT */
/* What was found in a channel, explained: the shape, place and time that say most for what it takes
 * to describe them. */
#include "base/bytes.h"
#include "base/real.h"
#include "search/search_private.h"

#define COMPLEXITY 0.05 /* share of its score that each further part of a description must add */
#define SIMPLER 0.97    /* of a box's worth, that an interval of one feature must reach instead */
#define PLACED 0.9      /* of a time's worth, that a region must reach instead */
#define GIVEN 0.95    /* of an outcome's worth, that what the vehicle is given must reach instead */
#define MOST_GAIN 0.5 /* share of an outcome beyond which a gain is not the word for it */
#define GRAZED 1.0    /* nats that blocks inside take away, before they are healthy ones */
#define KEPT_TURNS 8u /* blocks in which every feature is looked at for a rate, for the cost */
#define KEPT_LEAST 60u   /* blocks: four times what a state keeps, to tell it from a shift */
#define CLEARER 1.1      /* of what explains most otherwise, that a rate must explain */
#define PLACED_TWICE 1.4 /* of another region */
#define REFINEMENTS 4u   /* rounds of edges and onset */
#define TOPS 3u          /* features that are looked at since an onset */

double rimi_search_worth(const rim_search *s, uint32_t channel, const search_hypothesis *h) {
  static const double parts[NOISE_FAMILIES] = {0.0, 2.0, 2.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0};
  if (h->score <= SEARCH_NONE || !(h->ln_ratio > 0.0f))
    return -1e30;
  const bool is_gain = h->family == SEARCH_GAIN || h->shape == SEARCH_PROPORTIONAL;
  if (is_gain && rimi_abs((double)h->shift) > MOST_GAIN)
    return -1e30;
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  const double inflation = (double)rimi_le_f32(c.phi, SEARCH_SINCE);
  const double shape = h->shape != SEARCH_CONSTANT ? 1.0 : 0.0;
  const bool is_vague = h->family == SEARCH_FIELD; /* says neither when nor where */
  return (double)h->ln_ratio / inflation * (1.0 - COMPLEXITY * (parts[h->family] + shape)) -
         rimi_search_description((search_family)h->family) - (is_vague ? SEARCH_VAGUE_NATS : 0.0);
}

static search_hypothesis best_in_time(const rim_search *s) {
  search_hypothesis best = s->in_time[SEARCH_SINCE];
  for (uint32_t f = SEARCH_RAMP; f <= SEARCH_FIELD; ++f) {
    if (rimi_search_worth(s, s->channel, &s->in_time[f]) > rimi_search_worth(s, s->channel, &best))
      best = s->in_time[f];
  }
  return best;
}

static bool is_box(const search_hypothesis *h) { return search_dims(h) == 2u; }

/* A side over the whole range of its feature is no restriction. */
static void drop_whole_sides(rim_search *s, search_hypothesis *h) {
  if (!is_box(h))
    return;
  const bool whole[2] = {h->first[0] == 0 && h->last[0] == SEARCH_BINS - 1u,
                         h->first[1] == 0 && h->last[1] == SEARCH_BINS - 1u};
  if (!whole[0] && !whole[1])
    return;
  if (whole[0]) {
    h->feature[0] = h->feature[1];
    h->first[0] = h->first[1];
    h->last[0] = h->last[1];
  }
  h->family = h->family == SEARCH_BOX ? SEARCH_INTERVAL : SEARCH_INTERVAL_SINCE;
  rimi_search_evaluate(s, h);
}

bool rimi_search_beside(rim_search *s, uint32_t channel, const search_hypothesis *h,
                        search_hypothesis *out) {
  const uint32_t dims = search_dims(h);
  rimi_search_ready(s, channel);
  rimi_search_take_shape(s, (search_shape)h->shape);
  out->score = SEARCH_NONE;
  for (uint32_t k = 0; k < 2u * dims; ++k) {
    search_hypothesis side = {
        .family = SEARCH_INTERVAL, .shape = h->shape, .onset = SEARCH_FROM_START};
    side.feature[0] = h->feature[k / 2u];
    const uint8_t first = h->first[k / 2u], last = h->last[k / 2u];
    if (k % 2u == 0 ? first == 0 : last + 1u >= SEARCH_BINS)
      continue;
    side.first[0] = k % 2u == 0 ? 0u : (uint8_t)(last + 1u);
    side.last[0] = k % 2u == 0 ? (uint8_t)(first - 1u) : (uint8_t)(SEARCH_BINS - 1u);
    rimi_search_evaluate(s, &side);
    if (side.score > out->score)
      *out = side;
  }
  search_hypothesis refined = *out;
  if (out->score > SEARCH_NONE)
    rimi_search_refine_edges(s, &refined, 0);
  if (refined.score > SEARCH_NONE && refined.shift * out->shift > 0.0f) /* or it is h again */
    *out = refined;
  return out->score > SEARCH_NONE;
}

double rimi_search_sd_of_onset(const rim_search *s, const search_hypothesis *h) {
  double sd = 0.0;
  if (h->family == SEARCH_FIELD || h->onset == SEARCH_FROM_START)
    return sd;
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  search_hypothesis again = *h;
  rimi_search_scan_onset(s, &mask, &again, &sd);
  return sd;
}

double rimi_search_side(const rim_search *s, uint32_t channel, const search_hypothesis *h) {
  const noise_channel c = rimi_noise_channel(s->config.noise, channel);
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (search_walk w = search_walk_from(s, &mask); search_walk_next(&w);) {
    if (!w.inside)
      continue;
    const double raw = search_raw_prediction(s, search_slot(s, w.i), channel);
    const double p = (double)c.p_center + (double)c.p_scale * raw;
    n += 1.0;
    sum += p;
    squares += p * p;
  }
  if (!(2.0 * sum * sum > n * squares)) /* the mean's square is below the variance */
    return 0.0;
  return sum > 0.0 ? 1.0 : -1.0;
}

uint32_t rimi_search_first_shown(rim_search *s, const search_hypothesis *h) {
  if (h->onset != SEARCH_FROM_START)
    return h->onset;
  rimi_search_take_shape(s, (search_shape)h->shape);
  const search_mask mask = rimi_search_mask_of(s, h, -1);
  search_hypothesis later = *h;
  rimi_search_scan_onset(s, &mask, &later, NULL);
  const noise_channel c = rimi_noise_channel(s->config.noise, s->channel);
  const double gain = ((double)later.ln_ratio - (double)h->ln_ratio) / rimi_search_inflation(&c, h);
  return rimi_search_first_inside(s, gain > GRAZED ? &later : h);
}

/* The features whose intervals explain most by themselves, TOPS at most, best first; how many
 * explain anything. */
static uint32_t top_features(const rim_search *s, uint32_t channel, uint8_t top[TOPS]) {
  const uint8_t *scores = search_feature_scores(s, channel);
  uint32_t found = 0;
  for (uint32_t f = 0; f < s->config.features; ++f) {
    uint32_t at = found;
    while (at > 0 && scores[f] > scores[top[at - 1u]])
      --at;
    if (scores[f] == 0 || at == TOPS)
      continue;
    found += found < TOPS ? 1u : 0u;
    for (uint32_t k = found - 1u; k > at; --k)
      top[k] = top[k - 1u];
    top[at] = (uint8_t)f;
  }
  return found;
}

/* Whether a region feature is a reading or a prediction of an outcome, rather than a command or the
 * environment: what the vehicle is given. O(outcomes). */
static bool is_outcome(const rim_search *s, uint32_t feature) {
  const search_config *c = &s->config;
  if (c->region == NULL || c->outcome_feature == NULL)
    return false;
  const uint16_t of = rimi_le_u16(c->region, 2u * (size_t)feature);
  for (size_t o = 0; o < c->outcomes; ++o) {
    if (rimi_le_u16(c->outcome_feature, o) == of)
      return true;
  }
  return false;
}

static bool is_of_outcomes(const rim_search *s, const search_hypothesis *h) {
  return search_dims(h) > 0 && is_outcome(s, h->feature[0]) &&
         (search_dims(h) < 2u || is_outcome(s, h->feature[1]));
}

/* Where an interval of an outcome was found, the best one of what the vehicle is given takes its
 * place if it explains nearly as much with the same sign: outcomes follow what is given, so they
 * tell where it was too, and the cause lies there. `mask` and `h` are as it was scanned. */
static void prefer_given(rim_search *s, const search_mask *mask, search_hypothesis *h) {
  const uint8_t *scores = search_feature_scores(s, s->channel);
  uint32_t given = s->config.features;
  if (!(h->score > SEARCH_NONE) || !is_of_outcomes(s, h))
    return;
  for (uint32_t f = 0; f < s->config.features; ++f) {
    if (scores[f] > 0 && !is_outcome(s, f) &&
        (given == s->config.features || scores[f] > scores[given]))
      given = f;
  }
  if (given == s->config.features)
    return;
  search_hypothesis other = {.family = h->family, .shape = h->shape, .onset = h->onset};
  rimi_search_scan_interval(s, mask, given, &other, 0);
  if (other.shift * h->shift > 0.0f &&
      rimi_search_worth(s, s->channel, &other) >= GIVEN * rimi_search_worth(s, s->channel, h))
    *h = other;
}

/* The best interval of the feature that explains most by itself, or its box with the next best. */
static search_hypothesis region_instead(rim_search *s, uint32_t channel) {
  uint8_t top[TOPS] = {0};
  const uint32_t tops = top_features(s, channel, top);
  search_hypothesis best = {
      .family = SEARCH_INTERVAL, .shape = s->shape, .onset = SEARCH_FROM_START};
  best.score = SEARCH_NONE;
  if (tops == 0)
    return best;
  const search_mask all = {0};
  rimi_search_scan_interval(s, &all, top[0], &best, 0);
  if (!(best.score > SEARCH_NONE) || tops < 2u)
    return best;
  search_hypothesis box = best;
  box.family = SEARCH_BOX;
  box.feature[1] = top[1];
  box.first[1] = 0;
  box.last[1] = SEARCH_BINS - 1u;
  box.score = SEARCH_NONE;
  rimi_search_refine_edges(s, &box, 1);
  rimi_search_refine_edges(s, &box, 0);
  drop_whole_sides(s, &box);
  if (rimi_search_worth(s, channel, &box) > rimi_search_worth(s, channel, &best))
    return box;
  prefer_given(s, &all, &best);
  return best;
}

/* Edges and onset in turn. */
static void refine(rim_search *s, search_hypothesis *h, uint32_t rounds) {
  for (uint32_t round = 0; round < rounds && h->score > SEARCH_NONE; ++round) {
    if (round == 0)
      rimi_search_evaluate(s, h);
    rimi_search_refine_edges(s, h, 0);
    if (is_box(h))
      rimi_search_refine_edges(s, h, 1);
    if (h->onset != SEARCH_FROM_START) {
      const search_mask mask = rimi_search_mask_of(s, h, -1);
      rimi_search_scan_onset(s, &mask, h, NULL);
    }
  }
  drop_whole_sides(s, h);
}

/* Of h's worth, what another explanation must reach to be said instead. */
static double share_needed(const rim_search *s, const search_hypothesis *h,
                           const search_hypothesis *instead) {
  if (h->family == SEARCH_DURING)
    return PLACED;
  if (is_of_outcomes(s, h) && !is_of_outcomes(s, instead))
    return GIVEN;
  return h->family == SEARCH_BOX && instead->family == SEARCH_INTERVAL ? SIMPLER : 1.0;
}

void rimi_search_place(rim_search *s, uint32_t channel, search_hypothesis *h) {
  const search_hypothesis region = region_instead(s, channel);
  if (region.shift * h->shift > 0.0f && /* or it is the rest */
      rimi_search_worth(s, channel, &region) >
          share_needed(s, h, &region) * rimi_search_worth(s, channel, h))
    *h = region;
}

/* What is mostly so is not what came and went. */
static bool is_most(const rim_search *s, const search_hypothesis *h) {
  return 2u * h->blocks > s->held;
}

bool rimi_search_passed(rim_search *s, uint32_t channel, const search_hypothesis *since,
                        search_hypothesis *out) {
  rimi_search_ready(s, channel);
  if (since != NULL && (since->family == SEARCH_SINCE || since->family == SEARCH_RAMP ||
                        since->family == SEARCH_DURING)) {
    *out = (search_hypothesis){.family = SEARCH_DURING, .onset = since->onset};
    rimi_search_scan_end(s, out);
    search_hypothesis found = search_state(s, channel)->region; /* of another onset, it may be */
    if (found.family == SEARCH_DURING) {
      rimi_search_evaluate(s, &found);
      if (found.score > out->score && !is_most(s, &found))
        *out = found;
    }
  } else {
    rimi_search_scan_during(s, out);
    if (is_most(s, out))
      out->score = SEARCH_NONE;
  }
  if (out->score > SEARCH_NONE)
    rimi_search_place(s, channel, out);
  return out->score > SEARCH_NONE;
}

/* The best of what is not everywhere and for good, refined. */
static search_hypothesis best_in_part(rim_search *s, uint32_t channel) {
  search_hypothesis h = search_state(s, channel)->region;
  if (h.family == SEARCH_DURING) {
    rimi_search_evaluate(s, &h);
    rimi_search_refine_during(s, &h);
    search_hypothesis placed = *rimi_search_region(s, channel);
    const bool is_region = search_dims(&placed) > 0;
    if (is_region)
      refine(s, &placed, 1);
    /* Of the other sign it is the rest, unless what came and went is most of the run. */
    if (is_region && (placed.shift * h.shift > 0.0f || is_most(s, &h)) &&
        rimi_search_worth(s, channel, &placed) > PLACED * rimi_search_worth(s, channel, &h))
      h = placed;
  } else {
    refine(s, &h, REFINEMENTS);
  }
  if (h.score > SEARCH_NONE)
    rimi_search_place(s, channel, &h);
  return h;
}

/* The best interval since an onset of the features that explain most over the whole run, of the
 * shape that the work arrays have, refined. The search looks at the first of these alone; of a
 * fault that began late in the run that is often one by which time passes (a tank that empties). */
static search_hypothesis best_since(rim_search *s, uint32_t onset) {
  search_hypothesis best = {.family = SEARCH_INTERVAL_SINCE, .shape = s->shape, .onset = onset};
  uint8_t top[TOPS] = {0};
  const uint32_t tops = onset == SEARCH_FROM_START ? 0u : top_features(s, s->channel, top);
  const search_mask since = rimi_search_mask_of(s, &best, 0);
  best.score = SEARCH_NONE;
  for (uint32_t k = 0; k < tops; ++k) {
    search_hypothesis h = {.family = SEARCH_INTERVAL_SINCE, .shape = s->shape, .onset = onset};
    rimi_search_scan_interval(s, &since, top[k], &h, 0);
    if (h.score > best.score)
      best = h;
  }
  prefer_given(s, &since, &best);
  refine(s, &best, 1);
  return best;
}

/* The best gain in a region: in that of the best shift, or, of a gain since an onset, where a
 * feature is inside an interval. */
static search_hypothesis best_in_proportion(rim_search *s, const search_hypothesis *place,
                                            const search_hypothesis *gain) {
  search_hypothesis best = *place;
  rimi_search_take_shape(s, SEARCH_PROPORTIONAL);
  best.shape = SEARCH_PROPORTIONAL;
  if (best.family == SEARCH_DURING)
    best.score = SEARCH_NONE; /* its place is a time */
  refine(s, &best, 1);
  const search_hypothesis since =
      best_since(s, gain->score > SEARCH_NONE ? gain->onset : SEARCH_FROM_START);
  return rimi_search_worth(s, s->channel, &since) > rimi_search_worth(s, s->channel, &best) ? since
                                                                                            : best;
}

/* The best region in which the rate of a state deviates, of the features whose turn it is: their
 * best interval since the onset of what explains most so far. Where it explains more, it is
 * refined, and tried at any time. */
static search_hypothesis best_kept(rim_search *s, const search_hypothesis *instead) {
  const uint32_t features = s->config.features;
  const uint32_t turns = features < KEPT_TURNS ? features : KEPT_TURNS;
  search_hypothesis best = {.family = SEARCH_INTERVAL_SINCE, .shape = SEARCH_KEPT};
  best.onset = instead->onset != SEARCH_FROM_START ? instead->onset : s->count - s->held;
  rimi_search_take_shape(s, SEARCH_KEPT);
  const search_mask since = rimi_search_mask_of(s, &best, 0), all = {0};
  search_hypothesis h = best;
  best.score = SEARCH_NONE;
  for (uint32_t f = s->count % turns; f < features; f += turns) {
    if (rimi_search_is_own(s, f))
      continue;
    rimi_search_scan_interval(s, &since, f, &h, 0);
    if (h.score > best.score)
      best = h;
  }
  if (!(rimi_search_worth(s, s->channel, &best) > rimi_search_worth(s, s->channel, instead)))
    return best;
  refine(s, &best, 1);
  h = best;
  h.family = SEARCH_INTERVAL;
  h.onset = SEARCH_FROM_START;
  rimi_search_scan_interval(s, &all, best.feature[0], &h, 0);
  return rimi_search_worth(s, s->channel, &h) > rimi_search_worth(s, s->channel, &best) ? h : best;
}

/* A rate in a region instead of what explains most otherwise, where it explains clearly more; and
 * more so where that is a region as well, for a place seldom needs both. */
static void prefer_rate(rim_search *s, search_hypothesis *best) {
  if (s->held < KEPT_LEAST)
    return;
  const search_hypothesis rate = best_kept(s, best);
  const double share = search_dims(best) > 0 ? PLACED_TWICE : CLEARER;
  const double needed = share * rimi_max(0.0, rimi_search_worth(s, s->channel, best));
  if (rimi_search_worth(s, s->channel, &rate) > needed)
    *best = rate;
  rimi_search_take_shape(s, (search_shape)best->shape);
}

/* Whether it began at a time, and lasts: in a region as the deviation of each block inside. */
static bool is_dated(const search_hypothesis *h) {
  return h->family <= SEARCH_GAIN ||
         (search_dims(h) > 0 && h->onset != SEARCH_FROM_START && h->shape != SEARCH_KEPT);
}

void rimi_search_explain(rim_search *s, uint32_t channel, search_hypothesis *out,
                         double *onset_sd) {
  rimi_search_ready(s, channel);
  search_hypothesis best = best_in_time(s);
  search_hypothesis h = best_in_part(s, channel);
  const search_hypothesis since = best_since(s, best.onset);
  if (rimi_search_worth(s, channel, &since) >
      share_needed(s, &h, &since) * rimi_search_worth(s, channel, &h))
    h = since;
  if (h.score > SEARCH_NONE) {
    rimi_search_note(s, channel, &h);
    /* Most of the run, until what began lately: that is the rest of what began. */
    const bool is_rest = h.family == SEARCH_DURING && is_most(s, &h) && h.shift * best.shift < 0.0f;
    if (!is_rest && rimi_search_worth(s, s->channel, &h) > rimi_search_worth(s, s->channel, &best))
      best = h;
  }
  if (channel < search_fine(s) && (best.family == SEARCH_GAIN || best.family >= SEARCH_INTERVAL)) {
    const search_hypothesis gain = s->in_time[SEARCH_GAIN];
    const search_hypothesis part = best_in_proportion(s, &h, &gain);
    if (part.shape == SEARCH_PROPORTIONAL &&
        rimi_search_worth(s, s->channel, &part) > rimi_search_worth(s, s->channel, &best))
      best = part;
    else
      rimi_search_take_shape(s, SEARCH_CONSTANT);
  }
  if (channel < search_fine(s))
    prefer_rate(s, &best);
  if (channel < search_fine(s) && is_dated(&best))
    rimi_search_date(s, &best, onset_sd);
  else
    *onset_sd = rimi_search_sd_of_onset(s, &best);
  *out = best;
}
