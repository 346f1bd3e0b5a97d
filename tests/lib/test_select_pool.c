/* SPDX-License-Identifier: MIT */
/* The pool: incremental statistics of ellipses equal those counted point by point, also when the
 * lead changes and when observations leave the ring; its bounds; it climbs. */
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

#define SEED 43u
enum { D = 5, RING = 64, N = 400 };

static uint64_t memory[RIM_SELECT_SIZE(D, 1, RING, 16, 32, 4) / 8 + 1];
static rim_select *engine;
static double u[N][D], r[N];
static rim_rng rng;

static size_t size; /* of the engine */

static void start_with(uint64_t stream, bool small) {
  rimi_rng_seed(&rng, SEED, stream);
  const rim_select_config config = {.features = D,
                                    .ring = RING,
                                    .pairs = 4,
                                    .edges = small ? 10 : 0,
                                    .small = small,
                                    .seed = stream};
  assert_int_equal(rimi_select_size(&config, &size), RIM_OK);
  assert_true(size <= sizeof memory);
  memset(memory, 0xa5, sizeof memory);
  assert_int_equal(rimi_select_init(&engine, memory, size - 1, &config), RIM_E_SIZE);
  assert_int_equal(rimi_select_init(&engine, memory, size, &config), RIM_OK);
  for (int i = 0; i < N; ++i) {
    for (int f = 0; f < D; ++f)
      u[i][f] = rimi_rng_uniform(&rng);
    const bool inside = hypot(u[i][1] - 0.6, (u[i][3] - 0.4) * 1.5) < 0.25;
    r[i] = rimi_rng_normal(&rng) + (inside ? 2.0 : 0.0);
  }
}

static void start(uint64_t stream) { start_with(stream, false); }

/* As stage 1 defines it: cells of row y whose centre lies in the span of the tabulated ellipse;
 * here by the tables themselves, all grid cells. */
static void count_cells(const pair_state *p, const chain *k, uint32_t pair, double *s, double *n) {
  const rim_grid grid = select_grid(engine, pair);
  *s = 0.0;
  *n = 0.0;
  const double cx = k->shape.cx / (double)SELECT_ONE, cy = k->shape.cy / (double)SELECT_ONE;
  const double a = k->shape.a / (double)SELECT_ONE, b = k->shape.b / (double)SELECT_ONE;
  const double c = k->shape.c / (double)SELECT_ONE;
  for (uint32_t row = 0; row < 32; ++row) {
    const double z = ((row + 0.5) / 32.0 - cy) / a;
    const int entry = (int)(fabs(z) * 256.0 + 0.5);
    if (entry >= 256)
      continue;
    const double half = c * sqrt(1.0 - (entry / 256.0) * (entry / 256.0));
    const double middle = cx + b * z;
    for (uint32_t column = 0; column < 32; ++column) {
      const double x = (column + 0.5) / 32.0;
      if (x <= middle - half || x > middle + half)
        continue;
      int32_t units = 0;
      uint32_t count = 0;
      rimi_grid_span(grid.cell + (size_t)row * 33, column, column + 1u, &units, &count);
      *s += rimi_grid_steps(&grid, units) * RIM_GRID_STEP;
      *n += count;
    }
  }
  (void)p;
}

static void ellipses_count_their_cells(void **state) {
  (void)state;
  for (uint64_t stream = 0; stream < 4; ++stream) {
    start_with(stream, stream == 3);
    int checked = 0;
    int off = 0;
    for (int i = 0; i < N; ++i) {
      assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
      for (uint32_t pair = 0; pair < engine->pairs; ++pair) {
        const pair_state *p = select_pair(engine, pair);
        if (!p->active)
          continue;
        for (uint32_t j = 0; j < engine->chains; ++j) {
          double s;
          double n;
          count_cells(p, &p->chain[j], pair, &s, &n);
          ++checked;
          /* a cell whose centre is on the edge to the last bit may fall either way */
          off += fabs((double)p->chain[j].grid_n - n) > 0.0 ||
                 fabs((double)p->chain[j].grid_s - s) > 1e-3;
        }
      }
      rimi_select_work(engine, 1);
    }
    assert_true(checked > 10000);
    print_message("stream %d: %d of %d off\n", (int)stream, off, checked);
    assert_true(off * 300 < checked);
  }
}

/* What is carried from observation to observation is what a fresh evaluation would give, exactly:
 * the ring keeps residuals in steps and the grid in units, so that every sum is exact; also when
 * the units grow, since residuals do. */
static void incremental_equals_fresh(void **state) {
  (void)state;
  start(7);
  for (int i = N / 2; i < N; ++i)
    r[i] *= 30.0;
  int exact = 0;
  bool grown = false;
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    if (i % 7 == 0) {
      static uint64_t copy[sizeof memory / 8];
      memcpy(copy, memory, sizeof memory);
      rim_select *other = (rim_select *)(void *)copy;
      for (uint32_t pair = 0; pair < other->pairs; ++pair) {
        pair_state *p = select_pair(other, pair);
        if (!p->active)
          continue;
        chain kept[RIM_SELECT_CHAINS];
        memcpy(kept, p->chain, sizeof kept);
        rimi_select_pool_refresh(other, pair);
        for (int j = 0; j < RIM_SELECT_CHAINS; ++j) {
          assert_true(kept[j].grid_n == p->chain[j].grid_n);
          assert_true(kept[j].grid_s == p->chain[j].grid_s);
          assert_true(kept[j].n == p->chain[j].n);
          assert_true(kept[j].s == p->chain[j].s);
          exact += p->exact;
        }
      }
    }
    rimi_select_work(engine, 1);
  }
  for (uint32_t pair = 0; pair < engine->pairs; ++pair)
    grown = grown || select_pair(engine, pair)->grid_shift > RIM_GRID_LEAST_SHIFT;
  assert_true(grown);
  assert_true(exact > 500);
  assert_true(engine->total > 2 * engine->ring); /* observations did leave the ring */
}

/* For the leader, points of the ring count by their own coordinates. */
static void the_leader_is_exact_on_the_ring(void **state) {
  (void)state;
  start(9);
  for (int i = 0; i < RING; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    rimi_select_work(engine, 2);
  }
  assert_true(engine->leader < engine->pairs);
  const pair_state *p = select_pair(engine, engine->leader);
  assert_true(p->exact);
  int off = 0;
  for (int j = 0; j < RIM_SELECT_CHAINS; ++j) {
    const ellipse *e = &p->chain[j].shape;
    int n = 0;
    for (int i = 0; i < RING; ++i) {
      const double x = (floor(256.0 * u[i][p->x]) + 0.5) / 256.0;
      const double y = (floor(256.0 * u[i][p->y]) + 0.5) / 256.0;
      const double v = (y * SELECT_ONE - e->cy) / e->a;
      const double h = (x * SELECT_ONE - e->cx - e->b * v) / e->c;
      n += v * v + h * h < 1.0;
    }
    off += n != (int)p->chain[j].n;
  }
  assert_true(off <= 1); /* an ellipse may bulge past the cells it is looked for in */
}

static void entries_and_moves_are_bounded(void **state) {
  (void)state;
  start(11);
  rim_select_effort before = rimi_select_get_effort(engine);
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    rimi_select_work(engine, 1);
    const rim_select_effort after = rimi_select_get_effort(engine);
    assert_in_range(after.backfills - before.backfills, 0, 2);
    assert_in_range(after.moves - before.moves, 0, 64 + 48 / 5 + 4 * RIM_SELECT_CHAINS);
    assert_in_range(after.edges - before.edges, 0, 48 + 5);
    before = after;
  }
}

/* In the small profile a unit has twice the moves configured at first, 5/8 when the ring is full.
 */
static void the_small_profile_does_less_as_the_ring_fills(void **state) {
  (void)state;
  start_with(19, true);
  const uint32_t moves = RIM_SELECT_DEFAULT_MOVES;
  uint32_t first = 0, last = UINT32_MAX;
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    const rim_select_effort before = rimi_select_get_effort(engine);
    rimi_select_work(engine, 1);
    const uint32_t done = rimi_select_get_effort(engine).moves - before.moves;
    const uint32_t most =
        i + 1 < 5 * RING / 16 ? 2 * moves : moves * 5 * RING / (8u * engine->held);
    /* with offers for pairs that are active, or the ellipses of one that enters */
    assert_in_range(done, 0, (most > SMALL_CHAINS ? most : SMALL_CHAINS) + engine->edges);
    if (i + 1 < 5 * RING / 16 && done > first)
      first = done;
    if (i >= RING && done >= 5 * moves / 8 && done < last)
      last = done;
  }
  assert_true(first >= 2 * moves);
  assert_int_equal(last, 5 * moves / 8);
}

static void the_planted_pair_leads(void **state) {
  (void)state;
  start(13);
  for (int i = 0; i < 200; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    rimi_select_work(engine, 1);
  }
  pair_state *p = select_pair(engine, engine->leader);
  assert_int_equal(p->x, 1);
  assert_int_equal(p->y, 3);
  assert_true(rimi_select_pair_best(engine, p, NULL) > 20.0f);
}

/* In the small profile half of the ellipses are in use, and the leader's, on the grid, are a sample
 * of the posterior like those of the larger search: all but the first also go down. */
static void the_small_profile_uses_fewer_ellipses(void **state) {
  (void)state;
  start_with(17, true);
  int down[SMALL_CHAINS] = {0};
  for (int i = 0; i < N; ++i) {
    assert_int_equal(rimi_select_observe(engine, u[i], &r[i]), RIM_OK);
    const uint16_t leader = engine->leader;
    float before[SMALL_CHAINS] = {0.0f};
    for (uint32_t j = 0; leader < engine->pairs && j < SMALL_CHAINS; ++j) {
      const chain *k = &select_pair(engine, leader)->chain[j];
      before[j] = k->n >= 3.0f ? k->s * k->s / k->n : 0.0f;
    }
    rimi_select_work(engine, 1);
    if (leader != engine->leader || engine->entered > 0 || leader >= engine->pairs)
      continue;
    const pair_state *p = select_pair(engine, leader);
    assert_false(p->exact);
    for (uint32_t j = 0; j < SMALL_CHAINS; ++j) {
      const chain *k = &p->chain[j];
      down[j] += k->n >= 3.0f && k->s * k->s / k->n < before[j] * 0.999f;
    }
  }
  assert_int_equal(engine->chains, SMALL_CHAINS);
  assert_true(size + 4u * 400u + 2u * 32u * 32u < sizeof memory); /* and have less memory, */
  for (size_t i = size; i < sizeof memory; ++i)                   /* which they keep to */
    assert_int_equal(((const uint8_t *)memory)[i], 0xa5);
  assert_int_equal(down[0], 0);
  for (uint32_t j = 1; j < SMALL_CHAINS; ++j)
    assert_true(down[j] > 5);
  const pair_state *leader = select_pair(engine, engine->leader);
  assert_true(leader->x == 1 && leader->y == 3);
  double x[D] = {0.5, 0.6, 0.5, 0.4, 0.5};
  assert_true(rimi_select_membership(engine, 0, x) > 0.99);
  int between = 0;
  for (x[1] = 0.605; x[1] < 1.0; x[1] += 0.01) {
    const double share = 11.0 * rimi_select_membership(engine, 0, x);
    assert_true(fabs(share - floor(share + 0.5)) < 1e-9);
    between += share > 0.5 && share < 10.5;
  }
  assert_true(between > 0 && rimi_select_membership(engine, 0, x) < 0.01);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(ellipses_count_their_cells),
      cmocka_unit_test(the_small_profile_does_less_as_the_ring_fills),
      cmocka_unit_test(incremental_equals_fresh),
      cmocka_unit_test(the_leader_is_exact_on_the_ring),
      cmocka_unit_test(entries_and_moves_are_bounded),
      cmocka_unit_test(the_planted_pair_leads),
      cmocka_unit_test(the_small_profile_uses_fewer_ellipses)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
