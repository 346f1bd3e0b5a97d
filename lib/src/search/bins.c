/* SPDX-License-Identifier: MIT */
#include "search/bins.h"

#include <string.h>

uint16_t rimi_bins_cell(double u, uint16_t cells) {
  const double position = u * (double)cells;
  if (!(position > 0.0))
    return 0;
  if (position >= (double)cells)
    return (uint16_t)(cells - 1u);
  return (uint16_t)position;
}

void rimi_bins_clear(const rim_bins *table) {
  memset(table->sum, 0, RIM_BINS_SUM_BYTES(table->features, table->bins, table->channels));
  memset(table->count, 0, 2u * (size_t)table->features * (size_t)table->bins);
}

void rimi_bins_add(const rim_bins *table, const uint8_t *bin, const int16_t *steps) {
  const size_t channels = table->channels;
  for (size_t f = 0; f < table->features; ++f) {
    const size_t cell = f * table->bins + bin[f];
    int32_t *sum = table->sum + cell * channels;
    for (size_t c = 0; c < channels; ++c)
      sum[c] = (int32_t)((uint32_t)sum[c] + (uint32_t)steps[c]); /* defined after an upset too */
    ++table->count[cell];
  }
}

void rimi_bins_prefix(const rim_bins *table, uint16_t feature, uint16_t channel, double *sum,
                      double *count) {
  const size_t channels = table->channels;
  const size_t first = (size_t)feature * table->bins;
  const int32_t *cell_sum = table->sum + first * channels + channel;
  const uint16_t *cell_count = table->count + first;
  double s = 0.0;
  double n = 0.0;
  sum[0] = 0.0;
  count[0] = 0.0;
  for (size_t k = 0; k < table->bins; ++k) {
    s += (double)cell_sum[k * channels];
    n += (double)cell_count[k];
    sum[k + 1] = s * RIM_GRID_STEP;
    count[k + 1] = n;
  }
}

void rimi_bins_halve(const rim_bins *table) {
  const size_t cells = (size_t)table->features * table->bins;
  for (size_t i = 0; i < cells * table->channels; ++i)
    table->sum[i] /= 2;
  for (size_t i = 0; i < cells; ++i)
    table->count[i] = (uint16_t)(table->count[i] / 2u);
}

/* |units| of a row; what a cell holds is 65536 times that, and so is what it is compared with. */
#define GRID_MOST 16383

static uint32_t unit_shift(const rim_grid *table) {
  return *table->shift <= RIM_GRID_MOST_SHIFT ? *table->shift : RIM_GRID_MOST_SHIFT; /* an upset */
}

static int32_t units_of(uint32_t cell) { return (int32_t)((cell + 0x80000000u) >> 16) - 0x8000; }

static uint32_t cell_of(int32_t units, uint32_t count) { return (uint32_t)units * 65536u + count; }

void rimi_grid_clear(const rim_grid *table, uint32_t steps) {
  memset(table->cell, 0, RIM_GRID_BYTES(table->grid));
  *table->shift = RIM_GRID_LEAST_SHIFT;
  while (*table->shift < RIM_GRID_MOST_SHIFT && steps >> *table->shift > GRID_MOST / 2)
    ++*table->shift;
}

int32_t rimi_grid_units(const rim_grid *table, int32_t steps) {
  const int32_t unit = (int32_t)1 << unit_shift(table);
  return (steps >= 0 ? steps + unit / 2 : steps - unit / 2) / unit;
}

int32_t rimi_grid_steps(const rim_grid *table, int32_t units) {
  return units * ((int32_t)1 << unit_shift(table));
}

static void halve_sums(const rim_grid *table, uint32_t halved_counts) {
  const size_t cells = (size_t)table->grid * (table->grid + 1u);
  for (size_t i = 0; i < cells; ++i) {
    const uint32_t cell = table->cell[i];
    table->cell[i] = cell_of(units_of(cell) / 2, (cell & 0xffffu) >> halved_counts);
  }
}

bool rimi_grid_add(const rim_grid *table, uint32_t row, uint32_t column, int32_t units) {
  uint32_t *cell = table->cell + (size_t)row * (table->grid + 1u);
  int32_t largest = 0;
  for (uint32_t k = column + 1u; k <= table->grid; ++k) {
    cell[k] += cell_of(units, 1u);
    const int32_t sum = units_of(cell[k]);
    largest = sum > largest ? sum : -sum > largest ? -sum : largest;
  }
  if (largest <= GRID_MOST)
    return false;
  const bool coarser = *table->shift < RIM_GRID_ONE_SHIFT;
  if (coarser)
    ++*table->shift;
  halve_sums(table, coarser ? 0u : 1u);
  return true;
}

void rimi_grid_put(const rim_grid *table, uint32_t row, uint32_t column, int32_t units) {
  table->cell[(size_t)row * (table->grid + 1u) + column + 1u] += cell_of(units, 1u);
}

void rimi_grid_accumulate(const rim_grid *table) {
  for (size_t row = 0; row < table->grid; ++row) {
    uint32_t *cell = table->cell + row * (table->grid + 1u);
    for (size_t k = 1; k <= table->grid; ++k)
      cell[k] += cell[k - 1u];
  }
}

void rimi_grid_halve(const rim_grid *table) { halve_sums(table, 1u); }
