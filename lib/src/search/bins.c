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

void rimi_bins_add(const rim_bins *table, const uint8_t *bin, const float *residual) {
  const size_t channels = table->channels;
  for (size_t f = 0; f < table->features; ++f) {
    const size_t cell = f * table->bins + bin[f];
    float *sum = table->sum + cell * channels;
    for (size_t c = 0; c < channels; ++c)
      sum[c] += residual[c];
    ++table->count[cell];
  }
}

void rimi_bins_prefix(const rim_bins *table, uint16_t feature, uint16_t channel, double *sum,
                      double *count) {
  const size_t channels = table->channels;
  const size_t first = (size_t)feature * table->bins;
  const float *cell_sum = table->sum + first * channels + channel;
  const uint16_t *cell_count = table->count + first;
  double s = 0.0;
  double n = 0.0;
  sum[0] = 0.0;
  count[0] = 0.0;
  for (size_t k = 0; k < table->bins; ++k) {
    s += (double)cell_sum[k * channels];
    n += (double)cell_count[k];
    sum[k + 1] = s;
    count[k + 1] = n;
  }
}

void rimi_bins_halve(const rim_bins *table) {
  const size_t cells = (size_t)table->features * table->bins;
  for (size_t i = 0; i < cells * table->channels; ++i)
    table->sum[i] *= 0.5f;
  for (size_t i = 0; i < cells; ++i)
    table->count[i] = (uint16_t)(table->count[i] / 2u);
}

void rimi_grid_clear(const rim_grid *table) {
  memset(table->sum, 0, RIM_GRID_SUM_BYTES(table->grid));
  memset(table->count, 0, RIM_GRID_COUNT_BYTES(table->grid));
}

void rimi_grid_add(const rim_grid *table, uint16_t row, uint16_t column, double residual) {
  const size_t base = (size_t)row * (table->grid + 1u);
  for (size_t k = column + 1u; k <= table->grid; ++k) {
    table->sum[base + k] = (float)((double)table->sum[base + k] + residual);
    ++table->count[base + k];
  }
}

void rimi_grid_put(const rim_grid *table, uint16_t row, uint16_t column, double residual) {
  const size_t cell = (size_t)row * (table->grid + 1u) + column + 1u;
  table->sum[cell] = (float)((double)table->sum[cell] + residual);
  ++table->count[cell];
}

void rimi_grid_accumulate(const rim_grid *table) {
  for (size_t row = 0; row < table->grid; ++row) {
    const size_t base = row * (table->grid + 1u);
    double s = 0.0;
    uint32_t n = 0;
    for (size_t k = 1; k <= table->grid; ++k) {
      s += (double)table->sum[base + k];
      n += table->count[base + k];
      table->sum[base + k] = (float)s;
      table->count[base + k] = (uint16_t)n;
    }
  }
}

void rimi_grid_halve(const rim_grid *table) {
  const size_t cells = (size_t)table->grid * (table->grid + 1u);
  for (size_t i = 0; i < cells; ++i) {
    table->sum[i] *= 0.5f;
    table->count[i] = (uint16_t)(table->count[i] / 2u);
  }
}
