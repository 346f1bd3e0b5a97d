/* SPDX-License-Identifier: MIT */
/* rim_task.h - the monitor as a FreeRTOS task, without a heap: configSUPPORT_STATIC_ALLOCATION 1.
 *
 * Any task offers rows and commands; the monitor's task takes them in order and puts its records
 * into a queue from which one task of yours takes them. The rows' order of values is the image's
 * (`rim show MODEL.rim`). Everything is in static memory that these macros size; define others
 * before, for example in FreeRTOSConfig.h. */
#ifndef RIM_TASK_H
#define RIM_TASK_H

#include "FreeRTOS.h"
#include "task.h"

#include "rim_watch.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef RIM_TASK_MAX_VALUES
#define RIM_TASK_MAX_VALUES 32u /* of a row */
#endif
#ifndef RIM_TASK_MONITOR_BYTES
#define RIM_TASK_MONITOR_BYTES 65536u /* `rim show` prints what an image needs */
#endif
#ifndef RIM_TASK_ROWS
#define RIM_TASK_ROWS 8u /* that may wait */
#endif
#ifndef RIM_TASK_RECORDS
#define RIM_TASK_RECORDS 8u /* that may wait; a further one is dropped and counted */
#endif
#ifndef RIM_TASK_STACK_BYTES
#define RIM_TASK_STACK_BYTES 8192u /* the monitor's deepest calls, and a reserve */
#endif
#ifndef RIM_TASK_IDLE_MS
#define RIM_TASK_IDLE_MS 100u /* without a row: how often the monitor looks whether it is STALE */
#endif

typedef struct rim_task_row {
  double t_s;
  uint32_t count; /* values in use */
  double value[RIM_TASK_MAX_VALUES];
} rim_task_row;

/* How the task stands. All zero: not started. */
typedef struct rim_task_status {
  uint64_t digest;        /* of all verdicts: that of `rim replay` over the same rows */
  uint32_t rows, refused; /* refused: of another length than the image's */
  uint32_t records;       /* made */
  uint32_t dropped;       /* of those: found the queue of records full */
  uint32_t commands_refused;
  uint8_t level;             /* rim_level of the vehicle by the newest row */
  rim_monitor_health health; /* see rim/monitor.h */
} rim_task_status;

/* Opens the image, which stays where it is, and creates the task. Call it once, before or after the
 * scheduler starts. Errors as rim_monitor_init; RIM_E_CAPACITY: a row has more than
 * RIM_TASK_MAX_VALUES values; RIM_E_CONFIG: it runs already. */
rim_status rim_task_start(const void *image, size_t image_bytes, UBaseType_t priority);

/* Offers a copy of the row; waits at most so long for room. false: there was none. Not from an
 * interrupt. */
bool rim_task_offer(const rim_task_row *row, TickType_t wait);

/* Offers an operator's command, in order with the rows. */
bool rim_task_command(const rim_command *command, TickType_t wait);

/* Takes the oldest record; waits at most so long for one. false: there was none. */
bool rim_task_receive(rim_alarm *record, TickType_t wait);

/* Returns a copy of the status. All that was offered is in it once rows and refused add up to
 * the rows offered. */
rim_task_status rim_task_get_status(void);

/* Writes a record in words (rim_watch_words). */
size_t rim_task_words(const rim_alarm *record, char *out, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
