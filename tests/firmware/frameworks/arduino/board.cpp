// SPDX-License-Identifier: MIT
// A board for the sketch: a clock that the sketch's own loop advances, and the rows of a recording.
#include <Arduino.h>
#include <RimWatch.h>

#include <string.h>

#include "replay/recording.h"

extern "C" const unsigned char recording[], recording_end[];

SerialPort Serial;
static unsigned long now_ms;
static uint32_t row, rows, doubles;
static const unsigned char *data;

unsigned long millis() { return now_ms; }

static uint32_t word_at(const unsigned char *at) {
  return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

void readRow(double *value) {
  double line[64]; // this test runs on a little-endian computer
  memcpy(line, data + 8u * doubles * row, 8u * doubles);
  memcpy(value, line + 1, 8u * (doubles - 1u));
  row++;
}

template <size_t BYTES> static uint64_t digest_of(const RimWatch<BYTES> &m) { return m.digest(); }

#include "RimWatch.ino.cpp" // the sketch, as the Arduino builder hands it to the compiler

// Ten seconds of rows that are refused, each 50 ms.
static void refused(const char *why, size_t values) {
  const double value[kValues] = {};
  for (int i = 0; i < 200; i++, now_ms += 50)
    monitor.row(0.0, value, values);
  printf("%s: level %u\n", why, (unsigned)monitor.level());
}

int main() {
  const uint32_t image_bytes = word_at(recording + 8);
  rows = word_at(recording + 12);
  doubles = word_at(recording + 16);
  data = recording + RECORDING_HEADER_BYTES + ((image_bytes + 7u) & ~7u);
  setup();
  for (now_ms = 0; row < rows; now_ms++)
    loop();
  const unsigned used = monitor.rows();
  const unsigned long long digest = digest_of(monitor);
  // A source whose clock began again, then one whose rows are too short: all of them are refused.
  refused("refused for their time", kValues);
  monitor.restart(0.0);
  double value[kValues] = {};
  monitor.row(0.05, value, kValues);
  printf("told that it began again: level %u\n", (unsigned)monitor.level());
  refused("refused for their length", kValues - 1);
  printf("rows %u\ndigest %016llx\n", used, digest);
}
