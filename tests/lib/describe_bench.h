/* SPDX-License-Identifier: MIT */
/* Of test_describe*.c: a monitor whose channels have found what is put there by hand, and the
 * channel that its record is of. */
#ifndef DESCRIBE_BENCH_H
#define DESCRIBE_BENCH_H

#include "monitor/monitor_private.h"
#include "search/search_private.h"

#include "monitor_bench.h"

enum { BLOCKS = 240, AGREEMENT = O };

static bench b;
static rim_monitor *m;
static double alarm_at; /* score */

static inline int set_up_trained(void **state) {
  (void)state;
  print_message("seed %u\n", SEED);
  calibrate(false);
  return 0;
}

static inline void from(const recipe *r, bool external) {
  memset(&b, 0, sizeof b);
  b.external = external;
  build(&b.blob, r);
  start(&b);
  m = b.monitor;
  m->guard.busy = true; /* as within a step: the sums are made when it ends */
  alarm_at = m->models.threshold.alarm_score;
}

/* Blocks whose residuals are wave(channel, i, byte of feature 0) in units of 0.05, and noise. */
typedef double wave(uint32_t channel, uint32_t i, uint8_t byte);

static inline double nothing(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)channel, (void)i, (void)byte;
  return 0.0;
}

static inline void feed_blocks(wave *of, double noise, uint32_t count) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 1);
  const double zero[CHANNELS] = {0.0};
  for (uint32_t i = 0; i < count; ++i) {
    double residual[CHANNELS];
    const uint8_t feature[REGION] = {(uint8_t)(i * 37u), (uint8_t)(i * 101u)};
    for (uint32_t c = 0; c < CHANNELS; ++c)
      residual[c] = 0.05 * (noise * rimi_rng_normal(&rng) + of(c, i, feature[0]));
    const search_block block = {
        .t_s = i, .feature = feature, .mean = zero, .predicted = zero, .residual = residual};
    assert_int_equal(rimi_search_observe(m->search, &block), RIM_OK);
  }
}

static inline void feed(wave *of, double noise) { feed_blocks(of, noise, BLOCKS); }

/* The channel has found this. */
static inline void plant(uint32_t channel, search_family family, double score, double shift,
                         uint32_t onset) {
  const search_hypothesis h = {.family = (uint8_t)family,
                               .onset = onset,
                               .score = (float)score,
                               .ln_ratio = (float)score,
                               .shift = (float)shift,
                               .sd = 1.0f,
                               .blocks = onset < BLOCKS ? BLOCKS - onset : 10};
  channel_state *state = search_state(m->search, channel);
  state->time = h;
  state->region.score = SEARCH_NONE;
}

/* What the search says of a residual of so many units of 0.05 in this channel. */
static inline double as_shift(uint32_t channel, double units) {
  return 0.05 * units / (double)rimi_noise_channel(&m->models.noise, channel).s;
}

static inline void plant_nothing(void) {
  for (uint32_t c = 0; c < CHANNELS; ++c)
    plant(c, SEARCH_SINCE, 0.0, 0.0, 0);
}

/* The channel that the record of this leading one is of. */
static inline uint16_t named(uint16_t leading, rim_alarm *alarm) {
  const rim_verdict v = {.channel = leading, .level = RIM_LEVEL_ERROR, .t_s = 99.0};
  rimi_monitor_describe(m, &v, alarm);
  assert_int_equal(alarm->channel[0], m->explained_channel % O);
  assert_true(m->has_explained && alarm->channels >= 1 && alarm->t_s == 99.0);
  assert_int_equal(alarm->model_id, m->image.model_id);
  return m->explained_channel;
}

/* Row o of section AGREEMENT: its source, what it is mostly the integral of, and the weight of
 * outcome j. */
static inline void put_row(recipe *r, size_t o, double source, double mostly, size_t j,
                           double weight) {
  uint8_t *at = r->section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * o * (4 + O * (2 + MEANS));
  put_f32(at, source);
  put_f32(at + 8, mostly);
  put_f32(at + 16 + 4 * j, weight);
}

/* Nothing is the integral of anything. */
static inline recipe without_integrals(void) {
  recipe r = calibrated[0];
  for (size_t o = 0; o < O; ++o)
    put_row(&r, o, AGREEMENT_RESIDUALS, -1.0, 0, 0.0);
  return r;
}

/* Of a channel in section NOISE: 0 whether it is active, NOISE_CHANNEL_WORDS + FIELDS + i the part
 * of raw field i in the run's own effect. */
static inline void put_noise_number(recipe *r, size_t channel, size_t which, double value) {
  const size_t numbers = NOISE_CHANNEL_WORDS + FIELDS * (1 + RAW) + FAMILIES;
  put_f32(r->section[RIM_SECTION_NOISE].byte + 4 * (NOISE_HEADER_WORDS + channel * numbers + which),
          value);
}

/* A standing alarm of this outcome. */
static inline void stand(uint16_t outcome) {
  const rim_alarm a = {
      .level = RIM_LEVEL_ERROR, .channels = 1, .channel = {outcome}, .kind = RIM_KIND_SHIFT};
  rimi_alarm_life_row(&m->life, 1.0);
  for (int k = 0; k < 4; ++k)
    rimi_alarm_life_step(&m->life, RIM_DETECTOR_RIM, 1.0 + k, &a);
  assert_true(rim_monitor_standing(m, RIM_DETECTOR_RIM) != NULL);
}

#endif
