/* SPDX-License-Identifier: MIT */
/* The engine's layout, shared by select.c, select_scan.c and select_pool.c. */
#ifndef RIM_SELECT_PRIVATE_H
#define RIM_SELECT_PRIVATE_H

#include "base/rng.h"
#include "search/bins.h"
#include "search/select.h"

#define SELECT_ROOTS 256u                  /* table of sqrt(1 - (k/256)^2), */
#define SELECT_ROOT_ONE 4096u              /* in these */
#define SELECT_RESIDUAL_STEP RIM_GRID_STEP /* of a ring residual: int16 covers +-64 */

/* What bounds a unit's work (monitor/work.h). */
#define BASES_A_UNIT 3u /* masks made, each O(ring) */
#define EDGE_BINS 16u   /* of a conditional interval */
#define SHEARS 4u       /* further intervals of an edge that comes near, and one of the base */
#define SELECT_EDGE_INTERVALS (1u + SHEARS + 1u) /* of such an edge */
#define SELECT_AT_ONCE 6u                        /* at most: edges whose rows are read together */
#define ENTRIES_A_UNIT 2u                        /* pairs that may enter the pool, */
/* The small profile, for small processors: one pair per unit enters, the best of those offered, and
 * in its unit no ellipse moves; shears are tried only where the plain H3 might itself enter the
 * pool; a pair has half of the ellipses, each moving twice as often; and the leader's ellipses keep
 * the grid's resolution instead of being corrected point by point. Hence 32 levels of a feature are
 * enough in the ring, six features to a word; else there are 256, four to a word. */
#define SMALL_CHAINS 12u
#define SMALL_LEVEL_BITS 5u
#define SMALL_IN_WORD 6u
#define LEVEL_BITS 8u
#define LEVELS_IN_WORD 4u

/* Best interval of a (channel, feature) slice when it was last scanned. */
typedef struct slice {
  float ln_anom;
  uint8_t first, last; /* bins first..last */
  uint16_t swept;      /* low 16 bits of the sweep that last had it as base */
} slice;

typedef struct channel_state {
  double sum; /* of all residuals */
  float a, b, scale, offset;
  float score; /* best ln anom less penalty, >= 0 */
  uint16_t best_feature;
  uint16_t reserved;
  float best_interval; /* its ln anom */
  float reserved2;
} channel_state;

/* Points with ((y - cy) / a)^2 + ((x - cx - b (y - cy) / a) / c)^2 < 1: (b, c; 0, a) is a Cholesky
 * factor of A in eq. 3.8, positive definite for any a, c > 0. In units of 1 / SELECT_ONE of a
 * feature's range. */
typedef struct ellipse {
  int32_t cx, cy, a, b, c;
} ellipse;
#define SELECT_ONE 8192

typedef struct chain {
  ellipse shape;
  float s, n;           /* statistics as evaluated: exact on the ring for the leading pair */
  float grid_s, grid_n; /* on the grid alone */
} chain;

typedef struct pair_state {
  uint16_t x, y, channel; /* features, x < y */
  uint8_t active;
  uint8_t exact;      /* chains have statistics exact on the ring */
  float h3;           /* latest H3 of this pair, nats */
  uint16_t cursor;    /* next chain to move */
  uint8_t which;      /* chain with the best ln anom, */
  bool judged;        /* which and best are those of the chains as they are */
  uint8_t grid_shift; /* rim_grid */
  float best;
  chain chain[RIM_SELECT_CHAINS];
} pair_state;

/* A promising pair, as the edge sweep found it. */
typedef struct select_offer {
  uint16_t x, y, channel; /* x < y */
  double center[2];
  double half[2];  /* half sides of the box */
  double shape[3]; /* A of eq. 3.8: xx, xy, yy */
  double h3;       /* nats */
} select_offer;

struct rim_select {
  uint32_t magic;
  uint16_t features, channels, ring, bins, grid, pairs, scans, edges, moves;
  uint16_t head;   /* ring slot written next */
  uint16_t held;   /* observations in the ring */
  uint16_t leader; /* index of the pair with the best score; pairs: none */
  uint16_t turn;   /* other pair moved last */
  uint16_t sweeps;
  uint16_t entered; /* pairs that entered the pool in this unit */
  uint16_t base_feature, base_channel, next_feature;
  uint8_t base_first, base_last;
  uint16_t chains; /* ellipses a pair in use */
  uint16_t words;  /* of a row of the ring */
  uint32_t next_slice;
  uint32_t count; /* observations in the tables (halved with them) */
  uint32_t total; /* observations ever */
  float penalty[3];
  uint32_t sum_at, count_at, ring_at, residual_at, slice_at, channel_at, pair_at, grid_at, mask_at;
  uint32_t pair_bytes;
  uint32_t
      cell_at; /* not in the small profile: uint16_t [grid][grid]: 1 + newest ring slot in that cell
                       of the leader */
  uint32_t link_at; /* uint16_t [ring]: 1 + next older slot in the same cell; 0: none */
  rim_select_effort effort;
  select_offer waiting; /* small profile: the best offer, until a unit takes it */
  bool waits;
  bool small;
  rim_rng rng;
  uint64_t seed;
  uint16_t root[SELECT_ROOTS + 2]; /* whole words */
  float scores[RIM_SELECT_MAX_CHANNELS];
};

static inline void *select_at(const rim_select *e, uint32_t offset) {
  return (void *)((uintptr_t)e + offset);
}
static inline uint32_t *select_row(const rim_select *e, uint32_t slot) {
  return (uint32_t *)select_at(e, e->ring_at) + (size_t)slot * e->words;
}
static inline int16_t *select_residual(const rim_select *e, uint32_t slot) {
  return (int16_t *)select_at(e, e->residual_at) + (size_t)slot * e->channels;
}
static inline slice *select_slice(const rim_select *e, uint32_t channel, uint32_t feature) {
  return (slice *)select_at(e, e->slice_at) + (size_t)channel * e->features + feature;
}
static inline channel_state *select_channel(const rim_select *e, uint32_t channel) {
  return (channel_state *)select_at(e, e->channel_at) + channel;
}
static inline pair_state *select_pair(const rim_select *e, uint32_t pair) {
  return (pair_state *)select_at(e, e->pair_at + pair * e->pair_bytes);
}
static inline rim_bins select_bins(const rim_select *e) {
  return (rim_bins){e->features, e->bins, e->channels, (int32_t *)select_at(e, e->sum_at),
                    (uint16_t *)select_at(e, e->count_at)};
}
static inline rim_grid select_grid(const rim_select *e, uint32_t pair) {
  const size_t bytes = RIM_SELECT_ROUND8(RIM_GRID_BYTES(e->grid));
  return (rim_grid){e->grid, &select_pair(e, pair)->grid_shift,
                    (uint32_t *)select_at(e, e->grid_at + (uint32_t)(pair * bytes))};
}
static inline uint16_t *select_cell(const rim_select *e, uint32_t row, uint32_t column) {
  return (uint16_t *)select_at(e, e->cell_at) + (size_t)row * e->grid + column;
}
static inline uint16_t *select_link(const rim_select *e, uint32_t slot) {
  return (uint16_t *)select_at(e, e->link_at) + slot;
}
static inline double select_ln_anom(double s, double n, double a, double b) {
  return n > 0.0 ? s * s / (2.0 * n * (a + b * n)) : 0.0;
}

/* A feature in the ring: where its levels are. */
typedef struct ring_column {
  const uint32_t *word; /* of slot 0 */
  uint32_t words;       /* from slot to slot */
  uint32_t shift, mask; /* of a level */
  uint32_t up;          /* from a level to a byte */
} ring_column;

static inline uint32_t select_level_bits(const rim_select *e) {
  return e->small ? SMALL_LEVEL_BITS : LEVEL_BITS;
}
static inline uint32_t select_in_word(bool small) { return small ? SMALL_IN_WORD : LEVELS_IN_WORD; }
static inline ring_column select_column(const rim_select *e, uint32_t feature) {
  const uint32_t bits = select_level_bits(e);
  const uint32_t word = feature / select_in_word(e->small);
  return (ring_column){select_row(e, 0) + word, e->words,
                       (feature - word * select_in_word(e->small)) * bits, (1u << bits) - 1u,
                       8u - bits};
}
static inline uint32_t select_level(const ring_column *f, uint32_t slot) {
  return (f->word[slot * f->words] >> f->shift) & f->mask;
}
/* The middle of a level, of 256. */
static inline uint32_t select_middle(const ring_column *f, uint32_t level) {
  return (level << f->up) + ((1u << f->up) >> 1);
}
static inline uint32_t select_byte(const ring_column *f, uint32_t slot) {
  return select_middle(f, select_level(f, slot));
}

/* How much a channel's ln anom counts against other channels'. */
static inline double select_priority(const channel_state *state, double ln_anom) {
  return ln_anom * (double)state->scale - (double)state->offset;
}

/* Edges or moves of a unit. In the small profile they fall with the observations held, as what
 * another one changes does: SMALL_FIRST_WORK times those configured at first, 5/8 of them when the
 * ring is full. */
#define SMALL_FIRST_WORK 2u
static inline uint32_t select_unit_work(const rim_select *e, uint32_t configured) {
  if (!e->small)
    return configured;
  const uint32_t falling = configured * 5u * e->ring / (8u * (e->held > 0 ? e->held : 1u));
  const uint32_t first = SMALL_FIRST_WORK * configured;
  return falling < first ? falling : first;
}

/* select_scan.c */
void rimi_select_scan(rim_select *e, uint32_t budget);  /* intervals */
void rimi_select_sweep(rim_select *e, uint32_t budget); /* conditional intervals */
/* select_pool.c */
float rimi_select_pair_best(const rim_select *e, pair_state *p, uint32_t *which);
void rimi_select_pool_observe(rim_select *e, uint32_t slot);
void rimi_select_pool_forget(rim_select *e, uint32_t slot);
/* Priority of H3 that a new pair must exceed; *weakest: the pair it would replace, pairs: none. */
double rimi_select_pool_bar(const rim_select *e, uint32_t *weakest);
void rimi_select_pool_offer(rim_select *e, const select_offer *offer);
void rimi_select_pool_enter(
    rim_select *e); /* at the end of a sweep's slice: the offer that waits */
void rimi_select_pool_refresh(rim_select *e, uint32_t pair); /* evaluates every ellipse again */
void rimi_select_pool_move(rim_select *e, uint32_t budget);
double rimi_select_pair_membership(const rim_select *e, const pair_state *p, double x, double y);
#endif
