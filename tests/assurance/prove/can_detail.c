/* SPDX-License-Identifier: MIT */
/* One more frame for an assembly in any state that rim_can_take_detail can have left: so whatever
 * number of frames. It leaves such a state again. */
#include "any.h"
#include "rim/can.h"

int main(void) {
  rim_can_assembly assembly;
  rim_can_frame frame;
  rim_alarm alarm;
  bool complete;
  __ESBMC_assume(frame.length <= 64 && assembly.next < RIM_CAN_DETAIL_FRAMES);
  (void)rim_can_take_detail(&assembly, &frame, &alarm, &complete);
  __ESBMC_assert(assembly.next < RIM_CAN_DETAIL_FRAMES, "a state as before");
  return 0;
}
