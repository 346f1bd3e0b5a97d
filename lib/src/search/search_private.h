/* SPDX-License-Identifier: MIT */
/* The layout of a search, shared by search.c, statistic.c, scan.c. */
#ifndef RIM_SRC_SEARCH_PRIVATE_H
#define RIM_SRC_SEARCH_PRIVATE_H

#include "rim/image.h"
#include "search/search.h"

#define SEARCH_Z_STEP (1.0 / 64.0)      /* of a residual in the ring: int16 covers +-500 */
#define SEARCH_BYTE_STEP (1.0 / 31.0)   /* of a standardised mean or prediction: int8 covers +-4 */
#define SEARCH_CHANGE_STEP (1.0 / 64.0) /* of the commands' change: uint8 covers 3.98 */
#define SEARCH_COARSE_STEP (1.0 / 4.0)  /* of a residual in a byte: +-31 */
#define SEARCH_NONE (-1e30f)

/* What a pass over the ring needs of the channel in turn, oldest block first. */
typedef struct search_sums {
  double d, a, n;
  double g[NOISE_MAX_FIELDS];
} search_sums;

/* Sums per bin of one feature, and per cell of two. */
typedef struct search_bins {
  float n[SEARCH_BINS], d[SEARCH_BINS], a[SEARCH_BINS];
  float g[SEARCH_BINS][NOISE_MAX_FIELDS];
  float pair[SEARCH_BINS * (SEARCH_BINS + 1) / 2];
} search_bins;

typedef struct search_cells {
  float n[SEARCH_CELLS * SEARCH_CELLS], d[SEARCH_CELLS * SEARCH_CELLS];
  float a[SEARCH_CELLS * SEARCH_CELLS], g[SEARCH_CELLS * SEARCH_CELLS][NOISE_MAX_FIELDS];
} search_cells;

typedef struct channel_state {
  search_hypothesis time;   /* best of SINCE, RAMP, GAIN, FIELD */
  search_hypothesis region; /* best of the others */
  uint32_t gram_at;         /* doubles: packed G without its prior, then u */
  bool excludes;            /* G and u still hold the blocks that search_exclude() took out */
} channel_state;

/* Offsets of the arrays from the start of the instance. */
typedef struct search_layout {
  uint32_t time, feature, mean, predicted, z, coarse, change, state, gram, score, excluded;
  uint32_t work; /* float per block: q, a0, a1, p, then the fields' */
} search_layout;

struct rim_search {
  search_config config;
  uint32_t count;        /* blocks since the start */
  uint16_t held, head;   /* in the ring; slot written next */
  uint16_t channel;      /* in turn; its work arrays are valid when `fresh` */
  uint16_t next_channel; /* round robin */
  uint16_t stage;        /* of the turn */
  uint16_t next_pair;
  uint8_t top_feature; /* best single feature of the channel in turn */
  bool fresh, favour;
  search_layout at;
  uint32_t excluded_from, excluded_to; /* blocks of the newest search_exclude() */
  float *maxima;
  search_hypothesis in_time[SEARCH_FIELD + 1]; /* of the channel in turn: best by ratio of each */
  uint32_t fields;                             /* of the channel in turn */
  search_bins bins;
  search_cells cells;
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
static inline int8_t *search_predictions(const rim_search *s, uint32_t slot) {
  return (int8_t *)search_at(s, s->at.predicted) + (size_t)slot * s->config.outcomes;
}
/* Channels whose residuals are kept in 16 bits, and whose scale depends on the context: behaviour
 * and agreement. Those of the others, scatter and repeats, never need more than a byte. */
static inline uint32_t search_fine(const rim_search *s) {
  const uint32_t both = 2u * (uint32_t)s->config.outcomes;
  return both < s->config.channels ? both : s->config.channels;
}
static inline int16_t *search_fine_residuals(const rim_search *s, uint32_t slot) {
  return (int16_t *)search_at(s, s->at.z) + (size_t)slot * search_fine(s);
}
static inline int8_t *search_coarse_residuals(const rim_search *s, uint32_t slot) {
  return (int8_t *)search_at(s, s->at.coarse) +
         (size_t)slot * (s->config.channels - search_fine(s));
}
/* In standard deviations of the channel's noise, the scale taken off. */
static inline double search_residual(const rim_search *s, uint32_t channel, uint32_t slot) {
  const uint32_t fine = search_fine(s);
  return channel < fine
             ? (double)search_fine_residuals(s, slot)[channel] * SEARCH_Z_STEP
             : (double)search_coarse_residuals(s, slot)[channel - fine] * SEARCH_COARSE_STEP;
}
static inline uint8_t *search_changes(const rim_search *s) { return search_at(s, s->at.change); }
/* Whether the block in this slot is no evidence: a bit per slot. */
static inline uint8_t *search_excluded(const rim_search *s) { return search_at(s, s->at.excluded); }
static inline bool search_is_excluded(const rim_search *s, uint32_t slot) {
  return (search_excluded(s)[slot / 8u] >> (slot % 8u) & 1u) != 0;
}
static inline channel_state *search_state(const rim_search *s, uint32_t channel) {
  return (channel_state *)search_at(s, s->at.state) + channel;
}
static inline double *search_gram(const rim_search *s, const channel_state *c) {
  return (double *)search_at(s, s->at.gram) + c->gram_at;
}
/* Root of the last ln ratio of an interval of this feature, in eighths: what is scanned first. */
static inline uint8_t *search_feature_scores(const rim_search *s, uint32_t channel) {
  return (uint8_t *)search_at(s, s->at.score) + (size_t)channel * s->config.features;
}
static inline float *search_q(const rim_search *s) { return search_at(s, s->at.work); }
static inline float *search_a0(const rim_search *s) { return search_q(s) + s->config.ring; }
static inline float *search_a1(const rim_search *s) { return search_a0(s) + s->config.ring; }
static inline float *search_p(const rim_search *s) { return search_a1(s) + s->config.ring; }
static inline float *search_g(const rim_search *s, uint32_t i) {
  return search_p(s) + s->config.ring + (size_t)i * s->config.noise->fields;
}

/* Which blocks of the ring a pass looks at. */
typedef struct search_mask {
  uint32_t from;                       /* first index of the ring, 0: all */
  uint32_t to;                         /* index after the last, 0: all */
  uint8_t dims;                        /* features that must be inside their bins */
  uint8_t feature[2], low[2], high[2]; /* bytes low..high inclusive */
} search_mask;

static inline bool search_passes(const rim_search *s, const search_mask *mask, uint32_t i) {
  if (i < mask->from || (mask->to != 0 && i >= mask->to))
    return false;
  const uint32_t slot = search_slot(s, i);
  if (search_is_excluded(s, slot))
    return false;
  const uint8_t *f = search_features(s, slot);
  for (uint32_t k = 0; k < mask->dims; ++k) {
    if (f[mask->feature[k]] < mask->low[k] || f[mask->feature[k]] > mask->high[k])
      return false;
  }
  return true;
}

/* statistic.c */
/* The raw fields of a block for a channel. */
void rimi_search_raw_fields(const rim_search *s, const noise_channel *c, uint32_t slot,
                            uint32_t outcome, double *raw);
void rimi_search_weighted_fields(const rim_search *s, const noise_channel *c, uint32_t slot,
                                 uint32_t outcome, double w, double *fields);
double rimi_search_weight(const rim_search *s, const noise_channel *c, uint32_t channel,
                          uint32_t slot);
/* Prepares the work arrays for a channel, and judges SINCE, RAMP, GAIN and FIELD. */
void rimi_search_refresh(rim_search *s, uint32_t channel);
/* Fills ln_ratio, shift, sd, score of h from the sums. */
void rimi_search_judge(const rim_search *s, const search_sums *sums, search_hypothesis *h);
/* The best onset of the shift inside the mask (mask->from is ignored). *sd: of the onset, blocks;
 * NULL: not asked. */
void rimi_search_scan_onset(const rim_search *s, const search_mask *mask, search_hypothesis *h,
                            double *sd);

/* search.c: completes search_exclude() in this channel. */
void search_take_out(rim_search *s, uint32_t channel);
/* The best end of a shift that has its onset; it is before the newest block. */
void search_scan_end(const rim_search *s, search_hypothesis *h);

/* scan.c */
/* The best DURING, by bins of time; then each edge exactly given the other. */
void search_scan_during(rim_search *s, search_hypothesis *h);
void search_refine_during(const rim_search *s, search_hypothesis *h);
void rimi_search_scan_interval(rim_search *s, const search_mask *mask, uint32_t feature,
                               search_hypothesis *h, uint32_t which);
void rimi_search_scan_box(rim_search *s, uint32_t x, uint32_t y, search_hypothesis *h);
/* Judges the region as it stands, exactly. */
void rimi_search_evaluate(const rim_search *s, search_hypothesis *h);
void rimi_search_refine_edges(rim_search *s, search_hypothesis *h, uint32_t which);
search_mask rimi_search_mask_of(const rim_search *s, const search_hypothesis *h, int without);
void rimi_search_note(rim_search *s, uint32_t channel, const search_hypothesis *h);

#endif
