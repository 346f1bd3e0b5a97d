/* SPDX-License-Identifier: MIT */
/* The selection of rows with predictions, the searches over a finished set, the detector of
 * interference, the corrected model and the bound of work keep their bits (bits.h). */
#include <math.h>
#include <string.h>

#include "bits.h"

#include "base/rng.h"
#include "batch/dmaps.h"
#include "batch/faro.h"
#include "batch/select_batch.h"
#include "batch/stats.h"
#include "image/correct.h"
#include "interference/detector.h"
#include "interference_sample.h"
#include "monitor/work.h"
#include "search/select.h"

#define SEED 505u

static void take_region(uint64_t *digest, const rim_unit_region *region) {
  const rim_region *u = &region->unit;
  const size_t dims = u->dims;
  take_bits(digest, dims);
  for (size_t i = 0; i < dims; ++i)
    take_bits(digest, u->feature[i]);
  take_reals(digest, u->center, dims);
  take_reals(digest, u->lower, dims);
  take_reals(digest, u->upper, dims);
  take_reals(digest, u->inverse_shape, dims * dims);
}

/* ---- selection ---- */

enum { F = 6, C = 3, RING = 96, SELECT_BYTES = RIM_SELECT_SIZE(F, C, 512, 32, 32, 8) };

/* An ellipse of features 1 and 4 shifts channel 1, an interval of feature 2 channel 2; feature 5
 * follows feature 4. The kind says of what else there is. */
static void observation(rim_rng *rng, uint32_t i, double *u, double *r) {
  for (size_t f = 0; f < F; ++f)
    u[f] = rimi_rng_uniform(rng);
  u[5] = 0.5 * (u[4] + u[5]);
  if (i % 50 == 7)
    u[i % F] = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 1.0 : -0.5; /* at and behind an edge */
  const double a = (u[1] - 0.35) / 0.25, b = (u[4] - 0.6) / 0.2;
  for (size_t c = 0; c < C; ++c)
    r[c] = rimi_rng_normal(rng);
  r[1] += a * a + b * b + 0.8 * a * b < 1.0 ? 2.5 : 0.0;
  r[2] -= u[2] > 0.3 && u[2] < 0.55 && i > 200 ? 1.5 : 0.0;
}

static void take_selection(uint64_t *digest, const rim_select *e) {
  const float *scores = rimi_select_channel_scores(e);
  for (uint16_t c = 0; c < C; ++c) {
    rim_candidate best;
    take_real(digest, (double)scores[c]);
    if (!rimi_select_best_of_channel(e, c, &best))
      continue;
    take_region(digest, &best.region);
    const double of_best[5] = {best.n, best.s, best.shift, best.ln_anom, best.score};
    take_reals(digest, of_best, 5);
    take_bits(digest, (uint64_t)best.since << 8 | best.dims);
    for (int k = 0; k < 6; ++k) {
      double u[F];
      for (size_t f = 0; f < F; ++f)
        u[f] = 0.1 + 0.15 * k + 0.01 * (double)f;
      take_real(digest, rimi_select_membership(e, c, u));
    }
  }
  const rim_select_effort effort = rimi_select_get_effort(e);
  take_bits(digest, (uint64_t)effort.units << 32 | effort.scans);
  take_bits(digest, (uint64_t)effort.edges << 32 | effort.moves);
  take_bits(digest, effort.backfills);
}

static uint64_t selection(rim_select_config config, uint32_t rows) {
  static _Alignas(8) uint8_t memory[SELECT_BYTES];
  const float a[C] = {1.0f, 1.25f, 0.75f}, b[C] = {0.0f, 0.01f, 0.02f};
  const float scale[C] = {1.0f, 1.1f, 0.9f}, offset[C] = {0.5f, 0.0f, -0.25f};
  rim_select *e;
  rim_rng rng;
  uint64_t digest = BITS_START;
  config.features = F;
  config.channels = C;
  config.seed = SEED;
  config.a = a;
  config.b = b;
  assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &config), RIM_OK);
  assert_int_equal(rimi_select_set_channel_scale(e, scale, offset), RIM_OK);
  rimi_rng_seed(&rng, SEED, rows);
  for (uint32_t i = 0; i < rows; ++i) {
    double u[F], r[C];
    observation(&rng, i, u, r);
    assert_int_equal(rimi_select_observe(e, u, r), RIM_OK);
    rimi_select_work(e, i % 7 == 0 ? 2 : 1);
    if (i % 40 == 39 || i < 12)
      take_selection(&digest, e);
  }
  return digest;
}

static void selections_keep_their_bits(void **state) {
  (void)state;
  const rim_select_config
      full = {.ring = RING, .bins = 16, .grid = 16, .pairs = 4},
      small = {.ring = RING, .bins = 8, .grid = 8, .pairs = 3, .small = true},
      lean = {.ring = 64, .bins = 32, .grid = 32, .pairs = 8, .scans = 3, .edges = 9, .moves = 20};
  bits_are(selection(full, 600), UINT64_C(0xb00833225aa25e03));
  bits_are(selection(small, 400), UINT64_C(0xed3dee14b6ba4274));
  bits_are(selection(lean, 400), UINT64_C(0x3b87253392dde3c0));
}

/* ---- a finished set ---- */

enum { N = 260, D = 5, O = 2, NODES = 16 };

static double u[N * D], r[N * O];

/* Two regions that touch; some observations at the edges of their range. */
static void make_set(uint64_t stream, uint32_t outcomes) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, stream);
  for (uint32_t i = 0; i < N; ++i) {
    double *x = u + i * D;
    for (uint32_t f = 0; f < D; ++f)
      x[f] = i % 31 == 5 && f == i % D ? (double)(i % 2) : rimi_rng_uniform(&rng);
    const double a = (x[0] - 0.3) / 0.25, b = (x[2] - 0.4) / 0.3, c = (x[3] - 0.7) / 0.2;
    for (uint32_t o = 0; o < outcomes; ++o)
      r[i * outcomes + o] = rimi_rng_normal(&rng) + (a * a + b * b < 1.0 ? 2.0 : 0.0) -
                            (c * c + 0.25 * a * a < 1.0 && o == 0 ? 1.8 : 0.0);
  }
}

static uint64_t batch(rim_heuristic heuristic, uint32_t outcomes, uint8_t dims) {
  static uint64_t work[RIM_BATCH_SIZE(N, D, NODES) / 8 + 8];
  uint64_t digest = BITS_START;
  make_set(outcomes, outcomes);
  const rim_batch_data data = {N, D, (uint16_t)outcomes, u, r};
  const rim_batch_config c = {
      .heuristic = heuristic, .nodes = NODES, .max_dims = dims, .bins = 12, .seed = SEED};
  rim_batch_result result;
  assert_int_equal(rimi_select_batch(&c, &data, work, sizeof work, &result), RIM_OK);
  take_region(&digest, &result.region);
  take_reals(&digest, result.ellipsoid.center, result.dims);
  take_reals(&digest, result.ellipsoid.factor, result.dims * (result.dims + 1u) / 2u);
  take_real(&digest, result.ln_anom);
  take_bits(&digest, (uint64_t)result.inside << 32 | result.evaluations);
  take_bits(&digest, (uint64_t)result.nodes << 8 | result.dims);
  return digest;
}

static void searches_of_a_set_keep_their_bits(void **state) {
  (void)state;
  uint64_t digest = BITS_START;
  for (int h = RIM_HEURISTIC_H3; h <= RIM_HEURISTIC_NONE; ++h)
    for (uint32_t outcomes = 1; outcomes <= O; ++outcomes)
      for (uint8_t dims = 1; dims <= 3; ++dims)
        take_bits(&digest, batch((rim_heuristic)h, outcomes, dims));
  bits_are(digest, UINT64_C(0x88d949537a8bac4c));
}

static void regions_of_a_set_keep_their_bits(void **state) {
  (void)state;
  static uint64_t work[RIM_DMAPS_SIZE(N, D, O, NODES) / 8 + 8];
  static uint8_t given[N], skip[N];
  uint64_t digest = BITS_START;
  for (uint32_t i = 0; i < N; ++i)
    skip[i] = i % 17 == 3;
  for (uint32_t outcomes = 1; outcomes <= O; ++outcomes) {
    for (int kind = 0; kind < 4; ++kind) {
      make_set(10 + outcomes, outcomes);
      const rim_batch_data data = {N, D, (uint16_t)outcomes, u, r};
      const rim_dmaps_config c = {.lambda = kind == 0   ? 14.0
                                            : kind == 1 ? 3.0
                                                        : 6.0,
                                  .regions = kind == 1 ? 8 : 4,
                                  .border = kind == 2 ? 0.5 : 0.0,
                                  .search = {.nodes = NODES, .seed = SEED}};
      rim_dmaps_result result;
      const uint8_t *left_out = kind == 3 ? skip : NULL;
      assert_int_equal(rimi_dmaps_find(&c, &data, left_out, work, sizeof work, &result), RIM_OK);
      take_bits(&digest, result.count);
      for (uint8_t k = 0; k < result.count; ++k) {
        take_region(&digest, &result.region[k].region);
        take_real(&digest, result.region[k].ln_anom);
        take_real(&digest, result.region[k].price);
        take_bits(&digest, result.region[k].count);
      }
      take_real(&digest, result.value);
      take_bits(&digest, (uint64_t)result.searches << 32 | result.evaluations);
      assert_int_equal(rimi_dmaps_assign(&result, &data, left_out, given), RIM_OK);
      for (uint32_t i = 0; i < N; ++i)
        take_bits(&digest, given[i]);
      double shift[O];
      assert_int_equal(rimi_dmaps_shift(&data, given, 1, shift), RIM_OK);
      take_reals(&digest, shift, outcomes);
    }
  }
  bits_are(digest, UINT64_C(0x7f4e6e0f4a828424));
}

static double sum_inside(const rim_ellipsoid *e, void *context) {
  const uint32_t count = *(const uint32_t *)context;
  rim_stats sum = {0};
  for (uint32_t i = 0; i < count; ++i)
    if (rimi_ellipsoid_contains(e, u + i * D))
      (void)rimi_stats_add(&sum, r[i], 1.0);
  return rimi_stats_ln_anom(&sum);
}

static void candidates_keep_their_bits(void **state) {
  (void)state;
  uint64_t digest = BITS_START;
  make_set(30, 1);
  for (uint8_t dims = 1; dims <= 3; ++dims) {
    const rim_faro_config c = {
        .dims = dims, .candidates = 4, .seed = SEED, .cem = {.iterations = 2, .smoothing = 0.1}};
    rim_faro faro;
    assert_int_equal(rimi_faro_init(&faro, &c), RIM_OK);
    for (uint32_t i = 0; i < 60; ++i) {
      const uint32_t seen = i + 1;
      bool found;
      assert_int_equal(
          rimi_faro_step(&faro, u + i * D, sum_inside, (void *)(uintptr_t)&seen, 8.0, &found),
          RIM_OK);
      take_bits(&digest, faro.count * 2u + found);
      for (uint32_t k = 0; k < faro.count; ++k) {
        take_real(&digest, faro.value[k]);
        take_reals(&digest, faro.candidate[k].center, dims);
        take_reals(&digest, faro.candidate[k].factor, dims * (dims + 1u) / 2u);
      }
    }
  }
  bits_are(digest, UINT64_C(0x009fe51e150e6249));
}

/* ---- interference ---- */

/* Driven, blocked, pushed, let alone; gaps, missing commands and bad rows between. */
static void interference_keeps_its_bits(void **state) {
  (void)state;
  uint64_t digest = BITS_START;
  for (int spread = 0; spread < 2; ++spread) {
    rim_interference_model m = sample_interference();
    m.limit_spread = 0.3 * spread;
    static rim_interference s;
    rim_rng rng;
    double speed = 0.0, t_s = 0.0;
    assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
    rimi_rng_seed(&rng, SEED, 40u + (unsigned)spread);
    for (uint32_t i = 0; i < 900; ++i) {
      const double command = i / 60 % 5 == 0 ? 0.0 : i / 60 % 5 == 4 ? -0.6 : 0.3 * (i / 60 % 5);
      const double target = i > 300 && i < 340 ? 0.1 * command : i > 600 && i < 640 ? 1.0 : command;
      t_s += i == 450 ? 3.0 : i % 100 == 50 ? 0.12 : 0.05;
      speed += rimi_clamp(target - speed, -0.1, 0.06);
      const double measured = speed + 0.03 * rimi_rng_normal(&rng);
      const double bad = i % 211 == 100 ? (double)INFINITY : measured;
      rim_interference_verdict v;
      const double said = i % 97 == 5 ? (double)NAN : command;
      assert_int_equal(rimi_interference_step(&s, t_s, said, bad, &v), RIM_OK);
      if (!v.valid)
        continue;
      take_reals(&digest, v.score, sizeof v.score / sizeof v.score[0]);
      take_real(&digest, v.one_step_mps);
      rim_alarm a;
      memset(&a, 0, sizeof a);
      take_bits(&digest, rimi_interference_alarm(&v, 7, 0, &a));
      take_real(&digest, a.since_s);
      take_real(&digest, a.shift[0]);
      take_real(&digest, a.ln_anom);
      take_bits(&digest, a.kind);
    }
    take_bits(&digest, s.health.rows);
  }
  bits_are(digest, UINT64_C(0x0d08cb725ecbc51c));
}

/* ---- the bound of work ---- */

static void the_bound_of_work_keeps_its_bits(void **state) {
  (void)state;
  uint64_t digest = BITS_START;
  const rim_work_counts from = {.features = 29,
                                .outcomes = 25,
                                .channels = 100,
                                .region_features = 16,
                                .ring = 512,
                                .budget = 4,
                                .block_rows = 10,
                                .bins = 16,
                                .grid = 32,
                                .pairs = 6,
                                .scans = 16,
                                .edges = 48,
                                .moves = 64,
                                .inputs = 9,
                                .times = 5,
                                .terms = 120,
                                .means = 3,
                                .fields = 4,
                                .integrands = 12,
                                .angles = 2,
                                .prototypes = 16,
                                .top = 4,
                                .memory_bytes = 400000,
                                .image_bytes = 200000};
  for (unsigned flags = 0; flags < 64; ++flags) {
    rim_work_counts n = from;
    n.ring = (flags & 32u) != 0 ? 16 : 512; /* a pair's cells cost more than a short ring */
    n.trained = (flags & 1u) != 0;
    n.external = (flags & 2u) != 0;
    n.corrected = (flags & 4u) != 0;
    n.watched = (flags & 8u) != 0;
    n.small = (flags & 16u) != 0;
    rim_work w;
    rimi_work_bound(&n, &w);
    const uint32_t all[] = {w.row, w.search, w.block, w.judge, w.guard, w.step, w.halving};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
      take_bits(&digest, all[i]);
  }
  bits_are(digest, UINT64_C(0x17768e8a94d34cf2));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(selections_keep_their_bits),
      cmocka_unit_test(searches_of_a_set_keep_their_bits),
      cmocka_unit_test(regions_of_a_set_keep_their_bits),
      cmocka_unit_test(candidates_keep_their_bits),
      cmocka_unit_test(interference_keeps_its_bits),
      cmocka_unit_test(the_bound_of_work_keeps_its_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
