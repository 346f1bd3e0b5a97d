/* SPDX-License-Identifier: MIT */
/* Of the programs beside: an integration runs on this computer without its framework, on a board
 * whose clock is a number. Rows of twelve values come each 50 ms, more often than any integration
 * looks whether they fail to come: RUN_GOOD good ones, then those of a source whose clock began
 * again, for a minute. All of these are refused; the level printed last has to be STALE. */
#ifndef RUN_ROWS_H
#define RUN_ROWS_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rim/monitor.h"

#define RUN_VALUES 12
#define RUN_GOOD 100
#define RUN_REFUSED 1200
#define RUN_STEP_S 0.05

#ifdef __cplusplus
alignas(8)
#else
_Alignas(8)
#endif
    static unsigned char run_image[65536];

/* The bytes of an image; 0 after saying that there is none. */
static inline size_t run_read(const char *path) {
  FILE *file = fopen(path, "rb");
  const size_t bytes = file != NULL ? fread(run_image, 1, sizeof run_image, file) : 0;
  if (file != NULL)
    fclose(file);
  if (bytes == 0)
    fprintf(stderr, "%s: cannot be read\n", path);
  return bytes;
}

/* An image of rows that have no rate says nothing of when they fail to come: after two seconds. */
static inline void run_limit(rim_monitor *monitor) {
  rim_alarm_policy policy;
  memset(&policy, 0, sizeof policy);
  policy.stale_s = 2.0;
  (void)rim_monitor_set_policy(monitor, &policy);
}

/* Nine features; an outcome, and what the vehicle expects of it. Returns the row's time. */
static inline double run_row(int i, double value[RUN_VALUES]) {
  for (int k = 0; k < 10; k++)
    value[k] = sin(0.37 * (k + 1) * i);
  value[10] = 0.0;
  value[11] = 1.0;
  return i < RUN_GOOD ? 100.0 + RUN_STEP_S * i : 1.0;
}

#endif
