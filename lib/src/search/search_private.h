/* SPDX-License-Identifier: MIT */
/* The layout of a search, shared by search.c, statistic.c, scan.c. */
#ifndef RIM_SRC_SEARCH_PRIVATE_H
#define RIM_SRC_SEARCH_PRIVATE_H

#include "rim/image.h"
#include "search/search.h"

#define SEARCH_Z_STEP (1.0 / 16.0)    /* of a residual in the ring: int16 covers +-2000 */
#define SEARCH_BYTE_STEP (1.0 / 31.0) /* of a standardised mean or prediction: int8 covers +-4 */
/* By which the run's own effects must be clearer than by their description: where no runs taught
 * how large they are, and where they explain what something does that says when or where. */
#define SEARCH_VAGUE_NATS 2.5
#define SEARCH_ACTIVITY_STEP (1.0 / 24.0)    /* int8 covers +-5.3 */
#define SEARCH_DISTURBANCE_STEP (1.0 / 40.0) /* from SEARCH_CALMEST on: uint8 */
#define SEARCH_CALMEST (-3.0)
#define SEARCH_COARSE_STEP (1.0 / 4.0) /* of a residual in a byte: +-31 */
#define SEARCH_RAMP_UNIT (1.0 / 256.0) /* of a ramp's time, in blocks */
#define SEARCH_NONE (-1e30f)
#define SEARCH_UNKNOWN INT16_MIN       /* a residual that is not known */
#define SEARCH_COARSE_UNKNOWN INT8_MIN /* in a byte */
#define SEARCH_KEEPS 0.93 /* of what a block adds to a state, after a block: SEARCH_KEPT */
/* Added to the diagonal of a channel's G, in parts of it: more than the rounding of its sums in
 * single precision over tens of thousands of blocks, and less than any effect that shows. */
#define SEARCH_GRAM_RIDGE 0x1p-18

/* What a pass over the ring needs of the channel in turn, oldest block first. */
typedef struct search_sums {
  double d, a, n;
  double g[NOISE_MAX_FIELDS];
} search_sums;

/* Sums over a channel's fields. `rim train` makes four: written out, each takes fewer
 * instructions, with the same bits. As loops of four they become vectors, whose loads wait for the
 * stores of single numbers before them, and are slower than loops of k. */
#define SEARCH_USUAL_FIELDS 4u
static inline void search_add_floats(uint32_t k, float *restrict sum, const float *restrict g) {
  if (k == SEARCH_USUAL_FIELDS) {
    sum[0] += g[0];
    sum[1] += g[1];
    sum[2] += g[2];
    sum[3] += g[3];
    return;
  }
  for (uint32_t j = 0; j < k; ++j)
    sum[j] += g[j];
}
static inline void search_add_fields(uint32_t k, double *restrict sum, const float *restrict g) {
  if (k == SEARCH_USUAL_FIELDS) {
    sum[0] += (double)g[0];
    sum[1] += (double)g[1];
    sum[2] += (double)g[2];
    sum[3] += (double)g[3];
    return;
  }
  for (uint32_t j = 0; j < k; ++j)
    sum[j] += (double)g[j];
}
static inline void search_add_sums(uint32_t k, search_sums *sums, const search_sums *other) {
  sums->n += other->n;
  sums->d += other->d;
  sums->a += other->a;
  if (k == SEARCH_USUAL_FIELDS) {
    sums->g[0] += other->g[0];
    sums->g[1] += other->g[1];
    sums->g[2] += other->g[2];
    sums->g[3] += other->g[3];
    return;
  }
  for (uint32_t j = 0; j < k; ++j)
    sums->g[j] += other->g[j];
}
/* A less what the fields explain of it. */
static inline double search_unexplained(uint32_t k, double a, const double *g) {
  if (k == SEARCH_USUAL_FIELDS)
    return a - g[0] * g[0] - g[1] * g[1] - g[2] * g[2] - g[3] * g[3];
  for (uint32_t j = 0; j < k; ++j)
    a -= g[j] * g[j];
  return a;
}

/* Sums per bin of one feature, and per cell of two. */
typedef struct search_bin {
  float n, d, a, g[NOISE_MAX_FIELDS];
} search_bin;

static inline void search_add_bin(uint32_t k, search_sums *sums, const search_bin *bin) {
  sums->n += (double)bin->n;
  sums->d += (double)bin->d;
  sums->a += (double)bin->a;
  search_add_fields(k, sums->g, bin->g);
}

typedef struct search_bins {
  search_bin bin[SEARCH_BINS];
  float pair[SEARCH_BINS * (SEARCH_BINS + 1) / 2];
} search_bins;

typedef struct channel_state {
  search_hypothesis time;   /* best of SINCE, RAMP, GAIN, FIELD */
  search_hypothesis region; /* best of the others, by score */
} channel_state;

/* Offsets of the arrays from the start of the instance. */
typedef struct search_layout {
  uint32_t time, feature, mean, predicted, z, coarse, activity, apart, state, gram, score, scatter,
      level;
  uint32_t work;   /* float per block: q, a0, a1 */
  uint32_t fields; /* float[block][fields_per_block] */
  uint32_t fields_per_block;
} search_layout;

/* A channel's weights of the raw fields, decoded for a pass over the ring. */
typedef struct search_combination {
  double of[NOISE_MAX_FIELDS][NOISE_MAX_RAW];
} search_combination;

struct rim_search {
  search_config config;
  uint32_t count;        /* blocks since the start */
  uint16_t held, head;   /* in the ring; slot written next */
  uint16_t channel;      /* in turn; its work arrays are valid when `fresh` */
  uint16_t next_channel; /* round robin */
  uint16_t stage;        /* of the turn */
  uint16_t next_pair;
  uint8_t top_feature; /* best single feature of the channel in turn */
  uint8_t shape;       /* search_shape: what the work arrays are of */
  bool fresh, favour;
  search_layout at;
  uint32_t excluded_from, excluded_to;          /* blocks of the newest rimi_search_exclude() */
  uint32_t excludes[SEARCH_MAX_CHANNELS / 32u]; /* a bit per channel that still holds them */
  float *maxima;
  /* Of the channel that explains most: its best region by worth; state->region may be a time. */
  search_hypothesis placed;
  uint16_t placed_channel;
  search_hypothesis in_time[SEARCH_FIELD + 1]; /* of the channel in turn: best by ratio of each */
  uint32_t fields;                             /* of the channel in turn */
  uint32_t p_at;         /* which of a block's predictions is that of the channel in turn */
  double p_zero, p_step; /* of the channel in turn: its prediction in its s, from a byte */
  union {                /* of the scan in progress */
    search_bins bins;
    search_bin cells[SEARCH_CELLS * SEARCH_CELLS];
  };
};

static inline void *search_at(const rim_search *s, uint32_t offset) {
  return (void *)((uintptr_t)s + offset);
}
static inline uint32_t search_slot(const rim_search *s, uint32_t i) { /* i: 0 oldest held */
  const uint32_t slot = (uint32_t)s->head + s->config.ring - s->held + i;
  return slot >= s->config.ring ? slot - s->config.ring : slot;
}
static inline float *search_times(const rim_search *s) { return search_at(s, s->at.time); }
static inline uint8_t *search_features(const rim_search *s, uint32_t slot) {
  return (uint8_t *)search_at(s, s->at.feature) + (size_t)slot * s->config.features;
}
static inline int8_t *search_means(const rim_search *s, uint32_t slot) {
  return (int8_t *)search_at(s, s->at.mean) + (size_t)slot * s->config.means;
}
/* Channels whose residuals are kept in 16 bits, and whose scale depends on the context: behaviour
 * and agreement. Those of the others, scatter and repeats, never need more than a byte. */
static inline uint32_t search_fine_of(const search_config *c) {
  const uint32_t both = 2u * (uint32_t)c->outcomes;
  return both < c->channels ? both : c->channels;
}
static inline uint32_t search_fine(const rim_search *s) { return search_fine_of(&s->config); }
static inline int8_t *search_predictions(const rim_search *s, uint32_t slot) {
  return (int8_t *)search_at(s, s->at.predicted) + (size_t)slot * search_fine(s);
}
/* What a channel's residual is the rest of, standardised; of scatter and repeats: behaviour's. */
static inline uint32_t search_prediction_of(const rim_search *s, uint32_t channel) {
  return channel < search_fine(s) ? channel : channel % s->config.outcomes;
}
static inline double search_raw_prediction(const rim_search *s, uint32_t slot, uint32_t channel) {
  return (double)search_predictions(s, slot)[search_prediction_of(s, channel)] * SEARCH_BYTE_STEP;
}
static inline int16_t *search_fine_residuals(const rim_search *s, uint32_t slot) {
  return (int16_t *)search_at(s, s->at.z) + (size_t)slot * search_fine(s);
}
static inline int8_t *search_coarse_residuals(const rim_search *s, uint32_t slot) {
  return (int8_t *)search_at(s, s->at.coarse) +
         (size_t)slot * (s->config.channels - search_fine(s));
}
/* In standard deviations of the channel's innovations, sigma(x) not taken off. */
static inline double search_residual(const rim_search *s, uint32_t channel, uint32_t slot) {
  const uint32_t fine = search_fine(s);
  return channel < fine
             ? (double)search_fine_residuals(s, slot)[channel] * SEARCH_Z_STEP
             : (double)search_coarse_residuals(s, slot)[channel - fine] * SEARCH_COARSE_STEP;
}
static inline bool search_is_known(const rim_search *s, uint32_t channel, uint32_t slot) {
  const uint32_t fine = search_fine(s);
  return channel < fine ? search_fine_residuals(s, slot)[channel] != SEARCH_UNKNOWN
                        : search_coarse_residuals(s, slot)[channel - fine] != SEARCH_COARSE_UNKNOWN;
}
/* Per outcome: the scatter of the newest block, in SEARCH_COARSE_STEP, before it was limited. */
static inline int8_t *search_newest_scatter(const rim_search *s) {
  return (int8_t *)search_at(s, s->at.scatter);
}
/* Per channel of search_fine(): of rimi_noise_counted(). */
static inline noise_level *search_levels(const rim_search *s) { return search_at(s, s->at.level); }
/* How the block in a slot follows on the one before: 0, it adjoins. */
enum { SEARCH_APART = 1, SEARCH_FIRST = 2 };
static inline uint8_t *search_apart(const rim_search *s) { return search_at(s, s->at.apart); }
static inline int8_t *search_activities(const rim_search *s) {
  return search_at(s, s->at.activity);
}
static inline uint8_t *search_disturbances(const rim_search *s) {
  return (uint8_t *)search_activities(s) + s->config.ring;
}
static inline channel_state *search_state(const rim_search *s, uint32_t channel) {
  return (channel_state *)search_at(s, s->at.state) + channel;
}
static inline uint32_t search_gram_floats(const rim_search *s) {
  const uint32_t k = s->config.noise->fields;
  return k * (k + 1u) / 2u + k;
}
/* Packed G of a channel without its prior, then u. */
static inline float *search_gram(const rim_search *s, uint32_t channel) {
  return (float *)search_at(s, s->at.gram) + (size_t)channel * search_gram_floats(s);
}
/* Per outcome: what behaviour predicted for the newest block. */
static inline float *search_before(const rim_search *s) {
  return search_gram(s, s->config.channels);
}
/* What an interval of each feature explained when it was last scanned: FEATURE_SCORE times
 * ln(1 + ln ratio), 0 where nothing. Features are ranked by it. */
static inline uint8_t *search_feature_scores(const rim_search *s, uint32_t channel) {
  return (uint8_t *)search_at(s, s->at.score) + (size_t)channel * s->config.features;
}
static inline float *search_q(const rim_search *s) { return search_at(s, s->at.work); }
static inline float *search_a0(const rim_search *s) { return search_q(s) + s->config.ring; }
static inline float *search_a1(const rim_search *s) { return search_a0(s) + s->config.ring; }
static inline float *search_g(const rim_search *s, uint32_t i) {
  return (float *)search_at(s, s->at.fields) + (size_t)i * s->at.fields_per_block;
}
/* What block i and those after it that are inside a hypothesis add to A together, beyond what each
 * adds alone; and `later` for the block before. Begin with 0 at the newest. */
static inline double search_together(const rim_search *s, uint32_t i, double later) {
  return s->shape == SEARCH_KEPT ? SEARCH_KEEPS * later : later * (double)search_a1(s)[i];
}
static inline double search_later(const rim_search *s, uint32_t i, bool inside, double later) {
  if (s->shape != SEARCH_KEPT)
    return inside ? 1.0 : 0.0;
  return SEARCH_KEEPS * later + (inside ? (double)search_a1(s)[i] : 0.0);
}
/* The prediction of the channel in turn, in its s. */
static inline double search_p(const rim_search *s, uint32_t i) {
  return s->p_zero + s->p_step * (double)search_predictions(s, search_slot(s, i))[s->p_at];
}

/* Which blocks of the ring a pass looks at. */
typedef struct search_mask {
  uint32_t from;                       /* first index of the ring, 0: all */
  uint32_t to;                         /* index after the last, 0: all */
  uint8_t dims;                        /* features that must be inside their bins */
  uint8_t feature[2], low[2], high[2]; /* bytes low..high inclusive */
} search_mask;

/* A pass over the ring from the newest block of the mask to its oldest:
 *   for (search_walk w = search_walk_from(s, mask); search_walk_next(&w);) ... w.i, w.inside */
typedef struct search_walk {
  uint32_t i, end;               /* index of the ring, 0 oldest held; one before the last to come */
  const uint8_t *feature;        /* of block i */
  const uint8_t *first, *newest; /* of the ring's first and last slot */
  uint32_t stride;
  uint8_t at[2], low[2], width[2];
  bool everywhere; /* no feature must be inside its bins */
  bool inside;
} search_walk;

static inline search_walk search_walk_from(const rim_search *s, const search_mask *mask) {
  const uint32_t to = mask->to != 0 && mask->to < s->held ? mask->to : s->held;
  search_walk w = {.i = to, .end = mask->from < to ? mask->from : to};
  w.stride = s->config.features;
  w.everywhere = mask->dims == 0;
  w.first = search_features(s, 0);
  w.newest = search_features(s, s->config.ring - 1u);
  /* What lies after the first to come; the newest lies before the head. */
  w.feature = search_features(s, to == s->held ? s->head : search_slot(s, to));
  for (uint32_t k = 0; k < 2u; ++k) {
    const bool used = k < mask->dims;
    w.at[k] = used ? mask->feature[k] : 0u;
    w.low[k] = used ? mask->low[k] : 0u;
    w.width[k] = used ? (uint8_t)(mask->high[k] - mask->low[k]) : 255u;
  }
  return w;
}

static inline bool search_walk_next(search_walk *w) {
  if (w->i == w->end)
    return false;
  --w->i;
  w->feature = w->feature == w->first ? w->newest : w->feature - w->stride;
  w->inside = w->everywhere || ((uint8_t)(w->feature[w->at[0]] - w->low[0]) <= w->width[0] &&
                                (uint8_t)(w->feature[w->at[1]] - w->low[1]) <= w->width[1]);
  return true;
}

/* statistic.c */
/* The raw fields of a block but the prediction, which is the channel's: raw[1] = 0. */
void rimi_search_raw_fields(const rim_search *s, uint32_t slot, double *raw);
/* 1 / sigma(x) of a block: by its prediction, the activity and the disturbance. */
double rimi_search_scale(const rim_search *s, const noise_channel *c, uint32_t channel,
                         uint32_t slot);
/* Of a block: by its activity. */
double rimi_search_rho(const rim_search *s, const noise_channel *c, uint32_t slot);
/* rimi_search_scale(); 0 where the residual is not known. */
double rimi_search_weight(const rim_search *s, const noise_channel *c, uint32_t channel,
                          uint32_t slot);
/* -ln P(q or more) of k effects of a run, 1 <= k <= NOISE_MAX_FIELDS, whose sum of squares in their
 * healthy standard deviations is q > k. Where these are known (runs = 0) it is that of a chi-square
 * of k degrees of freedom, to 6 %; where so many runs taught them, of Hotelling's T^2, to 2 nats.
 * A few dozen runs do not show how far the effects of others lie: four effects that 30 runs taught
 * give 12 nats at q = 60, known ones 27. */
double rimi_search_surprise(uint32_t k, uint32_t runs, double q);
/* Prepares the work arrays for a channel, and judges SINCE, RAMP, GAIN and FIELD. */
void rimi_search_refresh(rim_search *s, uint32_t channel);
/* Makes the work arrays of the channel in turn those of a shape, so that every scan is of that. */
void rimi_search_take_shape(rim_search *s, search_shape shape);
/* L of G with its prior, packed, and the run effects b, of a channel that was refreshed. */
void rimi_search_effects(const rim_search *s, const noise_channel *c, double *l, double *b);
/* Fills ln_ratio, shift, sd, score of h from the sums. */
void rimi_search_judge(const rim_search *s, const search_sums *sums, search_hypothesis *h);
/* The best of several onsets, and their distribution: each as likely as what it explains. */
typedef struct search_onsets {
  double nats, weight, first, second; /* nats: of the best, as healthy runs inflate them */
  uint32_t at;                        /* the best: index of the ring */
} search_onsets;
void rimi_search_note_onset(search_onsets *onsets, double nats, uint32_t i);
/* Standard deviation, blocks: at least that of a block. */
double rimi_search_onset_sd(const search_onsets *onsets);
/* The best onset of the shift inside the mask (mask->from is ignored). *sd: of the onset, blocks;
 * NULL: not asked. */
void rimi_search_scan_onset(const rim_search *s, const search_mask *mask, search_hypothesis *h,
                            double *sd);

/* date.c: for SINCE, RAMP and GAIN, of the channel in turn; rimi_search_date() for regions too. */
void rimi_search_sum_in_time(const rim_search *s, const search_hypothesis *h, search_sums *sums);
/* Judges it since its onset, exactly. */
void rimi_search_judge_in_time(const rim_search *s, search_hypothesis *h);
/* Moves the onset where two shapes together explain clearly more than its own shape; then it is the
 * one of the three families that explains most since there. Of a region since an onset, of shape
 * CONSTANT or PROPORTIONAL, the onset alone moves, also where it grows. *onset_sd: blocks. Cost:
 * one pass over the ring with five models per block, and three passes where it moves. */
void rimi_search_date(rim_search *s, search_hypothesis *h, double *onset_sd);

/* contrary.c */
/* How improbable the run effects are that a judged hypothesis leaves, of the channel that was
 * refreshed: ln likelihood ratio, as healthy runs inflate it. 0 for FIELD, which is just that. */
double rimi_search_baseline(rim_search *s, const search_hypothesis *h);

/* explain.c */
/* What came and went (DURING) did so by itself, and a region is the one to be named, only where no
 * region of the features that explain most by themselves says more with its sign: otherwise h
 * becomes that. Of a box and an interval that say nearly the same it is the interval. Cost: an
 * interval's scan, three where there are two features. */
void rimi_search_place(rim_search *s, uint32_t channel, search_hypothesis *h);

/* search.c */
/* The best of a channel's regions; where its best in part is a time (DURING), the best beside it,
 * if that is known: of the channel that explains most. As it was when it was last judged. */
const search_hypothesis *rimi_search_region(const rim_search *s, uint32_t channel);
/* Whether the feature is the measured reading of the outcome of the channel in turn. */
bool rimi_search_is_own(const rim_search *s, uint32_t feature);
/* rimi_search_refresh(), where it is not done since the newest block, or of another shape. */
void rimi_search_ready(rim_search *s, uint32_t channel);
/* Completes rimi_search_exclude() in this channel, where that is still to be done. */
void rimi_search_take_out(rim_search *s, uint32_t channel);
/* The best end of a shift that has its onset; it is before the newest block. */
void rimi_search_scan_end(const rim_search *s, search_hypothesis *h);

/* scan.c */
/* The best DURING, by bins of time; then each edge exactly given the other. */
void rimi_search_scan_during(rim_search *s, search_hypothesis *h);
void rimi_search_refine_during(rim_search *s, search_hypothesis *h);
void rimi_search_scan_interval(rim_search *s, const search_mask *mask, uint32_t feature,
                               search_hypothesis *h, uint32_t which);
void rimi_search_scan_box(rim_search *s, uint32_t x, uint32_t y, search_hypothesis *h);
/* d, A and m'WB of a hypothesis' shape. */
void rimi_search_sum(rim_search *s, const search_hypothesis *h, search_sums *sums);
/* Judges the hypothesis as it stands, exactly. */
void rimi_search_evaluate(rim_search *s, search_hypothesis *h);
void rimi_search_refine_edges(rim_search *s, search_hypothesis *h, uint32_t which);
search_mask rimi_search_mask_of(const rim_search *s, const search_hypothesis *h, int without);
void rimi_search_note(rim_search *s, uint32_t channel, const search_hypothesis *h);

#endif
