/* SPDX-License-Identifier: MIT */
/* A recording (replay/recording.h) offered to the monitor's FreeRTOS task by another task, row by
 * row; a third one takes the records. Prints 'record WORDS' for each, then the counts and the
 * digest, on port.h's console. */
#include "base/bytes.h"
#include "port/port.h"
#include "replay/recording.h"
#include "rim_task.h"

#define OWN_STACK_BYTES 32768u
#define PRIORITY 2u

extern const unsigned char recording[], recording_end[];

typedef struct own_task {
  StaticTask_t memory;
  StackType_t stack[OWN_STACK_BYTES / sizeof(StackType_t)];
} own_task;

static own_task feeder, taker;
static volatile uint32_t taken;

static void print(const char *text) {
  while (*text != '\0')
    port_putchar(*text++);
}

static void print_count(const char *what, uint32_t value) {
  char digit[11] = {0};
  size_t at = sizeof digit - 1;
  do {
    digit[--at] = (char)('0' + value % 10u);
    value /= 10u;
  } while (value != 0);
  print(what);
  print(" ");
  print(digit + at);
  print("\n");
}

static void print_digest(uint64_t digest) {
  print("digest ");
  for (unsigned shift = 64; shift > 0; shift -= 4)
    port_putchar("0123456789abcdef"[digest >> (shift - 4) & 15u]);
  print("\n");
}

_Noreturn void assert_failed(const char *file, int line) {
  print(file);
  print_count(": assertion, line", (uint32_t)line);
  port_exit(4);
}

void vApplicationStackOverflowHook(TaskHandle_t task, char *name) {
  (void)task;
  print(name);
  print(": its stack is too small\n");
  port_exit(4);
}

static volatile bool is_refused; /* the records are about rows that are all refused */

static void take(void *nothing) {
  (void)nothing;
  static char words[120];
  rim_alarm record;
  for (;;) {
    if (!rim_task_receive(&record, portMAX_DELAY))
      continue;
    (void)rim_task_words(&record, words, sizeof words);
    print(is_refused ? "silence " : "record ");
    print(words);
    print("\n");
    taken++;
  }
}

static void finish(const rim_task_status *status) {
  print_count("rows", status->rows);
  print_count("refused", status->refused);
  print_count("commands_refused", status->commands_refused);
  print_count("records", status->records);
  print_count("dropped", status->dropped);
  print_count("level", status->level);
  print_digest(status->digest);
  port_exit(0);
}

/* Waits until everything offered has been looked at and every record taken. */
static rim_task_status settle(uint32_t offered) {
  rim_task_status status = rim_task_get_status();
  while (status.rows + status.refused < offered || taken + status.dropped < status.records) {
    vTaskDelay(1);
    status = rim_task_get_status();
  }
  return status;
}

/* Rows of the first time over and over, more often than the task looks whether any come: refused
 * for their time, and soon nothing is known. At most a minute. */
static void refuse(rim_task_row *row, const unsigned char *data) {
  is_refused = true;
  row->count--;
  row->t_s = rimi_le_f64(data, 0);
  for (uint32_t i = 0; i < 60000u / RIM_TASK_IDLE_MS * 4u; ++i) {
    configASSERT(rim_task_offer(row, portMAX_DELAY));
    vTaskDelay(pdMS_TO_TICKS(RIM_TASK_IDLE_MS / 4u));
    if (rim_task_get_status().level == RIM_LEVEL_STALE)
      break;
  }
  print_count("level of refused rows", rim_task_get_status().level);
}

static void feed(void *nothing) {
  (void)nothing;
  static rim_task_row row;
  const uint32_t image_bytes = rimi_le_u32(recording, 2), rows = rimi_le_u32(recording, 3);
  const unsigned char *image = recording + RECORDING_HEADER_BYTES;
  const unsigned char *data = image + ((image_bytes + 7u) & ~7u);
  const rim_status damaged = rim_task_start(image + 8, image_bytes - 8, PRIORITY);
  print(rim_status_text(damaged));
  print(": a damaged image\n");
  const rim_status opened = rim_task_start(image, image_bytes, PRIORITY);
  configASSERT(opened == RIM_OK);
  configASSERT(rim_task_start(image, image_bytes, PRIORITY) == RIM_E_CONFIG);
  (void)xTaskCreateStatic(take, "take", sizeof taker.stack / sizeof taker.stack[0], NULL, PRIORITY,
                          taker.stack, &taker.memory);
  row.count = rimi_le_u32(recording, 4) - 1u;
  for (uint32_t r = 0; r < rows; ++r) {
    row.t_s = rimi_le_f64(data, (size_t)r * (row.count + 1u));
    for (uint32_t i = 0; i < row.count; ++i)
      row.value[i] = rimi_le_f64(data, (size_t)r * (row.count + 1u) + 1u + i);
    configASSERT(rim_task_offer(&row, portMAX_DELAY));
  }
  /* A row too long, and a command for no alarm: each refused, and neither changes the digest. */
  row.count++;
  configASSERT(rim_task_offer(&row, portMAX_DELAY));
  const rim_command command = {.sequence = 99, .model_id = 1, .command = RIM_COMMAND_CLEAR};
  configASSERT(rim_task_command(&command, portMAX_DELAY));
  vTaskDelay(2);
  rim_task_status status = settle(rows + 1u);
  while (status.commands_refused == 0) {
    vTaskDelay(1);
    status = rim_task_get_status();
  }
  refuse(&row, data);
  finish(&status);
}

int main(void) {
  (void)xTaskCreateStatic(feed, "feed", sizeof feeder.stack / sizeof feeder.stack[0], NULL,
                          PRIORITY - 1u, feeder.stack, &feeder.memory);
  vTaskStartScheduler();
  return 4;
}
