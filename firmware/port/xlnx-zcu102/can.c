/* SPDX-License-Identifier: MIT */
/* The two CAN controllers of the Zynq UltraScale+ (UG1085 ch. 20, UG1087): polled, classic frames.
 *
 * Reference clock 100 MHz: prescaler 10 gives 0.1 us quanta, 1 + 15 + 4 of them a bit: 500 kbit/s,
 * sampled at 80 %. The emulator does not mind the clock. */
#include "port/port_can.h"

#include <string.h>

#define CONTROLLERS 2u
#define RESET 0x00u /* registers: offset from the controller's base */
#define MODE 0x04u
#define PRESCALER 0x08u
#define TIMING 0x0cu
#define STATUS 0x18u
#define INTERRUPTS 0x1cu
#define INTERRUPT_CLEAR 0x24u
#define SEND 0x30u    /* identifier, length, bytes 0 to 3, bytes 4 to 7: four words */
#define RECEIVE 0x50u /* the same; reading the identifier takes the frame off the queue */
#define FILTERS 0x60u

#define RESET_NOW 1u
#define ENABLE 2u
#define STATUS_NORMAL (1u << 3)
#define STATUS_SEND_FULL (1u << 10)
#define RECEIVED (1u << 7) /* the receive queue is not empty */
#define TIMING_BITS                                                                                \
  (14u | 3u << 4 | 0u << 7) /* each one less: segment 1, segment 2, jump width   \
                                               */
#define REMOTE (1u << 20)   /* of the identifier's word */
#define EXTENDED (1u << 19)
#define PATIENCE 1000000u

static volatile uint32_t *reg(unsigned controller, uint32_t offset) {
  const uintptr_t base = controller == 0 ? 0xff060000u : 0xff070000u;
  return (volatile uint32_t *)(base + offset);
}

bool port_can_open(unsigned controller) {
  if (controller >= CONTROLLERS)
    return false;
  *reg(controller, RESET) = RESET_NOW; /* falls back to 0: configuration mode */
  *reg(controller, PRESCALER) = 9;
  *reg(controller, TIMING) = TIMING_BITS;
  *reg(controller, MODE) = 0;    /* neither asleep, looped back nor silent */
  *reg(controller, FILTERS) = 0; /* none: every frame is taken */
  *reg(controller, RESET) = ENABLE;
  for (uint32_t i = 0; i < PATIENCE; ++i)
    if ((*reg(controller, STATUS) & STATUS_NORMAL) != 0)
      return true;
  return false;
}

static uint32_t word(const uint8_t *at) {
  return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

bool port_can_send(unsigned controller, const rim_can_frame *frame) {
  if ((*reg(controller, STATUS) & STATUS_SEND_FULL) != 0)
    return false;
  *reg(controller, SEND) = frame->id << 21;
  *reg(controller, SEND + 4) = (uint32_t)frame->length << 28;
  *reg(controller, SEND + 8) = word(frame->data);
  *reg(controller, SEND + 12) = word(frame->data + 4); /* the last one starts it */
  return true;
}

bool port_can_receive(unsigned controller, rim_can_frame *frame) {
  while ((*reg(controller, INTERRUPTS) & RECEIVED) != 0) {
    const uint32_t id = *reg(controller, RECEIVE);
    const uint32_t length = *reg(controller, RECEIVE + 4) >> 28;
    const uint32_t data[2] = {*reg(controller, RECEIVE + 8), *reg(controller, RECEIVE + 12)};
    *reg(controller, INTERRUPT_CLEAR) = RECEIVED; /* set again while frames wait */
    if ((id & (REMOTE | EXTENDED)) != 0)
      continue;
    memset(frame, 0, sizeof *frame);
    frame->id = id >> 21;
    frame->length = (uint8_t)(length < 8 ? length : 8);
    for (uint32_t i = 0; i < frame->length; ++i)
      frame->data[i] = (uint8_t)(data[i / 4] >> (24u - 8u * (i % 4)));
    return true;
  }
  return false;
}
