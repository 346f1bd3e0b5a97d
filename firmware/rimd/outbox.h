/* SPDX-License-Identifier: MIT */
/* outbox.h - alarms and health on their way out: never waits, keeps what matters, counts the rest.
 *
 * LCM takes a record whole. On CAN the newest summary waits as long as it must, older ones are
 * replaced by it; the finding and the detail of a record go out behind it, a few frames at a time,
 * and are given up when a newer record comes or the queue stays full. */
#ifndef OUTBOX_H
#define OUTBOX_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/can.h"
#include "transport/lcm_udp.h"
#include "transport/socketcan.h"

typedef struct outbox {
  lcm_udp *lcm;   /* NULL: none */
  socketcan *can; /* NULL: none */
  uint32_t node;
  uint32_t dropped;       /* records that did not go out whole on one of the buses, saturating */
  uint32_t frames_unsent; /* of details, and what the interface refused for good; saturating */
  bool lcm_waits;
  uint8_t lcm_alarm[RIM_LCM_ALARM_SIZE];
  bool summary_waits, summary_sent, heartbeat_waits, entry_waits;
  rim_can_frame summary, heartbeat, entry;
  uint64_t summary_ns;    /* when the last one went out */
  uint64_t progress_ns;   /* when the detail last got on */
  uint32_t details, next; /* frames of finding and detail under way, and the next to go */
  rim_can_frame detail[RIM_CAN_FINDING_FRAMES + RIM_CAN_DETAIL_FRAMES];
} outbox;

void outbox_init(outbox *box, lcm_udp *lcm, socketcan *can, uint32_t node);

/* A new record. */
void outbox_alarm(outbox *box, const rim_alarm *alarm, uint64_t now_ns);

/* The plan enters an alarmed region, or no longer does. */
void outbox_entry(outbox *box, const rim_entry *entry, uint64_t now_ns);

/* Cyclic: health and counters, and on CAN a heartbeat and the summary of `newest` again. */
void outbox_health(outbox *box, const rim_health_message *health, const rim_counters *counters,
                   const rim_alarm *newest, bool acknowledged, uint64_t now_ns);

/* What the image's indices mean, over LCM: RIM_MODEL. */
void outbox_model(outbox *box, const rim_image *image, uint8_t flags);

/* The finding and the detail of a record that was sent before once more, on CAN. */
void outbox_repeat(outbox *box, const rim_alarm *newest, uint64_t now_ns);

/* Sends what waits. Returns after how many milliseconds it should be called again; -1: nothing
 * waits. */
int outbox_pump(outbox *box, uint64_t now_ns);

#endif
