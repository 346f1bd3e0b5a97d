/* SPDX-License-Identifier: MIT */
/* fleet RECORDING [MONITORS] [ROWS]: a ground station that watches a constellation.
 *
 * So many monitors in one process on one image, every row of the recording offered to each in turn.
 * Prints rows per second of processor time of one core, memory, and whether all of them decided the
 * same. Exit 0; 1 when one decided otherwise; 2 usage; 3 data. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "flight.h"
#include "rim/image.h"
#include "rim/monitor.h"

typedef struct vehicle {
  rim_monitor *monitor;
  uint64_t digest;
} vehicle;

/* Every row to every monitor: what comes from a constellation is as mixed. */
static double fly(vehicle *fleet, size_t monitors, const flight *f, uint32_t count) {
  static double values[RECORDING_MAX_DOUBLES];
  const uint32_t features = rim_monitor_config(fleet[0].monitor, RIM_CONFIG_FEATURES);
  const clock_t began = clock();
  for (uint32_t r = 0; r < count; ++r) {
    const rim_observation now = flight_row(f, r, features, values);
    for (size_t k = 0; k < monitors; ++k) {
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
  const flight f = read_flight(argv[1]);
  const size_t asked = argc > 3 ? (size_t)strtoul(argv[3], NULL, 10) : f.row_count;
  const uint32_t count = asked < f.row_count ? (uint32_t)asked : f.row_count;
  size_t bytes = 0;
  if (monitors == 0 || count == 0 || rim_monitor_size(f.image, f.image_bytes, &bytes) != RIM_OK)
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
  const double took_s = fly(fleet, monitors, &f, count);
  size_t same = 0;
  for (size_t k = 0; k < monitors; ++k)
    same += fleet[k].digest == fleet[0].digest;
  printf("%zu monitors, %u rows each: %.0f rows a second of one core, %zu bytes a monitor, %.1f MB "
         "in all, %zu digests equal\n",
         monitors, count, (double)monitors * count / took_s, bytes,
         1e-6 * (double)(each * monitors + f.image_bytes), same);
  free(memory);
  free(fleet);
  free(f.image);
  return same == monitors ? 0 : 1;
}
