/* SPDX-License-Identifier: MIT */
/* The online search from outside: finds what was planted, among features and channels; goes on
 * after a copy; bounded work; refuses bad input and short memory. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/ellipsoid.h"
#include "base/rng.h"
#include "search/select.h"

#define SEED 47u
enum { D = 20, C = 3, N = 300, X = 4, Y = 13 };
#define BYTES RIM_SELECT_SIZE(D, C, 512, 16, 32, 6)

static uint64_t memory[BYTES / 8 + 8];
static double u[N][D], r[N][C];
static bool anomalous[N];

typedef enum planted { NOTHING, EVERYWHERE, INTERVAL, ELLIPSE } planted;

static void make(uint64_t stream, planted what, int channel) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, stream);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i][f] = rimi_rng_uniform(&rng);
    const double x = u[i][X] - 0.35;
    const double y = u[i][Y] - 0.6;
    anomalous[i] = what == EVERYWHERE || (what == INTERVAL && fabs(x) < 0.15) ||
                   (what == ELLIPSE && x * x / 0.09 + (y - 0.5 * x) * (y - 0.5 * x) / 0.02 < 1.0);
    for (int c = 0; c < C; ++c) {
      r[i][c] = rimi_rng_normal(&rng) + (c == channel && anomalous[i] ? -2.0 : 0.0);
    }
  }
}

static rim_select *started(uint64_t seed) {
  const rim_select_config config = {.features = D, .channels = C, .seed = seed};
  rim_select *engine = NULL;
  assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
  return engine;
}

static void feed(rim_select *engine, int from, int to) {
  for (int i = from; i < to; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], r[i]), RIM_OK);
    rimi_select_work(engine, 1);
  }
}

static uint64_t digest(const rim_select *engine) {
  rim_candidate best;
  uint64_t h = RIM_DIGEST_START;
  if (!rimi_select_best(engine, &best))
    return h;
  h = rimi_digest_f64(h, best.ln_anom);
  h = rimi_digest_f64(h, best.n + 1000.0 * best.channel + 1e6 * best.dims);
  for (int k = 0; k < best.dims; ++k)
    h = rimi_digest_f64(h, best.region.unit.center[k]);
  for (int i = 0; i < N; ++i)
    h = rimi_digest_f64(h, rimi_select_membership(engine, best.channel, u[i]));
  return h;
}

/* A reset leaves nothing of what was found, and the small profile takes less, by so much. */
static void a_reset_is_a_start(void **state) {
  (void)state;
  make(3, ELLIPSE, 1);
  rim_select *engine = started(7);
  feed(engine, 0, 100);
  const uint64_t first = digest(engine);
  rimi_select_reset(engine);
  rim_candidate best;
  assert_false(rimi_select_best(engine, &best));
  for (uint16_t c = 0; c < C; ++c)
    assert_true(rimi_select_channel_scores(engine)[c] == 0.0f);
  make(4, NOTHING, 0); /* what was found before is not found in what comes after */
  feed(engine, 0, 20);
  const uint64_t after = digest(engine);
  rim_select *fresh = started(7);
  feed(fresh, 0, 20);
  assert_true(digest(fresh) == after && after != first);
}

static void the_small_profile_is_small(void **state) {
  (void)state;
  rim_select_config c = {.features = D, .channels = C, .ring = 512, .bins = 16, .grid = 32};
  size_t size[2][2];
  for (uint16_t pairs = 0; pairs < 2; ++pairs) {
    for (int small = 0; small < 2; ++small) {
      c.pairs = (uint16_t)(3 + pairs);
      c.small = small != 0;
      assert_int_equal(rimi_select_size(&c, &size[pairs][small]), RIM_OK);
    }
  }
  assert_true(size[0][1] < size[0][0] && size[1][1] < size[1][0]);
  assert_int_equal(size[0][0], RIM_SELECT_SIZE(D, C, 512, 16, 32, 3));
  assert_int_equal(size[1][0], RIM_SELECT_SIZE(D, C, 512, 16, 32, 4));
  assert_true(size[1][1] - size[0][1] < size[1][0] - size[0][0]); /* so does each pair */
}

static void finds_an_ellipse_in_the_right_channel(void **state) {
  (void)state;
  int right = 0;
  double f1 = 0.0;
  for (uint64_t stream = 0; stream < 8; ++stream) {
    make(stream, ELLIPSE, (int)(stream % C));
    rim_select *engine = started(stream);
    feed(engine, 0, N);
    rim_candidate best;
    assert_true(rimi_select_best(engine, &best));
    assert_int_equal(best.channel, stream % C);
    assert_true(best.ln_anom > 15.0);
    assert_true(rimi_region_is_valid(&best.region.unit));
    assert_true(best.s < 0.0);
    assert_true(fabs(best.s * best.s / (2.0 * best.n) - best.ln_anom) < 1e-4 * best.ln_anom);
    right += best.dims == 2 && best.region.unit.feature[0] == X && best.region.unit.feature[1] == Y;
    double hit = 0.0;
    double wrong = 0.0;
    for (int i = 0; i < N; ++i) {
      const double p = rimi_select_membership(engine, best.channel, u[i]);
      assert_true(p >= 0.0 && p <= 1.0);
      hit += p > RIM_SELECT_MEMBERSHIP_CUT && anomalous[i];
      wrong += (p > RIM_SELECT_MEMBERSHIP_CUT) != anomalous[i];
    }
    f1 += 2.0 * hit / (2.0 * hit + wrong) / 8.0;
  }
  assert_true(right >= 7);
  assert_true(f1 > 0.85);
}

static void finds_fewer_features_where_fewer_matter(void **state) {
  (void)state;
  rim_candidate best;
  make(20, EVERYWHERE, 2);
  rim_select *engine = started(1);
  feed(engine, 0, N);
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.channel, 2);
  assert_int_equal(best.dims, 0);
  assert_true(best.n == N && best.since == 0);
  assert_true(rimi_select_membership(engine, best.channel, u[0]) == 1.0);
  make(21, INTERVAL, 0);
  engine = started(1);
  feed(engine, 0, N);
  assert_true(rimi_select_best_of_channel(engine, 0, &best));
  assert_in_range(best.dims, 1, 2);
  assert_true(best.region.unit.feature[0] == X ||
              (best.dims == 2 && best.region.unit.feature[1] == X));
  assert_true(best.since < 20);
  assert_true(fabs(best.shift + 2.0) < 0.5);
}

static void noise_scores_low(void **state) {
  (void)state;
  double most = 0.0;
  for (uint64_t stream = 30; stream < 36; ++stream) {
    make(stream, NOTHING, 0);
    rim_select *engine = started(stream);
    for (int i = 0; i < N; ++i) {
      feed(engine, i, i + 1);
      for (int c = 0; c < C; ++c) {
        const double score = (double)rimi_select_channel_scores(engine)[c];
        assert_true(score >= 0.0);
        most = fmax(most, score);
      }
    }
  }
  assert_true(most > 0.5 && most < 12.0);
}

static void a_copy_goes_on_elsewhere(void **state) {
  (void)state;
  make(40, ELLIPSE, 1);
  rim_select *engine = started(3);
  feed(engine, 0, 150);
  uint64_t *elsewhere = malloc(BYTES + 64);
  assert_non_null(elsewhere);
  uint64_t *moved = elsewhere + 3;
  memcpy(moved, memory, BYTES);
  feed(engine, 150, N);
  const uint64_t expected = digest(engine);
  memset(memory, 0xee, sizeof memory); /* nothing may point back */
  rim_select *copy = (rim_select *)(void *)moved;
  feed(copy, 150, N);
  assert_true(digest(copy) == expected);
  assert_true(expected != RIM_DIGEST_START);
  free(elsewhere);
}

static void reset_is_a_fresh_start(void **state) {
  (void)state;
  make(50, ELLIPSE, 0);
  rim_select *engine = started(5);
  feed(engine, 0, 200);
  const uint64_t once = digest(engine);
  rimi_select_reset(engine);
  rim_candidate best;
  assert_false(rimi_select_best(engine, &best));
  assert_true(rimi_select_membership(engine, 0, u[0]) == 0.0);
  assert_int_equal(rimi_select_observations(engine), 0);
  feed(engine, 0, 200);
  assert_true(digest(engine) == once);
}

static void scales_decide_between_channels(void **state) {
  (void)state;
  make(60, EVERYWHERE, 0);
  for (int i = 0; i < N; ++i)
    r[i][1] = r[i][0] * 0.5 - 0.5; /* weaker, but there */
  rim_select *engine = started(1);
  feed(engine, 0, 100);
  rim_candidate best;
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.channel, 0);
  const float scale[C] = {0.01f, 1.0f, 1.0f};
  assert_int_equal(rimi_select_set_channel_scale(engine, scale, NULL), RIM_OK);
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.channel, 1);
  const float offset[C] = {0.0f, 1e6f, 0.0f};
  assert_int_equal(rimi_select_set_channel_scale(engine, NULL, offset), RIM_OK);
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.channel, 0);
  const float zero[C] = {1.0f, 0.0f, 1.0f};
  const float not_finite[C] = {1.0f, NAN, 1.0f};
  assert_int_equal(rimi_select_set_channel_scale(engine, zero, NULL), RIM_E_RANGE);
  assert_int_equal(rimi_select_set_channel_scale(engine, NULL, not_finite), RIM_E_RANGE);
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.channel, 0);
}

/* A run offset of variance b makes the same sum less surprising: F = S^2 / 2 (a n + b n^2). */
static void run_offset_is_taken_off(void **state) {
  (void)state;
  static uint64_t own[RIM_SELECT_SIZE(1, 1, 16, 16, 32, 6) / 8];
  const float a = 1.0f;
  const float b = 0.25f;
  const rim_select_config config = {.features = 1, .ring = 16, .a = &a, .b = &b};
  rim_select *engine;
  assert_int_equal(rimi_select_init(&engine, own, sizeof own, &config), RIM_OK);
  const double one = 1.0;
  for (int i = 0; i < 100; ++i) {
    const double x = i / 100.0;
    assert_int_equal(rimi_select_observe(engine, &x, &one), RIM_OK);
    rimi_select_work(engine, 1);
  }
  rim_candidate best;
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.dims, 0);
  assert_true(fabs(best.ln_anom - 100.0 * 100.0 / (2.0 * (100.0 + 0.25 * 1e4))) < 1e-6);
}

static void outliers_and_edges_do_no_harm(void **state) {
  (void)state;
  make(70, NOTHING, 0);
  rim_select *engine = started(1);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i][f] = i % 3 == 0 ? -5.0 : i % 3 == 1 ? 1.0 : 1e308;
    r[i][i % C] = i % 2 == 0 ? 1e300 : -1e300;
    assert_int_equal(rimi_select_observe(engine, u[i], r[i]), RIM_OK);
    rimi_select_work(engine, 1);
  }
  rim_candidate best;
  assert_true(rimi_select_best(engine, &best));
  assert_true(isfinite(best.ln_anom) &&
              best.ln_anom <= N * RIM_SELECT_CLIP * RIM_SELECT_CLIP / 2.0);
}

static void bad_observations_change_nothing(void **state) {
  (void)state;
  make(80, ELLIPSE, 0);
  rim_select *engine = started(1);
  feed(engine, 0, 50);
  static uint64_t before[sizeof memory / 8];
  memcpy(before, memory, sizeof memory);
  u[60][D - 1] = NAN;
  r[61][C - 1] = INFINITY;
  assert_int_equal(rimi_select_observe(engine, u[60], r[60]), RIM_E_DATA);
  assert_int_equal(rimi_select_observe(engine, u[61], r[61]), RIM_E_DATA);
  assert_int_equal(rimi_select_observe(engine, NULL, r[60]), RIM_E_ARGUMENT);
  assert_memory_equal(before, memory, sizeof memory);
}

static void memory_is_respected(void **state) {
  (void)state;
  const rim_select_config config = {.features = D, .channels = C};
  size_t bytes = 0;
  assert_int_equal(rimi_select_size(&config, &bytes), RIM_OK);
  assert_int_equal(bytes, BYTES);
  rim_select *engine = NULL;
  assert_int_equal(rimi_select_init(&engine, memory, bytes - 1, &config), RIM_E_SIZE);
  assert_int_equal(rimi_select_init(&engine, (char *)memory + 4, bytes, &config), RIM_E_ALIGN);
  assert_int_equal(rimi_select_init(NULL, memory, bytes, &config), RIM_E_ARGUMENT);
  assert_null(engine);
  memset(memory, 0xc3, sizeof memory);
  make(90, ELLIPSE, 0);
  assert_int_equal(rimi_select_init(&engine, memory, bytes, &config), RIM_OK);
  feed(engine, 0, N);
  for (size_t i = bytes; i < sizeof memory; ++i) {
    assert_int_equal(((const uint8_t *)memory)[i], 0xc3);
  }
}

static void bad_configurations_are_refused(void **state) {
  (void)state;
  const rim_select_config bad[] = {
      {.features = 0},
      {.features = 129},
      {.features = D, .channels = 129},
      {.features = D, .ring = 15},
      {.features = D, .ring = 4097},
      {.features = D, .bins = 3},
      {.features = D, .bins = 33},
      {.features = D, .grid = 7},
      {.features = D, .grid = 65},
      {.features = D, .pairs = 17},
  };
  size_t bytes = 99;
  rim_select *engine = NULL;
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    assert_int_equal(rimi_select_size(&bad[i], &bytes), RIM_E_CONFIG);
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &bad[i]), RIM_E_CONFIG);
  }
  assert_int_equal(bytes, 99);
  const float zero = 0.0f;
  const float negative = -1.0f;
  const rim_select_config ranges[] = {{.features = 2, .a = &zero}, {.features = 2, .b = &negative}};
  for (size_t i = 0; i < 2; ++i) {
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &ranges[i]), RIM_E_RANGE);
  }
  assert_null(engine);
}

/* The tables outlive their counters: after 60000 observations they are halved, not overflown. */
static void long_runs_do_not_overflow(void **state) {
  (void)state;
  static uint64_t own[RIM_SELECT_SIZE(2, 1, 16, 4, 8, 1) / 8];
  const rim_select_config config = {
      .features = 2, .ring = 16, .bins = 4, .grid = 8, .pairs = 1, .moves = 24};
  rim_select *engine;
  assert_int_equal(rimi_select_init(&engine, own, sizeof own, &config), RIM_OK);
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 100);
  for (int i = 0; i < 150000; ++i) {
    const double x[2] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    const double z = rimi_rng_normal(&rng) + (x[0] < 0.5 && x[1] < 0.5 ? 1.0 : 0.0);
    assert_int_equal(rimi_select_observe(engine, x, &z), RIM_OK);
    if (i % 100 == 0)
      rimi_select_work(engine, 1);
  }
  rim_candidate best;
  assert_true(rimi_select_best(engine, &best));
  assert_int_equal(best.dims, 2);
  assert_true(best.n > 2000.0 && best.n < 30000.0);
  assert_true(fabs(best.shift - 1.0) < 0.2);
  assert_int_equal(rimi_select_observations(engine), 150000);
}

/* What is added to a bin is exact, however large the sum has been: an orbit's heat and cold, in one
 * bin of a feature that seldom changes, is no damage. */
static void sums_that_grow_and_fall_hold(void **state) {
  (void)state;
  static uint64_t own[RIM_SELECT_SIZE(2, 1, 16, 4, 8, 1) / 8];
  const rim_select_config config = {.features = 2, .ring = 16, .bins = 4, .grid = 8, .pairs = 1};
  rim_select *engine;
  assert_int_equal(rimi_select_init(&engine, own, sizeof own, &config), RIM_OK);
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 200);
  for (int i = 0; i < 150000; ++i) {
    const double x[2] = {i % 7000 == 0 ? 0.9 : 0.1, rimi_rng_uniform(&rng)};
    const double z = 0.5 * rimi_rng_normal(&rng) + (i % 60000 < 30000 ? 40.0 : -40.0);
    assert_int_equal(rimi_select_observe(engine, x, &z), RIM_OK);
    if (i % 499 == 0)
      assert_true(rimi_select_bins_hold(engine, 0) && rimi_select_bins_hold(engine, 1));
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(sums_that_grow_and_fall_hold),
      cmocka_unit_test(a_reset_is_a_start),
      cmocka_unit_test(the_small_profile_is_small),
      cmocka_unit_test(finds_an_ellipse_in_the_right_channel),
      cmocka_unit_test(finds_fewer_features_where_fewer_matter),
      cmocka_unit_test(noise_scores_low),
      cmocka_unit_test(a_copy_goes_on_elsewhere),
      cmocka_unit_test(reset_is_a_fresh_start),
      cmocka_unit_test(scales_decide_between_channels),
      cmocka_unit_test(run_offset_is_taken_off),
      cmocka_unit_test(outliers_and_edges_do_no_harm),
      cmocka_unit_test(bad_observations_change_nothing),
      cmocka_unit_test(memory_is_respected),
      cmocka_unit_test(bad_configurations_are_refused),
      cmocka_unit_test(long_runs_do_not_overflow),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
