/* SPDX-License-Identifier: MIT */
/* port_can.h - CAN controllers of a computer without an operating system, for replay/can_bus.c. */
#ifndef PORT_CAN_H
#define PORT_CAN_H

#include <stdbool.h>

#include "rim/can.h"

/* Starts a controller at 500 kbit/s. False when it does not leave its configuration mode. */
bool port_can_open(unsigned controller);

/* Puts a classic frame of 11 bits into the send queue; false when that is full, now. */
bool port_can_send(unsigned controller, const rim_can_frame *frame);

/* Takes the oldest frame received; false when there is none. Remote and 29-bit frames are dropped.
 */
bool port_can_receive(unsigned controller, rim_can_frame *frame);

#endif
