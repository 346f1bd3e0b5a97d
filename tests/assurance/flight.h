/* SPDX-License-Identifier: MIT */
/* flight.h - a recording (firmware/replay/recording.h) read whole, and its rows as observations. */
#ifndef FLIGHT_H
#define FLIGHT_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "replay/recording.h"
#include "rim/monitor.h"

typedef struct flight {
  uint8_t *image; /* free() it; the rows lie behind it */
  size_t image_bytes;
  const uint8_t *rows;
  uint32_t row_count, doubles;
} flight;

/* Ends the program with exit code 3. */
static inline _Noreturn void refuse(const char *what, const char *why) {
  fprintf(stderr, "%s: %s\n", what, why);
  exit(3);
}

static inline flight read_flight(const char *path) {
  FILE *file = fopen(path, "rb");
  if (file == NULL)
    refuse(path, strerror(errno));
  uint8_t head[RECORDING_HEADER_BYTES];
  if (fread(head, 1, sizeof head, file) != sizeof head || memcmp(head, RECORDING_MAGIC, 8) != 0)
    refuse(path, "no recording");
  flight f = {.image_bytes = rimi_le_u32(head, 2),
              .row_count = rimi_le_u32(head, 3),
              .doubles = rimi_le_u32(head, 4)};
  if (f.doubles == 0 || f.doubles > RECORDING_MAX_DOUBLES)
    refuse(path, "its rows are too wide");
  const size_t padded = (f.image_bytes + 7u) & ~(size_t)7u;
  const size_t row_bytes = (size_t)8 * f.doubles * f.row_count;
  f.image = aligned_alloc(64, (padded + row_bytes + 63u) & ~(size_t)63u);
  if (f.image == NULL || fread(f.image, 1, padded + row_bytes, file) != padded + row_bytes)
    refuse(path, "too short");
  fclose(file);
  f.rows = f.image + padded;
  return f;
}

/* Row `row` < row_count, its numbers in values[RECORDING_MAX_DOUBLES]. The image may be damaged:
 * what the rows hold beside `features` features follows from their width. */
static inline rim_observation flight_row(const flight *f, uint32_t row, uint32_t features,
                                         double *values) {
  for (uint32_t i = 0; i < f->doubles; ++i)
    values[i] = rimi_le_f64(f->rows, (size_t)row * f->doubles + i);
  rim_observation now = {.t_s = values[0], .context = values + 1};
  if (features < f->doubles - 1u && (f->doubles - 1u - features) % 3u == 0) {
    const uint32_t outcomes = (f->doubles - 1u - features) / 3u;
    now.outcome = now.context + features;
    now.mean = now.outcome + outcomes;
    now.sd = now.mean + outcomes;
  }
  return now;
}

#endif
