/* SPDX-License-Identifier: MIT */
#include "rim_zephyr.h"

typedef struct item {
  bool is_command;
  union {
    rim_zephyr_row row;
    rim_command command;
  } of;
} item;

K_MSGQ_DEFINE(rim_items, sizeof(item), CONFIG_RIMWATCH_QUEUE, 8);
K_MSGQ_DEFINE(rim_records, sizeof(rim_alarm), CONFIG_RIMWATCH_QUEUE, 8);
K_MUTEX_DEFINE(rim_status_lock);
K_THREAD_STACK_DEFINE(rim_stack, CONFIG_RIMWATCH_STACK_BYTES);

static struct k_thread thread;
static bool started;
static rim_watch watch;
static rim_zephyr_status status;
static uint32_t dropped, commands_refused;
static _Alignas(8) unsigned char monitor_memory[CONFIG_RIMWATCH_MONITOR_BYTES];

static void keep(void *user, const rim_alarm *record) {
  ARG_UNUSED(user);
  if (k_msgq_put(&rim_records, record, K_NO_WAIT) != 0)
    dropped++;
}

static void publish(void) {
  k_mutex_lock(&rim_status_lock, K_FOREVER);
  status.digest = watch.digest;
  status.rows = watch.rows;
  status.refused = watch.refused;
  status.records = watch.records;
  status.dropped = dropped;
  status.commands_refused = commands_refused;
  status.level = watch.level;
  status.reason = watch.reason;
  k_mutex_unlock(&rim_status_lock);
}

static void obey(const item *next) {
  if (!next->is_command)
    (void)rim_watch_row(&watch, next->of.row.t_s, next->of.row.value, next->of.row.count, NULL);
  else if (rim_watch_command(&watch, &next->of.command) != RIM_OK)
    commands_refused++;
}

static void run(void *a, void *b, void *c) {
  static item next;
  ARG_UNUSED(a);
  ARG_UNUSED(b);
  ARG_UNUSED(c);
  for (;;) {
    if (k_msgq_get(&rim_items, &next, K_MSEC(CONFIG_RIMWATCH_IDLE_MS)) == 0)
      obey(&next);
    rim_watch_tick(&watch, 1e-3 * (double)k_uptime_get());
    publish();
  }
}

rim_status rim_zephyr_start(const void *image, size_t image_bytes) {
  if (started)
    return RIM_E_CONFIG;
  const rim_status opened =
      rim_watch_open(&watch, monitor_memory, sizeof monitor_memory, image, image_bytes, keep, NULL);
  if (opened != RIM_OK)
    return opened;
  if (watch.values > CONFIG_RIMWATCH_MAX_VALUES)
    return RIM_E_CAPACITY;
  started = true;
  publish();
  const k_tid_t id =
      k_thread_create(&thread, rim_stack, K_THREAD_STACK_SIZEOF(rim_stack), run, NULL, NULL, NULL,
                      CONFIG_RIMWATCH_PRIORITY, K_FP_REGS, K_NO_WAIT);
  (void)k_thread_name_set(id, "rim");
  return RIM_OK;
}

int rim_zephyr_offer(const rim_zephyr_row *row, k_timeout_t wait) {
  item next = {.is_command = false};
  next.of.row = *row;
  return k_msgq_put(&rim_items, &next, wait);
}

int rim_zephyr_command(const rim_command *command, k_timeout_t wait) {
  item next = {.is_command = true};
  next.of.command = *command;
  return k_msgq_put(&rim_items, &next, wait);
}

int rim_zephyr_receive(rim_alarm *record, k_timeout_t wait) {
  return k_msgq_get(&rim_records, record, wait);
}

rim_zephyr_status rim_zephyr_get_status(void) {
  k_mutex_lock(&rim_status_lock, K_FOREVER);
  const rim_zephyr_status now = status;
  k_mutex_unlock(&rim_status_lock);
  return now;
}
