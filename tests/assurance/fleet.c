/* SPDX-License-Identifier: MIT */
/* fleet RECORDING [MONITORS] [ROWS]: a ground station that watches a constellation.
 *
 * So many monitors in one process on one image, every row of the recording offered to each in turn.
 * Prints rows per second of processor time of one core, memory, and whether all of them decided the
 * same. Exit 0; 1 when one decided otherwise; 2 usage; 3 data. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/bytes.h"
#include "replay/recording.h"
#include "rim/image.h"
#include "rim/monitor.h"

#define MOST_BYTES (64u << 20)

typedef struct vehicle {
  rim_monitor *monitor;
  uint64_t digest;
} vehicle;

static _Noreturn void refuse(const char *what, const char *why) {
  fprintf(stderr, "fleet: %s: %s\n", what, why);
  exit(3);
}

static uint8_t *read_all(const char *path) {
  FILE *file = fopen(path, "rb");
  uint8_t *data = aligned_alloc(64, MOST_BYTES);
  if (file == NULL || data == NULL)
    refuse(path, "cannot be read");
  const size_t bytes = fread(data, 1, MOST_BYTES, file);
  fclose(file);
  if (bytes < RECORDING_HEADER_BYTES || memcmp(data, RECORDING_MAGIC, 8) != 0)
    refuse(path, "no recording");
  return data;
}

static rim_observation observation(const rim_monitor *m, const double *row) {
  rim_observation now = {.t_s = row[0], .context = row + 1};
  if (rim_monitor_config(m, RIM_CONFIG_EXTERNAL) != 0) {
    const uint32_t outcomes = rim_monitor_config(m, RIM_CONFIG_OUTCOMES);
    now.outcome = now.context + rim_monitor_config(m, RIM_CONFIG_FEATURES);
    now.mean = now.outcome + outcomes;
    now.sd = now.mean + outcomes;
  }
  return now;
}

/* Every row to every monitor: what comes from a constellation is as mixed. */
static double fly(vehicle *fleet, size_t monitors, const uint8_t *rows, size_t count,
                  size_t doubles) {
  static double row[RECORDING_MAX_DOUBLES];
  const clock_t began = clock();
  for (size_t r = 0; r < count; ++r) {
    for (size_t i = 0; i < doubles; ++i)
      row[i] = rimi_le_f64(rows, r * doubles + i);
    for (size_t k = 0; k < monitors; ++k) {
      const rim_observation now = observation(fleet[k].monitor, row);
      rim_verdict verdict;
      if (rim_monitor_step(fleet[k].monitor, &now, &verdict) != RIM_OK)
        refuse("step", "refused");
      fleet[k].digest = rim_verdict_digest(fleet[k].digest, &verdict);
    }
  }
  return (double)(clock() - began) / (double)CLOCKS_PER_SEC;
}

int main(int argc, char **argv) {
  if (argc < 2 || argc > 4) {
    fputs("usage: fleet RECORDING [MONITORS] [ROWS]\n", stderr);
    return 2;
  }
  const size_t monitors = argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 1000;
  const uint8_t *data = read_all(argv[1]), *image = data + RECORDING_HEADER_BYTES;
  const size_t image_bytes = rimi_le_u32(data, 2), doubles = rimi_le_u32(data, 4);
  size_t count = rimi_le_u32(data, 3), bytes = 0;
  const size_t asked = argc > 3 ? (size_t)strtoul(argv[3], NULL, 10) : count;
  count = asked < count ? asked : count;
  if (monitors == 0 || count == 0 || doubles > RECORDING_MAX_DOUBLES ||
      rim_monitor_size(image, image_bytes, &bytes) != RIM_OK)
    refuse(argv[1], "cannot be flown");
  const size_t each = (bytes + 63u) & ~(size_t)63u;
  vehicle *fleet = calloc(monitors, sizeof *fleet);
  uint8_t *memory = aligned_alloc(64, each * monitors);
  if (fleet == NULL || memory == NULL)
    refuse("memory", "there is not so much");
  for (size_t k = 0; k < monitors; ++k) {
    fleet[k].digest = RIM_DIGEST_START;
    if (rim_monitor_init(&fleet[k].monitor, memory + k * each, each, image, image_bytes) != RIM_OK)
      refuse(argv[1], "its image cannot be used");
  }
  const double took_s =
      fly(fleet, monitors, image + ((image_bytes + 7u) & ~(size_t)7u), count, doubles);
  size_t same = 0;
  for (size_t k = 0; k < monitors; ++k)
    same += fleet[k].digest == fleet[0].digest;
  printf(
      "%zu monitors, %zu rows each: %.0f rows a second of one core, %zu bytes a monitor, %.1f MB "
      "in all, %zu digests equal\n",
      monitors, count, (double)(monitors * count) / took_s, bytes,
      1e-6 * (double)(each * monitors + image_bytes), same);
  free(memory);
  free(fleet);
  return same == monitors ? 0 : 1;
}
