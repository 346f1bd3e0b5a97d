/* SPDX-License-Identifier: MIT */
/* Replays the recording through rim_monitor_step() and prints what `rim replay` prints last,
 * 'digest HEX' over the bits of every verdict, and before it 'bits HEX' over intermediate results.
 *
 * A verdict's scores come from single precision and seldom show the last bit of a double; `bits`
 * does, so that it also finds a compiler that fuses a multiplication and an addition. */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "monitor/inspect.h"
#include "monitor/work.h"
#include "port/port.h"
#include "replay/bus.h"
#include "replay/recording.h"
#include "rim/image.h"
#include "rim/monitor.h"

#define MONITOR_BYTES 393216u /* five kinds of channel on the lander's 25 outcomes need 260 kB */

extern const unsigned char recording[], recording_end[];

static _Alignas(8) unsigned char memory[MONITOR_BYTES];

static void print(const char *text) {
  while (*text != '\0')
    port_putchar(*text++);
}

static void print_unsigned(uint32_t value) {
  char digits[11];
  size_t at = sizeof digits - 1;
  digits[at] = '\0';
  do {
    digits[--at] = (char)('0' + value % 10u);
    value /= 10u;
  } while (value != 0);
  print(digits + at);
}

static void print_hex64(uint64_t value) {
  for (unsigned shift = 64; shift > 0; shift -= 4)
    port_putchar("0123456789abcdef"[value >> (shift - 4) & 15u]);
}

static void print_count(const char *what, uint32_t value) {
  print(what);
  print(" ");
  print_unsigned(value);
  print("\n");
}

static _Noreturn void refuse(const char *reason) {
  print("refused: ");
  print(reason);
  print("\n");
  port_exit(3);
}

typedef struct flight {
  const unsigned char *image;
  const unsigned char *rows;
  uint32_t image_bytes;
  uint32_t row_count;
  uint32_t doubles;
} flight;

/* The sizes announced are checked against the bytes there are, without overflow. */
static flight open_recording(const unsigned char *data, size_t bytes) {
  if (bytes < RECORDING_HEADER_BYTES || memcmp(data, RECORDING_MAGIC, 8) != 0)
    refuse("no recording");
  flight f = {.image = data + RECORDING_HEADER_BYTES,
              .image_bytes = rimi_le_u32(data, 2),
              .row_count = rimi_le_u32(data, 3),
              .doubles = rimi_le_u32(data, 4)};
  size_t rest = bytes - RECORDING_HEADER_BYTES;
  if (f.image_bytes > rest || f.doubles < 2 || f.doubles > RECORDING_MAX_DOUBLES) {
    refuse("damaged recording");
  }
  const size_t padded = (f.image_bytes + (size_t)7) & ~(size_t)7;
  if (padded > rest || (rest - padded) / 8u / f.doubles < f.row_count)
    refuse("short recording");
  rest = padded + (size_t)8 * f.doubles * f.row_count;
  if (rimi_crc32(0, f.image, rest) != rimi_le_u32(data, 5))
    refuse("recording fails its check sum");
  f.rows = f.image + padded;
  return f;
}

static bool is_external(const rim_monitor *monitor) {
  return rim_monitor_config(monitor, RIM_CONFIG_EXTERNAL) != 0;
}

static uint32_t columns(const rim_monitor *monitor) {
  const uint32_t features = rim_monitor_config(monitor, RIM_CONFIG_FEATURES);
  const uint32_t outcomes = rim_monitor_config(monitor, RIM_CONFIG_OUTCOMES);
  return 1 + features + (is_external(monitor) ? 3 * outcomes : 0);
}

static rim_observation observation(const rim_monitor *monitor, const double *row) {
  rim_observation now = {.t_s = row[0], .context = row + 1};
  if (is_external(monitor)) {
    const uint32_t outcomes = rim_monitor_config(monitor, RIM_CONFIG_OUTCOMES);
    now.outcome = now.context + rim_monitor_config(monitor, RIM_CONFIG_FEATURES);
    now.mean = now.outcome + outcomes;
    now.sd = now.mean + outcomes;
  }
  return now;
}

static void print_bound(const flight *f) {
  rim_work_counts counts;
  rim_work work;
  if (rimi_work_counts_of(f->image, f->image_bytes, &counts) != RIM_OK)
    refuse("no bound of a step");
  rimi_work_bound(&counts, &work);
  print_count("step_instructions_bound", work.step);
}

static rim_monitor *open_monitor(const flight *f) {
  size_t bytes = 0;
  rim_monitor *monitor = NULL;
  rim_status status = rim_monitor_size(f->image, f->image_bytes, &bytes);
  if (status == RIM_OK)
    status = rim_monitor_init(&monitor, memory, sizeof memory, f->image, f->image_bytes);
  if (status != RIM_OK)
    refuse(rim_status_text(status));
  if (columns(monitor) != f->doubles)
    refuse("rows of another image");
  print_count("monitor_bytes", (uint32_t)bytes);
  print_bound(f);
  return monitor;
}

/* Ticks of the steps. Sums of whole numbers below 2^53 are exact in a double, and no computer needs
 * a helper of its compiler for them. */
typedef struct cost {
  double sum;
  uint32_t largest;
} cost;

static void print_cost(const cost *c, uint32_t rows) {
  const uint32_t unit = port_tick_instructions();
  if (unit == 0 || rows == 0)
    return;
  print_count("step_instructions_mean", (uint32_t)(c->sum * unit / rows + 0.5));
  print_count("step_instructions_largest", c->largest * unit);
}

/* Where a block lies, the best region's centre and score, and whether the block is inside. */
static uint64_t fold_block(uint64_t bits, const rim_monitor *monitor, const rim_verdict *verdict,
                           const double *context) {
  bits = rimi_digest_f64(bits, verdict->score);
  bits = rimi_digest_f64(bits, verdict->ln_anom);
  const uint8_t *place = rimi_monitor_place(monitor);
  const uint32_t features = rim_monitor_config(monitor, RIM_CONFIG_REGION_FEATURES);
  for (uint32_t i = 0; place != NULL && i < features; ++i)
    bits = rimi_digest_u32(bits, place[i]);
  if (place != NULL)
    return rimi_digest_u32(bits, rimi_monitor_inside(monitor, place, verdict->blocks - 1u));
  rim_candidate best;
  if (rimi_select_best_of_channel(rimi_monitor_search(monitor), verdict->channel, &best)) {
    bits = rimi_digest_f64(bits, best.ln_anom);
    bits = rimi_digest_f64(bits, best.shift);
    for (size_t i = 0; i < best.region.unit.dims; ++i)
      bits = rimi_digest_f64(bits, best.region.unit.center[i]);
  }
  return rimi_digest_f64(bits, rim_monitor_membership(monitor, context));
}

static void print_digest(const char *what, uint64_t digest) {
  print(what);
  print(" ");
  print_hex64(digest);
  print("\n");
}

/* Every record that waits goes out, as from `rim replay`; returns how many. */
static uint32_t send_waiting(rim_monitor *monitor) {
  rim_alarm record;
  uint32_t sent = 0;
  for (; rim_monitor_next_record(monitor, &record); ++sent)
    bus_alarm(&record);
  return sent;
}

int main(void) {
  const flight f = open_recording(recording, (size_t)(recording_end - recording));
  rim_monitor *monitor = open_monitor(&f);
  static double row[RECORDING_MAX_DOUBLES];
  uint64_t digest = RIM_DIGEST_START, bits = RIM_DIGEST_START;
  uint32_t records = 0, blocks = 0;
  cost spent = {0.0, 0};
  const char *no_bus = bus_open();
  if (no_bus != NULL)
    refuse(no_bus);
  for (uint32_t r = 0; r < f.row_count; ++r) {
    for (uint32_t i = 0; i < f.doubles; ++i)
      row[i] = rimi_le_f64(f.rows, (size_t)r * f.doubles + i);
    const rim_observation now = observation(monitor, row);
    (void)rim_monitor_idle(monitor, now.t_s);
    records += send_waiting(monitor);
    rim_verdict verdict;
    const uint32_t start = port_ticks();
    const rim_status status = rim_monitor_step(monitor, &now, &verdict);
    const uint32_t ticks = (port_ticks() - start) & port_tick_mask();
    if (status != RIM_OK)
      refuse(rim_status_text(status));
    spent.sum += ticks;
    if (ticks > spent.largest)
      spent.largest = ticks;
    if (verdict.alarm.seq != 0) {
      ++records;
      bus_alarm(&verdict.alarm);
    }
    records += send_waiting(monitor);
    digest = rim_verdict_digest(digest, &verdict);
    if (verdict.blocks != blocks)
      bits = fold_block(bits, monitor, &verdict, now.context);
    blocks = verdict.blocks;
  }
  print_count("rows", f.row_count);
  print_count("alarm_records", records);
  print_cost(&spent, f.row_count);
  bus_report(print_count);
  print_digest("bits", bits);
  print_digest("digest", digest);
  port_exit(0);
}
