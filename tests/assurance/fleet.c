/* SPDX-License-Identifier: MIT */
/* fleet RECORDING [MONITORS] [ROWS] [BATCH] [UNITS] [THREADS]: a ground station that watches a
 * constellation.
 *
 * So many monitors in one process on one image; the recording's rows are offered BATCH at a time
 * (1, at most 64) to each in turn. With 1 what each needs has left the processor's cache before its
 * next row comes, and is fetched while another works; a station that collects a few rows of a
 * vehicle before it looks at them pays for that once, and hears of an alarm later by as many
 * periods. What is decided does not depend on it.
 * With UNITS (0: those of the image) each row pays for so many units of search, while thresholds
 * stay as they were calibrated: less is found per row, so that an alarm comes later.
 * THREADS (1) form a pool, which takes some monitors at a time until all have had their rows; a
 * monitor belongs to nobody, and needs no lock, since one thread has it at a time.
 * All fly the same rows, so that a processor that predicts branches does so better than it would on
 * as many different vehicles.
 *
 * Prints rows per second of processor time of one core (of all threads together), rows per second
 * of the clock, memory, the row of the first alarm, and whether all of them decided the same.
 * Exit 0; 1 when one decided otherwise; 2 usage; 3 data. */
#define _GNU_SOURCE /* clocks, barriers, large pages */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

#include "base/crc.h"
#include "flight.h"
#include "rim/image.h"
#include "rim/monitor.h"

#define MOST_BATCH 64u
#define MOST_THREADS 256u
#define TAKEN 8u /* monitors at a time */
#define LINE 64u /* bytes that the processor fetches at once */
#define LARGE_PAGE ((size_t)1 << 21)

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

typedef struct pool {
  pthread_barrier_t begin, end; /* of the rows that all monitors get now */
  atomic_size_t next;           /* monitor that nobody has taken */
  vehicle *fleet;
  size_t monitors, bytes; /* how many, and of one */
  rim_observation now[MOST_BATCH];
  double values[MOST_BATCH][RECORDING_MAX_DOUBLES];
  uint32_t first, rows; /* of the recording; rows 0: that was all */
} pool;

/* In large pages where the system has them. The processor remembers where some thousand pages are:
 * of small ones that is a part of a fleet. */
static uint8_t *pages(size_t bytes) {
  const size_t whole = (bytes + LARGE_PAGE - 1u) / LARGE_PAGE * LARGE_PAGE;
  uint8_t *memory = aligned_alloc(LARGE_PAGE, whole);
  if (memory != NULL)
    (void)madvise(memory, whole, MADV_HUGEPAGE);
  return memory;
}

static double seconds(clockid_t which) {
  struct timespec now;
  (void)clock_gettime(which, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void offer(const pool *p, vehicle *v) {
  for (uint32_t i = 0; i < p->rows; ++i) {
    rim_verdict verdict;
    if (rim_monitor_step(v->monitor, &p->now[i], &verdict) != RIM_OK)
      refuse("step", "refused");
    v->digest = rim_verdict_digest(v->digest, &verdict);
    if (v->alarm == 0 && verdict.alarm.state == RIM_ALARM_RAISED)
      v->alarm = p->first + i + 1u;
  }
}

/* A monitor has left the cache since its last rows: it is fetched while the one before it works. */
static void fetch(const pool *p, size_t k) {
  const char *monitor = (const char *)p->fleet[k].monitor;
  for (size_t at = 0; at < p->bytes; at += LINE)
    __builtin_prefetch(monitor + at, 1, 2);
}

static void work(pool *p) {
  for (;;) {
    const size_t from = atomic_fetch_add(&p->next, TAKEN);
    for (size_t k = from; k < from + TAKEN && k < p->monitors; ++k) {
      if (k + 1 < p->monitors)
        fetch(p, k + 1);
      offer(p, &p->fleet[k]);
    }
    if (from + TAKEN >= p->monitors)
      return;
  }
}

typedef struct worker {
  pthread_t thread;
  pool *of;
  double took_s; /* processor time */
} worker;

static void *run(void *argument) {
  worker *self = argument;
  for (;;) {
    (void)pthread_barrier_wait(&self->of->begin);
    if (self->of->rows == 0)
      break;
    work(self->of);
    (void)pthread_barrier_wait(&self->of->end);
  }
  self->took_s = seconds(CLOCK_THREAD_CPUTIME_ID);
  return NULL;
}

/* Every row to every monitor: what comes from a constellation is as mixed. Returns the processor
 * time of all threads, seconds; the calling one is one of them. */
static double fly(pool *p, const flight *f, uint32_t count, uint32_t batch, size_t threads) {
  static worker workers[MOST_THREADS];
  const uint32_t features = rim_monitor_config(p->fleet[0].monitor, RIM_CONFIG_FEATURES);
  if (pthread_barrier_init(&p->begin, NULL, (unsigned)threads) != 0 ||
      pthread_barrier_init(&p->end, NULL, (unsigned)threads) != 0)
    refuse("threads", "cannot wait for each other");
  for (size_t w = 1; w < threads; ++w) {
    workers[w].of = p;
    if (pthread_create(&workers[w].thread, NULL, run, &workers[w]) != 0)
      refuse("threads", "there are not so many");
  }
  double took_s = -seconds(CLOCK_THREAD_CPUTIME_ID);
  for (p->first = 0; p->first < count; p->first += p->rows) {
    p->rows = batch < count - p->first ? batch : count - p->first;
    for (uint32_t i = 0; i < p->rows; ++i)
      p->now[i] = flight_row(f, p->first + i, features, p->values[i]);
    atomic_store(&p->next, 0);
    (void)pthread_barrier_wait(&p->begin);
    work(p);
    (void)pthread_barrier_wait(&p->end);
  }
  p->rows = 0;
  (void)pthread_barrier_wait(&p->begin);
  took_s += seconds(CLOCK_THREAD_CPUTIME_ID);
  for (size_t w = 1; w < threads; ++w) {
    (void)pthread_join(workers[w].thread, NULL);
    took_s += workers[w].took_s;
  }
  (void)pthread_barrier_destroy(&p->begin);
  (void)pthread_barrier_destroy(&p->end);
  return took_s;
}

int main(int argc, char **argv) {
  if (argc < 2 || argc > 7) {
    fputs("usage: fleet RECORDING [MONITORS] [ROWS] [BATCH] [UNITS] [THREADS]\n", stderr);
    return 2;
  }
  const size_t monitors = argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 1000;
  const flight f = read_flight(argv[1]);
  const size_t asked = argc > 3 ? (size_t)strtoul(argv[3], NULL, 10) : f.row_count;
  const uint32_t count = asked < f.row_count ? (uint32_t)asked : f.row_count;
  const size_t batch = argc > 4 ? (size_t)strtoul(argv[4], NULL, 10) : 1;
  const uint32_t units = argc > 5 ? (uint32_t)strtoul(argv[5], NULL, 10) : 0;
  if (units > 0)
    set_units(&f, units);
  const size_t threads = argc > 6 ? (size_t)strtoul(argv[6], NULL, 10) : 1;
  size_t bytes = 0;
  if (monitors == 0 || batch == 0 || batch > MOST_BATCH || count == 0 || threads == 0 ||
      threads > MOST_THREADS || rim_monitor_size(f.image, f.image_bytes, &bytes) != RIM_OK)
    refuse(argv[1], "cannot be flown");
  const size_t each = (bytes + 63u) & ~(size_t)63u;
  vehicle *fleet = calloc(monitors, sizeof *fleet);
  uint8_t *memory = pages(each * monitors);
  if (fleet == NULL || memory == NULL)
    refuse("memory", "there is not so much");
  for (size_t k = 0; k < monitors; ++k) {
    fleet[k].digest = RIM_DIGEST_START;
    if (rim_monitor_init(&fleet[k].monitor, memory + k * each, each, f.image, f.image_bytes) !=
        RIM_OK)
      refuse(argv[1], "its image cannot be used");
  }
  static pool all;
  all.fleet = fleet;
  all.monitors = monitors;
  all.bytes = bytes;
  const double began_s = seconds(CLOCK_MONOTONIC);
  const double took_s = fly(&all, &f, count, (uint32_t)batch, threads);
  const double rows = (double)monitors * count;
  const double per_s = rows / (seconds(CLOCK_MONOTONIC) - began_s);
  size_t same = 0;
  for (size_t k = 0; k < monitors; ++k)
    same += fleet[k].digest == fleet[0].digest;
  printf("%zu monitors, %u rows each, %zu at a time, %zu threads: %.0f rows a second of one core, "
         "%.0f by the clock, %zu bytes a monitor, %.1f MB in all, first alarm at row %u, "
         "%zu digests equal\n",
         monitors, count, batch, threads, rows / took_s, per_s, bytes,
         1e-6 * (double)(each * monitors + f.image_bytes), fleet[0].alarm, same);
  free(memory);
  free(fleet);
  free(f.image);
  return same == monitors ? 0 : 1;
}
