/* SPDX-License-Identifier: MIT */
#include "rimd/outbox.h"

#include <string.h>

#define MS UINT64_C(1000000)
#define INHIBIT_NS (100 * MS)  /* between summaries */
#define PATIENCE_NS (500 * MS) /* of a detail with a full queue */
#define BURST 6u               /* detail frames at a time: a CAN queue of Linux holds 10 */
#define BURST_MS 3
#define RETRY_MS 20
#define NETWORK_MS 100

static void add(uint32_t *counter, uint32_t more) {
  *counter = more > UINT32_MAX - *counter ? UINT32_MAX : *counter + more;
}

void outbox_init(outbox *box, lcm_udp *lcm, socketcan *can, uint32_t node) {
  memset(box, 0, sizeof *box);
  box->lcm = lcm;
  box->can = can;
  box->node = node;
}

static void give_up_detail(outbox *box) {
  if (box->next < box->details) {
    add(&box->frames_unsent, box->details - box->next);
    add(&box->dropped, 1);
  }
  box->details = box->next = 0;
}

static bool send_lcm_alarm(outbox *box) {
  return lcm_udp_send(box->lcm, RIM_LCM_CHANNEL_ALARM, box->lcm_alarm, sizeof box->lcm_alarm) == 0;
}

/* Finding first: it says most in the fewest frames. Returns whether the record has bytes. */
static bool queue_detail(outbox *box, const rim_alarm *alarm, uint64_t now_ns) {
  uint32_t pages = 0;
  give_up_detail(box);
  if (rim_can_pack_finding(box->detail, &pages, box->node, alarm) != RIM_OK)
    return false;
  rim_can_frame *detail = box->detail + pages;
  if (box->can->fd_capable) {
    if (rim_can_pack_detail_fd(detail, box->node, alarm) == RIM_OK)
      box->details = pages + 1;
  } else if (rim_can_pack_detail(detail, box->node, alarm) == RIM_OK) {
    box->details = pages + RIM_CAN_DETAIL_FRAMES;
  }
  box->progress_ns = now_ns;
  return box->details > 0;
}

/* Returns whether the record has bytes; what has none (a number that is not finite) is counted. */
static bool queue_can(outbox *box, const rim_alarm *alarm, uint64_t now_ns) {
  const bool summarised = rim_can_pack_summary(&box->summary, box->node, alarm) == RIM_OK;
  box->summary_waits = box->summary_waits || summarised;
  return queue_detail(box, alarm, now_ns) && summarised;
}

void outbox_alarm(outbox *box, const rim_alarm *alarm, uint64_t now_ns) {
  if (box->lcm != NULL) {
    if (box->lcm_waits)
      add(&box->dropped, 1); /* the newer one takes its place */
    box->lcm_waits = rim_lcm_pack_alarm(box->lcm_alarm, sizeof box->lcm_alarm, alarm) == RIM_OK;
    if (!box->lcm_waits)
      add(&box->dropped, 1);
  }
  if (box->can != NULL && !queue_can(box, alarm, now_ns))
    add(&box->dropped, 1);
  (void)outbox_pump(box, now_ns);
}

void outbox_entry(outbox *box, const rim_entry *entry, uint64_t now_ns) {
  uint8_t bytes[RIM_LCM_ENTRY_SIZE];
  if (box->lcm != NULL && rim_lcm_pack_entry(bytes, sizeof bytes, entry) == RIM_OK)
    (void)lcm_udp_send(box->lcm, RIM_LCM_CHANNEL_ENTRY, bytes, sizeof bytes);
  if (box->can != NULL && rim_can_pack_entry(&box->entry, box->node, entry) == RIM_OK)
    box->entry_waits = true;
  (void)outbox_pump(box, now_ns);
}

void outbox_health(outbox *box, const rim_health_message *health, const rim_counters *counters,
                   const rim_alarm *newest, bool acknowledged, uint64_t now_ns) {
  uint8_t bytes[RIM_LCM_COUNTERS_SIZE];
  if (box->lcm != NULL) {
    if (rim_lcm_pack_health(bytes, sizeof bytes, health) == RIM_OK)
      (void)lcm_udp_send(box->lcm, RIM_LCM_CHANNEL_HEALTH, bytes, RIM_LCM_HEALTH_SIZE);
    if (rim_lcm_pack_counters(bytes, sizeof bytes, counters) == RIM_OK)
      (void)lcm_udp_send(box->lcm, RIM_LCM_CHANNEL_COUNTERS, bytes, RIM_LCM_COUNTERS_SIZE);
  }
  if (box->can == NULL)
    return;
  if (rim_can_pack_heartbeat(&box->heartbeat, box->node, health, newest->flags, acknowledged) ==
      RIM_OK)
    box->heartbeat_waits = true;
  rim_alarm now = *newest;
  now.level = health->level;
  now.model_id = health->model_id;
  if (rim_can_pack_summary(&box->summary, box->node, &now) == RIM_OK)
    box->summary_waits = true;
  (void)outbox_pump(box, now_ns);
}

void outbox_model(outbox *box, const rim_image *image, uint8_t flags) {
  uint8_t bytes[RIM_LCM_MODEL_SIZE];
  for (uint32_t first = 0; box->lcm != NULL; first += RIM_MODEL_QUANTITIES) {
    if (rim_lcm_pack_model(bytes, sizeof bytes, image, first, flags) != RIM_OK)
      return; /* behind the last */
    (void)lcm_udp_send(box->lcm, RIM_LCM_CHANNEL_MODEL, bytes, sizeof bytes);
  }
}

void outbox_repeat(outbox *box, const rim_alarm *newest, uint64_t now_ns) {
  if (box->can == NULL || newest->seq == 0 || box->next < box->details)
    return; /* none was sent yet, or it is on its way */
  (void)queue_detail(box, newest, now_ns);
  (void)outbox_pump(box, now_ns);
}

/* Sends a waiting frame. Returns whether the queue may take another. A frame that the interface
 * will never take is given up, and counted. */
static bool send_waiting(outbox *box, const rim_can_frame *frame, bool *waits) {
  const socketcan_sent sent = socketcan_send(box->can, frame);
  if (sent == SOCKETCAN_REFUSED)
    add(&box->frames_unsent, 1);
  if (sent == SOCKETCAN_SENT || sent == SOCKETCAN_REFUSED)
    *waits = false;
  return sent == SOCKETCAN_SENT;
}

static bool pump_detail(outbox *box, uint64_t now_ns) {
  for (uint32_t i = 0; i < BURST && box->next < box->details; ++i) {
    const socketcan_sent sent = socketcan_send(box->can, &box->detail[box->next]);
    if (sent == SOCKETCAN_SENT) {
      box->next++;
      box->progress_ns = now_ns;
      continue;
    }
    if (sent != SOCKETCAN_FULL || now_ns - box->progress_ns > PATIENCE_NS)
      give_up_detail(box);
    return false;
  }
  return true;
}

static int pump_can(outbox *box, uint64_t now_ns) {
  bool flows = true;
  if (box->summary_waits && (!box->summary_sent || now_ns - box->summary_ns >= INHIBIT_NS)) {
    flows = send_waiting(box, &box->summary, &box->summary_waits);
    if (flows) {
      box->summary_ns = now_ns;
      box->summary_sent = true;
    }
  }
  if (flows && box->entry_waits)
    flows = send_waiting(box, &box->entry, &box->entry_waits);
  if (flows && box->heartbeat_waits)
    flows = send_waiting(box, &box->heartbeat, &box->heartbeat_waits);
  if (flows && box->next < box->details)
    flows = pump_detail(box, now_ns);
  else if (box->next < box->details && now_ns - box->progress_ns > PATIENCE_NS)
    give_up_detail(box);
  if (box->next < box->details)
    return flows ? BURST_MS : RETRY_MS;
  return box->summary_waits || box->entry_waits || box->heartbeat_waits ? RETRY_MS : -1;
}

int outbox_pump(outbox *box, uint64_t now_ns) {
  int again_ms = -1;
  if (box->lcm_waits && send_lcm_alarm(box))
    box->lcm_waits = false;
  if (box->lcm_waits)
    again_ms = NETWORK_MS;
  if (box->can != NULL) {
    const int can_ms = pump_can(box, now_ns);
    if (can_ms >= 0)
      again_ms = can_ms;
  }
  return again_ms;
}
