/* SPDX-License-Identifier: MIT */
/* The replay's alarms on CAN: summary and detail go out by controller 0, come back by controller 1
 * on the same bus, are put together again, and are held to what was sent. */
#include "replay/bus.h"

#include <string.h>

#include "port/port_can.h"
#include "rim/can.h"

#define NODE 9u
#define PATIENCE 1000000u /* looks at a queue before a frame is given up */

static struct {
  uint32_t frames, unsent, received, refused, equal;
  rim_alarm sent; /* the record under way */
  rim_can_assembly assembly;
} bus;

const char *bus_open(void) {
  bus.assembly.node = NODE;
  return port_can_open(0) && port_can_open(1) ? NULL : "a CAN controller does not start";
}

/* Single precision lies between: the frames of what came must be those of what went. */
static bool is_what_was_sent(const rim_alarm *alarm) {
  static rim_can_frame sent[RIM_CAN_DETAIL_FRAMES], came[RIM_CAN_DETAIL_FRAMES];
  return rim_can_pack_detail(sent, NODE, &bus.sent) == RIM_OK &&
         rim_can_pack_detail(came, NODE, alarm) == RIM_OK && memcmp(sent, came, sizeof sent) == 0;
}

static void receive(void) {
  rim_can_frame frame;
  while (port_can_receive(1, &frame)) {
    rim_can_summary summary;
    rim_alarm alarm;
    bool complete = false;
    rim_status status;
    bus.received++;
    if (frame.id == RIM_CAN_SUMMARY_ID + NODE) {
      status = rim_can_unpack_summary(&summary, &frame);
      if (status == RIM_OK && summary.seq != (uint8_t)bus.sent.seq)
        bus.refused++;
    } else {
      status = rim_can_take_detail(&bus.assembly, &frame, &alarm, &complete);
    }
    if (status != RIM_OK)
      bus.refused++;
    if (complete && is_what_was_sent(&alarm))
      bus.equal++;
  }
}

static void send(const rim_can_frame *frame) {
  for (uint32_t i = 0; i < PATIENCE; ++i) {
    receive(); /* so that the second controller's queue never fills */
    if (port_can_send(0, frame)) {
      bus.frames++;
      return;
    }
  }
  bus.unsent++;
}

void bus_alarm(const rim_alarm *alarm) {
  static rim_can_frame detail[RIM_CAN_DETAIL_FRAMES];
  rim_can_frame summary;
  bus.sent = *alarm;
  if (rim_can_pack_summary(&summary, NODE, alarm) != RIM_OK ||
      rim_can_pack_detail(detail, NODE, alarm) != RIM_OK)
    return;
  send(&summary);
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
    send(&detail[i]);
  const uint32_t before = bus.equal;
  for (uint32_t i = 0; i < PATIENCE && bus.equal == before; ++i)
    receive();
}

void bus_report(void (*print_count)(const char *what, uint32_t value)) {
  print_count("can_frames_sent", bus.frames);
  print_count("can_frames_unsent", bus.unsent);
  print_count("can_frames_received", bus.received);
  print_count("can_frames_refused", bus.refused);
  print_count("can_records_equal", bus.equal);
}
