/* SPDX-License-Identifier: MIT */
/* RimWatch.h - the monitor for Arduino sketches. BYTES: what `rim show` prints for the image. */
#ifndef RIMWATCH_ARDUINO_H
#define RIMWATCH_ARDUINO_H

#include <Arduino.h>

#include "rim_watch.h"

static_assert(sizeof(double) == 8, "this board's double has 32 bits: the monitor needs 64");

template <size_t BYTES> class RimWatch {
public:
  /* The image stays where it is, aligned to 8. Called with every record; may be NULL. */
  rim_status begin(const void *image, size_t bytes, void (*onRecord)(const rim_alarm &record)) {
    onRecord_ = onRecord;
    return rim_watch_open(&watch_, memory_, sizeof memory_, image, bytes, take, this);
  }

  rim_status row(double t_s, const double *value, size_t count) {
    const rim_status status = rim_watch_row(&watch_, t_s, value, count, NULL);
    idle();
    return status;
  }

  /* Call it from loop(): tells when rows that can be used fail to come. */
  void idle() { rim_watch_tick(&watch_, 1e-3 * (double)millis()); }

  /* The clock of the rows began again, and it is now_s on it (rim_watch_restart). */
  void restart(double now_s) { rim_watch_restart(&watch_, now_s); }

  rim_status clear(uint32_t sequence) { return command(RIM_COMMAND_CLEAR, sequence); }
  rim_status acknowledge(uint32_t sequence) { return command(RIM_COMMAND_ACKNOWLEDGE, sequence); }

  uint8_t level() const { return watch_.level; }    /* rim_level */
  uint64_t digest() const { return watch_.digest; } /* of all verdicts: see rim_watch.h */
  uint32_t rows() const { return watch_.rows; }
  size_t words(const rim_alarm &record, char *out, size_t bytes) const {
    return rim_watch_words(&watch_, &record, out, bytes);
  }

private:
  rim_status command(rim_command_code code, uint32_t sequence) {
    const rim_command c = {sequence, watch_.image.model_id, (uint8_t)code};
    return rim_watch_command(&watch_, &c);
  }
  static void take(void *self, const rim_alarm *record) {
    RimWatch *me = static_cast<RimWatch *>(self);
    if (me->onRecord_ != NULL)
      me->onRecord_(*record);
  }

  rim_watch watch_ = {};
  void (*onRecord_)(const rim_alarm &record) = NULL;
  alignas(8) unsigned char memory_[BYTES];
};

#endif
