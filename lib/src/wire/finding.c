/* SPDX-License-Identifier: MIT */
#include "rim/can.h"

#include "base/ellipsoid.h"
#include "wire/message.h"

#define SIZE 8u
#define PAGES_OF_FEATURE 3u

/* The check sum covers the identifier: the frame is begun with it. */
static uint8_t *begin_page(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm,
                           uint32_t page) {
  begin_frame(frame, RIM_CAN_FINDING_ID + node, SIZE);
  frame->data[0] = (uint8_t)page;
  frame->data[1] = (uint8_t)alarm->seq;
  return frame->data + 2;
}

static void number_page(rim_can_frame *frame, uint32_t node, const rim_alarm *alarm, uint32_t page,
                        double value) {
  put_f32(begin_page(frame, node, alarm, page), &value, 1);
}

rim_status rim_can_pack_finding(rim_can_frame frame[RIM_CAN_FINDING_FRAMES], uint32_t *count,
                                uint32_t node, const rim_alarm *alarm) {
  rim_region box;
  rim_status status = count == NULL ? RIM_E_ARGUMENT : check_record(frame, node, alarm);
  if (status == RIM_OK)
    status = box_of(&box, &alarm->region);
  if (status != RIM_OK)
    return status;
  const double bits = alarm->p_value > 0.0 ? -rimi_log(alarm->p_value) * (8.0 / RIM_LN_2) : 255.0;
  uint8_t *at = begin_page(&frame[0], node, alarm, RIM_CAN_PAGE_OUTCOME);
  at = rimi_le_put_u16(at, alarm->channels > 0 ? alarm->channel[0] : 0u);
  at[0] = (uint8_t)(alarm->kind | (uint32_t)box.dims << 3 | (uint32_t)alarm->channels << 5);
  at[1] = (uint8_t)whole(bits, 255.0);
  number_page(&frame[1], node, alarm, RIM_CAN_PAGE_SHIFT, alarm->shift[0]);
  number_page(&frame[2], node, alarm, RIM_CAN_PAGE_SHIFT_SD, alarm->shift_sd[0]);
  at = begin_page(&frame[3], node, alarm, RIM_CAN_PAGE_AGE);
  rimi_le_put_u32(at, whole((alarm->t_s - alarm->since_s) * 1000.0, 4294967294.0));
  number_page(&frame[4], node, alarm, RIM_CAN_PAGE_AGE_SD, alarm->since_sd_s);
  rim_can_frame *next = frame + 5;
  for (uint32_t d = 0; d < box.dims; d++, next += PAGES_OF_FEATURE) {
    const uint32_t first = RIM_CAN_PAGE_FEATURE + PAGES_OF_FEATURE * d;
    rimi_le_put_u16(begin_page(next, node, alarm, first), box.feature[d]);
    number_page(next + 1, node, alarm, first + 1u, box.lower[d]);
    number_page(next + 2, node, alarm, first + 2u, box.upper[d]);
  }
  *count = (uint32_t)(next - frame);
  for (uint32_t i = 0; i < *count; ++i)
    finish_frame(&frame[i]);
  return RIM_OK;
}

static rim_status read_outcome(rim_can_finding *out, const uint8_t *at) {
  out->index = rimi_le_u16(at, 0);
  out->kind = at[2] & 7u;
  out->dims = (at[2] >> 3) & 3u;
  out->channels = at[2] >> 5;
  out->value = rimi_exp((double)at[3] * (-RIM_LN_2 / 8.0));
  return out->kind <= RIM_KIND_PUSHED && out->channels <= RIM_ALARM_MAX_CHANNELS ? RIM_OK
                                                                                 : RIM_E_RANGE;
}

rim_status rim_can_unpack_finding(rim_can_finding *out, const rim_can_frame *frame) {
  if (out == NULL || frame == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_sent(frame, RIM_CAN_FINDING_ID, SIZE);
  if (status != RIM_OK)
    return status;
  const rim_can_finding none = {.node = (uint8_t)(frame->id - RIM_CAN_FINDING_ID),
                                .seq = frame->data[1],
                                .page = frame->data[0]};
  *out = none;
  if (out->page >= RIM_CAN_FINDING_FRAMES)
    return RIM_E_RANGE;
  const uint8_t *at = frame->data + 2;
  if (out->page == RIM_CAN_PAGE_OUTCOME)
    return read_outcome(out, at);
  if (out->page >= RIM_CAN_PAGE_FEATURE && (out->page - RIM_CAN_PAGE_FEATURE) % 3 == 0) {
    out->index = rimi_le_u16(at, 0);
  } else if (out->page == RIM_CAN_PAGE_AGE) {
    out->value = (double)rimi_le_u32(at, 0) * 1e-3;
  } else {
    get_f32(at, &out->value, 1);
  }
  return rimi_is_finite(out->value) ? RIM_OK : RIM_E_DATA;
}
