/* SPDX-License-Identifier: MIT */
/* fuzz_repaired.h - the decoders behind a check sum, which is made good again before they see the
 * bytes: a search by chance never gets past it. */
#ifndef FUZZ_REPAIRED_H
#define FUZZ_REPAIRED_H

#define _GNU_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "image/correct.h"
#include "interference/detector.h"
#include "monitor/work.h"
#include "rim/image.h"
#include "rim/monitor.h"
#include "rimd/state.h"

#define FUZZ_MONITOR_BYTES (1u << 19)
#define FUZZ_ROWS 48u
#define FUZZ_WORK 400000000u /* instructions of all rows, by the bound of a step */
#define FUZZ_STATE_CRC 44u   /* where rimd/state.c has it, within a head of 48 bytes */
#define FUZZ_STATE_DAEMON 64u
#define FUZZ_STATE_MONITOR 512u

static inline void fuzz_put(uint8_t *at, uint32_t value) { (void)rimi_le_put_u32(at, value); }

/* Both sections with a sum of their own have it in a word that the sum leaves out. */
static inline void fuzz_repair_section(uint8_t *section, size_t bytes, size_t at) {
  if (bytes < at + 4u)
    return;
  const uint32_t crc = rimi_crc32(0, section, at);
  fuzz_put(section + at, rimi_crc32(crc, section + at + 4u, bytes - at - 4u));
}

static inline void fuzz_repair_image(uint8_t *image, size_t bytes) {
  if (bytes < 64u)
    return;
  memcpy(image, RIM_IMAGE_MAGIC, 8);
  fuzz_put(image + 8, RIM_IMAGE_ENDIAN_TAG);
  fuzz_put(image + 12, RIM_IMAGE_MAJOR);
  fuzz_put(image + 16, (uint32_t)bytes);
  memset(image + 36, 0, 28);
  const uint32_t sections = rimi_le_u32(image, 6);
  for (uint32_t i = 0; i < sections && 64u + 16u * (i + 1u) <= bytes; ++i) {
    const uint8_t *entry = image + 64u + 16u * i;
    const uint32_t id = rimi_le_u32(entry, 0), offset = rimi_le_u32(entry, 1);
    const uint32_t size = rimi_le_u32(entry, 2);
    const size_t at = id == RIM_SECTION_CORRECT ? 28u : id == RIM_SECTION_INTERFERENCE ? 12u : 0u;
    if (at != 0 && offset <= bytes && size <= bytes - offset)
      fuzz_repair_section(image + offset, size, at);
  }
  fuzz_put(image + 28, rimi_crc32(0, image + 64, bytes - 64u));
  fuzz_put(image + 32, 0);
  fuzz_put(image + 32, rimi_crc32(0, image, 64));
}

/* A whole monitor on whatever opens: rows that follow from a number of the image, then what a
 * restart does with its bytes. */
static inline void fuzz_flight(const uint8_t *data, size_t bytes) {
  static _Alignas(8) uint8_t memory[FUZZ_MONITOR_BYTES];
  static double context[RIM_MONITOR_MAX_FEATURES], outcome[RIM_MONITOR_MAX_OUTCOMES],
      mean[RIM_MONITOR_MAX_OUTCOMES], sd[RIM_MONITOR_MAX_OUTCOMES];
  uint64_t *copy = malloc(bytes > 0 ? bytes : 1);
  rim_monitor *m = NULL;
  if (copy == NULL)
    return;
  uint8_t *image = (uint8_t *)copy;
  memcpy(image, data, bytes);
  fuzz_repair_image(image, bytes);
  if (rim_monitor_init(&m, memory, sizeof memory, image, bytes) == RIM_OK) {
    uint32_t random = rimi_le_u32(image, 7);
    const double period_s = 1e-6 * (double)rim_monitor_config(m, RIM_CONFIG_PERIOD_US);
    rim_observation row = {.context = context, .outcome = outcome, .mean = mean, .sd = sd};
    rim_verdict verdict;
    rim_work_counts counts;
    rim_work work = {.step = UINT32_MAX};
    if (rimi_work_counts_of(image, bytes, &counts) == RIM_OK)
      rimi_work_bound(&counts, &work);
    /* An image may ask for as much search as it likes. */
    const uint32_t rows = work.step > FUZZ_WORK / FUZZ_ROWS ? FUZZ_WORK / work.step : FUZZ_ROWS;
    for (uint32_t t = 0; t < rows; ++t) {
      row.t_s = (double)t * (period_s > 0.0 ? period_s : 0.1);
      for (size_t i = 0; i < RIM_MONITOR_MAX_FEATURES; ++i) {
        random = random * 1664525u + 1013904223u;
        context[i] = 1e-4 * (double)(random >> 12) - 50.0;
        outcome[i] = 0.01 * context[i] + mean[i];
        sd[i] = 1.0;
      }
      if (rim_monitor_step(m, &row, &verdict) != RIM_OK || verdict.level == RIM_LEVEL_INTEGRITY)
        abort();
    }
    if (rim_monitor_attach(&m, memory, sizeof memory, image, bytes) != RIM_OK)
      abort();
    (void)rim_monitor_membership(m, context);
  }
  free(copy);
}

/* rimd's state file. */
static inline void fuzz_state(const uint8_t *data, size_t bytes) {
  static uint8_t daemon[FUZZ_STATE_DAEMON], monitor[FUZZ_STATE_MONITOR], scratch[4096];
  uint8_t file[2048];
  const state_parts parts = {.daemon = daemon,
                             .monitor = monitor,
                             .daemon_bytes = sizeof daemon,
                             .monitor_bytes = sizeof monitor,
                             .model_id = 7,
                             .image_crc = 8};
  char name[64];
  if (bytes > sizeof file || state_bytes(&parts) > sizeof scratch)
    return;
  memcpy(file, data, bytes);
  if (bytes >= FUZZ_STATE_CRC + 4u) {
    memset(file + FUZZ_STATE_CRC, 0, 4);
    const uint32_t crc = rimi_crc32(0, file, bytes);
    memcpy(file + FUZZ_STATE_CRC, &crc, 4);
  }
  const int fd = memfd_create("state", MFD_CLOEXEC);
  if (fd < 0)
    return;
  if (write(fd, file, bytes) == (ssize_t)bytes) {
    snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
    (void)state_load(name, &parts, scratch);
  }
  close(fd);
}

static inline void fuzz_own_sum(const uint8_t *data, size_t bytes) {
  static double x[RIM_CORRECT_MAX_FEATURES], mean[RIM_CORRECT_MAX_OUTCOMES];
  uint64_t *copy = malloc(bytes > 0 ? bytes : 1);
  rim_correct correct;
  rim_interference_model model;
  static rim_interference watch;
  if (copy == NULL)
    return;
  uint8_t *section = (uint8_t *)copy;
  memcpy(section, data, bytes);
  fuzz_repair_section(section, bytes, 28);
  if (rimi_correct_open(&correct, section, bytes) == RIM_OK)
    (void)rimi_correct_mean(&correct, x, mean, mean);
  memcpy(section, data, bytes);
  fuzz_repair_section(section, bytes, 12);
  if (rimi_interference_open(&model, section, bytes) == RIM_OK &&
      rimi_interference_init(&watch, &model) == RIM_OK) {
    rim_interference_verdict verdict;
    for (uint32_t t = 0; t < 64u; ++t)
      (void)rimi_interference_step(&watch, 0.05 * (double)t, 1.0, 0.02 * (double)t, &verdict);
  }
  free(copy);
}

#endif
