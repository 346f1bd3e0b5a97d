/* SPDX-License-Identifier: MIT */
/* rim/bins.h - fixed-capacity tables of sufficient statistics (thesis 3.1.1, p. 28: "only
 * sufficient statistics of each discrete state, instead of all the data points, need to be
 * stored").
 *
 * Two kinds of table over unit features u in [0, 1):
 *   - bins: for every feature, bin and channel the sum of residuals; for every feature and bin the
 *     count. They hold everything seen.
 *   - grid: for one pair of features and one channel, G x G cells kept as prefix sums along each
 *     row, so that the statistics of a whole span of cells of a row cost two look-ups.
 * Residuals are standardised: variance 1 in nominal running. Storage is float and uint16_t; all
 * arithmetic is double. Nothing here checks pointers: the callers (select) do.
 *
 * A table may be filled at most RIM_BINS_MAX_COUNT times; then halve it (rimi_bins_halve,
 * rimi_grid_halve), which weighs what was seen by one half. */
#ifndef RIM_BINS_H
#define RIM_BINS_H

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
/* Bytes of one grid; multiples of 4. */
#define RIM_GRID_SUM_BYTES(grid) (4u * (size_t)(grid) * ((size_t)(grid) + 1u))
#define RIM_GRID_COUNT_BYTES(grid) (2u * (size_t)(grid) * ((size_t)(grid) + 1u))

/* A view of one-dimensional tables in the caller's memory. */
typedef struct rim_bins {
  uint16_t features;
  uint16_t bins;
  uint16_t channels;
  float *sum;      /* [features][bins][channels] */
  uint16_t *count; /* [features][bins] */
} rim_bins;

/* A view of one pair's grid. Cell (row, column): row from the second feature, column from the
 * first. sum[row][k] holds the residuals of the row's cells 0..k-1; k = 0..grid. */
typedef struct rim_grid {
  uint16_t grid;
  float *sum;      /* [grid][grid + 1] */
  uint16_t *count; /* [grid][grid + 1] */
} rim_grid;

/* Cell of a unit coordinate: floor(u * cells), clamped to 0..cells - 1. u must not be NaN. */
uint16_t rimi_bins_cell(double u, uint16_t cells);

void rimi_bins_clear(const rim_bins *table);
/* Add one observation: bin[f] < bins for every feature, residual[c] for every channel.
 * O(features * channels). */
void rimi_bins_add(const rim_bins *table, const uint8_t *bin, const float *residual);
/* One (feature, channel) slice into prefix sums: sum[k], count[k] of bins 0..k-1, k = 0..bins.
 * O(bins). */
void rimi_bins_prefix(const rim_bins *table, uint16_t feature, uint16_t channel, double *sum,
                      double *count);
void rimi_bins_halve(const rim_bins *table);

void rimi_grid_clear(const rim_grid *table);
/* Add one observation to a cell. O(grid). */
void rimi_grid_add(const rim_grid *table, uint16_t row, uint16_t column, double residual);
/* The same without keeping the prefix property: any number of these, then one rimi_grid_accumulate,
 * equals as many rimi_grid_add on an empty grid (up to rounding of float sums). O(1), O(grid^2). */
void rimi_grid_put(const rim_grid *table, uint16_t row, uint16_t column, double residual);
void rimi_grid_accumulate(const rim_grid *table);
void rimi_grid_halve(const rim_grid *table);

#ifdef __cplusplus
}
#endif
#endif
