/* SPDX-License-Identifier: MIT */
/* search/select.h - FS-RIM: which features, and which region of them, deviate most (thesis ch. 4).
 *
 * Online form, what the monitor runs: observations come one by one, the search goes on in bounded
 * slices between them. (The thesis's own, over a finished set: batch/select_batch.h.) It keeps
 *   - 1-D tables of every feature, bin and channel (search/bins.h) over everything seen; beyond
 *   60000
 *     observations what is older weighs one half, then a quarter...;
 *   - a ring of the latest observations, features in 256 levels (32 in the small profile), to
 *     backfill what the search turns to;
 *   - the best interval of every (feature, channel), rescanned round robin (App. A, p. 115);
 *   - an edge sweep: a strong interval as a mask, and the exact conditional interval of each other
 *     feature: H3 (eq. 4.5, p. 52). Where H3 comes near what the pool holds, also intervals of the
 *     other feature sheared by the base: with 100 features H3 alone ranks the right partner first
 *     in 90 % of golf runs, with shear in 96 %. Of an edge that comes nearer still the base is
 *     searched again, within the interval of the other feature;
 *   - a pool of active (feature, feature, channel) triples, each a grid of prefix sums and 24
 *     ellipses (12 in the small profile), which move by differential evolution. The
 *     leading pair's are accepted by the rule of Metropolis at temperature 1, on the ring's own
 *     points where an edge cuts a cell (in the small profile on the grid alone): once they
 *     have climbed, they are a sample of the posterior over ellipses (flat prior, likelihood ratio
 *     eq. 3.1), and membership of a point is the average over them. A pair that is not the leader
 *     stays or goes by its latest H3, not by its best ellipse.
 * Hypotheses have 0 (everywhere), 1 (interval) or 2 (ellipse) features.
 *
 * Statistics: residuals r[c] have nominal variance 1. Over a region that holds n observations of
 * sum S, nominal Var(S) = a_c n + b_c n^2 and ln anom F = S^2 / (2 Var(S)), which with a = 1, b = 0
 * is eq. 3.7 (p. 28).
 *
 * Everything is deterministic: fixed order, random numbers from the configured seed and a counter.
 * An engine is one flat block of memory without pointers into itself: copy its bytes elsewhere, and
 * the copy goes on as the original would. */
#ifndef RIM_SELECT_H
#define RIM_SELECT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/ellipsoid.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_SELECT_MAX_FEATURES 128
#define RIM_SELECT_MAX_CHANNELS 128
#define RIM_SELECT_MAX_BINS 32
#define RIM_SELECT_MAX_GRID 64
#define RIM_SELECT_MAX_PAIRS 16
#define RIM_SELECT_MAX_RING 4096
#define RIM_SELECT_CHAINS 24 /* ellipses a pair */
#define RIM_SELECT_CLIP 63.0 /* residuals are clipped to +-63 standard deviations */

#define RIM_SELECT_DEFAULT_RING 512
#define RIM_SELECT_DEFAULT_BINS 16
#define RIM_SELECT_DEFAULT_GRID 32
#define RIM_SELECT_DEFAULT_PAIRS 6
#define RIM_SELECT_DEFAULT_SCANS 16
#define RIM_SELECT_DEFAULT_EDGES 48
#define RIM_SELECT_DEFAULT_MOVES 64

/* Zero-initialise, then fill. */
typedef struct rim_select_config {
  uint16_t features; /* 1..128 */
  uint16_t channels; /* 1..128; 0: 1 */
  uint16_t ring;     /* observations kept for backfill, 16..4096; 0: 512 */
  uint16_t bins;     /* per feature, 4..32; 0: 16 */
  uint16_t grid;     /* cells per side, 8..64; 0: 32 */
  uint16_t pairs;    /* active pairs, 1..16; 0: 6 (with one feature none is used) */
  /* Work of one unit of budget (rimi_select_work): */
  uint16_t scans; /* (feature, channel) slices rescanned; 0: 16 */
  uint16_t edges; /* conditional intervals, H3 and its sheared forms; 0: 48 */
  uint16_t moves; /* ellipses proposed and evaluated; 0: 64 */
  bool small;     /* the small profile, for small processors: 12 ellipses per pair, none of them
                     corrected by the ring's points; one pair per unit enters, and in its unit none
                     moves; sheared intervals only where the plain one might enter; of `edges` and
                     `moves` twice as many while the ring is nearly empty, 5/8 when it is full */
  uint64_t seed;
  const float *a; /* [channels], > 0; NULL: 1. Copied. */
  const float *b; /* [channels], >= 0; NULL: 0. Copied. */
} rim_select_config;

/* A hypothesis: this channel's mean is shifted in this region. */
typedef struct rim_candidate {
  uint8_t dims; /* 0..2; region.unit.dims equals it */
  uint16_t channel;
  rim_unit_region region; /* dims 1 is the interval as an ellipsoid, bounds exact */
  double n;               /* observations inside */
  double s;               /* sum of their residuals */
  double shift;           /* most likely shift, s / n (eq. 3.6) */
  double ln_anom;         /* F, natural logarithm of eq. 3.1 */
  double score;   /* ln_anom * scale_c - offset_c, less a penalty for the number of features */
  uint32_t since; /* index (from 0) of the earliest observation in the ring inside the region;
                        UINT32_MAX: none */
} rim_candidate;

/* Counted since init: what was done, for tests of the bound and for bench. */
typedef struct rim_select_effort {
  uint32_t observations;
  uint32_t units;
  uint32_t scans;
  uint32_t edges;
  uint32_t moves;     /* ellipses evaluated */
  uint32_t backfills; /* pairs filled from the ring; at most 2 a unit */
} rim_select_effort;

typedef struct rim_select rim_select;

#define RIM_SELECT_HEADER_BYTES 1536u /* at least the private header; checked in select.c */
#define RIM_SELECT_ROUND8(bytes) ((((size_t)(bytes)) + 7u) / 8u * 8u)
#define RIM_SELECT_PAIR_BYTES 896u
/* Bytes of one engine, at most: the small profile needs less, see rimi_select_size(). A constant
 * expression. Every argument explicit (not 0). */
#define RIM_SELECT_SIZE(features, channels, ring, bins, grid, pairs)                               \
  (RIM_SELECT_HEADER_BYTES +                                                                       \
   RIM_SELECT_ROUND8(4u * (size_t)(features) * (size_t)(bins) * (size_t)(channels)) +              \
   RIM_SELECT_ROUND8(2u * (size_t)(features) * (size_t)(bins)) +                                   \
   RIM_SELECT_ROUND8((size_t)(ring)*4u * (((size_t)(features) + 3u) / 4u)) +                       \
   RIM_SELECT_ROUND8((size_t)(ring)*2u * (size_t)(channels)) +                                     \
   RIM_SELECT_ROUND8((size_t)(ring)*2u) +                                                          \
   RIM_SELECT_ROUND8((size_t)(features) * (size_t)(channels)*8u) +                                 \
   RIM_SELECT_ROUND8((size_t)(channels)*48u) + RIM_SELECT_ROUND8((size_t)(ring)*2u) +              \
   RIM_SELECT_ROUND8(2u * (size_t)(grid) * (size_t)(grid)) +                                       \
   (size_t)(pairs) *                                                                               \
       (RIM_SELECT_ROUND8(4u * (size_t)(grid) * ((size_t)(grid) + 1u)) + RIM_SELECT_PAIR_BYTES))

/* The configuration with the defaults instead of zeros. Nothing is checked. */
rim_select_config rimi_select_filled(const rim_select_config *config);

/* Bytes for this configuration, defaults filled in. RIM_E_ARGUMENT: NULL; RIM_E_CONFIG: a count out
 * of range; *bytes unchanged on error. */
rim_status rimi_select_size(const rim_select_config *config, size_t *bytes);

/* Prepare an engine in the caller's memory.
 * RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: memory not aligned to 8; RIM_E_SIZE: fewer bytes than
 * rimi_select_size(); RIM_E_CONFIG: a count out of range; RIM_E_RANGE: a <= 0, b < 0 or not finite.
 * *engine is unchanged on error. */
rim_status rimi_select_init(rim_select **engine, void *memory, size_t bytes,
                            const rim_select_config *config);

/* Forget every observation; configuration, scales and seed stay. */
void rimi_select_reset(rim_select *engine);

/* How channels compare: everywhere a choice is made between candidates of different channels, it is
 * made by ln_anom * scale[c] - offset[c]. [channels] each; NULL: 1 and 0. Copied; may be called at
 * any time. RIM_E_ARGUMENT: NULL engine; RIM_E_RANGE: a scale
 * <= 0 or a value not finite: unchanged. */
rim_status rimi_select_set_channel_scale(rim_select *engine, const float *scale,
                                         const float *offset);

/* Add one observation. u: `features` doubles, unit features; outside [0, 1) they are clamped to the
 * edge bins. r: `channels` doubles, standardised residuals, clipped at +-RIM_SELECT_CLIP.
 * RIM_E_ARGUMENT: NULL; RIM_E_DATA: NaN or infinity, nothing changed.
 * O(features * channels + pairs * (grid + chains)); when 60000 observations are held, the tables
 * are halved first, O(bytes), and so is a pair's grid before a sum no longer fits. Stack < 2 kB. */
rim_status rimi_select_observe(rim_select *engine, const double *u, const double *r);

/* Search for `budget` units. One unit is at most `scans` interval scans, O(bins^2) each; `edges` +
 * 5 conditional intervals, O(ring + 16^2) each; 2 pairs entering the pool, each a backfill of
 * O(ring + grid^2) and 24 ellipses; `moves` + edges / 5 + 48 further ellipses, O(grid) each (an
 * entering leader is evaluated again); in the small profile up to twice the edges and moves; for
 * the leader's ellipses also the ring's points in cells on their boundary. Does nothing before the
 * first observation. Stack < 2 kB. */
void rimi_select_work(rim_select *engine, uint32_t budget);

/* The best hypothesis of any channel by score. Returns false, and *out is unchanged, before the
 * first observation. O(channels + pairs * chains + ring). */
bool rimi_select_best(const rim_select *engine, rim_candidate *out);

/* The best hypothesis of one channel by ln_anom less the penalty for its number of features. As
 * above; false also for channel >= channels. */
bool rimi_select_best_of_channel(const rim_select *engine, uint16_t channel, rim_candidate *out);

/* The same without `since` (UINT32_MAX), which alone looks through the ring. */
bool rimi_select_shift_of_channel(const rim_select *engine, uint16_t channel, rim_candidate *out);

/* [channels]: ln anom of each channel's best hypothesis less the penalty for its number of features
 * (expected nominal maximum over as many alternatives), never below 0. Valid until the next call
 * that changes the engine; brought up to date by observe and work. */
const float *rimi_select_channel_scores(const rim_select *engine);

/* Chance, 0..1, that a context lies inside the region of a channel's best hypothesis: share of the
 * ellipses that hold it for two features; 0 or 1 for one (NaN: 0); 1 for none. u: `features` unit
 * features. 0 before the first observation and for channel >= channels. For a decision compare with
 * RIM_SELECT_MEMBERSHIP_CUT. O(channels + pairs * chains). */
double rimi_select_membership(const rim_select *engine, uint16_t channel, const double *u);
#define RIM_SELECT_MEMBERSHIP_CUT 0.5

/* ---- for monitor/guard.h (select_guard.c); as in search/search.h ---- */
const void *rimi_select_control(const rim_select *engine, size_t *bytes);
uint32_t rimi_select_held(const rim_select *engine);
uint32_t rimi_select_next_slot(const rim_select *engine);
uint32_t rimi_select_slot_sum(const rim_select *engine, uint32_t slot);
uint32_t rimi_select_tables_sum(const rim_select *engine); /* of what nothing changes */
/* Whether this feature's bins hold as many observations, and the same sum, as were seen. O(bins
 * channels). */
bool rimi_select_bins_hold(const rim_select *engine, uint32_t feature);
/* Whether every index that is followed in this row lies in its table. O(pairs + channels). */
bool rimi_select_indices_hold(const rim_select *engine);

uint32_t rimi_select_observations(const rim_select *engine);
rim_select_effort rimi_select_get_effort(const rim_select *engine);

#ifdef __cplusplus
}
#endif
#endif
