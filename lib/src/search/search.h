/* SPDX-License-Identifier: MIT */
/* The search: which hypothesis about where and since when an outcome deviates says most.
 *
 * Blocks of residuals are kept in a ring. A channel's residuals are r = B b + n (section NOISE):
 * run effects b with a Gaussian prior, and autocorrelated noise n, F n = sigma(x) a, where F takes
 * off what each block keeps of the one before, and w = 1 / sigma(x). A hypothesis is a shape m
 * over the blocks (1 inside a region, a ramp, the prediction itself); its shift, standard error and
 * ln likelihood ratio are those of generalised least squares with b integrated out:
 *
 *   d = m'We - (m'WB) G^-1 (B'We)   A = m'Wm - (m'WB) G^-1 (B'Wm)   W = F'w^2 F  G = B'WB + prior
 *   shift = d / A   sd = A^-1/2   ln likelihood ratio = d^2 / (2 A)
 *
 * Without run effects, autocorrelation and sigma(x) this is eq. 3.7 of the thesis (p. 29). Every
 * shape of region uses this one statistic. What a hypothesis scores is its ln likelihood ratio,
 * divided by what healthy runs inflate it by (phi), less the nats that describe it.
 *
 * All work is done in units of bounded cost, each at most O(ring (fields + raw)): see
 * rimi_search_work(). */
#ifndef RIM_SRC_SEARCH_H
#define RIM_SRC_SEARCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/noise.h"
#include "rim/status.h"

#define SEARCH_MAX_FEATURES 64u
#define SEARCH_MAX_CHANNELS 640u
#define SEARCH_MAX_RING 1024u
#define SEARCH_BINS 24u /* of a feature, by SEARCH_CUTS cuts */
#define SEARCH_CUTS 23u
#define SEARCH_CELLS 5u /* per side of the grid over which boxes are searched */
#define SEARCH_LEAST 3u /* blocks inside a hypothesis */
#define SEARCH_FROM_START UINT32_MAX
#define SEARCH_AS_MEASURED 0xffffu /* in section REGION: no prediction stands for the reading */

typedef enum search_family {
  SEARCH_SINCE = 0, /* a shift of every block since the onset */
  SEARCH_RAMP = 1,  /* growing in proportion to the time since the onset */
  SEARCH_GAIN = 2,  /* in proportion to the prediction, since the onset */
  SEARCH_FIELD = 3, /* the run's own effects are impossible; no onset */
  SEARCH_INTERVAL = 4,
  SEARCH_BOX = 5,
  SEARCH_INTERVAL_SINCE = 6,
  SEARCH_BOX_SINCE = 7,
  SEARCH_DURING = 8 /* a shift of every block from the onset to its end */
} search_family;

/* What a shift inside a hypothesis is like. */
typedef enum search_shape {
  SEARCH_CONSTANT = 0,
  SEARCH_PROPORTIONAL = 1, /* to the prediction: a gain, in a region or from an onset to an end */
  /* One of the rate: what each block inside adds is kept for a while, and so is there outside as
   * well (a tank with a hole at some height). */
  SEARCH_KEPT = 2
} search_shape;

typedef struct search_hypothesis {
  uint8_t family;
  uint8_t feature[2];        /* of the region features; as many as the family has */
  uint8_t first[2], last[2]; /* bins */
  uint8_t shape;             /* search_shape */
  uint32_t onset;            /* block, counted from the start of the run; SEARCH_FROM_START */
  uint32_t end;              /* DURING: the block after its last; 0: it goes on */
  float ln_ratio;            /* ln likelihood ratio */
  float score;               /* ln_ratio / phi - description */
  float shift, sd;           /* in the channel's s */
  uint32_t blocks;           /* inside */
} search_hypothesis;

/* Region features that a hypothesis names: 0, 1 or 2. */
static inline uint32_t search_dims(const search_hypothesis *h) {
  return h->family == SEARCH_BOX || h->family == SEARCH_BOX_SINCE             ? 2u
         : h->family == SEARCH_INTERVAL || h->family == SEARCH_INTERVAL_SINCE ? 1u
                                                                              : 0u;
}

typedef struct search_config {
  uint16_t features, channels, outcomes, means, ring;
  uint8_t cells_per_turn; /* boxes searched in a turn of a channel */
  const rim_noise *noise;
  const uint8_t *cuts; /* u8[features][SEARCH_CUTS], ascending: bytes of a feature */
  /* Sections REGION, u16[features][2], and OUTCOMES, u16[outcomes]; NULL: every feature may
   * describe every channel's regions. An outcome's own reading, taken as measured, may not: it is
   * high where it is high. */
  const uint8_t *region, *outcome_feature;
} search_config;

/* One block: the region features as bytes, the means' and predictions' standardised values, and
 * each channel's residual in the outcome's unit. */
typedef struct search_block {
  double t_s; /* since the start of the run */
  const uint8_t *feature;
  const double *mean;      /* [means] */
  const double *predicted; /* [channels], at most 2 outcomes: what behaviour and agreement expect */
  const double *residual;  /* [channels] */
  const bool *unknown;     /* [channels]: says nothing of this block; NULL: all are known */
  bool apart;              /* the block before is not its neighbour in time */
  double disturbance;      /* rimi_noise_disturbance() */
} search_block;

typedef struct rim_search rim_search;

/* Bytes for an instance; 0 where the configuration is out of range. */
size_t rimi_search_size(const search_config *config);
/* RIM_E_CONFIG, RIM_E_SIZE, RIM_E_ALIGN (8). */
rim_status rimi_search_init(rim_search **search, void *memory, size_t bytes,
                            const search_config *config);
void rimi_search_reset(rim_search *search);
/* After the bytes were copied: where the sections are now. */
void rimi_search_attach(rim_search *search, const search_config *config);

/* Takes a block. RIM_E_DATA: a number is not finite; nothing is changed. */
rim_status rimi_search_observe(rim_search *search, const search_block *block);

/* Does `units` units of search. */
void rimi_search_work(rim_search *search, uint32_t units);

uint32_t rimi_search_blocks(const rim_search *search); /* observed since the start */
/* The best hypothesis of a channel that was found; score below -1e9 where there is none. */
const search_hypothesis *rimi_search_best(const rim_search *search, uint32_t channel);

/* Refines the hypothesis of a channel exactly over the ring: edges and onset in turn, and the
 * simplest shape that explains nearly as much. O(ring) a few dozen times. *onset_sd: standard
 * deviation of the onset in blocks. */
void rimi_search_explain(rim_search *search, uint32_t channel, search_hypothesis *out,
                         double *onset_sd);

/* Judges a hypothesis in a channel, exactly. False where the data say nothing of it. O(ring). */
bool rimi_search_evaluate_channel(rim_search *search, uint32_t channel, search_hypothesis *h);

/* Whether a block with these region bytes, number `block` of the run, is inside. */
bool rimi_search_inside(const rim_search *search, const search_hypothesis *h,
                        const uint8_t *feature, uint32_t block);

double rimi_search_time_of(const rim_search *search, uint32_t block); /* of a block, s */
/* First block of the ring inside the hypothesis whose residual is known in the channel that was
 * judged last. */
uint32_t rimi_search_first_inside(const rim_search *search, const search_hypothesis *h);
/* The onset; without one the first block inside that shows the deviation: where a region is drawn a
 * little too large, a block that only grazes it may come long before, and says that nothing was
 * wrong then. In the channel that was judged last. O(ring). */
uint32_t rimi_search_first_shown(rim_search *search, const search_hypothesis *h);
uint32_t rimi_search_oldest(const rim_search *search);
/* Bytes at which the bins first..last of a feature begin and end. */
void rimi_search_edges(const rim_search *search, uint32_t feature, uint32_t first, uint32_t last,
                       uint32_t *low, uint32_t *high);

/* What a judged hypothesis explains beyond its description, each part of it worth a share: by the
 * ratio itself, for phi differs between families and would prefer the one that healthy runs inflate
 * least. */
double rimi_search_worth(const rim_search *search, uint32_t channel, const search_hypothesis *h);

/* The best interval beside h's region, below or above it in one of its features, at any time:
 * where h says that the outcome reads low, what reads high may be the rest. False where h has no
 * region or nothing lies beside it. Cost: four passes over the ring and an interval's search. */
bool rimi_search_beside(rim_search *search, uint32_t channel, const search_hypothesis *h,
                        search_hypothesis *out);

/* The best of what came and went: a shift from where `since` begins (SINCE, RAMP or DURING; NULL:
 * from anywhere) to an end, or the region that explains nearly as much. False where there is
 * nothing. What the search itself found to have come and gone is tried as well, as its onset may be
 * the better one. Cost: three passes over the ring and three intervals' searches. */
bool rimi_search_passed(rim_search *search, uint32_t channel, const search_hypothesis *since,
                        search_hypothesis *out);

/* A shift is meant against nominal: where h leaves a baseline that no healthy run has, and a region
 * explains at least half as much without one, or is some nats likelier when the baselines are
 * counted, h becomes that, mostly with the other sign; *onset_sd is then that of its onset, in
 * blocks, and the result is true. is_known: h's sign was said before, of what began when the run's
 * effects were known: it takes more to turn it, and only a region without such a baseline does.
 * Cost: as of rimi_search_beside(), twice, and of rimi_search_passed(). */
bool rimi_search_against_nominal(rim_search *search, uint32_t channel, search_hypothesis *h,
                                 bool is_known, double *onset_sd);

/* Standard deviation of a hypothesis' onset, blocks, in the channel that was judged last: 0 where
 * it has none. Cost: one pass over the ring. */
double rimi_search_sd_of_onset(const rim_search *search, const search_hypothesis *h);

/* The sign that a channel's prediction mostly has in the blocks inside h: 1, -1, or 0 where its
 * mean there is smaller than its standard deviation. O(ring). */
double rimi_search_side(const rim_search *search, uint32_t channel, const search_hypothesis *h);

/* Of a hypothesis of SEARCH_KEPT: what a block inside has, in the mean, of what it and those before
 * it added, per unit of the shift. O(ring). */
double rimi_search_kept_mean(const rim_search *search, const search_hypothesis *h);

double rimi_search_description(search_family family); /* nats */

/* How much of a block's scatter counts, in standard deviations: beyond that of the block before it
 * (0 where none is) and beyond 0, at most SEARCH_ALONE. A step of a command that falls into a block
 * makes that one block scatter, by ten standard deviations where a landing's engines light; were it
 * to count, healthy runs would hide every lasting change of the noise. One that lasts loses only
 * what its first block exceeds. */
#define SEARCH_ALONE 2.0
double rimi_search_limited(double scatter, double before);

/* How much of what a step leaves counts, in standard deviations of the noise: a few blocks in which
 * a model of products is wrong are no fault that lasts. */
#define SEARCH_STEP_MOST 3.0

/* By how much healthy runs exceed the ratio that the noise model of channel c expects of such a
 * hypothesis, at least 1. Its root is what standard errors are multiplied by. */
double rimi_search_inflation(const noise_channel *c, const search_hypothesis *h);

/* The residuals of the blocks from..to-1 are unknown from now on, in every channel, and every
 * hypothesis is searched for again: a deviation that ended must not hide the next. The run effects
 * are learnt from the other blocks, each channel's in its next turn. False, and nothing is changed,
 * while an earlier call still waits for that, or where none of the blocks is held. O(channels). */
bool rimi_search_exclude(rim_search *search, uint32_t from, uint32_t to);

/* Before rimi_search_observe(), while a deviation h stands. What the ring held remains evidence of
 * the run's effects when it leaves; where it lies inside h it does not, in any channel: otherwise a
 * fault that lasts longer than the ring becomes what is usual in this run, and its alarm clears or
 * turns its sign. Nothing of FIELD, which is about those effects, or while the ring is not full.
 * Cost: of rimi_search_observe(), at most. */
void rimi_search_let_go(rim_search *search, const search_hypothesis *h);

/* ---- for monitor/guard.h (search_guard.c) ---- */

/* What holds pointers, sizes and indices: aligned to 4, *bytes a multiple of 4. */
const void *rimi_search_control(const rim_search *search, size_t *bytes);
uint32_t rimi_search_held(const rim_search *search);      /* blocks in the ring: slots 0..held-1 */
uint32_t rimi_search_next_slot(const rim_search *search); /* that the next block is written to */
uint32_t rimi_search_slot_sum(const rim_search *search, uint32_t slot); /* of all of a block */
uint32_t rimi_search_effects_sum(const rim_search *search); /* of what only a block changes */
/* Whether what the channel in turn was found to be, and that of some others, is a hypothesis. */
bool rimi_search_indices_hold(const rim_search *search);
bool rimi_search_is_taking_out(const rim_search *search); /* or an exclusion that is not complete */

/* For calibration on the ground: [channels][NOISE_FAMILIES] largest ln likelihood ratios so far are
 * kept there when not NULL. */
void rimi_search_keep_maxima(rim_search *search, float *maxima);

#endif
