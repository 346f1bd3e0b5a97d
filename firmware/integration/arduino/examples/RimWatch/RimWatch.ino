/* SPDX-License-Identifier: MIT */
/* A row each 50 ms, by your readRow(); alarms on the serial console. model.h is the flight image:
 *   xxd -i model.rim | sed 's/^unsigned char/alignas(8) const unsigned char/' > model.h */
#include <RimWatch.h>

#include "model.h"

static const size_t kValues = 4;
static RimWatch<49152> monitor; /* `rim show model.rim` prints what the image needs */
static uint32_t next_ms;

/* Yours: the values in the order that `rim show model.rim` prints. */
extern void readRow(double *value);

static void tell(const rim_alarm &record) {
  char words[120];
  monitor.words(record, words, sizeof words);
  Serial.println(words);
}

void setup() {
  Serial.begin(115200);
  const rim_status status = monitor.begin(model_rim, model_rim_len, tell);
  if (status != RIM_OK)
    Serial.println(rim_status_text(status));
  next_ms = millis();
}

void loop() {
  if ((int32_t)(millis() - next_ms) < 0) {
    monitor.idle();
    return;
  }
  double value[kValues];
  readRow(value);
  monitor.row(next_ms / 1000.0, value, kValues); /* rounded as a log has it */
  next_ms += 50;
}
