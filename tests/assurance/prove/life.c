/* SPDX-License-Identifier: MIT */
/* The life of the alarms in any state, whatever a detector finds, whoever commands and whatever the
 * time: no index leads out, nothing overflows, and at most as many records wait as there are
 * detectors, and one. Of rim_monitor_step: all that follows the judgement. */
#include "any.h"
#include "monitor/alarm_life.h"

double nondet_double(void);
uint32_t nondet_uint32(void);
_Bool nondet_bool(void);

int main(void) {
  rim_alarm_life life;
  rim_alarm candidate, out;
  rim_command command;
  rim_alarm_status status;
  rim_alarm_policy policy;
  uint32_t forget;
  const double now_s = nondet_double();
  const rim_detector detector = (rim_detector)nondet_uint32();
  rimi_alarm_life_row(&life, now_s);
  rimi_alarm_life_step(&life, detector, now_s, nondet_bool() ? &candidate : NULL);
  (void)rimi_alarm_life_over(&life, detector, now_s);
  (void)rimi_alarm_life_command(&life, &command, nondet_uint32(), &forget);
  __ESBMC_assert(forget < 1u << RIM_DETECTORS, "of the detectors that there are");
  (void)rimi_alarm_life_set_policy(&life, &policy);
  (void)rimi_alarm_life_idle(&life, now_s);
  rimi_alarm_life_status(&life, &status);
  (void)rimi_alarm_life_would_raise(&life, detector, &candidate);
  (void)rimi_alarm_life_next_record(&life, &out);
  (void)rimi_alarm_life_next_record(&life, &out);
  (void)rimi_alarm_life_next_record(&life, &out);
  __ESBMC_assert(!rimi_alarm_life_next_record(&life, &out), "no more wait than can");
  return 0;
}
