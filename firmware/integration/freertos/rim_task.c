/* SPDX-License-Identifier: MIT */
#include "rim_task.h"

#include "queue.h"

typedef struct item {
  bool is_command;
  union {
    rim_task_row row;
    rim_command command;
  } of;
} item;

static struct {
  rim_watch watch;
  TaskHandle_t task;
  QueueHandle_t items, records;
  rim_task_status status; /* written by the task alone */
} self;

static _Alignas(8) unsigned char monitor_memory[RIM_TASK_MONITOR_BYTES];
static StackType_t stack[RIM_TASK_STACK_BYTES / sizeof(StackType_t)];
static StaticTask_t task_memory;
static StaticQueue_t items_memory, records_memory;
static _Alignas(8) uint8_t items_storage[RIM_TASK_ROWS * sizeof(item)];
static _Alignas(8) uint8_t records_storage[RIM_TASK_RECORDS * sizeof(rim_alarm)];

static void keep(void *user, const rim_alarm *record) {
  (void)user;
  if (xQueueSend(self.records, record, 0) != pdTRUE)
    self.status.dropped++;
}

static void publish(void) {
  const rim_monitor_health health = rim_monitor_get_health(self.watch.monitor);
  taskENTER_CRITICAL();
  self.status.digest = self.watch.digest;
  self.status.rows = self.watch.rows;
  self.status.refused = self.watch.refused;
  self.status.records = self.watch.records;
  self.status.level = self.watch.level;
  self.status.health = health;
  taskEXIT_CRITICAL();
}

static void obey(const item *next) {
  if (!next->is_command)
    (void)rim_watch_row(&self.watch, next->of.row.t_s, next->of.row.value, next->of.row.count,
                        NULL);
  else if (rim_watch_command(&self.watch, &next->of.command) != RIM_OK)
    self.status.commands_refused++;
}

static void run(void *nothing) {
  static item next;
  (void)nothing;
  for (;;) {
    if (xQueueReceive(self.items, &next, pdMS_TO_TICKS(RIM_TASK_IDLE_MS)) == pdTRUE)
      obey(&next);
    rim_watch_tick(&self.watch, (double)xTaskGetTickCount() / (double)configTICK_RATE_HZ);
    publish();
  }
}

rim_status rim_task_start(const void *image, size_t image_bytes, UBaseType_t priority) {
  if (self.task != NULL)
    return RIM_E_CONFIG;
  const rim_status status = rim_watch_open(&self.watch, monitor_memory, sizeof monitor_memory,
                                           image, image_bytes, keep, NULL);
  if (status != RIM_OK)
    return status;
  if (self.watch.values > RIM_TASK_MAX_VALUES)
    return RIM_E_CAPACITY;
  self.items =
      xQueueCreateStatic(RIM_TASK_ROWS, (UBaseType_t)sizeof(item), items_storage, &items_memory);
  self.records = xQueueCreateStatic(RIM_TASK_RECORDS, (UBaseType_t)sizeof(rim_alarm),
                                    records_storage, &records_memory);
  self.task =
      xTaskCreateStatic(run, "rim", (configSTACK_DEPTH_TYPE)(sizeof stack / sizeof stack[0]), NULL,
                        priority, stack, &task_memory);
  return self.task != NULL ? RIM_OK : RIM_E_CONFIG;
}

bool rim_task_offer(const rim_task_row *row, TickType_t wait) {
  item next = {.is_command = false};
  if (row == NULL || self.items == NULL)
    return false;
  next.of.row = *row;
  return xQueueSend(self.items, &next, wait) == pdTRUE;
}

bool rim_task_command(const rim_command *command, TickType_t wait) {
  item next = {.is_command = true};
  if (command == NULL || self.items == NULL)
    return false;
  next.of.command = *command;
  return xQueueSend(self.items, &next, wait) == pdTRUE;
}

bool rim_task_receive(rim_alarm *record, TickType_t wait) {
  return record != NULL && self.records != NULL &&
         xQueueReceive(self.records, record, wait) == pdTRUE;
}

rim_task_status rim_task_get_status(void) {
  taskENTER_CRITICAL();
  const rim_task_status status = self.status;
  taskEXIT_CRITICAL();
  return status;
}

size_t rim_task_words(const rim_alarm *record, char *out, size_t bytes) {
  return rim_watch_words(&self.watch, record, out, bytes);
}
