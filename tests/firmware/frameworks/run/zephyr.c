/* SPDX-License-Identifier: MIT */
/* zephyr IMAGE: rim_zephyr's thread with a queue that always has a row. */
#include "rim_zephyr.c"

#include <setjmp.h>

#include "rows.h"

static k_thread_entry_t entry;
static jmp_buf ended;
static int taken;

int64_t k_uptime_get(void) { return (int64_t)(1000.0 * RUN_STEP_S * taken); }

int k_msgq_get(struct k_msgq *queue, void *data, k_timeout_t wait) {
  (void)queue;
  (void)wait;
  if (taken == RUN_GOOD)
    printf("level %u\n", rim_zephyr_get_status().level);
  if (taken == RUN_GOOD + RUN_REFUSED)
    longjmp(ended, 1);
  item *next = data;
  memset(next, 0, sizeof *next);
  next->of.row.count = RUN_VALUES;
  next->of.row.t_s = run_row(taken++, next->of.row.value);
  return 0;
}

int k_msgq_put(struct k_msgq *queue, const void *data, k_timeout_t wait) {
  (void)queue;
  (void)data;
  (void)wait;
  return 0;
}

int k_mutex_lock(struct k_mutex *mutex, k_timeout_t wait) {
  (void)mutex;
  (void)wait;
  return 0;
}
int k_mutex_unlock(struct k_mutex *mutex) {
  (void)mutex;
  return 0;
}

k_tid_t k_thread_create(struct k_thread *new_thread, k_thread_stack_t *memory, size_t bytes,
                        k_thread_entry_t start, void *a, void *b, void *c, int priority,
                        uint32_t options, k_timeout_t delay) {
  (void)memory, (void)bytes, (void)a, (void)b, (void)c, (void)priority, (void)options, (void)delay;
  entry = start;
  return new_thread;
}
int k_thread_name_set(k_tid_t id, const char *name) {
  (void)id;
  (void)name;
  return 0;
}

int main(int argc, char **argv) {
  const size_t bytes = argc > 1 ? run_read(argv[1]) : 0;
  if (bytes == 0 || rim_zephyr_start(run_image, bytes) != RIM_OK)
    return 3;
  run_limit(watch.monitor);
  if (setjmp(ended) == 0)
    entry(NULL, NULL, NULL);
  printf("level %u\n", rim_zephyr_get_status().level);
  return 0;
}
