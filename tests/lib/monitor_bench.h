/* SPDX-License-Identifier: MIT */
/* Of test_monitor*.c and test_interference_watch.c: flight images written by hand, and the vehicle
 * that is watched through them.
 *
 * Two images. EXTERNAL brings its own predictions, and judges every row by itself. TRAINED has the
 * vehicle's true behaviour, agreement without weights, and noise with an offset of the run. Their
 * thresholds are the largest score of runs of the same vehicle without a fault. */
#ifndef MONITOR_BENCH_H
#define MONITOR_BENCH_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/real.h"
#include "base/rng.h"
#include "image/noise.h"
#include "image/nominal.h"
#include "image/quadratic.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/monitor.h"
#include "section_bytes.h"

/* More than two: of TRAINED alone, each with a feature of its own after the first four. */
#ifndef BENCH_OUTCOMES
#define BENCH_OUTCOMES 2
#endif
#ifndef BENCH_FEATURES
#define BENCH_FEATURES (2 + BENCH_OUTCOMES) /* of fewer the last outcomes have one together */
#endif
#ifndef BENCH_IMAGE
#define BENCH_IMAGE 16384 /* bytes, at most */
#endif

enum { O = BENCH_OUTCOMES, D = BENCH_FEATURES, BINS = 16, GRID = 16, PAIRS = 2, REGION = 2 };
enum { BLOCK = 4, CUTS = 23 };
enum { EXTERNAL_RING = 64, TRAINED_RING = 256, CHANNELS = RIM_MONITOR_KINDS * O };
enum { NULL_RUNS = 19, ROWS = 1200, SECTIONS = 23 };
enum { INPUTS = 1, TIMES = 2, TERMS = 1, MEANS = 1, RAW = 4 + MEANS, FIELDS = 1, FAMILIES = 9 };
enum {
  EXTERNAL_SIZE = RIM_MONITOR_SIZE(D, O, REGION, EXTERNAL_RING, BINS, GRID, PAIRS),
  TRAINED_SIZE =
      RIM_MONITOR_TRAINED_SIZE(D, O, REGION, TRAINED_RING, INPUTS *TIMES, TERMS, FIELDS, MEANS)
};
#define PERIOD_S 0.25
#define SEED 2718u

/* ---- a flight image, written by hand ---- */

typedef struct recipe {
  bytes section[SECTIONS]; /* by rim_section; size 0: absent */
} recipe;

typedef struct image {
  _Alignas(8) uint8_t byte[BENCH_IMAGE];
  size_t size;
} image;

static void build(image *m, const recipe *r) {
  memset(m, 0, sizeof *m);
  uint32_t sections = 0;
  for (size_t id = 0; id < SECTIONS; ++id)
    sections += r->section[id].size > 0;
  size_t at = 64u + 16u * sections, entry = 64;
  for (uint32_t id = 0; id < SECTIONS; ++id) {
    const bytes *b = &r->section[id];
    if (b->size == 0)
      continue;
    put_u32(m->byte + entry, id);
    put_u32(m->byte + entry + 4, (uint32_t)at);
    put_u32(m->byte + entry + 8, (uint32_t)b->size);
    entry += 16;
    memcpy(m->byte + at, b->byte, b->size);
    at = (at + b->size + 7u) / 8u * 8u;
    assert_true(at < sizeof m->byte);
  }
  m->size = at;
  const uint32_t crc = rimi_crc32(0, m->byte + 64, at - 64);
  memcpy(m->byte, RIM_IMAGE_MAGIC, 8);
  const uint32_t words[6] = {
      RIM_IMAGE_ENDIAN_TAG, RIM_IMAGE_MAJOR, (uint32_t)at, crc, sections, crc};
  for (size_t i = 0; i < 6; ++i)
    put_u32(m->byte + 8 + 4 * i, words[i]);
  put_u32(m->byte + 32, rimi_crc32(0, m->byte, 64));
}

static inline void set_word(recipe *r, rim_config_word word, uint32_t value) {
  put_u32(r->section[RIM_SECTION_CONFIG].byte + 4 * word, value);
}

/* Alarm at the largest of the maxima, warning at three quarters of it. */
static void put_threshold(bytes *b, uint32_t channels, const double *maxima, uint32_t runs) {
  b->size = 0;
  double largest = 0.0;
  for (uint32_t i = 0; i < runs; ++i)
    largest = rimi_max(largest, maxima[i]);
  const uint32_t counts[4] = {channels, runs > 0 ? 1 : 0, 0, runs > 0 ? 1 : 0};
  for (size_t i = 0; i < 4; ++i)
    u32(b, counts[i]);
  f32(b, runs > 0 ? 1.001 * largest : 1e30);
  f32(b, runs > 0 ? 0.75 * largest : 1e30);
  f32(b, runs > 0 ? 1.0 / (runs + 1.0) : 1.0);
  f32(b, 0.0);
  if (runs > 0)
    f32(b, largest);
  for (uint32_t c = 0; c < channels; ++c)
    f32(b, 0.0);
  for (uint32_t c = 0; c < channels; ++c)
    f32(b, 1.0);
}

static void put_config(bytes *b, uint32_t ring, uint32_t block_rows, uint32_t external) {
  uint32_t w[RIM_CONFIG_WORDS] = {0};
  w[RIM_CONFIG_FEATURES] = D;
  w[RIM_CONFIG_OUTCOMES] = O;
  w[RIM_CONFIG_BLOCK_ROWS] = block_rows;
  w[RIM_CONFIG_EXTERNAL] = external;
  w[RIM_CONFIG_PERIOD_US] = (uint32_t)(1e6 * PERIOD_S);
  w[RIM_CONFIG_STALE_MS] = 2000;
  w[RIM_CONFIG_REGION_FEATURES] = REGION;
  w[RIM_CONFIG_RING] = ring;
  w[RIM_CONFIG_BINS] = BINS;
  w[RIM_CONFIG_GRID] = GRID;
  w[RIM_CONFIG_PAIRS] = PAIRS;
  w[RIM_CONFIG_PERSISTENCE] = 3;
  w[RIM_CONFIG_INHIBIT_MS] = 10000;
  w[RIM_CONFIG_SEED] = 5;
  for (size_t i = 0; i < RIM_CONFIG_WORDS; ++i)
    u32(b, w[i]);
}

static void put_region(recipe *r, unsigned first, unsigned second) {
  const unsigned entry[4] = {first, 0xffff, second, 0xffff};
  for (size_t i = 0; i < 4; ++i)
    u16(&r->section[RIM_SECTION_REGION], entry[i]);
}

static void external_recipe(recipe *r) {
  memset(r, 0, sizeof *r);
  put_config(&r->section[RIM_SECTION_CONFIG], EXTERNAL_RING, 1, 1);
  const double range[2 * D] = {-1, -10, 100, 0, 1, 10, 300, 1};
  for (size_t i = 0; i < 2 * D; ++i)
    f32(&r->section[RIM_SECTION_FEATURES], range[i]);
  put_region(r, 2, 0);
  for (size_t i = 0; i < D; ++i)
    u8(&r->section[RIM_SECTION_COMMANDS], i == 0);
  for (const char *c = "a\nb\nc\nd\ne\n"; *c; ++c)
    u8(&r->section[RIM_SECTION_NAMES], (uint8_t)*c);
  put_threshold(&r->section[RIM_SECTION_THRESHOLD], O, NULL, 0);
}

/* One input, command 0, as it is (time constant of a row) and over 10 rows; one term and one mean,
 * the command itself. */
static void put_basis(bytes *b) {
  const uint32_t header[8] = {1, INPUTS, TIMES, TERMS, MEANS, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  u16(b, 0);
  u16(b, 0xffff);
  f32(b, 1.0);
  f32(b, 0.1);
  for (size_t i = 0; i < 4; ++i)
    u16(b, 0); /* BASIS_MEAN of filter 0 */
  f32(b, 0.0);
  f32(b, 1.0);
  u16(b, 0);
  u16(b, 0);
  f32(b, 0.0);
  f32(b, 1.0);
  for (size_t o = 0; o < O; ++o)
    f32(b, 0.0);
}

/* Outcome 0 is twice the command, outcome 1 about 0; second differences have six times the variance
 * of the noise, .01, and the logarithm of four such squares is .35 below that of their mean. */
static void put_behaviour(bytes *b) {
  const uint32_t header[4] = {1, TERMS, 2 * O, 0};
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < 2 * O; ++i)
    u32(b, 0);
  for (size_t i = 0; i < 2 * O; ++i)
    f32(b, i < O ? 0.0 : -2.813 - 0.35);
  for (size_t i = 0; i < 2 * O; ++i)
    f32(b, i == 0 ? 2.0 : 0.0);
}

static void put_agreement(bytes *b) {
  const uint32_t header[4] = {3, O, MEANS, 0};
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < O; ++i)
    f32(b, 20.0);
  for (size_t i = 0; i < O * (4 + O * (2 + MEANS)); ++i)
    f32(b, 0.0);
}

/* An offset of the run of a quarter of a block's noise, nothing else; sd and
 * is_active per channel. */
static void put_noise_of(bytes *b, const double *sd, const bool *is_active) {
  const uint32_t header[4] = {NOISE_LAYOUT, CHANNELS, RAW, FIELDS};
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  const double rest[5] = {300.0, 20.0, 2000.0, 0.0, 0.0};
  for (size_t i = 0; i < 5; ++i)
    f32(b, rest[i]);
  for (size_t c = 0; c < CHANNELS; ++c) {
    const double scalars[NOISE_CHANNEL_WORDS] = {is_active[c], FIELDS, 0, sd[c], 0, 1};
    for (size_t i = 0; i < NOISE_CHANNEL_WORDS; ++i)
      f32(b, scalars[i]);
    f32(b, 16.0);
    for (size_t i = 0; i < RAW; ++i)
      f32(b, i == 0 ? 1.0 : 0.0);
    for (size_t i = 0; i < FAMILIES; ++i)
      f32(b, 1.0);
  }
}

static void put_noise(bytes *b) {
  double sd[CHANNELS];
  bool is_active[CHANNELS];
  for (size_t c = 0; c < CHANNELS; ++c) {
    sd[c] = c < 2 * O ? 0.05 : c < 3 * O ? 0.9 : 0.1;
    is_active[c] = true;
  }
  put_noise_of(b, sd, is_active);
}

/* A model of one outcome: an eighth, and half of the product of its block's first input with that
 * of the block before. */
static inline void put_quadratic(bytes *s, uint32_t inputs, uint32_t outcome,
                                 rim_quadratic_use use) {
  const uint32_t header[4] = {RIM_QUADRATIC_LAYOUT, inputs, 1, 2 * inputs};
  for (size_t i = 0; i < 4; ++i)
    u32(s, header[i]);
  for (uint32_t i = 0; i < 2 * inputs; ++i)
    f32(s, i < inputs ? 0.0 : 1.0);
  u16(s, outcome);
  u16(s, use);
  for (uint32_t i = 0; i < RIM_QUADRATIC_TERMS(inputs, 2 * inputs); ++i)
    f32(s, i == 0 ? 0.125 : i == 1 + 2 * inputs + inputs ? 0.5 : 0.0);
}

static inline unsigned sensor(size_t o) {
  return (unsigned)(o < 2 ? 1 + o : 2 + o < D ? 2 + o : D - 1);
}

/* Command 0 drives sensor 1, s1 = 2 u; sensor 2 stays about 0; both have noise of 0.1. Feature 3
 * has nothing to do with either. */
static void trained_recipe(recipe *r) {
  memset(r, 0, sizeof *r);
  put_config(&r->section[RIM_SECTION_CONFIG], TRAINED_RING, BLOCK, 0);
  set_word(r, RIM_CONFIG_BUDGET, 4);
  const double bound[2][4] = {{-1, -3, -0.5, 0}, {1, 3, 0.5, 1}}; /* more sensors: as sensor 2 */
  for (size_t i = 0; i < 2 * D; ++i)
    f32(&r->section[RIM_SECTION_FEATURES], bound[i / D][i % D < 4 ? i % D : 2]);
  put_region(r, 0, 3);
  for (size_t o = 0; o < O; ++o)
    u16(&r->section[RIM_SECTION_OUTCOMES], sensor(o));
  for (size_t i = 0; i < D; ++i)
    u8(&r->section[RIM_SECTION_COMMANDS], i == 0);
  put_basis(&r->section[RIM_SECTION_BASIS]);
  put_behaviour(&r->section[RIM_SECTION_BEHAVIOUR]);
  put_agreement(&r->section[RIM_SECTION_AGREEMENT]);
  put_noise(&r->section[RIM_SECTION_NOISE]);
  for (size_t i = 0; i < REGION * CUTS; ++i)
    u8(&r->section[RIM_SECTION_CUTS], (unsigned)((i % CUTS + 1) * 256 / 24));
  put_threshold(&r->section[RIM_SECTION_THRESHOLD], CHANNELS, NULL, 0);
}

/* ---- the vehicle ---- */

typedef struct row {
  double t_s, context[D], outcome[O], mean[O], sd[O];
  rim_observation view;
} row;

static double triangle(double phase) { return rimi_abs(2.0 * (phase - rimi_floor(phase)) - 1.0); }

/* Row `t` of a run. The command is a triangle of its own length; where it is above 0.4 the first
 * sensor (trained), or where feature 2 is between 150 and 200 the second outcome (external), is
 * shifted. */
static void make_row(row *r, bool external, uint32_t run, uint32_t t, double shift) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED + run, t);
  const double command = 2.0 * triangle((double)t / (241.0 + (double)(run % 7u))) - 1.0;
  memset(r, 0, sizeof *r);
  r->t_s = 10.0 + PERIOD_S * (double)t;
  r->context[0] = command;
  r->context[3] = triangle((double)t / 97.0);
  if (external) {
    r->context[1] = 3.0 * rimi_rng_normal(&rng);
    r->context[2] = 100.0 + 200.0 * rimi_rng_uniform(&rng);
    for (size_t o = 0; o < O; ++o) {
      r->mean[o] = command + (double)o;
      r->sd[o] = 0.5;
      r->outcome[o] = r->mean[o] + r->sd[o] * rimi_rng_normal(&rng);
    }
    if (r->context[2] > 150.0 && r->context[2] < 200.0)
      r->outcome[1] += shift;
  } else {
    r->context[1] = 2.0 * command + 0.1 * rimi_rng_normal(&rng) + (command > 0.4 ? shift : 0.0);
    for (size_t o = 1; o < O; ++o)
      r->context[sensor(o)] = 0.1 * rimi_rng_normal(&rng);
  }
  const rim_observation view = {r->t_s, r->context, r->outcome, r->mean, r->sd};
  r->view = view;
}

typedef struct bench {
  image blob;
  _Alignas(8) uint8_t memory[EXTERNAL_SIZE + TRAINED_SIZE];
  rim_monitor *monitor;
  bool external;
} bench;

/* Bytes that the image of this kind asks for. */
static inline size_t size_of(bool external) {
  recipe r;
  image m;
  size_t size = 0;
  if (external)
    external_recipe(&r);
  else
    trained_recipe(&r);
  build(&m, &r);
  assert_int_equal(rim_monitor_size(m.byte, m.size, &size), RIM_OK);
  assert_true(size <= (external ? EXTERNAL_SIZE : TRAINED_SIZE));
  return size;
}

static void start(bench *b) {
  assert_int_equal(
      rim_monitor_init(&b->monitor, b->memory, sizeof b->memory, b->blob.byte, b->blob.size),
      RIM_OK);
}

/* What a source sends of a row with predictions: value[D + 3 O]. */
static inline void put_values(const row *r, double *value) {
  memcpy(value, r->context, sizeof r->context);
  memcpy(value + D, r->outcome, sizeof r->outcome);
  memcpy(value + D + O, r->mean, sizeof r->mean);
  memcpy(value + D + 2 * O, r->sd, sizeof r->sd);
}

static rim_verdict step(const bench *b, uint32_t run, uint32_t t, double shift) {
  row r;
  rim_verdict v;
  make_row(&r, b->external, run, t, shift);
  assert_int_equal(rim_monitor_step(b->monitor, &r.view, &v), RIM_OK);
  return v;
}

static inline uint64_t run_digest(const bench *b, uint32_t run, uint32_t from, uint32_t to,
                                  double shift) {
  uint64_t digest = RIM_DIGEST_START;
  for (uint32_t t = from; t < to; ++t) {
    const rim_verdict v = step(b, run, t, shift);
    digest = rim_verdict_digest(digest, &v);
  }
  return digest;
}

/* The recipes with thresholds from null runs, made once. */
static recipe calibrated[2];

static void calibrate(bool external) {
  recipe *r = &calibrated[external];
  bench b;
  b.external = external;
  if (external)
    external_recipe(r);
  else
    trained_recipe(r);
  build(&b.blob, r);
  double maxima[NULL_RUNS] = {0};
  for (uint32_t run = 0; run < NULL_RUNS; ++run) {
    start(&b);
    for (uint32_t t = 0; t < ROWS; ++t) {
      const rim_verdict v = step(&b, 100 + run, t, 0.0);
      if (v.blocks > 0)
        maxima[run] = rimi_max(maxima[run], v.score);
    }
  }
  put_threshold(&r->section[RIM_SECTION_THRESHOLD], external ? O : CHANNELS, maxima, NULL_RUNS);
}

static inline int set_up(void **state) {
  (void)state;
  print_message("seed %u\n", SEED);
  calibrate(false);
  calibrate(true);
  return 0;
}

/* Section LEVEL: one prototype at 0, of reach 1; each outcome is an eighth. */
static inline void put_level(bytes *s, uint32_t inputs, uint32_t outputs) {
  const uint32_t header[8] = {RIM_NOMINAL_LAYOUT, inputs, outputs, 1, 1, 0, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(s, header[i]);
  for (uint32_t i = 0; i < 3 * inputs; ++i)
    f32(s, i < inputs ? 0.0 : 1.0);
  const double head[4] = {1.0, 1.0, 0.0, 0.0};
  for (size_t i = 0; i < 4; ++i)
    f32(s, head[i]);
  for (uint32_t i = 0; i < inputs; ++i)
    f32(s, 0.0);
  for (uint32_t o = 0; o < 2 * outputs; ++o)
    f32(s, o < outputs ? 1.0 : 0.125); /* each outcome is an eighth */
}

static inline void make_bench_of(bench *b, const recipe *r, bool external) {
  memset(b, 0, sizeof *b);
  b->external = external;
  build(&b->blob, r);
  start(b);
}

static inline void make_bench(bench *b, bool external) {
  make_bench_of(b, &calibrated[external], external);
}

/* How a monitor of this image begins. */
static inline rim_status status_of_image(const recipe *r) {
  static _Alignas(8) uint8_t memory[EXTERNAL_SIZE + TRAINED_SIZE];
  static image blob;
  rim_monitor *m = NULL;
  build(&blob, r);
  const rim_status status = rim_monitor_init(&m, memory, sizeof memory, blob.byte, blob.size);
  assert_int_equal(status == RIM_OK, m != NULL);
  return status;
}

#endif
