/* SPDX-License-Identifier: MIT */
/* Intervals and conditional intervals (H3) against brute force, through the engine's own state. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "search/select.h"
#include "search/select_private.h"

#define SEED 41u
enum { D = 4, C = 2, N = 300, B = 16 };

static uint64_t memory[RIM_SELECT_SIZE(D, C, 1024, B, 32, 6) / 8 + 1];
static rim_select *engine;
static double u[N][D], r[N][C];
static const float a[C] = {1.0f, 1.5f}, b[C] = {0.0f, 0.02f};

static void fill(uint64_t stream) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, stream);
  const rim_select_config config = {.features = D, .channels = C, .seed = stream, .a = a, .b = b};
  assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i][f] = rimi_rng_uniform(&rng);
    for (int c = 0; c < C; ++c) {
      const bool inside = c == 1 && u[i][0] < 0.4 && u[i][2] > 0.5;
      r[i][c] = floor(512.0 * (rimi_rng_normal(&rng) - (inside ? 1.5 : 0.0))) / 512.0;
    }
    assert_int_equal(rimi_select_observe(engine, u[i], r[i]), RIM_OK);
  }
}

/* Largest S^2 / 2 (a n + b n^2) over intervals of `bins` bins of f, of points that `keep` marks. */
static double brute(int f, int c, int bins, const bool *keep, int *first, int *last) {
  double best = 0.0;
  for (int i = 0; i < bins; ++i) {
    for (int j = i; j < bins; ++j) {
      double s = 0.0;
      double n = 0.0;
      for (int k = 0; k < N; ++k) {
        const int bin = (int)floor(floor(256.0 * u[k][f]) * bins / 256.0);
        if (bin < i || bin > j || (keep != NULL && !keep[k]))
          continue;
        s += r[k][c];
        n += 1.0;
      }
      const double value = n > 0.0 ? s * s / (2.0 * n * ((double)a[c] + (double)b[c] * n)) : 0.0;
      if (value <= best)
        continue;
      best = value;
      *first = i;
      *last = j;
    }
  }
  return best;
}

static void scans_equal_brute_force(void **state) {
  (void)state;
  for (uint64_t stream = 0; stream < 10; ++stream) {
    fill(stream);
    rimi_select_scan(engine, D * C);
    assert_int_equal(rimi_select_get_effort(engine).scans, D * C);
    for (int c = 0; c < C; ++c) {
      double most = 0.0;
      for (int f = 0; f < D; ++f) {
        int first = 0;
        int last = 0;
        const double expected = brute(f, c, B, NULL, &first, &last);
        const slice *s = select_slice(engine, (uint32_t)c, (uint32_t)f);
        assert_true(fabs((double)s->ln_anom - expected) <= 1e-6 * expected);
        assert_int_equal(s->first, first);
        assert_int_equal(s->last, last);
        most = fmax(most, expected);
      }
      assert_true(fabs((double)select_channel(engine, (uint32_t)c)->best_interval - most) <
                  1e-6 * most);
    }
  }
}

/* Whatever interval a slice is said to have had, the scan finds the best, and reads no bin that
 * there is not (which the sanitizers see). */
static void an_upset_slice_is_scanned_anew(void **state) {
  (void)state;
  static const uint8_t upset[][2] = {{0, B}, {0, 255}, {9, 3}, {200, 210}};
  fill(20);
  rimi_select_scan(engine, D * C);
  const slice was = *select_slice(engine, 1, 2);
  for (size_t i = 0; i < sizeof upset / sizeof *upset; ++i) {
    select_slice(engine, 1, 2)->first = upset[i][0];
    select_slice(engine, 1, 2)->last = upset[i][1];
    rimi_select_scan(engine, D * C);
    assert_memory_equal(select_slice(engine, 1, 2), &was, sizeof was);
  }
}

static void a_scan_equals_brute_force(void **state) {
  (void)state;
  fill(20);
  rimi_select_scan(engine, D * C);
  for (uint16_t f = 0; f < D; ++f) {
    double s[B + 1];
    double n[B + 1];
    const rim_bins table = select_bins(engine);
    rimi_bins_prefix(&table, f, 1, s, n);
    double most = 0.0;
    uint32_t first = 0, bins = 0;
    for (uint32_t low = 0; low < B; ++low) {
      for (uint32_t high = low + 1; high <= B; ++high) {
        const double count = n[high] - n[low], sum = s[high] - s[low];
        const double var = count * ((double)a[1] + (double)b[1] * count);
        const double anom = count >= 1.0 ? 0.5 * sum * sum / var : 0.0;
        if (anom > most * (1.0 + 1e-12) || (anom >= most && most > 0.0 && high - low < bins)) {
          most = anom;
          first = low;
          bins = high - low;
        }
      }
    }
    const slice *found = select_slice(engine, 1, f);
    assert_true(fabs((double)found->ln_anom - most) <= 1e-6 * most);
    assert_int_equal(found->first, first);
    assert_int_equal(found->last + 1u - found->first, bins);
  }
}

/* A sweep from base f offers each pair at least its H3: brute force over the base's points. */
static void sweep_equals_brute_force(void **state) {
  (void)state;
  fill(30);
  rimi_select_scan(engine, D * C);
  rimi_select_sweep(engine, 2 * D * 5);
  assert_int_equal(engine->base_channel, 1); /* the planted one is the strongest */
  int checked = 0;
  for (uint32_t i = 0; i < engine->pairs; ++i) {
    const pair_state *p = select_pair(engine, i);
    if (!p->active)
      continue;
    double plain = 0.0;
    for (int side = 0; side < 2; ++side) {
      const int base = side == 0 ? p->x : p->y;
      const int other = side == 0 ? p->y : p->x;
      const slice *s = select_slice(engine, p->channel, (uint32_t)base);
      bool keep[N];
      for (int k = 0; k < N; ++k) {
        const int bin = (int)(u[k][base] * B);
        keep[k] = bin >= s->first && bin <= s->last;
      }
      int first;
      int last;
      const double value = brute(other, p->channel, 16, keep, &first, &last);
      if (side == 0 || value < plain)
        plain = value;
    }
    assert_true((double)p->h3 >= plain * (1.0 - 1e-6));
    ++checked;
  }
  assert_true(checked >= 2);
}

/* Two readings at the ends that deviate by as much, one up and one down: each alone has S^2 / 2 n a
 * of 1/2, both together 0. Of equals the one that deviates downwards is said, wherever it is. */
static void of_equals_the_lower_reading(void **state) {
  (void)state;
  for (int up = 0; up < 2; ++up) { /* which of the ends deviates upwards */
    const rim_select_config config = {.features = 1, .bins = 4};
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
    for (int end = 0; end < 2; ++end) {
      const double at = end == 0 ? 0.1 : 0.9, deviates = end == up ? 1.0 : -1.0;
      assert_int_equal(rimi_select_observe(engine, &at, &deviates), RIM_OK);
    }
    rimi_select_scan(engine, 1);
    const slice *s = select_slice(engine, 0, 0);
    assert_true(s->ln_anom == 0.5f);
    assert_int_equal(s->first, up == 0 ? 3 : 0);
    assert_int_equal(s->last, up == 0 ? 3 : 0);
  }
}

/* Bins that hold nothing, before and behind, hide no reading of either sign. */
static void empty_bins_hide_nothing(void **state) {
  (void)state;
  for (int up = 0; up < 2; ++up) {
    const rim_select_config config = {.features = 1, .bins = 4};
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
    const double at = 0.3, deviates = up ? 1.0 : -1.0;
    assert_int_equal(rimi_select_observe(engine, &at, &deviates), RIM_OK);
    rimi_select_scan(engine, 1);
    const slice *s = select_slice(engine, 0, 0);
    assert_true(s->ln_anom == 0.5f && s->first == 1 && s->last == 1);
  }
}

/* A feature that was a channel's best and explains less now gives way to another of its own. */
static void the_best_feature_is_one_of_the_channel(void **state) {
  (void)state;
  fill(50);
  rimi_select_scan(engine, D * C);
  for (uint32_t was = 0; was < D; ++was) {
    channel_state *state_0 = select_channel(engine, 0);
    state_0->best_interval = 1e6f; /* before its observations were forgotten */
    state_0->best_feature = (uint16_t)was;
    select_slice(engine, 1, 0)->ln_anom = 1e9f; /* the next channel's */
    rimi_select_scan(engine, D);
    uint32_t best = 0;
    for (uint32_t f = 1; f < D; ++f)
      best =
          select_slice(engine, 0, f)->ln_anom > select_slice(engine, 0, best)->ln_anom ? f : best;
    assert_int_equal(state_0->best_feature, best);
    assert_true(state_0->best_interval == select_slice(engine, 0, best)->ln_anom);
    rimi_select_scan(engine, D); /* the other channel, until it is the first one's turn again */
  }
}

/* Where nothing is known yet the first feature of the first channel is the first base. Three bases
 * are taken in a unit, each with all other features, whatever else the budget would allow. */
static void a_unit_takes_three_bases(void **state) {
  (void)state;
  const rim_select_config config = {.features = D, .channels = C, .a = a, .b = b};
  assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
  for (uint32_t p = 0; p < engine->pairs; ++p) { /* a pool that asks for more than there is */
    select_pair(engine, p)->active = 1;
    select_pair(engine, p)->h3 = 1e3f;
  }
  const uint32_t sweeps = engine->sweeps;
  rimi_select_sweep(engine, 1);
  assert_int_equal(rimi_select_get_effort(engine).edges, 1);
  assert_true(engine->base_channel == 0 && engine->base_feature == 0);
  assert_int_equal(engine->sweeps, sweeps + 1);
  rimi_select_sweep(engine, 1000000); /* the rest of this one is the first of three */
  assert_int_equal(engine->sweeps, sweeps + 3);
  assert_int_equal(rimi_select_get_effort(engine).edges, 3 * (D - 1));
  assert_int_equal(engine->next_feature, D);
}

/* A budget that is spent exactly is spent: as much again takes the same edges. */
static void a_spent_budget_ends_a_unit(void **state) {
  (void)state;
  static uint64_t before[sizeof memory / sizeof *memory];
  fill(60);
  rimi_select_scan(engine, D * C);
  memcpy(before, memory, sizeof memory);
  for (uint32_t budget = 1; budget < 60; ++budget) {
    uint32_t used[2] = {budget, 0};
    for (int again = 0; again < 2; ++again) {
      memcpy(memory, before, sizeof memory);
      const uint32_t from = rimi_select_get_effort(engine).edges;
      rimi_select_sweep(engine, used[0]);
      used[again] = rimi_select_get_effort(engine).edges - from;
    }
    assert_int_equal(used[1], used[0]);
  }
}

/* What lies in the ring behind what is held, left there by another run, is not searched. */
static void nothing_behind_the_ring_is_searched(void **state) {
  (void)state;
  static uint64_t clean[sizeof memory / sizeof *memory];
  for (int rest = 0; rest < 2; ++rest) {
    fill(30);
    if (rest == 1) {
      memset(select_row(engine, N), 0x20, (512 - N) * 4u * engine->words);
      memset(select_residual(engine, N), 0x7f, (512 - N) * C * sizeof(int16_t));
    }
    rimi_select_scan(engine, D * C);
    rimi_select_sweep(engine, 2 * D * 5);
    if (rest == 0)
      memcpy(clean, memory, sizeof memory);
  }
  for (uint32_t p = 0; p < engine->pairs; ++p) {
    const uint8_t *was =
        (const uint8_t *)clean + ((uint8_t *)select_pair(engine, p) - (uint8_t *)memory);
    assert_memory_equal(select_pair(engine, p), was, engine->pair_bytes);
  }
}

/* 32 x 32 cells, as many as the small profile tells apart, one observation each. Eight columns
 * deviate much, in eight rows; the next eight a little, in all other rows. Over all rows the
 * columns deviate most together; within the eight rows only the first eight do, and the offer says
 * so: 64 observations of -3, ln anom 192^2 / 2 / 64. */
static void the_base_is_that_of_the_rows(void **state) {
  (void)state;
  for (int small = 0; small < 2; ++small) {
    const rim_select_config config = {.features = 2, .ring = 1024, .small = small == 1};
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
    for (int x = 0; x < 32; ++x) {
      for (int y = 0; y < 32; ++y) {
        const bool row = y >= 12 && y < 20;
        const double at[2] = {(x + 0.5) / 32.0, (y + 0.5) / 32.0};
        const double deviates = x >= 8 && x < 16 && row     ? -3.0
                                : x >= 16 && x < 24 && !row ? -0.6
                                                            : 0.0;
        assert_int_equal(rimi_select_observe(engine, at, &deviates), RIM_OK);
      }
    }
    rimi_select_scan(engine, 1);
    const slice *base = select_slice(engine, 0, 0);
    assert_true(base->first == 4 && base->last == 11);
    rimi_select_sweep(engine, 1);
    const pair_state *p = select_pair(engine, 0);
    assert_true(p->active && p->x == 0 && p->y == 1);
    assert_int_equal(p->chain[0].shape.cx, 3 * SELECT_ONE / 8);
    assert_int_equal(p->chain[0].shape.cy, SELECT_ONE / 2);
    assert_true(fabs((double)p->h3 - 288.0) < 0.1);
  }
}

/* More rows in the base than a packed word counts, all of them at the limit, and most in one bin of
 * the second feature: 300 of -63, whether edges are taken together or one by one. */
static void a_full_ring_is_summed(void **state) {
  (void)state;
  for (uint32_t budget = 1; budget <= 1000; budget += 999) {
    const rim_select_config config = {.features = D};
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
    for (int i = 0; i < 500; ++i) {
      const bool inside = i % 5 < 3;
      const double at[D] = {0.5, inside ? 5.5 / 16.0 : 12.5 / 16.0, (i % 16 + 0.5) / 16.0,
                            (i / 16 % 16 + 0.5) / 16.0};
      const double deviates = inside ? -63.0 : 63.0;
      assert_int_equal(rimi_select_observe(engine, at, &deviates), RIM_OK);
    }
    rimi_select_scan(engine, 1); /* the first feature alone is known: it is the base */
    double h3 = 0.0;             /* the largest: later bases say less */
    for (uint32_t left = 20; left > 0; --left) {
      rimi_select_sweep(engine, budget);
      for (uint32_t p = 0; p < engine->pairs; ++p) {
        const pair_state *pair = select_pair(engine, p);
        if (pair->active && pair->x == 0 && pair->y == 1)
          h3 = fmax(h3, (double)pair->h3);
      }
    }
    assert_true(h3 == 63.0 * 63.0 * 300.0 / 2.0);
  }
}

static void budgets_are_kept(void **state) {
  (void)state;
  fill(40);
  const rim_select_effort before = rimi_select_get_effort(engine);
  rimi_select_scan(engine, 3);
  rimi_select_sweep(engine, 7);
  const rim_select_effort after = rimi_select_get_effort(engine);
  assert_int_equal(after.scans - before.scans, 3);
  assert_in_range(after.edges - before.edges, 7, 7 + 5);
  rimi_select_scan(engine, 1000); /* never the same slice twice */
  assert_int_equal(rimi_select_get_effort(engine).scans - after.scans, D * C);
}

/* The ring gives back the middle of each feature's level: one of 256, or of 32 in the small
 * profile, where six share a word, and the last word has one. */
static void levels_are_kept(void **state) {
  (void)state;
  enum { MANY = 13 };
  for (int small = 0; small < 2; ++small) {
    const rim_select_config config = {.features = MANY, .ring = 16, .small = small == 1};
    assert_int_equal(rimi_select_init(&engine, memory, sizeof memory, &config), RIM_OK);
    for (uint32_t i = 0; i < 40; ++i) {
      double at[MANY];
      for (uint32_t f = 0; f < MANY; ++f)
        at[f] = (i * 37u + f * 101u) % 256u / 256.0;
      const double residual = 1.0;
      assert_int_equal(rimi_select_observe(engine, at, &residual), RIM_OK);
      for (uint32_t f = 0; f < MANY; ++f) {
        const ring_column column = select_column(engine, f);
        const uint32_t byte = (i * 37u + f * 101u) % 256u;
        assert_int_equal(select_byte(&column, i % 16u), small ? byte / 8u * 8u + 4u : byte);
      }
    }
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(levels_are_kept),
                                     cmocka_unit_test(scans_equal_brute_force),
                                     cmocka_unit_test(a_scan_equals_brute_force),
                                     cmocka_unit_test(an_upset_slice_is_scanned_anew),
                                     cmocka_unit_test(sweep_equals_brute_force),
                                     cmocka_unit_test(of_equals_the_lower_reading),
                                     cmocka_unit_test(empty_bins_hide_nothing),
                                     cmocka_unit_test(the_best_feature_is_one_of_the_channel),
                                     cmocka_unit_test(a_unit_takes_three_bases),
                                     cmocka_unit_test(a_spent_budget_ends_a_unit),
                                     cmocka_unit_test(nothing_behind_the_ring_is_searched),
                                     cmocka_unit_test(the_base_is_that_of_the_rows),
                                     cmocka_unit_test(a_full_ring_is_summed),
                                     cmocka_unit_test(budgets_are_kept)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
