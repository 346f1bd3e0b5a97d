/* SPDX-License-Identifier: MIT */
/* Any frame, classic or FD, whatever it says its length is up to 64: summary, heartbeat, command,
 * entry. */
#include "any.h"
#include "rim/can.h"

int main(void) {
  rim_can_frame frame;
  rim_can_summary summary;
  rim_can_heartbeat heartbeat;
  rim_command command;
  rim_entry entry;
  __ESBMC_assume(frame.length <= 64);
  (void)rim_can_unpack_summary(&summary, &frame);
  (void)rim_can_unpack_heartbeat(&heartbeat, &frame);
  (void)rim_can_unpack_command(&command, 5, &frame);
  (void)rim_can_unpack_entry(&entry, &frame);
  return 0;
}
