/* SPDX-License-Identifier: MIT */
/* Tables against plain sums; prefix property; halving; cells at the edges. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "search/bins.h"

#define SEED 17u
enum { D = 5, B = 7, C = 3, G = 9, N = 400 };

static rim_rng rng;
static int32_t sum[D * B * C];
static uint16_t count[D * B + 1];
static const rim_bins table = {D, B, C, sum, count};

static void cells_cover_the_range(void **state) {
  (void)state;
  assert_int_equal(rimi_bins_cell(0.0, 16), 0);
  assert_int_equal(rimi_bins_cell(-0.0, 16), 0);
  assert_int_equal(rimi_bins_cell(-1e300, 16), 0);
  assert_int_equal(rimi_bins_cell(1.0, 16), 15);
  assert_int_equal(rimi_bins_cell(1e300, 16), 15);
  assert_int_equal(rimi_bins_cell(nextafter(1.0, 0.0), 16), 15);
  assert_int_equal(rimi_bins_cell(nextafter(0.0625, 0.0), 16), 0);
  assert_int_equal(rimi_bins_cell(0.0625, 16), 1);
  assert_int_equal(rimi_bins_cell(0.5, 256), 128);
}

static void table_equals_plain_sums(void **state) {
  (void)state;
  static double s[D][B][C];
  static int n[D][B];
  memset(s, 0, sizeof s);
  memset(n, 0, sizeof n);
  rimi_bins_clear(&table);
  for (int i = 0; i < N; ++i) {
    uint8_t bin[D];
    int16_t r[C];
    for (int f = 0; f < D; ++f)
      bin[f] = (uint8_t)rimi_rng_below(&rng, B);
    for (int c = 0; c < C; ++c)
      r[c] = (int16_t)((int)rimi_rng_below(&rng, 2001) - 1000);
    rimi_bins_add(&table, bin, r);
    for (int f = 0; f < D; ++f) {
      ++n[f][bin[f]];
      for (int c = 0; c < C; ++c)
        s[f][bin[f]][c] += r[c] / 512.0;
    }
  }
  for (uint16_t f = 0; f < D; ++f) {
    for (uint16_t c = 0; c < C; ++c) {
      double prefix_s[B + 1];
      double prefix_n[B + 1];
      rimi_bins_prefix(&table, f, c, prefix_s, prefix_n);
      double total_s = 0.0;
      double total_n = 0.0;
      for (int k = 0; k <= B; ++k) {
        assert_true(prefix_s[k] == total_s && prefix_n[k] == total_n); /* exact: steps of 1/512 */
        if (k < B) {
          total_s += s[f][k][c];
          total_n += n[f][k];
        }
      }
      assert_true(total_n == N);
    }
  }
  double before_s[B + 1];
  double before_n[B + 1];
  double after_s[B + 1];
  double after_n[B + 1];
  rimi_bins_prefix(&table, 2, 1, before_s, before_n);
  count[D * B] = 7; /* behind the last */
  rimi_bins_halve(&table);
  assert_int_equal(count[D * B], 7);
  rimi_bins_prefix(&table, 2, 1, after_s, after_n);
  for (int k = 0; k < B; ++k) { /* each cell, the first and the last */
    assert_true(after_n[k + 1] - after_n[k] == floor(0.5 * (before_n[k + 1] - before_n[k])));
    assert_true(after_s[k + 1] - after_s[k] ==
                trunc(256.0 * (before_s[k + 1] - before_s[k])) / 512.0);
  }
  double all = 0.0;
  for (uint16_t f = 0; f < D; ++f) {
    double first_n[B + 1];
    rimi_bins_prefix(&table, f, 0, before_s, first_n);
    all += first_n[B];
    assert_true(first_n[1] == floor(0.5 * n[f][0]));
  }
  assert_true(all <= 0.5 * D * N);
}

/* Each sum, the first and the last too, towards 0. */
static void halving_halves_every_sum(void **state) {
  (void)state;
  for (int i = 0; i < D * B * C; ++i)
    sum[i] = i % 2 == 0 ? i + 1 : -i - 1;
  rimi_bins_halve(&table);
  for (int i = 0; i < D * B * C; ++i)
    assert_int_equal(sum[i], i % 2 == 0 ? i / 2 : -(i + 1) / 2);
}

typedef struct held {
  uint8_t shift;
  uint32_t cell[G * (G + 1)];
} held;

static void row_of(const held *h, int row, int low, int high, int32_t *units, uint32_t *n) {
  *units = 0;
  *n = 0;
  rimi_grid_span(h->cell + row * (G + 1), (uint32_t)low, (uint32_t)high, units, n);
}

static void grid_added_equals_put_and_accumulated(void **state) {
  (void)state;
  static held h1, h2;
  const rim_grid one = {G, &h1.shift, h1.cell};
  const rim_grid two = {G, &h2.shift, h2.cell};
  rimi_grid_clear(&one, 0);
  rimi_grid_clear(&two, 0);
  assert_int_equal(h1.shift, RIM_GRID_LEAST_SHIFT);
  int32_t sum_of[G][G] = {{0}};
  uint32_t count_of[G][G] = {{0}};
  for (int i = 0; i < N; ++i) {
    const uint32_t row = rimi_rng_below(&rng, G);
    const uint32_t column = rimi_rng_below(&rng, G);
    const int32_t units = (int32_t)rimi_rng_below(&rng, 201) - 100;
    assert_false(rimi_grid_add(&one, row, column, units));
    rimi_grid_put(&two, row, column, units);
    sum_of[row][column] += units;
    ++count_of[row][column];
  }
  rimi_grid_accumulate(&two);
  assert_memory_equal(&h1, &h2, sizeof h1);
  rimi_grid_halve(&two);
  for (int row = 0; row < G; ++row) {
    assert_int_equal(h1.cell[row * (G + 1)], 0);
    int32_t in_row = 0;
    uint32_t rows_count = 0;
    for (int k = 0; k < G; ++k) {
      int32_t units;
      uint32_t n;
      row_of(&h1, row, k, k + 1, &units, &n);
      assert_int_equal(units, sum_of[row][k]);
      assert_int_equal(n, count_of[row][k]);
      in_row += units;
      rows_count += n;
      row_of(&h2, row, 0, k + 1, &units, &n);
      assert_int_equal(units, in_row / 2);
      assert_int_equal(n, rows_count / 2);
    }
  }
}

/* Steps in units are rounded to the nearest, away from zero where two are as near. */
static void residuals_are_rounded_to_units(void **state) {
  (void)state;
  static held h;
  const rim_grid grid = {G, &h.shift, h.cell};
  rimi_grid_clear(&grid, 0);
  const int32_t steps[] = {0, 3, 4, 11, 12, -3, -4, -11, -12, 32256, -32256};
  const int32_t units[] = {0, 0, 1, 1, 2, 0, -1, -1, -2, 4032, -4032};
  for (size_t i = 0; i < sizeof steps / sizeof *steps; ++i)
    assert_int_equal(rimi_grid_units(&grid, steps[i]), units[i]);
  assert_int_equal(rimi_grid_steps(&grid, -5), -40);
}

/* Sums beyond 16 bits: units grow in time up to a standard deviation, and each sum keeps its half;
 * after that counts are halved too, and the mean stays. */
static void units_grow_before_a_sum_is_too_large(void **state) {
  (void)state;
  for (int sign = -1; sign <= 1; sign += 2) {
    static held h;
    const rim_grid grid = {G, &h.shift, h.cell};
    rimi_grid_clear(&grid, 0);
    int32_t units;
    uint32_t n;
    for (int i = 0; i < 4; ++i)
      assert_false(rimi_grid_add(&grid, 2, 3, sign * 4000));
    row_of(&h, 2, 3, 4, &units, &n);
    assert_int_equal(units, sign * 16000);
    assert_true(rimi_grid_add(&grid, 2, 3, sign * 4000));
    assert_int_equal(h.shift, RIM_GRID_LEAST_SHIFT + 1);
    row_of(&h, 2, 0, G, &units, &n);
    assert_int_equal(units, sign * 10000);
    assert_int_equal(n, 5);
    uint32_t seen = 5;
    for (; h.shift < RIM_GRID_ONE_SHIFT; ++seen)
      rimi_grid_add(&grid, 2, 3, rimi_grid_units(&grid, sign * 32256));
    row_of(&h, 2, 3, 4, &units, &n);
    assert_int_equal(n, seen);
    for (uint32_t i = 0; i < RIM_BINS_MAX_COUNT; ++i)
      rimi_grid_add(&grid, 2, 3, rimi_grid_units(&grid, sign * 32256));
    assert_int_equal(h.shift, RIM_GRID_ONE_SHIFT);
    row_of(&h, 2, 3, 4, &units, &n);
    assert_in_range(n, 100, 16383 / 63 + 1);
    assert_true(fabs(rimi_grid_steps(&grid, units) / (double)n - sign * 32256.0) < 512.0);
    row_of(&h, 2, 0, 3, &units, &n);
    assert_true(units == 0 && n == 0);
  }
}

/* A grid that is filled at once has units for what is to come into a row. */
static void units_are_those_of_what_comes(void **state) {
  (void)state;
  static held h;
  const rim_grid grid = {G, &h.shift, h.cell};
  rimi_grid_clear(&grid, 8191u << 3);
  assert_int_equal(h.shift, 3);
  rimi_grid_clear(&grid, (8191u << 3) + 8u);
  assert_int_equal(h.shift, 4);
  rimi_grid_clear(&grid, 4096u * 32256u);
  assert_in_range(h.shift, RIM_GRID_ONE_SHIFT + 1u, RIM_GRID_MOST_SHIFT - 1u);
  rimi_grid_clear(&grid, UINT32_MAX);
  assert_int_equal(h.shift, RIM_GRID_MOST_SHIFT);
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(cells_cover_the_range),
      cmocka_unit_test(table_equals_plain_sums),
      cmocka_unit_test(halving_halves_every_sum),
      cmocka_unit_test(grid_added_equals_put_and_accumulated),
      cmocka_unit_test(residuals_are_rounded_to_units),
      cmocka_unit_test(units_grow_before_a_sum_is_too_large),
      cmocka_unit_test(units_are_those_of_what_comes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
