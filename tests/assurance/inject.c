/* SPDX-License-Identifier: MIT */
/* inject RECORDING memory|control|image --flips N --seed S [--from ROW] [--to ROW] [--blame]
 *
 * What single-event upsets do to a monitor: the recording (firmware/replay/record.c) is flown once
 * as it is; then N times a process is forked at a random row, one random bit is turned over there
 * and the flight goes on to its last row. Printed: how many of them crashed, hung, were detected by
 * the library (RIM_LEVEL_INTEGRITY), raised an alarm that the flight without a flip did not raise,
 * changed alarms, changed any verdict, or changed nothing; shares with Wilson's 95 % interval.
 *
 * memory: all of the monitor's bytes; control: the parts that hold pointers, sizes, indices and the
 * alarms' life (header, rows, head of the search); image: the flight image in RAM.
 * --blame: one line for each flip that was neither harmless nor found. Exit 0; 2 usage; 3 data. */
#define _GNU_SOURCE
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/rng.h"
#include "flight.h"
#include "monitor/monitor_private.h"
#include "search/search_private.h"

#define HANG_S 10u
#define WITHIN_S 5.0
#define MAX_AREAS 3u

typedef enum outcome {
  CRASH,
  HANG,
  FALSE_ALARM,
  CHANGED,
  DETECTED,
  DIGEST_ONLY,
  HARMLESS,
  OUTCOMES
} outcome;

static const char *const names[OUTCOMES] = {
    "crash", "hang", "false alarm", "alarms differ", "detected", "digest only", "harmless"};

/* What a child tells. */
typedef struct result {
  uint64_t digest, alarms; /* of all verdicts; of the records alone */
  uint32_t raised, detected_row;
  bool ended, detected;
} result;

typedef struct area {
  uint8_t *at;
  size_t bytes;
} area;

static void fly_row(rim_monitor *m, const flight *f, uint32_t row, result *r) {
  double values[RECORDING_MAX_DOUBLES];
  const rim_observation now = flight_row(f, row, m->words[RIM_CONFIG_FEATURES], values);
  rim_verdict v;
  if (rim_monitor_step(m, &now, &v) != RIM_OK)
    return;
  r->digest = rim_verdict_digest(r->digest, &v);
  if (v.level == RIM_LEVEL_INTEGRITY && !r->detected) {
    r->detected = true;
    r->detected_row = row;
  }
  rim_alarm record = v.alarm;
  bool is_record = record.seq != 0;
  for (int guard = 0; is_record && guard < 8; ++guard) {
    const rim_verdict of = {.alarm = record};
    r->alarms = rim_verdict_digest(r->alarms, &of);
    r->raised += record.state == RIM_ALARM_RAISED;
    is_record = rim_monitor_next_record(m, &record);
  }
}

static size_t find_areas(rim_monitor *m, const char *where, const flight *f, size_t memory_bytes,
                         area *areas) {
  if (strcmp(where, "memory") == 0) {
    areas[0] = (area){(uint8_t *)m, memory_bytes};
    return 1;
  }
  if (strcmp(where, "image") == 0) {
    areas[0] = (area){f->image, f->image_bytes};
    return 1;
  }
  if (strcmp(where, "control") != 0) {
    fprintf(stderr, "inject: flips are into memory, control or image, not '%s'\n", where);
    exit(2);
  }
  areas[0] = (area){(uint8_t *)m, sizeof *m};
  areas[1].at = (uint8_t *)(uintptr_t)rimi_blocks_control(m->rows, &areas[1].bytes);
  if (m->search != NULL)
    areas[2] = (area){(uint8_t *)m->search, offsetof(struct rim_search, bins)};
  else
    areas[2].at = (uint8_t *)(uintptr_t)rimi_select_control(m->select, &areas[2].bytes);
  return 3;
}

static void flip(const area *areas, size_t count, uint64_t bit, size_t *offset) {
  for (size_t i = 0; i < count; ++i) {
    if (bit < 8u * (uint64_t)areas[i].bytes) {
      areas[i].at[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
      *offset = (size_t)(bit / 8u);
      return;
    }
    bit -= 8u * (uint64_t)areas[i].bytes;
  }
}

static outcome judge(const result *got, int status, const result *clean, bool quiet) {
  if (WIFSIGNALED(status))
    return WTERMSIG(status) == SIGALRM ? HANG : CRASH;
  if (!got->ended)
    return CRASH;
  if (got->raised > clean->raised && quiet)
    return FALSE_ALARM;
  if (got->detected)
    return DETECTED;
  if (got->alarms != clean->alarms)
    return CHANGED;
  return got->digest != clean->digest ? DIGEST_ONLY : HARMLESS;
}

/* Forks, turns a bit over, flies on to the row `to`. */
static outcome try_flip(rim_monitor *m, const flight *f, const result *so_far, uint32_t row,
                        uint32_t to, const area *areas, size_t count, uint64_t bit,
                        const result *clean, result *got) {
  int ends[2];
  if (pipe(ends) != 0)
    refuse("pipe", strerror(errno));
  fflush(stdout);
  const pid_t child = fork();
  if (child < 0)
    refuse("fork", strerror(errno));
  if (child == 0) {
    result r = *so_far;
    size_t offset;
    alarm(HANG_S);
    flip(areas, count, bit, &offset);
    for (; row < to; ++row)
      fly_row(m, f, row, &r);
    r.ended = true;
    _exit(write(ends[1], &r, sizeof r) == (ssize_t)sizeof r ? 0 : 1);
  }
  close(ends[1]);
  memset(got, 0, sizeof *got);
  const ssize_t bytes = read(ends[0], got, sizeof *got);
  got->ended = bytes == (ssize_t)sizeof *got && got->ended;
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return judge(got, status, clean, clean->raised == 0);
}

static void print_share(const char *what, uint32_t k, uint32_t n) {
  const double p = (double)k / n, z = 1.96, d = 1.0 + z * z / n;
  const double half = z * sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * (double)n));
  const double low = (p + z * z / (2.0 * n) - half) / d, high = (p + z * z / (2.0 * n) + half) / d;
  printf("  %-14s %7u  %7.3f %% [%.3f, %.3f]\n", what, k, 100.0 * p, 100.0 * fmax(low, 0.0),
         100.0 * high);
}

typedef struct options {
  uint32_t flips, from, to;
  uint64_t seed;
  bool blame;
} options;

static int by_row(const void *a, const void *b) {
  const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
  return (x > y) - (x < y);
}

static uint64_t one_below(rim_rng *rng, uint64_t n) {
  const uint64_t high = rimi_rng_u32(rng);
  return (high << 32 | rimi_rng_u32(rng)) % n;
}

/* Flips after which at least WITHIN_S of flight came, and how many of them were found in it. */
typedef struct latency {
  uint32_t flips, found;
  double latest_s;
} latency;

static void print_table(const uint32_t *counts, const options *o, const latency *l) {
  for (size_t i = 0; i < OUTCOMES; ++i)
    print_share(names[i], counts[i], o->flips);
  print_share("det. or harml.", counts[DETECTED] + counts[HARMLESS], o->flips);
  if (l->flips > 0)
    print_share("found in 5 s", l->found, l->flips);
  printf("  (of %u flips with 5 s of flight after them; latest detection after %.2f s)\n", l->flips,
         l->latest_s);
}

static double row_s(const flight *f, uint32_t row) {
  return rimi_le_f64(f->rows, (size_t)row * f->doubles);
}

static void campaign(rim_monitor *m, const flight *f, const options *o, const area *areas,
                     size_t count, const result *start, const result *clean, const char *where) {
  uint32_t *rows = calloc(o->flips, sizeof *rows), counts[OUTCOMES] = {0};
  rim_rng rng;
  rimi_rng_seed(&rng, o->seed, 1);
  for (uint32_t i = 0; i < o->flips; ++i)
    rows[i] = o->from + (uint32_t)one_below(&rng, o->to - o->from);
  qsort(rows, o->flips, sizeof *rows, by_row);
  uint64_t bits = 0;
  for (size_t i = 0; i < count; ++i)
    bits += 8u * (uint64_t)areas[i].bytes;
  result now = *start;
  uint32_t row = o->from;
  latency late = {0, 0, 0.0};
  const double end_s = row_s(f, o->to - 1u);
  printf(
      "%s: %u flips of one bit in %llu bytes, rows %u..%u, seed %llu; alarms without a flip: %u\n",
      where, o->flips, (unsigned long long)(bits / 8u), o->from, o->to, (unsigned long long)o->seed,
      clean->raised);
  for (uint32_t i = 0; i < o->flips; ++i) {
    for (; row < rows[i]; ++row)
      fly_row(m, f, row, &now);
    const uint64_t bit = one_below(&rng, bits);
    result got;
    const outcome of = try_flip(m, f, &now, row, o->to, areas, count, bit, clean, &got);
    ++counts[of];
    const double took_s = got.detected ? row_s(f, got.detected_row) - row_s(f, row) : INFINITY;
    late.flips += end_s - row_s(f, row) >= WITHIN_S;
    late.found += end_s - row_s(f, row) >= WITHIN_S && took_s <= WITHIN_S;
    late.latest_s = got.detected ? fmax(late.latest_s, took_s) : late.latest_s;
    if (o->blame && of != HARMLESS && of != DETECTED)
      printf("%s: byte %llu bit %u at row %u%s\n", names[of], (unsigned long long)(bit / 8u),
             (unsigned)(bit % 8u), row, got.detected ? ", detected later" : "");
  }
  print_table(counts, o, &late);
  free(rows);
}

static bool read_option(options *o, const char *key, const char *value) {
  char *end = NULL;
  const unsigned long long n = value != NULL ? strtoull(value, &end, 10) : 0;
  if (value == NULL || end == value || *end != '\0')
    return false;
  if (strcmp(key, "--flips") == 0 && n > 0 && n <= 1000000)
    o->flips = (uint32_t)n;
  else if (strcmp(key, "--seed") == 0)
    o->seed = n;
  else if (strcmp(key, "--from") == 0)
    o->from = (uint32_t)n;
  else if (strcmp(key, "--to") == 0)
    o->to = (uint32_t)n;
  else
    return false;
  return true;
}

int main(int argc, char **argv) {
  options o = {.flips = 1000, .to = UINT32_MAX};
  bool is_usage = argc >= 3;
  for (int i = 3; i < argc && is_usage; ++i) {
    if (strcmp(argv[i], "--blame") == 0)
      o.blame = true;
    else
      is_usage = read_option(&o, argv[i], i + 1 < argc ? argv[i + 1] : NULL) && ++i < argc;
  }
  if (!is_usage) {
    fputs("usage: inject RECORDING memory|control|image [--flips N] [--seed S] [--from ROW] "
          "[--to ROW] [--blame]\n",
          stderr);
    return 2;
  }
  const flight f = read_flight(argv[1]);
  o.to = o.to < f.row_count ? o.to : f.row_count;
  if (o.from >= o.to)
    refuse(argv[1], "has no such rows");
  size_t bytes = 0;
  rim_monitor *m = NULL;
  if (rim_monitor_size(f.image, f.image_bytes, &bytes) != RIM_OK)
    refuse(argv[1], "its image cannot be used");
  void *memory = aligned_alloc(64, (bytes + 63u) & ~(size_t)63u);
  if (memory == NULL || rim_monitor_init(&m, memory, bytes, f.image, f.image_bytes) != RIM_OK)
    refuse(argv[1], "its image cannot be used");
  result start = {.digest = RIM_DIGEST_START, .alarms = RIM_DIGEST_START};
  for (uint32_t row = 0; row < o.from; ++row)
    fly_row(m, &f, row, &start);
  const uint32_t before = start.raised;
  start.raised = 0;
  area areas[MAX_AREAS];
  const size_t count = find_areas(m, argv[2], &f, bytes, areas);
  /* The flight without a flip, in a child too. */
  area none = {NULL, 0};
  result clean;
  if (try_flip(m, &f, &start, o.from, o.to, &none, 0, 0, &start, &clean) == CRASH || !clean.ended)
    refuse(argv[1], "crashes without a flip");
  if (before > 0)
    printf("%u alarms were raised before row %u\n", before, o.from);
  campaign(m, &f, &o, areas, count, &start, &clean, argv[2]);
  free(memory);
  free(f.image);
  return 0;
}
