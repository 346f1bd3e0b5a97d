/* SPDX-License-Identifier: MIT */
/* fleet RECORDING [MONITORS] [ROWS] [BATCH] [UNITS]: a ground station that watches a constellation.
 *
 * So many monitors in one process on one image; the recording's rows are offered BATCH at a time
 * (1, at most 64) to each in turn. With 1 what each needs has left the processor's cache before its
 * next row comes; a station that collects a few rows of a vehicle before it looks at them pays for
 * that once, and hears of an alarm later by as many periods. What is decided does not depend on it.
 * With UNITS each row pays for so many units of search instead of those of the image, whose
 * thresholds stay as they were calibrated: less is found per row, so that an alarm comes later.
 * All fly the same rows, so that a processor that predicts branches does so better than it would on
 * as many different vehicles.
 *
 * Prints rows per second of processor time of one core, memory, the row of the first alarm, and
 * whether all of them decided the same. Exit 0; 1 when one decided otherwise; 2 usage; 3 data. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/crc.h"
#include "flight.h"
#include "rim/image.h"
#include "rim/monitor.h"

#define MOST_BATCH 64u

typedef struct vehicle {
  rim_monitor *monitor;
  uint64_t digest;
  uint32_t alarm; /* row of the first, from 1 on; 0: none */
} vehicle;

/* The image with another budget, and its check sums as rim/image.h says them. */
static void set_units(const flight *f, uint32_t units) {
  rim_image view;
  const uint8_t *config;
  size_t bytes;
  if (rim_image_open(&view, f->image, f->image_bytes) != RIM_OK ||
      rim_image_section(&view, RIM_SECTION_CONFIG, &config, &bytes) != RIM_OK)
    refuse("image", "has no configuration");
  uint8_t *at = f->image + (config - f->image);
  (void)rimi_le_put_u32(at + 4u * RIM_CONFIG_BUDGET, units);
  (void)rimi_le_put_u32(f->image + 28, rimi_crc32(0, f->image + 64, f->image_bytes - 64));
  (void)rimi_le_put_u32(f->image + 32, 0);
  (void)rimi_le_put_u32(f->image + 32, rimi_crc32(0, f->image, 64));
}

/* Every row to every monitor: what comes from a constellation is as mixed. */
static double fly(vehicle *fleet, size_t monitors, const flight *f, uint32_t count,
                  uint32_t batch) {
  static double values[MOST_BATCH][RECORDING_MAX_DOUBLES];
  static rim_observation now[MOST_BATCH];
  const uint32_t features = rim_monitor_config(fleet[0].monitor, RIM_CONFIG_FEATURES);
  const clock_t began = clock();
  for (uint32_t first = 0; first < count; first += batch) {
    const uint32_t some = batch < count - first ? batch : count - first;
    for (uint32_t i = 0; i < some; ++i)
      now[i] = flight_row(f, first + i, features, values[i]);
    for (size_t k = 0; k < monitors; ++k) {
      for (uint32_t i = 0; i < some; ++i) {
        rim_verdict verdict;
        if (rim_monitor_step(fleet[k].monitor, &now[i], &verdict) != RIM_OK)
          refuse("step", "refused");
        fleet[k].digest = rim_verdict_digest(fleet[k].digest, &verdict);
        if (fleet[k].alarm == 0 && verdict.alarm.state == RIM_ALARM_RAISED)
          fleet[k].alarm = first + i + 1u;
      }
    }
  }
  return (double)(clock() - began) / (double)CLOCKS_PER_SEC;
}

int main(int argc, char **argv) {
  if (argc < 2 || argc > 6) {
    fputs("usage: fleet RECORDING [MONITORS] [ROWS] [BATCH] [UNITS]\n", stderr);
    return 2;
  }
  const size_t monitors = argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 1000;
  const flight f = read_flight(argv[1]);
  const size_t asked = argc > 3 ? (size_t)strtoul(argv[3], NULL, 10) : f.row_count;
  const uint32_t count = asked < f.row_count ? (uint32_t)asked : f.row_count;
  const size_t batch = argc > 4 ? (size_t)strtoul(argv[4], NULL, 10) : 1;
  if (argc > 5)
    set_units(&f, (uint32_t)strtoul(argv[5], NULL, 10));
  size_t bytes = 0;
  if (monitors == 0 || batch == 0 || batch > MOST_BATCH || count == 0 ||
      rim_monitor_size(f.image, f.image_bytes, &bytes) != RIM_OK)
    refuse(argv[1], "cannot be flown");
  const size_t each = (bytes + 63u) & ~(size_t)63u;
  vehicle *fleet = calloc(monitors, sizeof *fleet);
  uint8_t *memory = aligned_alloc(64, each * monitors);
  if (fleet == NULL || memory == NULL)
    refuse("memory", "there is not so much");
  for (size_t k = 0; k < monitors; ++k) {
    fleet[k].digest = RIM_DIGEST_START;
    if (rim_monitor_init(&fleet[k].monitor, memory + k * each, each, f.image, f.image_bytes) !=
        RIM_OK)
      refuse(argv[1], "its image cannot be used");
  }
  const double took_s = fly(fleet, monitors, &f, count, (uint32_t)batch);
  size_t same = 0;
  for (size_t k = 0; k < monitors; ++k)
    same += fleet[k].digest == fleet[0].digest;
  printf("%zu monitors, %u rows each, %zu at a time: %.0f rows a second of one core, %zu bytes a "
         "monitor, %.1f MB "
         "in all, first alarm at row %u, %zu digests equal\n",
         monitors, count, batch, (double)monitors * count / took_s, bytes,
         1e-6 * (double)(each * monitors + f.image_bytes), fleet[0].alarm, same);
  free(memory);
  free(fleet);
  free(f.image);
  return same == monitors ? 0 : 1;
}
