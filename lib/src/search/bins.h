/* SPDX-License-Identifier: MIT */
/* search/bins.h - fixed-capacity tables of sufficient statistics (thesis 3.1.1, p. 28: "only
 * sufficient statistics of each discrete state, instead of all the data points, need to be
 * stored").
 *
 * Two kinds of table over unit features u in [0, 1):
 *   - bins: for every feature, bin and channel the sum of residuals in steps of RIM_GRID_STEP; for
 *     every feature and bin the count. They hold everything seen.
 *   - grid: for one pair of features and one channel, G x G cells kept as prefix sums along each
 *     row, so that the statistics of a whole span of cells of a row cost two look-ups. Sum and
 *     count share a word: 4 bytes a cell.
 * Residuals are standardised: variance 1 in nominal running. All tables are of integers: whatever a
 * sum has been, it is exact, and can be checked (monitor/guard.h). Nothing here checks pointers;
 * the callers (select) do.
 *
 * A table may be filled at most RIM_BINS_MAX_COUNT times; then halve it (rimi_bins_halve,
 * rimi_grid_halve), which weighs what was seen by one half. */
#ifndef RIM_BINS_H
#define RIM_BINS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_BINS_MAX 32           /* bins a feature */
#define RIM_GRID_MAX 64           /* cells a side */
#define RIM_BINS_MAX_COUNT 60000u /* observations before halving; below 65536: uint16_t counts */

/* Bytes of the two tables of `rim_bins`; both multiples of 4. */
#define RIM_BINS_SUM_BYTES(features, bins, channels)                                               \
  (4u * (size_t)(features) * (size_t)(bins) * (size_t)(channels))
#define RIM_BINS_COUNT_BYTES(features, bins)                                                       \
  (4u * (((size_t)(features) * (size_t)(bins) + 1u) / 2u))
/* Bytes of one grid; a multiple of 4. */
#define RIM_GRID_BYTES(grid) (4u * (size_t)(grid) * ((size_t)(grid) + 1u))
#define RIM_GRID_STEP (1.0 / 512.0) /* of a residual that is added, at most +-63 */

/* A view of one-dimensional tables in the caller's memory. */
typedef struct rim_bins {
  uint16_t features;
  uint16_t bins;
  uint16_t channels;
  int32_t *sum;    /* [features][bins][channels], in steps: 60000 of 63 standard deviations fit */
  uint16_t *count; /* [features][bins] */
} rim_bins;

/* A view of one pair's grid. Cell (row, column): row from the second feature, column from the
 * first. cell[row][k] holds 65536 * sum + count of the row's cells 0..k-1, modulo 2^32; k is 0 to
 * grid. Sums are in units of 2^*shift steps, *shift at least RIM_GRID_LEAST_SHIFT, and stay within
 * +-16383: the difference of two still has 16 bits. When one has grown beyond, *shift grows and
 * every sum is halved, which loses half a unit; but no unit grows beyond a standard deviation,
 * since rounding would move means: then what was seen weighs one half. A unit is 1/64 at first, or,
 * if that is more, 1/8000 of what the residuals that fill a grid add up to in a row. */
typedef struct rim_grid {
  uint16_t grid;
  uint8_t *shift;
  uint32_t *cell; /* [grid][grid + 1] */
} rim_grid;
#define RIM_GRID_LEAST_SHIFT 3u /* 63 standard deviations are 4032 units */
#define RIM_GRID_ONE_SHIFT 9u   /* one standard deviation */
#define RIM_GRID_MOST_SHIFT 15u /* filled with a ring of 63 standard deviations in one row */

/* Cell of a unit coordinate: floor(u * cells), clamped to 0..cells - 1. u must not be NaN. */
uint16_t rimi_bins_cell(double u, uint16_t cells);

void rimi_bins_clear(const rim_bins *table);
/* Add one observation: bin[f] < bins for every feature, steps[c], its residual, for every channel.
 * O(features * channels). */
void rimi_bins_add(const rim_bins *table, const uint8_t *bin, const int16_t *steps);
/* One (feature, channel) slice into prefix sums: sum[k], count[k] of bins 0..k-1, k = 0..bins; the
 * sums in standard deviations. O(bins). */
void rimi_bins_prefix(const rim_bins *table, uint16_t feature, uint16_t channel, double *sum,
                      double *count);
/* Of each sum and count the half, rounded towards 0. */
void rimi_bins_halve(const rim_bins *table);

/* Empty, for residuals whose absolute values, in steps, add up to no more than `steps` in a row. */
void rimi_grid_clear(const rim_grid *table, uint32_t steps);
/* A residual, in steps, in the grid's units, and such a sum in steps. */
int32_t rimi_grid_units(const rim_grid *table, int32_t steps);
int32_t rimi_grid_steps(const rim_grid *table, int32_t units);
/* Add one observation, in units, to a cell. Returns whether every sum was halved. O(grid), or
 * O(grid^2). */
bool rimi_grid_add(const rim_grid *table, uint32_t row, uint32_t column, int32_t units);
/* The same without keeping the prefix property: any number of these, then one rimi_grid_accumulate,
 * equals as many rimi_grid_add on a grid cleared for as many. O(1), O(grid^2). */
void rimi_grid_put(const rim_grid *table, uint32_t row, uint32_t column, int32_t units);
void rimi_grid_accumulate(const rim_grid *table);
void rimi_grid_halve(const rim_grid *table);

/* Adds to *units and *count those of the cells low..high - 1 of a row. */
static inline void rimi_grid_span(const uint32_t *row, uint32_t low, uint32_t high, int32_t *units,
                                  uint32_t *count) {
  const uint32_t both = row[high] - row[low] + 0x80000000u;
  *count += both & 0xffffu;
  *units += (int32_t)(both >> 16) - 0x8000;
}

#ifdef __cplusplus
}
#endif
#endif
