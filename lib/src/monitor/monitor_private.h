/* SPDX-License-Identifier: MIT */
/* The monitor's own layout, shared by the sources of this room. */
#ifndef RIM_SRC_MONITOR_PRIVATE_H
#define RIM_SRC_MONITOR_PRIVATE_H

#include "base/bytes.h"
#include "image/basis.h"
#include "image/correct.h"
#include "image/noise.h"
#include "image/nominal.h"
#include "image/quadratic.h"
#include "image/threshold.h"
#include "interference/detector.h"
#include "monitor/blocks.h"
#include "monitor/guard.h"
#include "monitor/inspect.h"
#include "monitor/interference_watch.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/monitor.h"
#include "search/search.h"
#include "search/select.h"

#define MONITOR_UPDATE_RATIO 0.25 /* ln anom grown by a quarter is worth another record */
/* A deviation is over when its outcome has been quiet since for this number of blocks and this part
 * of a healthy run: a place that is visited again and again is no end. */
#define MONITOR_OVER_BLOCKS 8u
#define MONITOR_OVER_RUN 0.5
#define MONITOR_NO_OUTCOME 0xffffu
/* Of a channel's own noise: an error of its nominal value above which a block says nothing. */
#define MONITOR_MOST_UNKNOWN 0.1
#define MONITOR_NOT_KNOWN 1e30
#define MONITOR_FORGOTTEN 0.01 /* of a state at the start: it does not gather over a run */
#define MONITOR_BEYOND 0.1   /* of a run's length: how much longer than healthy ones it may be */

/* Views into the image; what is absent is all zero. */
typedef struct monitor_models {
  rim_behaviour behaviour;
  rim_agreement agreement;
  rim_nominal level;
  rim_quadratic quadratic;
  rim_noise noise;
  rim_correct correct;
  rim_threshold threshold;
} monitor_models;

#define MONITOR_GAPS 8u
#define MONITOR_GAP 3.0 /* times the mean spacing of rows since the last one */

/* A gap between rows with predictions, which are numbered and otherwise taken as evenly spaced. */
typedef struct monitor_gap {
  double before_s, after_s; /* of the rows on either side */
  uint32_t index;           /* of the row after it */
} monitor_gap;

struct rim_monitor {
  uint32_t magic;
  uint32_t library;      /* RIM_VERSION_NUMBER: another version may mean other fields */
  uint32_t header_bytes; /* sizeof(struct rim_monitor): another compiler may lay it out otherwise */
  uint32_t words[RIM_CONFIG_WORDS];
  rim_image image;
  monitor_models models;
  bool is_trained;       /* the image has section NOISE */
  const uint8_t *range;  /* f32 low[features], high[features] */
  const uint8_t *region; /* u16[region features][2] */
  const uint8_t *scales; /* f32[outcomes], or NULL */
  blocks *rows;
  rim_search *search;        /* trained, else NULL */
  rim_select *select;        /* not trained, else NULL */
  interference_watch *watch; /* NULL: the image has none */
  double *unit;              /* not trained: [region features] in unit coordinates */
  double *predicted, *residual, *level, *agreement_state; /* trained: [2 O] [4 O] [2 O] [5 O] */
  uint8_t *place;                                         /* trained: [region features] */
  bool *unknown;                                          /* trained: [channels], of the block */
  rim_alarm_life life;
  search_hypothesis explained; /* of the newest record */
  float explained_onset_sd;    /* blocks */
  uint16_t explained_channel;
  bool has_explained, has_place;
  /* What the standing alarm's records said of an outcome, a bit per outcome; well: of a deviation
   * that began when the run's own effects were known. */
  uint32_t said_high[RIM_MONITOR_MAX_OUTCOMES / 32], said_low[RIM_MONITOR_MAX_OUTCOMES / 32];
  uint32_t said_well[RIM_MONITOR_MAX_OUTCOMES / 32];
  uint32_t ended_first, ended_end, ended_count; /* blocks of the newest deviation that ended */
  uint32_t raised_at; /* trained: blocks of the run when the alarm was raised that stands */
  double run_start_s, first_block_s, last_block_s, last_valid_s, out_value, out_t_s;
  uint32_t steps, refused, partly;
  uint16_t channel_count, out_feature;
  monitor_gap gap[MONITOR_GAPS]; /* not trained: the newest ones, in order */
  uint32_t gaps;
  uint32_t unseen; /* trained: blocks in a row, the newest ones, that said nothing of any outcome */
  rim_verdict last; /* what a row that completes no block repeats; interference: NULL */
  rim_interference_verdict motion; /* of the newest row */
  monitor_guard guard;             /* sums all that is above: last */
};

/* Behind agreement_state: [2 inputs] of section QUADRATIC. */
static inline double *monitor_quadratic_state(const rim_monitor *m) {
  return m->agreement_state + AGREEMENT_STATE * (size_t)m->words[RIM_CONFIG_OUTCOMES];
}

static inline bool monitor_has_steps(const rim_monitor *m) {
  return rimi_quadratic_has_steps(&m->models.quadratic);
}

_Static_assert(sizeof(struct rim_monitor) <= RIM_MONITOR_HEADER_BYTES, "header outgrown");

/* Everything that is read from the image, gathered before anything is written. */
typedef struct monitor_plan {
  rim_image image;
  uint32_t words[RIM_CONFIG_WORDS];
  monitor_models models;
  bool is_trained, has_watch;
  blocks_config rows;
  search_config search;
  rim_select_config select;
  const uint8_t *range, *region, *scales;
  uint16_t channel_count;
} monitor_plan;

static inline double monitor_low(const rim_monitor *m, size_t f) {
  return (double)rimi_le_f32(m->range, f);
}
static inline double monitor_width(const rim_monitor *m, size_t f) {
  return (double)rimi_le_f32(m->range, m->words[RIM_CONFIG_FEATURES] + f) - monitor_low(m, f);
}

/* The feature of the image that region feature i is. */
static inline uint16_t monitor_region(const rim_monitor *m, size_t i) {
  return rimi_le_index(m->region, 2 * i, m->words[RIM_CONFIG_FEATURES]);
}
static inline double monitor_scale(const rim_monitor *m, size_t outcome) {
  return m->scales != NULL ? (double)rimi_le_f32(m->scales, outcome) : 1.0;
}

/* describe.c: the record of what is found now. */
void rimi_monitor_describe(rim_monitor *m, const rim_verdict *verdict, rim_alarm *alarm);

/* unknown.c: the channels of which the block that ended says nothing, in m->unknown; m->level is
 * overwritten. is_beyond: the block lies beyond what section LEVEL was trained on. is_next: it
 * follows on another. Returns whether something is missing that healthy runs have: a command, a
 * reading, or a run no longer than theirs. O(channels + features * outcomes). */
bool rimi_monitor_find_unknown(rim_monitor *m, bool is_beyond, bool is_next);

/* step.c: no record, nothing found. */
void rimi_monitor_clear_verdict(rim_monitor *m);
/* open.c: the run and all observations; the observations of the regions alone, while the run goes
 * on. The alarms' life is left as it is. */
void rimi_monitor_forget(rim_monitor *m);
void rimi_monitor_forget_regions(rim_monitor *m);

#endif
