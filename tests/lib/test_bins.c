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
static float sum[D * B * C];
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
    float r[C];
    for (int f = 0; f < D; ++f)
      bin[f] = (uint8_t)rimi_rng_below(&rng, B);
    for (int c = 0; c < C; ++c)
      r[c] = (float)((int)rimi_rng_below(&rng, 2001) - 1000) / 512.0f;
    rimi_bins_add(&table, bin, r);
    for (int f = 0; f < D; ++f) {
      ++n[f][bin[f]];
      for (int c = 0; c < C; ++c)
        s[f][bin[f]][c] += (double)r[c];
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
  assert_true(after_s[B] == 0.5 * before_s[B]);
  for (int k = 0; k < B; ++k) /* each cell, the first and the last */
    assert_true(after_n[k + 1] - after_n[k] == floor(0.5 * (before_n[k + 1] - before_n[k])));
  double all = 0.0;
  for (uint16_t f = 0; f < D; ++f) {
    double first_n[B + 1];
    rimi_bins_prefix(&table, f, 0, before_s, first_n);
    all += first_n[B];
    assert_true(first_n[1] == floor(0.5 * n[f][0]));
  }
  assert_true(all <= 0.5 * D * N);
}

/* Each sum, the first and the last too. */
static void halving_halves_every_sum(void **state) {
  (void)state;
  for (int i = 0; i < D * B * C; ++i)
    sum[i] = (float)(i + 1);
  rimi_bins_halve(&table);
  for (int i = 0; i < D * B * C; ++i)
    assert_true(sum[i] == 0.5f * (float)(i + 1));
}

static void grid_added_equals_put_and_accumulated(void **state) {
  (void)state;
  static float s1[G * (G + 1)];
  static float s2[G * (G + 1)];
  static uint16_t n1[G * (G + 1)];
  static uint16_t n2[G * (G + 1)];
  const rim_grid one = {G, s1, n1};
  const rim_grid two = {G, s2, n2};
  rimi_grid_clear(&one);
  rimi_grid_clear(&two);
  double row_sum[G] = {0};
  int row_count[G] = {0};
  for (int i = 0; i < N; ++i) {
    const uint16_t row = (uint16_t)rimi_rng_below(&rng, G);
    const uint16_t column = (uint16_t)rimi_rng_below(&rng, G);
    const double r = ((int)rimi_rng_below(&rng, 2001) - 1000) / 512.0;
    rimi_grid_add(&one, row, column, r);
    rimi_grid_put(&two, row, column, r);
    row_sum[row] += r;
    ++row_count[row];
  }
  rimi_grid_accumulate(&two);
  assert_memory_equal(s1, s2, sizeof s1);
  assert_memory_equal(n1, n2, sizeof n1);
  for (int row = 0; row < G; ++row) {
    assert_true(s1[row * (G + 1)] == 0.0f && n1[row * (G + 1)] == 0);
    assert_true((double)s1[row * (G + 1) + G] == row_sum[row]);
    assert_int_equal(n1[row * (G + 1) + G], row_count[row]);
    for (int k = 0; k < G; ++k)
      assert_true(n1[row * (G + 1) + k] <= n1[row * (G + 1) + k + 1]);
  }
  rimi_grid_halve(&one);
  for (int i = 0; i < G * (G + 1); ++i)
    assert_true(s1[i] == 0.5f * s2[i] && n1[i] == n2[i] / 2);
  for (int row = 0; row < G; ++row) {
    for (int k = 0; k < G; ++k)
      assert_true(n1[row * (G + 1) + k] <= n1[row * (G + 1) + k + 1]);
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(cells_cover_the_range),
      cmocka_unit_test(table_equals_plain_sums),
      cmocka_unit_test(halving_halves_every_sum),
      cmocka_unit_test(grid_added_equals_put_and_accumulated),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
