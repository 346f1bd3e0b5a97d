/* SPDX-License-Identifier: MIT */
/* rim_zephyr.h - the monitor as a Zephyr thread, without a heap; Kconfig sizes it.
 *
 * Any thread offers rows and commands; the monitor's thread takes them in order and puts its
 * records into a queue from which one thread of yours takes them. */
#ifndef RIM_ZEPHYR_H
#define RIM_ZEPHYR_H

#include <zephyr/kernel.h>

#include "rim_watch.h"

typedef struct rim_zephyr_row {
  double t_s;
  uint32_t count; /* values in use */
  double value[CONFIG_RIMWATCH_MAX_VALUES];
} rim_zephyr_row;

typedef struct rim_zephyr_status {
  uint64_t digest; /* of all verdicts: that of `rim replay` over the same rows */
  uint32_t rows, refused, records, dropped, commands_refused;
  uint8_t level, reason; /* rim_level, rim_reason */
} rim_zephyr_status;

/* Opens the image, which stays where it is, and starts the thread. Errors as rim_monitor_init;
 * RIM_E_CAPACITY: a row has more values than Kconfig says; RIM_E_CONFIG: it runs already. */
rim_status rim_zephyr_start(const void *image, size_t image_bytes);

/* 0, or Zephyr's negative errno of k_msgq_put and k_msgq_get. */
int rim_zephyr_offer(const rim_zephyr_row *row, k_timeout_t wait);
int rim_zephyr_command(const rim_command *command, k_timeout_t wait);
int rim_zephyr_receive(rim_alarm *record, k_timeout_t wait);

rim_zephyr_status rim_zephyr_get_status(void);

#endif
